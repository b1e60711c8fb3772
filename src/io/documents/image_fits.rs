//! Images as FITS: float64 in electron/s, with WCS, exposure keywords, and extensions PSF and MASK.

use std::path::Path;

use fitskit::{Hdu, HeaderValue, ImageData, PixelData};

use super::exposure_keywords::ExposureKeywords;
use super::image_wcs::push_wcs;
use crate::error::{Domain, Error, Result};
use crate::imaging::{Instrument, PixelSampling, Psf, SkyGrid};
use crate::io::containers::{Provenance, fits_file as fits, write_atomically};

/// A PSF kernel on the pixels of the image or on finer ones, row-major (y, x).
#[derive(Debug, Clone, PartialEq)]
pub struct PsfKernel {
    /// Values, `ny` rows of `nx`.
    pub data: Vec<f64>,
    /// Columns.
    pub nx: usize,
    /// Rows.
    pub ny: usize,
    /// Its own pixels along the side of an image's pixel.
    pub oversampling: usize,
}

/// An image with what is needed to fit it.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageFile {
    /// Flux in electron/s per pixel, row-major (y, x); the first pixel is at the bottom left.
    pub data: Vec<f64>,
    /// Columns (x to the right).
    pub nx: usize,
    /// Rows (y up).
    pub ny: usize,
    /// Side of a pixel, arcsec.
    pub pixel_scale_arcsec: f64,
    /// What the header says about the exposure.
    pub keywords: ExposureKeywords,
    /// Extension `PSF`.
    pub psf: Option<PsfKernel>,
    /// Extension `MASK`, in the order of `data`: true where the pixel is used.
    pub mask: Option<Vec<bool>>,
}

impl ImageFile {
    /// Pixels of a simulated exposure as the fitter reads them: with exposure time, background, PSF and redshifts.
    pub fn simulated(
        pixels_e_s: &[f64],
        grid: &SkyGrid,
        instrument: &Instrument,
        psf: &Psf,
        sampling: PixelSampling,
        [z_lens, z_source]: [f64; 2],
    ) -> Self {
        let n = grid.pixels();
        let gaussian = matches!(psf, Psf::Gaussian(_));
        Self {
            data: pixels_e_s.to_vec(),
            nx: n,
            ny: n,
            pixel_scale_arcsec: grid.pixel_scale_arcsec(),
            keywords: ExposureKeywords {
                exposure_time_s: Some(instrument.exposure_s),
                background_rms_e_per_s: Some(instrument.background_rms_e_s()),
                psf_fwhm_arcsec: gaussian.then_some(instrument.psf_fwhm_arcsec),
                psf_truncation_sigma: gaussian.then_some(instrument.psf_truncation_sigma),
                z_lens: Some(z_lens),
                z_source: Some(z_source),
                pixel_sampling: Some(sampling),
            },
            psf: match psf {
                Psf::Kernel { width, weights, oversampling } => Some(PsfKernel {
                    data: weights.clone(),
                    nx: *width,
                    ny: *width,
                    oversampling: *oversampling,
                }),
                _ => None,
            },
            mask: None,
        }
    }

    /// Writes the image atomically; the same image and provenance give the same bytes.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when sizes do not fit together, [`Error::OutputPlace`], [`Error::Write`].
    pub fn write(&self, path: &Path, provenance: &Provenance) -> Result<()> {
        check_size("image", self.data.len(), self.nx, self.ny)?;
        Domain::POSITIVE.check("pixel scale (arcsec)", self.pixel_scale_arcsec)?;
        let is_used = |i: usize| self.mask.as_ref().is_none_or(|mask| mask.get(i).copied().unwrap_or(true));
        if let Some(i) = (0..self.data.len()).find(|&i| is_used(i) && !self.data[i].is_finite()) {
            let what = format!("pixel x = {}, y = {} (counted from 1)", i % self.nx + 1, i / self.nx + 1);
            return Err(Error::out_of_range(&what, self.data[i], "a finite number"));
        }
        let mut primary = Hdu::primary_image(image(self.nx, self.ny, PixelData::F64(self.data.clone())));
        let header = &mut primary.header;
        if self.psf.is_some() || self.mask.is_some() {
            header.set("EXTEND", HeaderValue::Logical(true), Some("PSF or MASK follows"));
        }
        fits::push_text(header, "BUNIT", "electron/s", "per pixel");
        self.keywords.push(header)?;
        push_wcs(header, self.nx, self.ny, self.pixel_scale_arcsec);
        fits::push_provenance(header, provenance);
        let mut units = vec![primary];
        if let Some(psf) = &self.psf {
            check_size("PSF", psf.data.len(), psf.nx, psf.ny)?;
            let mut unit = extension("PSF", image(psf.nx, psf.ny, PixelData::F64(psf.data.clone())));
            let scale = self.pixel_scale_arcsec / psf.oversampling as f64;
            fits::push_f64(&mut unit.header, "PIXSCALE", scale, "arcsec, side of a pixel of the PSF");
            units.push(unit);
        }
        if let Some(mask) = &self.mask {
            check_size("mask", mask.len(), self.nx, self.ny)?;
            let flags = mask.iter().map(|&used| u8::from(used)).collect();
            units.push(extension("MASK", image(self.nx, self.ny, PixelData::U8(flags))));
        }
        write_atomically(path, |temporary| fits::write(temporary, units))
    }
}

fn image(nx: usize, ny: usize, pixels: PixelData) -> ImageData {
    ImageData::new(vec![nx, ny], pixels)
}

fn extension(name: &str, image: ImageData) -> Hdu {
    let mut unit = Hdu::image_extension(image);
    fits::push_text(&mut unit.header, "EXTNAME", name, "name of this extension");
    unit
}

fn check_size(what: &str, length: usize, nx: usize, ny: usize) -> Result<()> {
    if length != nx * ny || length == 0 {
        let allowed = format!("nx·ny = {nx}·{ny}, and not 0");
        return Err(Error::out_of_range(&format!("the number of pixels of the {what}"), length, &allowed));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> ImageFile {
        let keywords = ExposureKeywords {
            exposure_time_s: Some(5400.0),
            background_rms_e_per_s: Some(0.005919973387690837),
            psf_fwhm_arcsec: Some(0.08),
            z_lens: Some(0.1 + 0.2),
            pixel_sampling: Some(PixelSampling::Point),
            ..Default::default()
        };
        ImageFile {
            data: vec![1.0, -2.5e-300, 0.1 + 0.2, 4.0, 5.0, 6.0],
            nx: 3,
            ny: 2,
            pixel_scale_arcsec: 0.08,
            keywords,
            psf: Some(PsfKernel { data: vec![0.25, 0.5, 0.25], nx: 3, ny: 1, oversampling: 2 }),
            mask: Some(vec![true, true, false, true, true, true]),
        }
    }

    fn write(image: &ImageFile) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image.fits");
        image.write(&path, &Provenance::new(Some(1), "a = 1\n")).unwrap();
        (folder, path)
    }

    /// Writes the sample, lets `edit` change the units, and returns the reader's error.
    fn fault(edit: impl FnOnce(&mut Vec<Hdu>)) -> String {
        let (_folder, path) = write(&sample());
        let mut units = fits::read(&path).unwrap();
        edit(&mut units);
        fits::write(&path, units).unwrap();
        let error = ImageFile::read(&path).unwrap_err();
        assert!(error.is_bad_input());
        error.to_string().split_once("image.fits: ").unwrap().1.into()
    }

    #[test]
    fn an_image_survives_to_the_bit_and_the_same_one_gives_the_same_bytes() {
        let (_folder, path) = write(&sample());
        assert_eq!(ImageFile::read(&path).unwrap(), sample());
        let (_second, again) = write(&sample());
        assert!(std::fs::read(&path).unwrap() == std::fs::read(again).unwrap());
        let bare = ImageFile { psf: None, mask: None, keywords: Default::default(), ..sample() };
        let (_third, path) = write(&bare);
        assert_eq!(ImageFile::read(&path).unwrap(), bare);
    }

    #[test]
    fn an_image_in_an_extension_and_integers_with_an_offset_are_read() {
        let (_folder, path) = write(&sample());
        let mut units = fits::read(&path).unwrap();
        let mut unit = extension("SCI", image(3, 2, PixelData::I16(vec![-32768, 0, 1, 2, 3, 4])));
        unit.header.keywords.extend(units[0].header.keywords.drain(5..)); // all but the five of the shape
        unit.header.set("BZERO", HeaderValue::Float(32768.0), None);
        units[0] = Hdu::primary_empty();
        units.push(unit);
        fits::write(&path, units).unwrap();
        let image = ImageFile::read(&path).unwrap();
        assert_eq!(image.data, [0.0, 32768.0, 32769.0, 32770.0, 32771.0, 32772.0]);
        assert_eq!((image.keywords.exposure_time_s, image.pixel_scale_arcsec), (Some(5400.0), 0.08));
    }

    #[test]
    fn pixels_that_are_no_numbers_must_be_masked_out() {
        let mut nan = sample();
        nan.data[2] = f64::NAN;
        let (_folder, path) = write(&nan);
        assert_eq!(ImageFile::read(&path).unwrap().data[2], 0.0);
        let mut units = fits::read(&path).unwrap();
        units.pop();
        fits::write(&path, units).unwrap();
        let error = ImageFile::read(&path).unwrap_err().to_string();
        nan.mask = None;
        let refused = nan.write(&path, &Provenance::new(None, "")).unwrap_err().to_string();
        assert!(refused.contains("pixel x = 3, y = 1 (counted from 1) is NaN"), "{refused}");
        assert!(error.contains("pixel x = 3, y = 1 (counted from 1) is NaN; finite numbers only"), "{error}");
    }

    #[test]
    fn wrong_units_masks_and_keywords_are_named() {
        let text = |value: &str| HeaderValue::String(value.into());
        assert_eq!(
            fault(|units| units[0].header.set("BUNIT", text("adu"), None)),
            "BUNIT is 'adu', but must be 'electron/s': multiply by the electrons per count, divide by the exposure time (EXPTIME = 5400 s)"
        );
        assert_eq!(
            fault(|units| units[0].header.set("PIXSAMP", text("fine"), None)),
            "PIXSAMP is 'fine', but must be 'point' or 'adaptive'"
        );
        assert_eq!(
            fault(|units| units[0].header.set("PIXSAMP", HeaderValue::Integer(1), None)),
            "PIXSAMP is '1', but must be 'point' or 'adaptive'"
        );
        assert_eq!(
            fault(|units| units[0].header.set("EXPTIME", text("long"), None)),
            "keyword EXPTIME is 'long', but must be a finite number"
        );
        assert_eq!(
            fault(|units| units[2] = extension("MASK", image(2, 3, PixelData::U8(vec![1; 6])))),
            "MASK has 2x3 pixels, but the image has 3x2"
        );
        assert_eq!(
            fault(|units| units[2] = extension("MASK", image(3, 2, PixelData::U8(vec![2; 6])))),
            "MASK holds 2; allowed: 1 = use the pixel, 0 = do not"
        );
        assert_eq!(
            fault(|units| *units = vec![Hdu::primary_empty()]),
            "holds no image; its extensions are: none"
        );
    }

    #[test]
    fn a_kernel_lies_on_the_pixels_of_the_image_or_on_whole_parts_of_them() {
        let (_folder, path) = write(&sample());
        assert_eq!(Some(PsfKernel::read(&path, 0.08).unwrap()), sample().psf, "the extension is taken");
        let (_second, path) = write(&ImageFile { psf: None, mask: None, ..sample() });
        let kernel = |scale| PsfKernel::read(&path, scale);
        assert_eq!((kernel(0.08).unwrap().data, kernel(0.24).unwrap().oversampling), (sample().data, 3));
        for scale in [0.1, 0.04, 0.08 * 65.0] {
            let error = kernel(scale).unwrap_err().to_string();
            assert!(
                error.contains("the PSF has pixels of 0.08 arcsec, but must have those of the image"),
                "{error}"
            );
        }
        let bare = Hdu::primary_image(image(3, 1, PixelData::F64(vec![1.0, 2.0, 1.0])));
        fits::write(&path, vec![bare]).unwrap();
        assert_eq!(PsfKernel::read(&path, 0.1).unwrap().data, [1.0, 2.0, 1.0]);
    }

    #[test]
    fn an_image_of_the_wrong_size_is_not_written() {
        let image = ImageFile { nx: 4, ..sample() };
        let error = image.write(Path::new("image.fits"), &Provenance::new(None, "")).unwrap_err().to_string();
        assert_eq!(error, "the number of pixels of the image is 6, but must be nx·ny = 4·2, and not 0");
    }
}
