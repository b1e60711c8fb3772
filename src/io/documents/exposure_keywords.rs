//! What an image's header says about its exposure.

use std::path::Path;

use fitskit::Header;

use crate::error::{Domain, Error, FileFault, Result};
use crate::imaging::PixelSampling;
use crate::io::containers::fits_file as fits;

/// What the header says about the exposure; a keyword that is absent is `None`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ExposureKeywords {
    /// `EXPTIME`, s.
    pub exposure_time_s: Option<f64>,
    /// `BKGRMS`, standard deviation of the background per pixel, electron/s.
    pub background_rms_e_per_s: Option<f64>,
    /// `PSFFWHM`, full width at half maximum of the Gaussian PSF, arcsec.
    pub psf_fwhm_arcsec: Option<f64>,
    /// `PSFTRUNC`, radius at which the PSF is cut, in standard deviations.
    pub psf_truncation_sigma: Option<f64>,
    /// `ZLENS`, redshift of the main lens.
    pub z_lens: Option<f64>,
    /// `ZSOURCE`, redshift of the source.
    pub z_source: Option<f64>,
    /// `PIXSAMP`, how the pixels were integrated where the image was simulated: `point` or `adaptive`.
    pub pixel_sampling: Option<PixelSampling>,
}

/// Name, comment and value of each keyword that is a number; the one list both ways use.
type KeywordOf<V> = [(&'static str, &'static str, V); 6];

impl ExposureKeywords {
    /// The names of all of them.
    pub(super) const NAMES: [&str; 7] =
        ["EXPTIME", "BKGRMS", "PSFFWHM", "PSFTRUNC", "ZLENS", "ZSOURCE", SAMPLING];

    fn named(&mut self) -> KeywordOf<&mut Option<f64>> {
        [
            ("EXPTIME", "s, exposure time", &mut self.exposure_time_s),
            ("BKGRMS", "electron/s, background rms", &mut self.background_rms_e_per_s),
            ("PSFFWHM", "arcsec, FWHM of the Gaussian PSF", &mut self.psf_fwhm_arcsec),
            ("PSFTRUNC", "sigma, truncation of the PSF", &mut self.psf_truncation_sigma),
            ("ZLENS", "redshift of the main lens", &mut self.z_lens),
            ("ZSOURCE", "redshift of the source", &mut self.z_source),
        ]
    }

    /// The keywords of a header.
    pub(super) fn read(path: &Path, header: &Header) -> Result<Self> {
        let mut keywords = Self::default();
        for (name, _, value) in keywords.named() {
            *value = fits::number(path, header, name)?;
        }
        keywords.pixel_sampling = pixel_sampling(path, header)?;
        Ok(keywords)
    }

    /// Adds the keywords that are present.
    pub(super) fn push(mut self, header: &mut Header) -> Result<()> {
        for (name, comment, value) in self.named() {
            if let Some(value) = *value {
                fits::push_f64(header, name, Domain::FINITE.check(name, value)?, comment);
            }
        }
        if let Some(sampling) = self.pixel_sampling {
            fits::push_text(header, SAMPLING, sampling.name(), "how pixels were integrated");
        }
        Ok(())
    }
}

const SAMPLING: &str = "PIXSAMP";

fn pixel_sampling(path: &Path, header: &Header) -> Result<Option<PixelSampling>> {
    let Some(card) = header.find(SAMPLING) else { return Ok(None) };
    let value = card.value.as_ref().map(ToString::to_string).unwrap_or_default();
    let given = header.get_string(SAMPLING).unwrap_or(&value);
    let all = [PixelSampling::Point, PixelSampling::Adaptive];
    let found = all.into_iter().find(|sampling| sampling.name() == given.trim());
    let fault = || {
        Error::file(
            FileFault::Content,
            path,
            format!("{SAMPLING} is '{given}', but must be 'point' or 'adaptive'"),
        )
    };
    found.map(Some).ok_or_else(fault)
}
