//! The image of a mock system, and its quality Q.

use serde::{Deserialize, Serialize};

use super::system::MockSystem;
use crate::error::Result;
use crate::imaging::{Exposure, Instrument, Noise, PixelSampling, Psf, Scene, SkyGrid, integrate_pixels};
use crate::monitor::Silent;
use crate::numerics::random::{Stage, StreamName};
use crate::profile::light::Sersic;

/// What a camera sees of a system.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MockImage {
    /// The image.
    pub exposure: Exposure,
    /// The lensed source with its perturbers alone, PSF applied, e⁻/s per pixel.
    pub source_e_s: Vec<f64>,
    /// Q = Σ SNR over the pixels where it exceeds 1, lens light left out.
    pub quality: f64,
}

/// Errors of the adaptive pixel integral of each light stay below this fraction of the background rms.
const TOLERANCE_OF_BACKGROUND_RMS: f64 = 0.005;

impl MockImage {
    /// Exposes `system`; noise depends on `seed` and the number of the system alone.
    ///
    /// # Errors
    /// A system whose image has more than 4096 pixels a side.
    pub fn expose(
        system: &MockSystem,
        instrument: &Instrument,
        psf: &Psf,
        sampling: PixelSampling,
        seed: u64,
    ) -> Result<Self> {
        let grid = SkyGrid::new(system.pixels, instrument.pixel_scale_arcsec)?;
        let noise = instrument.noise();
        let mapping = system.mapping()?;
        let see = |source: &Sersic, lens_light: Option<&Sersic>| -> Result<Vec<f64>> {
            let scene = Scene { mapping: &mapping, source, lens_light };
            let tolerance =
                TOLERANCE_OF_BACKGROUND_RMS * noise.background_rms_e_s / psf.oversampling() as f64;
            let flux = integrate_pixels(&scene, &psf.model_grid(&grid), sampling, tolerance, &Silent)?;
            Ok(psf.convolve(&flux, grid.pixels()))
        };
        let sources = sources(system, instrument)?;
        let mut source_e_s = vec![0.0; grid.pixels() * grid.pixels()];
        for source in &sources {
            source_e_s.iter_mut().zip(see(source, None)?).for_each(|(sum, flux)| *sum += flux);
        }
        let dark = Sersic::with_flux(0.0, 1.0, 1.0, [0.0; 2], [0.0; 2])?;
        let mut noise_free_e_s = see(&dark, Some(&lens_light(system, instrument)?))?;
        noise_free_e_s.iter_mut().zip(&source_e_s).for_each(|(sum, flux)| *sum += flux);
        let name = StreamName { seed, realisation: system.number, stage: Stage::NoiseImage };
        let noisy_e_s = noise.added_to(&noise_free_e_s, name);
        let quality = image_quality(&source_e_s, noise);
        Ok(Self { exposure: Exposure { grid, noise_free_e_s, noisy_e_s }, source_e_s, quality })
    }
}

/// Q = Σ SNR over the pixels with SNR > 1, SNR = f/√(f/t + σ²) of the noise-free flux f (equation 24 of Hogg et al. 2023).
///
/// ```
/// // One pixel of 10 σ without shot noise, one below the noise.
/// let noise = haloray::imaging::Noise { background_rms_e_s: 0.006, exposure_s: 1e12 };
/// let q = haloray::mock::image_quality(&[0.06, 0.005], noise);
/// assert!((q - 10.0).abs() < 1e-6);
/// ```
pub fn image_quality(source_e_s: &[f64], noise: Noise) -> f64 {
    let snr = |flux: f64| flux / noise.sigma(flux);
    source_e_s.iter().map(|flux| snr(*flux)).filter(|snr| *snr > 1.0).sum()
}

fn sources(system: &MockSystem, instrument: &Instrument) -> Result<Vec<Sersic>> {
    let main = &system.source;
    let flux = instrument.flux_e_s(main.magnitude);
    let mut all =
        vec![Sersic::with_flux(flux, main.radius_arcsec, main.index, main.ellipticity, main.centre_arcsec)?];
    for p in &system.perturbers {
        all.push(Sersic::with_flux(p.flux * flux, p.radius_arcsec, p.index, p.ellipticity, p.centre_arcsec)?);
    }
    Ok(all)
}

fn lens_light(system: &MockSystem, instrument: &Instrument) -> Result<Sersic> {
    let stars = &system.baryons;
    let flux = instrument.flux_e_s(stars.magnitude);
    Sersic::with_flux(flux, stars.radius_arcsec, stars.index, stars.ellipticity, [0.0; 2])
}
