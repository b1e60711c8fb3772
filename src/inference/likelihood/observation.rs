//! The image to fit, with what is known of its noise and PSF.

use serde::{Deserialize, Serialize};

use crate::error::{Domain, Error, Result};
use crate::imaging::{Instrument, Noise, Psf, SkyGrid};

/// A square image in e⁻/s with its noise model and PSF.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Observation {
    /// The sky grid.
    pub grid: SkyGrid,
    /// Flux per pixel in e⁻/s, row-major (y, x).
    pub data_e_s: Vec<f64>,
    /// True where the pixel is used.
    pub used: Vec<bool>,
    /// Standard deviation of the background per pixel, e⁻/s.
    pub background_rms_e_s: f64,
    /// Exposure time in s.
    pub exposure_s: f64,
    /// Point-spread function.
    pub psf: Psf,
}

impl Observation {
    /// What `camera` took through `psf`, every pixel in use; fluxes in e⁻/s, row-major (y, x).
    pub fn of_camera(grid: SkyGrid, data_e_s: Vec<f64>, camera: &Instrument, psf: Psf) -> Self {
        Self {
            grid,
            used: vec![true; data_e_s.len()],
            data_e_s,
            background_rms_e_s: camera.background_rms_e_s(),
            exposure_s: camera.exposure_s,
            psf,
        }
    }

    /// Checks sizes and numbers.
    ///
    /// # Errors
    /// Sizes that do not fit the grid, no pixel used, pixels in use or noise that are not finite and positive.
    pub fn validate(&self) -> Result<()> {
        let n = self.grid.pixels() * self.grid.pixels();
        for (what, length) in
            [("pixels of the image", self.data_e_s.len()), ("pixels of the mask", self.used.len())]
        {
            if length != n {
                return Err(Error::out_of_range(what, length, &format!("{n}, those of the grid")));
            }
        }
        Domain::POSITIVE.check("BKGRMS", self.background_rms_e_s)?;
        Domain::POSITIVE.check("EXPTIME", self.exposure_s)?;
        if !self.used.contains(&true) {
            return Err(Error::out_of_range(
                "number of pixels in use",
                0,
                "at least 1 (MASK: 1 = use the pixel)",
            ));
        }
        for (value, _) in self.data_e_s.iter().zip(&self.used).filter(|(_, used)| **used) {
            Domain::FINITE.check("a pixel in use", *value)?;
        }
        Ok(())
    }

    /// The noise of its pixels.
    pub fn noise(&self) -> Noise {
        Noise { background_rms_e_s: self.background_rms_e_s, exposure_s: self.exposure_s }
    }

    /// Number of pixels in use.
    pub fn pixels_in_use(&self) -> usize {
        self.used.iter().filter(|used| **used).count()
    }
}
