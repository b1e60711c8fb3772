//! An exposure: scene, pixel integration, PSF and noise in one value.

use super::grid::SkyGrid;
use super::instrument::Instrument;
use super::noise::add_noise;
use super::pixels::{PixelSampling, integrate_pixels};
use super::psf::Psf;
use super::scene::Scene;
use crate::error::Result;
use crate::monitor::Monitor;
use crate::numerics::random::StreamName;

/// A simulated image with and without noise, e⁻/s per pixel, row-major (y, x).
#[derive(Debug, Clone, PartialEq)]
pub struct Exposure {
    /// The sky grid.
    pub grid: SkyGrid,
    /// Convolved with the PSF, no noise.
    pub noise_free_e_s: Vec<f64>,
    /// With noise.
    pub noisy_e_s: Vec<f64>,
}

/// Errors of the adaptive pixel integral stay below this fraction of the background rms.
const TOLERANCE_OF_BACKGROUND_RMS: f64 = 0.01;

/// Exposes a scene.
///
/// Pixel fluxes are integrated to 1% of the background rms, convolved with `psf`, and the noise of that
/// stream is added.
///
/// # Errors
/// When `monitor`, which is told of every ray, cancels.
pub fn expose(
    scene: &Scene,
    grid: SkyGrid,
    instrument: &Instrument,
    psf: &Psf,
    sampling: PixelSampling,
    noise: StreamName,
    monitor: &dyn Monitor,
) -> Result<Exposure> {
    let rms = instrument.background_rms_e_s();
    let flux = integrate_pixels(scene, &grid, sampling, TOLERANCE_OF_BACKGROUND_RMS * rms, monitor)?;
    let noise_free_e_s = psf.convolve(&flux, grid.pixels());
    let StreamName { seed, realisation, stage } = noise;
    let noisy_e_s = add_noise(&noise_free_e_s, rms, instrument.exposure_s, seed, realisation, stage);
    Ok(Exposure { grid, noise_free_e_s, noisy_e_s })
}
