//! An exposure: scene, pixel integration, PSF and noise in one value.

use serde::{Deserialize, Serialize};

use super::grid::SkyGrid;
use super::instrument::Instrument;
use super::pixels::{PixelSampling, integrate_pixels};
use super::psf::Psf;
use super::scene::Scene;
use crate::error::Result;
use crate::monitor::Monitor;
use crate::numerics::random::StreamName;

/// A simulated image with and without noise, e⁻/s per pixel, row-major (y, x).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// The sky grid.
    pub grid: SkyGrid,
    /// Convolved with the PSF, no noise.
    pub noise_free_e_s: Vec<f64>,
    /// With noise.
    pub noisy_e_s: Vec<f64>,
}

/// What the adaptive pixel integral refines to, over the background rms. Single pixels are off by more from the mean of 512²
/// samples, the worst that were met by 7 times as much: a cusp can hide between the places where expansions are compared.
const TOLERANCE_OF_BACKGROUND_RMS: f64 = 0.01;

/// Exposes a scene.
///
/// Pixel fluxes are integrated to 1% of the background rms, 7% in the worst pixel of thirty images, convolved with `psf`, and the noise of that
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
    noise_stream: StreamName,
    monitor: &dyn Monitor,
) -> Result<Exposure> {
    let noise = instrument.noise();
    let tolerance = TOLERANCE_OF_BACKGROUND_RMS * noise.background_rms_e_s;
    let tolerance = tolerance / psf.oversampling() as f64;
    let flux = integrate_pixels(scene, &psf.model_grid(&grid), sampling, tolerance, monitor)?;
    let noise_free_e_s = psf.convolve(&flux, grid.pixels());
    let noisy_e_s = noise.added_to(&noise_free_e_s, noise_stream);
    Ok(Exposure { grid, noise_free_e_s, noisy_e_s })
}
