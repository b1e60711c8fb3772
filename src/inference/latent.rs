//! What a sampler asks of a model: the likelihood in coordinates whose prior is standard normal.

/// A likelihood over latent coordinates z, each with a standard normal prior (see [`crate::inference`]).
pub trait LatentLikelihood: Sync {
    /// Number of coordinates, at least one.
    fn dimension(&self) -> usize;

    /// ln L(z); −∞ where the model cannot be evaluated, never NaN.
    fn log_likelihood(&self, latent: &[f64]) -> f64;

    /// ln L(z), with ∂lnL/∂z written to `gradient` (length [`Self::dimension`]; unspecified where ln L = −∞).
    fn log_likelihood_gradient(&self, latent: &[f64], gradient: &mut [f64]) -> f64;
}
