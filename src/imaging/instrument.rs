//! Instrument settings and the noise they imply.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::noise::Noise;
use crate::error::{Domain, Error, Result, shortest};

/// A camera and one exposure with it. The default is HST WFC3/IR F160W as in the paper.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Instrument {
    /// Width of a pixel.
    pub pixel_scale_arcsec: f64,
    /// Exposure time in seconds.
    pub exposure_s: f64,
    /// Magnitude of a source that gives one electron per second.
    pub zero_point_mag: f64,
    /// Sky brightness, magnitudes per square arcsecond.
    pub sky_mag_arcsec2: f64,
    /// Read noise of the exposure, electrons per pixel.
    pub read_noise_e: f64,
    /// Full width at half maximum of the Gaussian PSF; 0 for none.
    pub psf_fwhm_arcsec: f64,
    /// Where the Gaussian is cut, in standard deviations.
    pub psf_truncation_sigma: f64,
    /// A FITS image to use as PSF kernel instead of the Gaussian (odd number of pixels, normalised on reading).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub psf_file: Option<std::path::PathBuf>,
}

impl Default for Instrument {
    /// HST WFC3/IR F160W: 0.08″ pixels, 5400 s, sky 22.3 mag/arcsec² (Windhorst et al. 2011; CONVENTIONS section 6).
    fn default() -> Self {
        Self {
            pixel_scale_arcsec: 0.08,
            exposure_s: 5400.0,
            zero_point_mag: 25.96,
            sky_mag_arcsec2: 22.3,
            read_noise_e: 4.0,
            psf_fwhm_arcsec: 0.08,
            psf_truncation_sigma: 5.0,
            psf_file: None,
        }
    }
}

impl Instrument {
    /// Checks every number.
    ///
    /// # Errors
    /// The first setting outside its domain.
    pub fn validate(&self) -> Result<()> {
        let magnitude = Domain::from_to(-100.0, 100.0);
        for (domain, name, value) in [
            (Domain::POSITIVE, "pixel_scale_arcsec", self.pixel_scale_arcsec),
            (Domain::POSITIVE, "exposure_s", self.exposure_s),
            (magnitude, "zero_point_mag", self.zero_point_mag),
            (magnitude, "sky_mag_arcsec2", self.sky_mag_arcsec2),
            (Domain::NON_NEGATIVE, "read_noise_e", self.read_noise_e),
            (Domain::NON_NEGATIVE, "psf_fwhm_arcsec", self.psf_fwhm_arcsec),
            (Domain::POSITIVE, "psf_truncation_sigma", self.psf_truncation_sigma),
        ] {
            domain.check(&format!("instrument.{name}"), value)?;
        }
        let sigma_pixels =
            self.psf_fwhm_arcsec / (8.0 * std::f64::consts::LN_2).sqrt() / self.pixel_scale_arcsec;
        if self.psf_truncation_sigma * sigma_pixels <= 4096.0 {
            return Ok(());
        }
        let allowed = "such that psf_truncation_sigma standard deviations are at most 4096 pixels";
        Err(Error::out_of_range("instrument.psf_fwhm_arcsec", shortest(self.psf_fwhm_arcsec), allowed))
    }

    /// Electrons per second of a source of the given magnitude, 10^(−0.4(m − ZP)).
    pub fn flux_e_s(&self, magnitude: f64) -> f64 {
        10f64.powf(-0.4 * (magnitude - self.zero_point_mag))
    }

    /// Background rms per pixel in e⁻/s: √(read² + sky·Δ²·t)/t.
    ///
    /// ```
    /// let hst = haloray::imaging::Instrument::default();
    /// assert!((hst.background_rms_e_s() / 0.005919973387690837 - 1.0).abs() < 1e-14);
    /// ```
    pub fn background_rms_e_s(&self) -> f64 {
        let sky_e = self.flux_e_s(self.sky_mag_arcsec2) * self.pixel_scale_arcsec.powi(2) * self.exposure_s;
        (self.read_noise_e.powi(2) + sky_e).sqrt() / self.exposure_s
    }

    /// The noise of its pixels.
    pub fn noise(&self) -> Noise {
        Noise { background_rms_e_s: self.background_rms_e_s(), exposure_s: self.exposure_s }
    }
}
