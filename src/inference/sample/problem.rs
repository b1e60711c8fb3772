//! What is sampled: the posterior density ln L(z) − ½|z|², and what is known of it beforehand.

use nalgebra::DMatrix;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

use super::whitening::Whitening;
use crate::error::{Error, Result};
use crate::inference::likelihood::LatentLikelihood;

/// What is sampled, and what is known of it beforehand.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// The likelihood over latent coordinates.
    pub likelihood: &'a dyn LatentLikelihood,
    /// Points in z with a finite likelihood, one in each mode that is known, the highest first; chains start around them in turn.
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
