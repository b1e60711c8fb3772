//! A point that a sampler stands on, with the posterior density there.

use serde::{Deserialize, Serialize};

use super::normal::log_prior;
use crate::inference::likelihood::LatentLikelihood;

/// A point with its density and, for gradient samplers, the slope there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Point {
    pub z: Vec<f64>,
    /// ln L.
    pub log_likelihood: f64,
    /// ln L − ½|z|².
    pub log_density: f64,
    /// Gradient of the log-density; empty if it was not asked for.
    pub gradient: Vec<f64>,
}

impl Point {
    /// Density without gradient.
    pub fn new(likelihood: &dyn LatentLikelihood, z: Vec<f64>) -> Self {
        let log_likelihood = likelihood.log_likelihood(&z);
        Self::with(z, log_likelihood, Vec::new())
    }

    /// Density and gradient.
    pub fn with_gradient(likelihood: &dyn LatentLikelihood, z: Vec<f64>) -> Self {
        let mut gradient = vec![0.0; z.len()];
        let log_likelihood = likelihood.log_likelihood_gradient(&z, &mut gradient);
        gradient.iter_mut().zip(&z).for_each(|(g, z)| *g -= z);
        let finite = gradient.iter().all(|g| g.is_finite());
        Self::with(z, if finite { log_likelihood } else { f64::NEG_INFINITY }, gradient)
    }

    fn with(z: Vec<f64>, log_likelihood: f64, gradient: Vec<f64>) -> Self {
        let log_likelihood = if log_likelihood.is_nan() { f64::NEG_INFINITY } else { log_likelihood };
        Self { log_density: log_likelihood + log_prior(&z), z, log_likelihood, gradient }
    }
}
