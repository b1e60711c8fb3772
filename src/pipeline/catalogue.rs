//! Section 3: every image of a catalogue fitted with every model, one fit a core.

use std::time::Instant;

use super::one_core_each::one_core_each;
use crate::error::{Error, Result};
use crate::imaging::PixelSampling;
use crate::inference::model::{CompiledModel, ModelDescription};
use crate::inference::sample::SamplerSettings;
use crate::inference::{Fit, FitSettings, NoStore, Observation};
use crate::mock::ShearRecovery;
use crate::monitor::{Monitor, Uncounted};

/// An image to fit.
#[derive(Debug, Clone)]
pub struct CatalogueImage {
    /// Name of its file.
    pub name: String,
    /// The image.
    pub observation: Observation,
    /// How its pixels were integrated, where it says so.
    pub pixel_sampling: Option<PixelSampling>,
}

/// How to fit a catalogue.
#[derive(Debug, Clone, Copy)]
pub struct CatalogueSettings {
    /// The sampler.
    pub sampler: SamplerSettings,
    /// How pixels are integrated, instead of what the model says.
    pub pixel_sampling: Option<PixelSampling>,
    /// Whether the profile likelihood of γ_LOS is wanted too.
    pub profile: bool,
    /// Seed of every fit.
    pub seed: u64,
}

impl CatalogueSettings {
    /// `description` with the pixel sampling of the study, else that of the image, else its own.
    pub fn resolved(&self, description: &ModelDescription, image: &CatalogueImage) -> ModelDescription {
        let sampling = description.sampling(self.pixel_sampling.or(image.pixel_sampling));
        ModelDescription { pixel_sampling: Some(sampling), ..description.clone() }
    }
}

/// The models, ready to be fitted.
///
/// # Errors
/// Models that cannot be compiled, or that know no γ_LOS.
pub fn compiled_with_shear(models: &[ModelDescription]) -> Result<Vec<CompiledModel>> {
    let compiled = |description: &ModelDescription| {
        let model = CompiledModel::new(description)?;
        let quantities = model.quantities();
        let is_there = |wanted: &&str| quantities.iter().any(|own| own.name == **wanted);
        match ShearRecovery::PARAMETERS.iter().all(is_there) {
            true => Ok(model),
            false => {
                let allowed = "one with gamma1_los and gamma2_los among its parameters";
                Err(Error::out_of_range("model", &description.name, allowed))
            }
        }
    };
    models.iter().map(compiled).collect()
}

/// Fits the pairs (image, model) of `tasks`, those early in the list first; `ended` sees each fit as it ends, or why there
/// is none, with its seconds.
///
/// # Errors
/// Those of [`compiled_with_shear`] and of `ended`, which decides what becomes of an image that cannot be fitted.
pub fn fit_catalogue(
    images: &[CatalogueImage],
    models: &[ModelDescription],
    tasks: &[(usize, usize)],
    settings: &CatalogueSettings,
    monitor: &dyn Monitor,
    ended: impl Fn((usize, usize), Result<ShearRecovery>, f64) -> Result<()> + Sync,
) -> Result<()> {
    let monitor = &Uncounted(monitor);
    let compiled = compiled_with_shear(models)?;
    one_core_each(tasks.len() as u64, |i| {
        let (image, model) = tasks[i as usize];
        let image = &images[image];
        let description = settings.resolved(&models[model], image);
        let fit_settings = FitSettings {
            likelihood: description.likelihood,
            pixel_sampling: description.pixel_sampling.unwrap_or(PixelSampling::Adaptive),
            sampler: settings.sampler,
            seed: settings.seed,
            ..FitSettings::default()
        };
        let start = Instant::now();
        let observation = image.observation.clone();
        let fit = Fit::run(observation, compiled[model].clone(), fit_settings, &mut NoStore, monitor);
        let recovery = fit.and_then(|fit| {
            let names = ShearRecovery::PARAMETERS.map(String::from);
            let profiles = if settings.profile { fit.profiles(&names, monitor)? } else { vec![] };
            ShearRecovery::of(&fit, &profiles, &image.name, &description.name)
        });
        ended(tasks[i as usize], recovery, start.elapsed().as_secs_f64())
    })?;
    Ok(())
}
