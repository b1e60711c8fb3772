//! Section 4's fits: the images of a run, each fitted with tidal models of its line of sight.

use std::time::Instant;

use super::haloes::line_of_sight_of;
use super::los_shears::{DEFINITIONS, LosShears};
use super::matter::Selection;
use super::shapes::LensAndSource;
use super::simulate::Simulation;
use super::view::View;
use crate::config::Config;
use crate::diagnostics::{EffectiveLineOfSight, Tidal};
use crate::error::Result;
use crate::imaging::{Exposure, Psf};
use crate::inference::model::{
    CompiledModel, FreeParameter, LightDescription, ModelDescription, ParameterRule,
};
use crate::inference::{Fit, FitSettings, NoStore, Observation, Prior, climb_from};
use crate::mapping::HaloSight;
use crate::mapping::tidal::LineOfSightKind;
use crate::monitor::Monitor;
use crate::profile::light::Sersic;
use crate::profile::registry::{Parameter, Role};

/// One image of a run fitted with one model.
#[derive(Debug, Clone)]
pub struct ViewFit {
    /// `all_haloes` or `tidal_haloes`.
    pub image: &'static str,
    /// Name of the model.
    pub model: String,
    /// The model in full.
    pub description: ModelDescription,
    /// The posterior.
    pub fit: Fit,
    /// Seconds the fit took.
    pub seconds: f64,
    /// Shears and rotation by parameter name, as each of [`DEFINITIONS`] has them; the axis ray's first. For a fit through the
    /// haloes the true lens and source alone.
    pub expected: Vec<(&'static str, Vec<(String, f64)>)>,
    /// A climb from the truth ends so much above the highest maximum that the fit found (ln p), where it does.
    pub missed_by: Option<f64>,
}

impl ViewFit {
    /// What the axis ray has, or the truth of a fit through haloes.
    pub fn on_axis(&self) -> &[(String, f64)] {
        self.expected.first().map_or(&[], |(_, values)| values)
    }
}

/// Fits both images of `run` with each of the named built-in models; pixels are integrated as they were simulated.
///
/// # Errors
/// A model that is not built in; [`Error::Cancelled`](crate::Error::Cancelled).
pub fn fit_views(
    run: &Simulation,
    psf: &Psf,
    models: &[String],
    monitor: &dyn Monitor,
) -> Result<Vec<ViewFit>> {
    let mut fits = Vec::new();
    let tidal = run.single_haloes.decisive(&run.config).within(run.config.diagnostics.delta_threshold);
    let in_tidal_regime = run.haloes.catalogue.select(&tidal);
    for (image, view, catalogue, selection) in [
        ("all_haloes", &run.all, &run.haloes.catalogue, Selection::All),
        ("tidal_haloes", &run.tidal, &in_tidal_regime, Selection::TidalRegime),
    ] {
        for name in models {
            let through_haloes = || {
                let sight = line_of_sight_of(&run.config, &run.haloes, catalogue, selection)?;
                HaloSight::new(sight, run.config.line_of_sight.z_lens)
            };
            let seen = FittedView::of(image, &run.config, &run.shapes, view, psf);
            fits.push(seen.fit(name, through_haloes, monitor)?);
        }
    }
    Ok(fits)
}

/// An image to be fitted, with everything that it was made of.
pub(super) struct FittedView<'a> {
    pub image: &'static str,
    pub config: &'a Config,
    pub shapes: &'a LensAndSource,
    pub exposure: &'a Exposure,
    pub effective: &'a EffectiveLineOfSight,
    pub los_shears: &'a LosShears,
    pub psf: &'a Psf,
}

/// A built-in model made ready for one image, and how it is fitted.
pub(super) struct ReadyModel {
    pub description: ModelDescription,
    pub model: CompiledModel,
    pub settings: FitSettings,
}

impl<'a> FittedView<'a> {
    /// The image of a view.
    pub fn of(
        image: &'static str,
        config: &'a Config,
        shapes: &'a LensAndSource,
        view: &'a View,
        psf: &'a Psf,
    ) -> Self {
        let View { exposure, effective, los_shears, .. } = view;
        Self { image, config, shapes, exposure, effective, los_shears, psf }
    }

    /// Makes a built-in model ready.
    pub fn ready(
        &self,
        name: &str,
        through_haloes: impl FnOnce() -> Result<HaloSight>,
    ) -> Result<ReadyModel> {
        let config = self.config;
        let mut description = ModelDescription::built_in(name)?;
        description.pixel_sampling = Some(config.image.pixel_sampling);
        if config.lens_light.is_some() && description.lens_light.is_empty() {
            description.lens_light.push(lens_light());
        }
        let settings = FitSettings {
            likelihood: description.likelihood,
            pixel_sampling: config.image.pixel_sampling,
            seed: config.seed,
            ..FitSettings::default()
        };
        let model = match description.line_of_sight.model {
            LineOfSightKind::Haloes => CompiledModel::through_haloes(&description, through_haloes()?)?,
            _ => CompiledModel::new(&description)?,
        };
        Ok(ReadyModel { description, model, settings })
    }

    /// Fits a built-in model, and climbs from the truth beside.
    pub fn fit(
        &self,
        name: &str,
        through_haloes: impl FnOnce() -> Result<HaloSight>,
        monitor: &dyn Monitor,
    ) -> Result<ViewFit> {
        let image = self.image;
        let ReadyModel { description, model, settings } = self.ready(name, through_haloes)?;
        let start = Instant::now();
        let _task = monitor.task(&format!("{image}, {name}"), None);
        let fit = Fit::run(self.observation(), model, settings, &mut NoStore, monitor)?;
        let seconds = start.elapsed().as_secs_f64();
        let expected = self.expected(&description);
        let missed_by = self.climb_from_truth(&fit, &expected, monitor);
        Ok(ViewFit { image, model: name.into(), expected, description, fit, seconds, missed_by })
    }

    /// By how much the top that is reached from the truth lies above the highest maximum of the fit, if it does.
    fn climb_from_truth(
        &self,
        fit: &Fit,
        expected: &[(&'static str, Vec<(String, f64)>)],
        monitor: &dyn Monitor,
    ) -> Option<f64> {
        /// A gain in ln p that rounding and the ends of climbs do not explain.
        const NOTICED: f64 = 0.5;
        let latent = self.truth(fit.likelihood.model(), expected);
        let top = climb_from(&fit.likelihood, latent, monitor).ok()?;
        let gain = top.log_posterior - fit.maximum.log_posterior;
        (gain > NOTICED).then_some(gain)
    }

    /// Latent coordinates of the true lens and source behind the shears of the nearest tidal model, which knows those of the image
    /// better than the axis ray; medians of the priors for everything else.
    pub fn truth(&self, model: &CompiledModel, expected: &[(&'static str, Vec<(String, f64)>)]) -> Vec<f64> {
        let shears = expected.iter().find(|(name, _)| *name == "best_tidal").or(expected.first());
        let known: Vec<(String, f64)> = self
            .lens_and_source()
            .into_iter()
            .chain(shears.iter().flat_map(|(_, set)| set.clone()))
            .collect();
        let medians = model.at_latent(&vec![0.0; model.free.len()]).0;
        let value = |(free, median): (&FreeParameter, f64)| {
            known.iter().find(|(name, _)| *name == free.name).map_or(median, |(_, value)| *value)
        };
        let truth: Vec<f64> = model.free.iter().zip(medians).map(value).collect();
        model.to_latent(&truth).iter().map(|z| z.clamp(-5.0, 5.0)).collect()
    }

    /// The image as a fit wants it.
    pub fn observation(&self) -> Observation {
        let (instrument, exposure) = (&self.config.instrument, self.exposure);
        Observation {
            grid: exposure.grid,
            data_e_s: exposure.noisy_e_s.clone(),
            used: vec![true; exposure.noisy_e_s.len()],
            background_rms_e_s: instrument.background_rms_e_s(),
            exposure_s: instrument.exposure_s,
            psf: self.psf.clone(),
        }
    }

    /// What every definition has for the shears of the fit; for a fit through the haloes themselves the true lens and
    /// source, their centres where the ray that is seen on the axis meets their planes.
    pub fn expected(&self, description: &ModelDescription) -> Vec<(&'static str, Vec<(String, f64)>)> {
        if description.line_of_sight.model == LineOfSightKind::Haloes {
            return vec![("truth", self.lens_and_source())];
        }
        let by_definition = DEFINITIONS.iter().zip(self.los_shears.all(self.effective));
        let numbers = |od: Tidal, los: Tidal| {
            [
                ("gamma1_od", od.gamma.re),
                ("gamma2_od", od.gamma.im),
                ("gamma1_los", los.gamma.re),
                ("gamma2_los", los.gamma.im),
                ("omega_los", los.omega),
            ]
            .map(|(name, value)| (name.to_string(), value))
            .to_vec()
        };
        by_definition
            .filter_map(|(name, tensors)| tensors.map(|(od, los)| (*name, numbers(od, los))))
            .collect()
    }

    /// The true lens and source, their centres where the ray that is seen on the axis meets their planes.
    fn lens_and_source(&self) -> Vec<(String, f64)> {
        let (lens, source) = (&self.config.lens, &self.config.source);
        let ([lens_e1, lens_e2], [e1, e2]) = (self.shapes.lens_ellipticity, self.shapes.source_ellipticity);
        [
            ("lens.theta_E", lens.einstein_radius_arcsec),
            ("lens.gamma", lens.slope),
            ("lens.e1", lens_e1),
            ("lens.e2", lens_e2),
            ("lens.center_x", 0.0),
            ("lens.center_y", 0.0),
            ("source.R_sersic", source.radius_arcsec),
            ("source.n_sersic", source.sersic_index),
            ("source.e1", e1),
            ("source.e2", e2),
            ("source.center_x", 0.0),
            ("source.center_y", 0.0),
        ]
        .map(|(name, value)| (name.to_string(), value))
        .to_vec()
    }
}

/// Light of the lens galaxy under its usual priors, on the axis, where a run puts it.
fn lens_light() -> LightDescription {
    let free = Sersic::PARAMETERS.iter().filter(|parameter| parameter.role != Role::Centre);
    let prior = |parameter: &Parameter| Prior { shape: parameter.usual_prior, low: None, high: None };
    LightDescription {
        profile: "SERSIC_ELLIPSE".into(),
        amplitude: None,
        parameters: free.map(|own| (own.name.to_string(), ParameterRule::Free(prior(own)))).collect(),
    }
}
