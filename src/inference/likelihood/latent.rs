//! What a search or a sampler asks of a model: the likelihood in coordinates whose prior is standard normal.

use nalgebra::{DMatrix, DVector};

/// The posterior expanded about a point: ln L, gradient of ln L − ½|z|², and its Fisher matrix plus one.
#[derive(Debug, Clone)]
pub struct Curvature {
    /// ln L − ½|z|².
    pub log_posterior: f64,
    /// Its gradient; what hardly depends on the parameters may be left out.
    pub gradient: DVector<f64>,
    /// Fisher matrix of the latent coordinates, amplitudes marginalised, plus the unit matrix of the prior.
    pub metric: DMatrix<f64>,
}

/// Why there is no [`Curvature`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoCurvature {
    /// This likelihood knows none anywhere.
    Unknown,
    /// The likelihood is zero there.
    ZeroLikelihood,
}

/// A likelihood over latent coordinates z, each with a standard normal prior (see [`crate::inference`]).
pub trait LatentLikelihood: Sync {
    /// Number of coordinates, at least one.
    fn dimension(&self) -> usize;

    /// ln L(z); −∞ where the model cannot be evaluated, never NaN.
    fn log_likelihood(&self, latent: &[f64]) -> f64;

    /// ln L(z), with ∂lnL/∂z written to `gradient` (length [`Self::dimension`]; unspecified where ln L = −∞).
    fn log_likelihood_gradient(&self, latent: &[f64], gradient: &mut [f64]) -> f64;

    /// The log-posterior expanded about z.
    ///
    /// # Errors
    /// Where the likelihood is zero, and everywhere for likelihoods that do not know their curvature.
    fn curvature(&self, _latent: &[f64]) -> Result<Curvature, NoCurvature> {
        Err(NoCurvature::Unknown)
    }

    /// Whether what is computed now will be thrown away, so that long loops may end.
    fn is_cancelled(&self) -> bool {
        false
    }
}

#[cfg(test)]
pub(crate) mod known {
    //! A likelihood whose curvature is known, for tests of what asks for curvatures alone.

    use super::*;

    type SlopeAndMetric = (DVector<f64>, DMatrix<f64>);

    /// ln L, and gradient and metric of the posterior where there is a likelihood.
    pub struct Known {
        pub dimension: usize,
        pub log_likelihood: fn(&[f64]) -> f64,
        pub slope_and_metric: fn(&[f64]) -> SlopeAndMetric,
    }

    impl LatentLikelihood for Known {
        fn dimension(&self) -> usize {
            self.dimension
        }

        fn log_likelihood(&self, z: &[f64]) -> f64 {
            (self.log_likelihood)(z)
        }

        fn log_likelihood_gradient(&self, _: &[f64], _: &mut [f64]) -> f64 {
            unreachable!("only curvatures are asked for")
        }

        fn curvature(&self, z: &[f64]) -> Result<Curvature, NoCurvature> {
            let log_likelihood = self.log_likelihood(z);
            if log_likelihood == f64::NEG_INFINITY {
                return Err(NoCurvature::ZeroLikelihood);
            }
            let (gradient, metric) = (self.slope_and_metric)(z);
            let log_posterior = log_likelihood - 0.5 * z.iter().map(|z| z * z).sum::<f64>();
            Ok(Curvature { log_posterior, gradient, metric })
        }
    }
}
