//! One fit of one image: γ_LOS with its errors, χ², evidence, and the H0 of its best fit.

use super::delays::Delays;
use super::plan::{Estimate, FitStart};
use super::rows::ValidityFit;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::inference::diagnose::Goodness;
use crate::inference::model::{CompiledModel, ModelDescription};
use crate::inference::{Fit, ImageLikelihood, Maximum, NoStore, Top, normal_pair};
use crate::mapping::tidal::TidalLens;
use crate::monitor::Monitor;
use crate::pipeline::fitted_shear::moments;
use crate::pipeline::tidal_twin::time_delay_distance_mpc;
use crate::pipeline::view_fits::{FittedView, ReadyModel};

/// Which fit.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// Place of the model in the plan, and its name.
    pub model: (usize, &'a str),
    pub start: FitStart,
    pub estimate: Estimate,
}

const SHEAR: [&str; 2] = ["gamma1_los", "gamma2_los"];

/// Fits an image; a fit that fails says why and is no error.
///
/// # Errors
/// When cancelled.
pub(super) fn fit(
    seen: &FittedView,
    wanted: Wanted,
    delays: Option<&Delays>,
    monitor: &dyn Monitor,
) -> Result<ValidityFit> {
    match try_fit(seen, wanted, delays, monitor) {
        Err(Error::Cancelled) => Err(Error::Cancelled),
        Err(error) => Ok(ValidityFit::failed(wanted.model.0, wanted.start, error.to_string())),
        fit => fit,
    }
}

fn try_fit(
    seen: &FittedView,
    wanted: Wanted,
    delays: Option<&Delays>,
    monitor: &dyn Monitor,
) -> Result<ValidityFit> {
    let Wanted { model: (place, name), start, estimate } = wanted;
    let without = || Error::out_of_range("model", name, "one whose gamma1_los and gamma2_los are free");
    let ReadyModel { description, model, settings } = seen.ready(name, || Err(without()))?;
    let from = (start == FitStart::Truth).then(|| seen.truth(&model, &seen.expected(&description)));
    let image = seen.observation();
    let (likelihood, maximum, found, is_converged) = match (estimate, from) {
        (Estimate::Laplace, from) => {
            let Top { likelihood, mut modes, .. } = Top::find(image, model, &settings, from, monitor)?;
            let maximum = modes.swap_remove(0);
            let found = normal_pair(likelihood.model(), &maximum, SHEAR);
            (likelihood, maximum, found, true)
        }
        (Estimate::Sample, from) => {
            let fit = match from {
                Some(latent) => Fit::run_from(image, model, settings, latent, monitor)?,
                None => Fit::run(image, model, settings, &mut NoStore, monitor)?,
            };
            let found = moments(&fit, SHEAR);
            (fit.likelihood, fit.maximum, found, fit.status.is_converged)
        }
    };
    let (shear, covariance) = found.ok_or_else(without)?;
    let numbers = numbers(&likelihood, &maximum)?;
    let own = delays_of_fit(seen.config, &description, &likelihood, &maximum, delays)?;
    let h0_ratio = delays.zip(own.as_ref()).map_or(f64::NAN, |(truth, own)| truth.h0_ratio(own));
    let Numbers { chi2, degrees_of_freedom, p_value } = numbers;
    Ok(ValidityFit {
        model: place,
        start,
        shear,
        covariance,
        chi2,
        degrees_of_freedom,
        p_value,
        log_posterior: maximum.log_posterior,
        log_evidence: maximum.log_evidence().unwrap_or(f64::NAN),
        is_converged,
        h0_ratio,
        failure: String::new(),
    })
}

struct Numbers {
    chi2: f64,
    degrees_of_freedom: f64,
    p_value: f64,
}

fn numbers(likelihood: &ImageLikelihood, maximum: &Maximum) -> Result<Numbers> {
    let best_fit = likelihood.model().at_latent(&maximum.latent).0;
    let image = likelihood.image(&best_fit).ok_or_else(|| {
        Error::out_of_range("the best fit", "without an image", "a model that can be evaluated")
    })?;
    let degrees_of_freedom = likelihood.degrees_of_freedom();
    let chi2 = likelihood.chi2_reduced(&image) * degrees_of_freedom;
    Ok(Numbers { chi2, degrees_of_freedom, p_value: Goodness::of(likelihood, &image).p_value })
}

/// Delays of the same images behind lens and line of sight of the best fit; none of a model without them.
fn delays_of_fit(
    config: &Config,
    description: &ModelDescription,
    likelihood: &ImageLikelihood,
    maximum: &Maximum,
    truth: Option<&Delays>,
) -> Result<Option<Delays>> {
    let model: &CompiledModel = likelihood.model();
    let best_fit = model.at_latent(&maximum.latent).0;
    let value = |name: &str| model.value_of(name, &best_fit);
    let kind = description.line_of_sight.model;
    let numbers: Option<Vec<f64>> = kind.parameters().iter().map(|parameter| value(parameter.name)).collect();
    let source = value("source.center_x").zip(value("source.center_y"));
    let (Some(numbers), Some(source), Some(truth)) = (numbers, source, truth) else { return Ok(None) };
    let mapping = TidalLens {
        time_delay_distance_mpc: Some(time_delay_distance_mpc(config)),
        ..TidalLens::new(kind.build(&numbers), model.lenses(&best_fit)?)
    };
    Ok(truth.followed(&mapping, source.into()))
}
