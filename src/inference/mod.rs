//! Fitting an image: parameters and priors, forward model, likelihood, samplers, convergence, posterior.
//!
//! Samplers work in *latent* coordinates z: each parameter is p = F⁻¹(Φ(z)) with F the distribution function of its
//! prior and Φ the standard normal one, so that every prior is N(0, 1) in z and nothing has an edge. The
//! log-posterior density in z is ln L(z) − ½|z|²; u = Φ(z) are the coordinates of the unit cube.

pub mod convergence;
mod draws;
mod latent;
pub mod sampler;

pub use draws::{DrawStatistics, HPD_FRACTION};
pub use latent::LatentLikelihood;
