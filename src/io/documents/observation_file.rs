//! A FITS image read as an observation to fit.

use std::path::Path;

use super::exposure_keywords::ExposureKeywords;
use super::image_fits::{ImageFile, PsfKernel};
use crate::error::{Domain, Error, FileFault, Result};
use crate::imaging::{Psf, SkyGrid};
use crate::inference::Observation;

/// Where the Gaussian PSF of an image that does not say is cut, in standard deviations.
const DEFAULT_TRUNCATION_SIGMA: f64 = 5.0;

/// A Gaussian has lost its last bit long before this many standard deviations.
const LARGEST_TRUNCATION_SIGMA: f64 = 40.0;

/// Reads a square image with EXPTIME, BKGRMS, and PSFFWHM (with PSFTRUNC, else 5σ) or an extension PSF; MASK if there is one.
///
/// # Errors
/// Those of [`ImageFile::read`]; keywords that are missing, contradict one another or lie outside their domain; a PSF
/// kernel that is not normalised to 1e-3; an image that is not square.
pub fn read_observation(path: &Path) -> Result<(Observation, ExposureKeywords)> {
    let read = || {
        let image = ImageFile::read(path)?;
        let observation = observation(path, &image)?;
        observation.validate()?;
        Ok((observation, image.keywords))
    };
    read().map_err(|error: Error| error.in_file(FileFault::Observation, path))
}

fn observation(path: &Path, image: &ImageFile) -> Result<Observation> {
    if image.nx != image.ny {
        let size = format!("{}×{} pixels", image.nx, image.ny);
        return Err(Error::out_of_range(
            "size of the image",
            size,
            "square; cut it out, or mask what is added",
        ));
    }
    let keywords = &image.keywords;
    let missing = |name: &str, what: &str| Error::out_of_range(name, "missing", what);
    let exposure_s = keywords.exposure_time_s.ok_or_else(|| missing("EXPTIME", "the exposure time in s"))?;
    let background = keywords.background_rms_e_per_s;
    let background_rms_e_s =
        background.ok_or_else(|| missing("BKGRMS", "the background rms per pixel in e⁻/s"))?;
    if let (Some(lens), Some(source)) = (keywords.z_lens, keywords.z_source) {
        let allowed = format!("above 0 and below ZSOURCE = {source}");
        Domain::inside(0.0, source).check_in_words("ZLENS", lens, &allowed)?;
    }
    Ok(Observation {
        grid: SkyGrid::new(image.nx, image.pixel_scale_arcsec)?,
        data_e_s: image.data.clone(),
        used: image.mask.clone().unwrap_or_else(|| vec![true; image.data.len()]),
        background_rms_e_s,
        exposure_s,
        psf: psf(path, image)?,
    })
}

fn psf(path: &Path, image: &ImageFile) -> Result<Psf> {
    /// Sums of kernels that differ by more than this from 1 are a mistake, not rounding.
    const NORMALISED: f64 = 1e-3;
    match (&image.psf, image.keywords.psf_fwhm_arcsec) {
        (Some(_), Some(fwhm)) => Err(Error::out_of_range(
            "PSFFWHM",
            fwhm,
            "left out beside an extension PSF: one of the two holds",
        )),
        (None, None) => {
            let allowed = "the FWHM of a Gaussian PSF in arcsec (0 for none), or an extension PSF";
            Err(Error::out_of_range("PSFFWHM", "missing", allowed))
        }
        (None, Some(fwhm)) => {
            let truncation = image.keywords.psf_truncation_sigma.unwrap_or(DEFAULT_TRUNCATION_SIGMA);
            let width = image.nx as f64 * image.pixel_scale_arcsec;
            let allowed = format!("between 0 and the width of the image, {width:.4} arcsec");
            Domain::from_to(0.0, width).check_in_words("PSFFWHM", fwhm, &allowed)?;
            let allowed = format!("above 0 and at most {LARGEST_TRUNCATION_SIGMA} standard deviations");
            Domain::above_to(0.0, LARGEST_TRUNCATION_SIGMA)
                .check_in_words("PSFTRUNC", truncation, &allowed)?;
            Psf::gaussian(fwhm, truncation, image.pixel_scale_arcsec)
        }
        (Some(kernel), None) => {
            let total: f64 = kernel.data.iter().sum();
            let near_one = Domain::from_to(1.0 - NORMALISED, 1.0 + NORMALISED);
            let normalised = near_one.check_in_words("sum of the PSF kernel", total, "1 within 1e-3");
            let psf = normalised
                .and_then(|_| Psf::kernel(kernel.nx, kernel.ny, kernel.data.clone(), kernel.oversampling));
            tell_of_centre(path, kernel);
            let fine = image.nx * kernel.oversampling;
            Domain::from_to(1.0, 4096.0)
                .check("pixels of the image times those of the PSF in one", fine as f64)?;
            psf.map_err(|error| error.in_file(FileFault::PsfKernel, path))
        }
    }
}

/// Warns of a kernel whose light is not centred on its middle pixel: a fit would find everything displaced by as much.
fn tell_of_centre(path: &Path, kernel: &PsfKernel) {
    /// Pixels of the image.
    const NOTICED: f64 = 0.25;
    let total: f64 = kernel.data.iter().sum();
    let moment = |along: &dyn Fn(usize) -> usize, side: usize| {
        let weighted: f64 = kernel.data.iter().enumerate().map(|(i, weight)| weight * along(i) as f64).sum();
        (weighted / total - 0.5 * (side as f64 - 1.0)) / kernel.oversampling as f64
    };
    let offset = [moment(&|i| i % kernel.nx, kernel.nx), moment(&|i| i / kernel.nx, kernel.ny)];
    if offset[0].hypot(offset[1]) > NOTICED {
        let [x, y] = offset;
        log::warn!(
            "{}: the light of the PSF is {x:.2}, {y:.2} pixels off the kernel's middle; everything fitted is displaced by as much",
            path.display()
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image() -> ImageFile {
        ImageFile {
            data: vec![0.1; 9],
            nx: 3,
            ny: 3,
            pixel_scale_arcsec: 0.08,
            keywords: ExposureKeywords {
                exposure_time_s: Some(5400.0),
                background_rms_e_per_s: Some(0.006),
                psf_fwhm_arcsec: Some(0.08),
                z_lens: Some(0.5),
                z_source: Some(1.5),
                ..Default::default()
            },
            psf: None,
            mask: None,
        }
    }

    #[test]
    fn what_cannot_be_fitted_is_named() {
        assert!(observation(Path::new("i.fits"), &image()).unwrap().validate().is_ok());
        let fault = |edit: fn(&mut ImageFile)| {
            let mut image = image();
            edit(&mut image);
            observation(Path::new("i.fits"), &image).and_then(|o| o.validate()).unwrap_err().to_string()
        };
        let kernel = |value: f64| PsfKernel { data: vec![value; 9], nx: 3, ny: 3, oversampling: 1 };
        assert!(
            observation(Path::new("i.fits"), &ImageFile { psf: Some(kernel(1.0 / 9.0)), ..image() }).is_err()
        );
        for (message, word) in [
            (fault(|i| i.keywords.exposure_time_s = None), "EXPTIME is missing"),
            (fault(|i| i.keywords.background_rms_e_per_s = None), "BKGRMS is missing"),
            (fault(|i| i.keywords.background_rms_e_per_s = Some(-0.1)), "BKGRMS is -0.1"),
            (fault(|i| i.keywords.psf_fwhm_arcsec = None), "PSFFWHM is missing"),
            (
                fault(|i| i.keywords.psf_fwhm_arcsec = Some(9.2e18)),
                "PSFFWHM is 9.2e18, but must be between 0",
            ),
            (
                fault(|i| i.keywords.psf_truncation_sigma = Some(1e300)),
                "PSFTRUNC is 1e300, but must be above 0",
            ),
            (fault(|i| i.keywords.z_lens = Some(1.5)), "below ZSOURCE"),
            (fault(|i| (i.nx, i.ny) = (9, 1)), "square"),
            (fault(|i| i.mask = Some(vec![false; 9])), "pixels in use"),
            (
                fault(|i| {
                    i.keywords.psf_fwhm_arcsec = None;
                    i.psf = Some(PsfKernel { data: vec![0.2; 9], nx: 3, ny: 3, oversampling: 1 });
                }),
                "1 within 1e-3",
            ),
        ] {
            assert!(message.contains(word), "{message}");
        }
    }
}
