//! Section 4's fits: the images of a run, each fitted with tidal models of its line of sight.

use std::time::Instant;

use super::haloes::line_of_sight_of;
use super::matter::Selection;
use super::simulate::Simulation;
use super::view::View;
use crate::error::Result;
use crate::imaging::Psf;
use crate::inference::diagnose::ESS_LIMIT;
use crate::inference::model::{CompiledModel, LightDescription, ModelDescription, ParameterRule};
use crate::inference::sample::{SamplerSettings, ValleySettings};
use crate::inference::{Fit, FitSettings, NoStore, Observation, Prior};
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
    /// Shears and rotation that the haloes have on the axis, by parameter name.
    pub expected: Vec<(String, f64)>,
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
            let mut description = ModelDescription::built_in(name)?;
            description.pixel_sampling = Some(run.config.image.pixel_sampling);
            if run.config.lens_light.is_some() && description.lens_light.is_empty() {
                description.lens_light.push(lens_light());
            }
            let settings = FitSettings {
                likelihood: description.likelihood,
                pixel_sampling: run.config.image.pixel_sampling,
                sampler: SamplerSettings::Valley(ValleySettings::default()),
                min_ess: ESS_LIMIT,
                seed: run.config.seed,
            };
            let model = match description.line_of_sight.model {
                LineOfSightKind::Haloes => {
                    let sight = line_of_sight_of(&run.config, &run.haloes, catalogue, selection)?;
                    let haloes = HaloSight::new(sight, run.config.line_of_sight.z_lens)?;
                    CompiledModel::through_haloes(&description, haloes)?
                }
                _ => CompiledModel::new(&description)?,
            };
            let start = Instant::now();
            let _task = monitor.task(&format!("{image}, {name}"), None);
            let fit = Fit::run(observation(run, view, psf), model, settings, &mut NoStore, monitor)?;
            let seconds = start.elapsed().as_secs_f64();
            fits.push(ViewFit {
                image,
                model: name.clone(),
                expected: expected(run, view, &description),
                description,
                fit,
                seconds,
            });
        }
    }
    Ok(fits)
}

fn observation(run: &Simulation, view: &View, psf: &Psf) -> Observation {
    let instrument = &run.config.instrument;
    Observation {
        grid: view.exposure.grid,
        data_e_s: view.exposure.noisy_e_s.clone(),
        used: vec![true; view.exposure.noisy_e_s.len()],
        background_rms_e_s: instrument.background_rms_e_s(),
        exposure_s: instrument.exposure_s,
        psf: psf.clone(),
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

/// What the tensors of the axis ray have for the shears of the fit; for a fit through the haloes themselves the true lens and
/// source, their centres where the ray that is seen on the axis meets their planes.
fn expected(run: &Simulation, view: &View, description: &ModelDescription) -> Vec<(String, f64)> {
    if description.line_of_sight.model == LineOfSightKind::Haloes {
        let (lens, source) = (&run.config.lens, &run.config.source);
        let ([lens_e1, lens_e2], [e1, e2]) = (run.shapes.lens_ellipticity, run.shapes.source_ellipticity);
        return [
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
        .to_vec();
    }
    let (od, los) = (&view.effective.od.tidal, &view.effective.los);
    [
        ("gamma1_od", od.gamma.re),
        ("gamma2_od", od.gamma.im),
        ("gamma1_los", los.gamma.re),
        ("gamma2_los", los.gamma.im),
        ("omega_los", los.omega),
    ]
    .map(|(name, value)| (name.to_string(), value))
    .to_vec()
}
