//! How probable an image is under a model, over latent coordinates, amplitudes of the lights marginalised.

mod amplitudes;
mod counted;
mod image;
mod latent;
mod observation;
mod pixel_sums;
mod refine;
mod restricted;

pub use counted::{CountedLikelihood, Counter};
pub use image::{ImageLikelihood, ModelImage};
#[cfg(test)]
pub(crate) use latent::known;
pub use latent::{Curvature, LatentLikelihood, NoCurvature};
pub use observation::Observation;
pub(in crate::inference) use refine::Mode;
pub(super) use restricted::{Others, WithinEdges};
