//! Fitting an image: parameters and priors, forward model, likelihood, samplers, convergence, posterior.
//!
//! Samplers work in *latent* coordinates z: each parameter is p = F⁻¹(Φ(z)) with F the distribution function of its
//! prior and Φ the standard normal one, so that every prior is N(0, 1) in z and nothing has an edge. The
//! log-posterior density in z is ln L(z) − ½|z|²; u = Φ(z) are the coordinates of the unit cube.

mod bits;
mod climb;
pub mod convergence;
mod draws;
mod fit;
mod floor;
mod image_likelihood;
mod latent;
pub mod likelihood;
pub mod model;
mod observation;
mod pixel_sums;
mod prior;
pub mod sampler;
mod start;

pub use climb::Maximum;
pub use draws::{DrawStatistics, HPD_FRACTION};
pub use fit::{Fit, FitSettings, ParameterSummary, Stage as FitStage};
pub use image_likelihood::{ImageLikelihood, ModelImage};
pub use latent::{Curvature, LatentLikelihood};
pub use observation::Observation;
pub use prior::{Prior, PriorShape};
pub use start::{climb_from, find_start};
