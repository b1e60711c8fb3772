//! How probable an image is under a model, over latent coordinates, amplitudes of the lights marginalised.

mod amplitudes;
mod image;
mod latent;
mod observation;
mod pixel_sums;

pub use amplitudes::LikelihoodKind;
pub use image::{ImageLikelihood, ModelImage};
pub use latent::{Curvature, LatentLikelihood};
pub use observation::Observation;
