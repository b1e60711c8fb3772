//! The maxima of a posterior alone, and the normal posterior about one: what a fit has before it samples.

use super::fit_settings::FitSettings;
use super::likelihood::{ImageLikelihood, Observation};
use super::model::CompiledModel;
use super::optimise::{Maximum, climb_from};
use super::store::{FitState, NoStore};
use crate::error::Result;
use crate::monitor::Monitor;

/// The maxima that samplers start from, and the likelihood whose pixels were refined about them.
#[derive(Debug, Clone)]
pub struct Top {
    /// The likelihood.
    pub likelihood: ImageLikelihood,
    /// Its highest maximum and others apart from it and within 3 in ln p, the highest first; never empty.
    pub modes: Vec<Maximum>,
    /// Evaluations of the likelihood in the search and at refinements.
    pub evaluations: u64,
}

impl Top {
    /// Finds the start of a fit of `observation`: blind, or the top that is reached from the latent coordinates `from`.
    ///
    /// # Errors
    /// Observations or priors that cannot be, a point where the model cannot be evaluated; when cancelled.
    pub fn find(
        observation: Observation,
        model: CompiledModel,
        settings: &FitSettings,
        from: Option<Vec<f64>>,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let mut likelihood = ImageLikelihood::new(observation, model, settings.likelihood, monitor)?;
        let mut state = match from {
            Some(latent) => FitState::at(climb_from(&likelihood, latent, monitor)?),
            None => FitState::default(),
        };
        let modes = state.start(&mut likelihood, settings, &mut NoStore, monitor)?;
        Ok(Self { likelihood, modes, evaluations: state.evaluations() })
    }

    /// The highest maximum.
    pub fn maximum(&self) -> &Maximum {
        &self.modes[0]
    }
}

/// Values at a maximum and covariance (11, 12, 22) of two free parameters in the normal posterior about it, the priors' stretch
/// taken to first order; none where there is no such parameter or the metric is indefinite.
pub fn normal_pair(
    model: &CompiledModel,
    maximum: &Maximum,
    names: [&str; 2],
) -> Option<([f64; 2], [f64; 3])> {
    let place = |name: &str| model.free.iter().position(|free| free.name == name);
    let [i, j] = [place(names[0])?, place(names[1])?];
    let (values, slopes) = model.at_latent(&maximum.latent);
    let inverse = maximum.metric.clone().cholesky()?.inverse();
    let covariance = |a: usize, b: usize| slopes[a] * slopes[b] * inverse[(a, b)];
    Some(([values[i], values[j]], [covariance(i, i), covariance(i, j), covariance(j, j)]))
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::inference::model::ModelDescription;

    #[test]
    fn a_normal_posterior_has_the_covariance_of_its_metric_and_the_evidence_of_its_volume() {
        let model = CompiledModel::new(&ModelDescription::built_in("tidal-minimal").unwrap()).unwrap();
        let n = model.free.len();
        let place = |name: &str| model.free.iter().position(|free| free.name == name).unwrap();
        let (i, j) = (place("gamma1_los"), place("gamma2_los"));
        let mut metric = DMatrix::identity(n, n);
        // The inverse of [[2, 1], [1, 2]] is [[2, −1], [−1, 2]]/3.
        (metric[(i, i)], metric[(j, j)], metric[(i, j)], metric[(j, i)]) = (2.0, 2.0, 1.0, 1.0);
        let maximum = Maximum { latent: vec![0.0; n], log_posterior: -5.0, metric };
        let (values, covariance) = normal_pair(&model, &maximum, ["gamma1_los", "gamma2_los"]).unwrap();
        // At the middle of a flat prior of width 1 the slope is the normal density at 0.
        let square = 1.0 / std::f64::consts::TAU;
        assert!(values.iter().all(|value| value.abs() < 1e-15));
        for (got, wanted) in covariance.iter().zip([2.0, -1.0, 2.0]) {
            assert!((got - wanted / 3.0 * square).abs() < 1e-12, "{covariance:?}");
        }
        assert!((maximum.log_evidence().unwrap() + 5.0 + 0.5 * 3f64.ln()).abs() < 1e-12);
        assert!(normal_pair(&model, &maximum, ["gamma1_los", "nothing"]).is_none());
    }
}
