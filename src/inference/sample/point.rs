//! The posterior density a sampler moves on: ln L(z) − ½|z|², with the point it was evaluated at.

use nalgebra::DMatrix;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::whitening::Whitening;
use crate::error::{Error, Result};
use crate::inference::LatentLikelihood;
use crate::inference::bits;

/// What is sampled, and what is known of it beforehand.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// The likelihood over latent coordinates.
    pub likelihood: &'a dyn LatentLikelihood,
    /// Points in z with a finite likelihood; chains start around them in turn, those of the valley sampler at the first.
    /// Nested sampling needs none.
    pub starts: &'a [Vec<f64>],
    /// Symmetric positive-definite curvature −∂²ln p/∂z² around the mode (Fisher matrix + 1), where known.
    pub metric: Option<&'a DMatrix<f64>>,
}

impl Problem<'_> {
    /// The map of the metric, or none.
    pub(super) fn whitening(&self) -> Result<Whitening> {
        let dimension = self.likelihood.dimension();
        self.metric.map_or_else(
            || Ok(Whitening::identity(dimension)),
            |metric| Whitening::from_metric(metric, dimension),
        )
    }

    /// A point around the start of that number: start + `spread`·L·N(0, 1), nearer where the likelihood is
    /// zero.
    pub(super) fn scattered(
        &self,
        number: usize,
        spread: f64,
        whitening: &Whitening,
        rng: &mut impl Rng,
    ) -> Result<Vec<f64>> {
        /// Halvings of the spread before the start itself is taken.
        const HALVINGS: i32 = 10;
        let dimension = self.likelihood.dimension();
        let Some(start) = self.starts.get(number % self.starts.len().max(1)) else {
            return Err(Error::out_of_range("the number of start points", 0, "at least 1"));
        };
        if start.len() != dimension {
            let what = "the number of coordinates of a start point";
            return Err(Error::out_of_range(what, start.len(), &dimension.to_string()));
        }
        if let Some(value) = start.iter().find(|value| !value.is_finite()) {
            return Err(Error::out_of_range("a coordinate of a start point", value, "finite"));
        }
        for halving in 0..HALVINGS {
            let normal: Vec<f64> = (0..dimension).map(|_| StandardNormal.sample(rng)).collect();
            let scale = spread * 0.5_f64.powi(halving);
            let step = whitening.push(&normal);
            let z: Vec<f64> = start.iter().zip(&step).map(|(z, step)| z + scale * step).collect();
            if self.likelihood.log_likelihood(&z).is_finite() {
                return Ok(z);
            }
        }
        match self.likelihood.log_likelihood(start) {
            value if value.is_finite() => Ok(start.clone()),
            value => Err(Error::out_of_range("the log-likelihood at a start point", value, "finite")),
        }
    }
}

/// A point with its density and, for gradient samplers, the slope there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Point {
    #[serde(with = "bits")]
    pub z: Vec<f64>,
    /// ln L and ln L − ½|z|².
    #[serde(with = "bits")]
    densities: Vec<f64>,
    /// Gradient of the log-density; empty if it was not asked for.
    #[serde(with = "bits")]
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
        let log_prior = log_prior(&z);
        Self { z, densities: vec![log_likelihood, log_likelihood + log_prior], gradient }
    }

    /// ln L.
    pub fn log_likelihood(&self) -> f64 {
        self.densities[0]
    }

    /// ln L − ½|z|².
    pub fn log_density(&self) -> f64 {
        self.densities[1]
    }
}

/// −½|z|².
pub(super) fn log_prior(z: &[f64]) -> f64 {
    -0.5 * z.iter().map(|z| z * z).sum::<f64>()
}
