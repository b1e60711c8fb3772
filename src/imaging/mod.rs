//! From a mapping to an exposure: sky grid, source light, pixel integration, PSF, noise.

mod blur;
mod exposure;
mod gaussian_blur;
mod grid;
mod instrument;
mod noise;
mod pixels;
mod psf;
mod scene;

pub use blur::Blur;
pub use exposure::{Exposure, expose};
pub use grid::SkyGrid;
pub use instrument::Instrument;
pub use noise::Noise;
pub use pixels::{PixelSampling, integrate_pixels};
pub use psf::Psf;
pub use scene::Scene;
