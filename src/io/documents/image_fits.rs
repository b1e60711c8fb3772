//! Images as FITS: float64 in electron/s, with WCS, exposure keywords, and extensions PSF and MASK.

use std::path::Path;

use fitskit::{Hdu, HduData, Header, HeaderValue, ImageData, PixelData};

use super::exposure_keywords::ExposureKeywords;
use super::image_wcs::{pixel_scale_arcsec as scale_of, push_wcs};
use crate::error::{Domain, Error, FileFault, Result};
use crate::imaging::{Instrument, PixelSampling, Psf, SkyGrid};
use crate::io::containers::{Provenance, fits_file as fits, write_atomically};

/// A PSF kernel on the pixels of the image, row-major (y, x).
#[derive(Debug, Clone, PartialEq)]
pub struct PsfKernel {
    /// Values, `ny` rows of `nx`.
    pub data: Vec<f64>,
    /// Columns.
    pub nx: usize,
    /// Rows.
    pub ny: usize,
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
                Psf::Kernel { width, weights } => {
                    Some(PsfKernel { data: weights.clone(), nx: *width, ny: *width })
                }
                _ => None,
            },
            mask: None,
        }
    }

    /// Reads an image: the primary one or, where that is empty, the first image extension that is
    /// neither PSF nor MASK. Integer and scaled pixels are converted.
    ///
    /// A pixel that is not finite must be masked out, and is then returned as 0.
    ///
    /// # Errors
    /// [`Error::Read`] or [`Error::File`], naming keyword, extension or pixel.
    pub fn read(path: &Path) -> Result<Self> {
        let units = fits::read(path)?;
        let extension = |name| units.iter().skip(1).find(|unit| fits::is_called(unit, name));
        let (psf, mask) = (extension("PSF"), extension("MASK"));
        let is_image = |unit: &&Hdu| matches!(&unit.data, HduData::Image(_));
        let is_extra = |unit: &Hdu| fits::is_called(unit, "PSF") || fits::is_called(unit, "MASK");
        let unit = units.iter().find(|unit| is_image(unit) && !is_extra(unit));
        let Some(unit) = unit else { return Err(Error::file(FileFault::Content, path, "holds no image")) };

        let (mut data, nx, ny) = pixels(path, unit, "the image")?;
        check_unit(path, &unit.header)?;
        let mask = mask.map(|unit| read_mask(path, unit, (nx, ny))).transpose()?;
        check_finite(path, &mut data, nx, mask.as_deref())?;
        let psf = psf.map(|unit| read_psf(path, unit)).transpose()?;
        let keywords = ExposureKeywords::read(path, &unit.header)?;
        let pixel_scale_arcsec = scale_of(path, &unit.header)?;
        Ok(Self { data, nx, ny, pixel_scale_arcsec, keywords, psf, mask })
    }

    /// Writes the image atomically; the same image and provenance give the same bytes.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] when sizes do not fit together, [`Error::OutputPlace`], [`Error::Write`].
    pub fn write(&self, path: &Path, provenance: &Provenance) -> Result<()> {
        check_size("image", self.data.len(), self.nx, self.ny)?;
        Domain::POSITIVE.check("pixel scale (arcsec)", self.pixel_scale_arcsec)?;
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
            units.push(extension("PSF", image(psf.nx, psf.ny, PixelData::F64(psf.data.clone()))));
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

/// Scaled pixels with the two axes; further axes must have length 1.
fn pixels(path: &Path, unit: &Hdu, what: &str) -> Result<(Vec<f64>, usize, usize)> {
    let axes = match &unit.data {
        HduData::Image(image) => image.axes.as_slice(),
        _ => &[],
    };
    let (HduData::Image(image), [nx, ny, rest @ ..]) = (&unit.data, axes) else {
        return Err(Error::file(FileFault::Content, path, format!("{what} has no two axes")));
    };
    if rest.iter().any(|&length| length != 1) {
        return Err(Error::file(
            FileFault::Content,
            path,
            format!("{what} has the axes {axes:?}, but must have two"),
        ));
    }
    let scale = fits::number(path, &unit.header, "BSCALE")?.unwrap_or(1.0);
    let zero = fits::number(path, &unit.header, "BZERO")?.unwrap_or(0.0);
    Ok((image.scaled_values(scale, zero), *nx, *ny))
}

/// The project's flux unit under the names in use; an image without `BUNIT` is taken to have it.
fn check_unit(path: &Path, header: &Header) -> Result<()> {
    let Some(unit) = header.get_string("BUNIT") else { return Ok(()) };
    let plain = unit.trim().to_ascii_lowercase().replace(' ', "");
    match plain.as_str() {
        "" | "electron/s" | "electrons/s" | "e-/s" | "e/s" | "electrons-1" | "electrons**-1" => Ok(()),
        _ => Err(Error::file(
            FileFault::Content,
            path,
            format!("BUNIT is '{unit}', but must be 'electron/s': divide by gain and time"),
        )),
    }
}

fn check_finite(path: &Path, data: &mut [f64], nx: usize, mask: Option<&[bool]>) -> Result<()> {
    for (i, value) in data.iter_mut().enumerate().filter(|(_, value)| !value.is_finite()) {
        if mask.is_none_or(|mask| mask[i]) {
            let problem = format!(
                "pixel x = {}, y = {} (counted from 1) is {value}; finite numbers only, \
                 or leave it out with an extension MASK (1 = use the pixel)",
                i % nx + 1,
                i / nx + 1
            );
            return Err(Error::file(FileFault::Content, path, problem));
        }
        *value = 0.0;
    }
    Ok(())
}

fn read_mask(path: &Path, unit: &Hdu, (nx, ny): (usize, usize)) -> Result<Vec<bool>> {
    let (values, mask_nx, mask_ny) = pixels(path, unit, "MASK")?;
    if (mask_nx, mask_ny) != (nx, ny) {
        let problem = format!("MASK has {mask_nx}x{mask_ny} pixels, but the image has {nx}x{ny}");
        return Err(Error::file(FileFault::Content, path, problem));
    }
    match values.iter().find(|&&value| value != 0.0 && value != 1.0) {
        Some(value) => Err(Error::file(
            FileFault::Content,
            path,
            format!("MASK holds {value}; allowed: 1 = use the pixel, 0 = do not"),
        )),
        None => Ok(values.iter().map(|&value| value == 1.0).collect()),
    }
}

impl PsfKernel {
    /// Reads a kernel that lies on pixels of `pixel_scale_arcsec`: the extension `PSF` or, without one, the first image.
    ///
    /// # Errors
    /// [`Error::Read`], or [`Error::File`] for a value that is not finite or a stated pixel scale that differs.
    pub fn read(path: &Path, pixel_scale_arcsec: f64) -> Result<Self> {
        /// Pixel scales that differ by less than this are equal but for rounding.
        const SCALE_TOLERANCE: f64 = 1e-3;
        let units = fits::read(path)?;
        let named = units.iter().find(|unit| fits::is_called(unit, "PSF"));
        let unit = named.or_else(|| units.iter().find(|unit| matches!(&unit.data, HduData::Image(_))));
        let Some(unit) = unit else { return Err(Error::file(FileFault::PsfKernel, path, "holds no image")) };
        let has_scale = ["CDELT1", "CD1_1", "PIXSCALE"].iter().any(|name| unit.header.find(name).is_some());
        if has_scale {
            let stated = scale_of(path, &unit.header)?;
            if (stated / pixel_scale_arcsec - 1.0).abs() > SCALE_TOLERANCE {
                let problem = format!(
                    "the PSF has pixels of {stated} arcsec, but must have those of the image, {pixel_scale_arcsec} arcsec"
                );
                return Err(Error::file(FileFault::PsfKernel, path, problem));
            }
        }
        read_psf(path, unit)
    }
}

fn read_psf(path: &Path, unit: &Hdu) -> Result<PsfKernel> {
    let (data, nx, ny) = pixels(path, unit, "PSF")?;
    match data.iter().find(|value| !value.is_finite()) {
        Some(value) => {
            Err(Error::file(FileFault::PsfKernel, path, format!("PSF holds {value}; finite numbers only")))
        }
        None => Ok(PsfKernel { data, nx, ny }),
    }
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
            psf: Some(PsfKernel { data: vec![0.25, 0.5, 0.25], nx: 3, ny: 1 }),
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
        nan.mask = None;
        let (_folder, path) = write(&nan);
        let error = ImageFile::read(&path).unwrap_err().to_string();
        assert!(error.contains("pixel x = 3, y = 1 (counted from 1) is NaN; finite numbers only"), "{error}");
    }

    #[test]
    fn wrong_units_masks_and_keywords_are_named() {
        let text = |value: &str| HeaderValue::String(value.into());
        assert_eq!(
            fault(|units| units[0].header.set("BUNIT", text("adu"), None)),
            "BUNIT is 'adu', but must be 'electron/s': divide by gain and time"
        );
        assert_eq!(
            fault(|units| units[0].header.set("PIXSAMP", text("fine"), None)),
            "PIXSAMP is 'fine', but must be 'point' or 'adaptive'"
        );
        assert_eq!(
            fault(|units| units[0].header.set("PIXSAMP", HeaderValue::Integer(1), None)),
            "PIXSAMP is 'not text', but must be 'point' or 'adaptive'"
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
        assert_eq!(fault(|units| *units = vec![Hdu::primary_empty()]), "holds no image");
    }

    #[test]
    fn a_kernel_needs_no_pixel_scale_but_must_not_state_another() {
        let (_folder, path) = write(&sample());
        assert_eq!(Some(PsfKernel::read(&path, 0.1).unwrap()), sample().psf, "the extension is taken");
        let (_second, path) = write(&ImageFile { psf: None, mask: None, ..sample() });
        assert_eq!(PsfKernel::read(&path, 0.08).unwrap().data, sample().data);
        let error = PsfKernel::read(&path, 0.1).unwrap_err().to_string();
        assert!(
            error.ends_with("pixels of 0.08 arcsec, but must have those of the image, 0.1 arcsec"),
            "{error}"
        );
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
