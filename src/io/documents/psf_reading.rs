//! Kernels of a PSF as they are read: on the pixels of an image, or on finer ones.

use std::path::Path;

use fitskit::Hdu;

use super::image_fits::PsfKernel;
use super::image_pixels::{is_image, pixels};
use super::image_wcs::{pixel_scale_arcsec, rounded};
use crate::error::{Error, FileFault, Result};
use crate::io::containers::fits_file as fits;

impl PsfKernel {
    /// Reads a kernel for an image with pixels of `pixel_scale_arcsec`: the extension `PSF` or, without one, the first image.
    ///
    /// # Errors
    /// [`Error::Read`], or [`Error::File`] for a value that is not finite or a pixel scale that does not go into the image's.
    pub fn read(path: &Path, pixel_scale_arcsec: f64) -> Result<Self> {
        let units = fits::read(path)?;
        let named = fits::extension(path, &units, "PSF")?;
        let unit = named.or_else(|| units.iter().find(is_image));
        match unit {
            Some(unit) => read_psf(path, unit, pixel_scale_arcsec),
            None => Err(Error::file(FileFault::PsfKernel, path, "holds no image")),
        }
    }
}

/// A kernel whose header says the size of its pixels, or into how many (`OVERSAMP`) those of the image are parted, or the part
/// itself (PSFEx's `PSF_SAMP`), or nothing: then they are those of the image.
pub(super) fn read_psf(path: &Path, unit: &Hdu, image_scale_arcsec: f64) -> Result<PsfKernel> {
    /// Pixel scales that differ by less than this are equal but for rounding.
    const SCALE_TOLERANCE: f64 = 1e-3;
    /// Finer kernels than this would have a side of tens of thousands of pixels.
    const FINEST: f64 = 64.0;
    let fault = |problem: String| Err(Error::file(FileFault::PsfKernel, path, problem));
    let own_scale =
        pixel_scale_arcsec(path, &unit.header).map_err(|e| e.in_file(FileFault::PsfKernel, path))?;
    let stated_parts = fits::number(path, &unit.header, "OVERSAMP")?;
    if let Some(parts) = stated_parts.filter(|parts| *parts <= 0.0) {
        return fault(format!("OVERSAMP is {parts}, but must be positive"));
    }
    if let (Some(own), Some(parts)) = (own_scale, stated_parts)
        && (own * parts / image_scale_arcsec - 1.0).abs() > SCALE_TOLERANCE
    {
        log::warn!(
            "{}: the PSF has pixels of {} arcsec, which counts, though OVERSAMP = {parts} of the image's {} arcsec are others",
            path.display(),
            rounded(own),
            rounded(image_scale_arcsec)
        );
    }
    let own_scale = match own_scale {
        None => match stated_parts {
            Some(parts) => Some(image_scale_arcsec / parts),
            None => fits::number(path, &unit.header, "PSF_SAMP")?.map(|step| image_scale_arcsec * step),
        },
        stated => stated,
    };
    if own_scale.is_none() {
        log::info!(
            "{}: the PSF does not say how large its pixels are; they are taken for those of the image, {} arcsec",
            path.display(),
            rounded(image_scale_arcsec)
        );
    }
    let parts = image_scale_arcsec / own_scale.unwrap_or(image_scale_arcsec);
    let whole = parts.round();
    if !(1.0..=FINEST).contains(&whole) || (parts / whole - 1.0).abs() > SCALE_TOLERANCE {
        return fault(format!(
            "the PSF has pixels of {} arcsec, but must have those of the image, {} arcsec, \
             or a half, a third … a 64th of them",
            rounded(own_scale.unwrap_or(image_scale_arcsec)),
            rounded(image_scale_arcsec)
        ));
    }
    if whole > 1.0 {
        log::info!(
            "{}: the PSF has {whole}×{whole} pixels for one of the image, and is used so",
            path.display()
        );
    }
    let (data, nx, ny) = pixels(path, unit, "PSF")?;
    if let Some(value) = data.iter().find(|value| !value.is_finite()) {
        return fault(format!("PSF holds {value}; finite numbers only"));
    }
    if let Some(note) = note_on_negative_pixels(&data) {
        log::info!("{}: {note}", path.display());
    }
    Ok(PsfKernel { data, nx, ny, oversampling: whole as usize })
}

/// What is said of a kernel with negative pixels, as deconvolutions leave them.
fn note_on_negative_pixels(kernel: &[f64]) -> Option<String> {
    let total: f64 = kernel.iter().sum();
    let negative: Vec<f64> = kernel.iter().copied().filter(|value| *value < 0.0).collect();
    let (count, part) = (negative.len(), negative.iter().sum::<f64>() / total);
    let note = || {
        format!("{count} pixels of the PSF are negative, {part:.2e} of its sum; they are used as they are")
    };
    (total > 0.0 && count > 0).then(note)
}

#[cfg(test)]
mod tests {
    use super::super::image_fits::ImageFile;
    use super::*;
    use fitskit::{HeaderValue, ImageData, PixelData};

    /// An image with these extensions and one keyword more each.
    fn file_with(extensions: &[(&str, &[(&str, f64)])]) -> (tempfile::TempDir, std::path::PathBuf) {
        let image = |side: usize| ImageData::new(vec![side, side], PixelData::F64(vec![1.0; side * side]));
        let mut primary = Hdu::primary_image(image(9));
        for (name, value) in [("PIXSCALE", 0.1), ("EXPTIME", 1000.0), ("BKGRMS", 0.01), ("PSFFWHM", 0.1)] {
            primary.header.set(name, HeaderValue::Float(value), None);
        }
        let named = |(name, numbers): &(&str, &[(&str, f64)])| {
            let mut unit = Hdu::image_extension(image(9));
            unit.header.set("EXTNAME", HeaderValue::String((*name).into()), None);
            numbers.iter().for_each(|(name, value)| unit.header.set(name, HeaderValue::Float(*value), None));
            unit
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("i.fits");
        fits::write(&path, [primary].into_iter().chain(extensions.iter().map(named)).collect()).unwrap();
        (folder, path)
    }

    #[test]
    fn a_second_extension_of_a_name_is_refused() {
        let none: &[(&str, f64)] = &[];
        for name in ["MASK", "PSF"] {
            let (_folder, path) = file_with(&[(name, none)]);
            ImageFile::read(&path).unwrap();
            let (_folder, path) = file_with(&[(name, none), (&name.to_lowercase(), none)]);
            let error = ImageFile::read(&path).unwrap_err().to_string();
            assert!(error.contains(&format!("has 2 extensions called {name}, but may have one")), "{error}");
        }
    }

    #[test]
    fn a_kernel_is_as_fine_as_its_scale_or_else_its_oversampling_says() {
        for (keywords, oversampling) in [
            (&[][..], 1),
            (&[("OVERSAMP", 4.0)], 4),
            (&[("PSF_SAMP", 0.25)], 4),
            (&[("PIXELSCL", 0.05)], 2),
            (&[("OVERSAMP", 4.0), ("PIXELSCL", 0.05)], 2),
        ] {
            let (_folder, path) = file_with(&[("PSF", keywords)]);
            assert_eq!(PsfKernel::read(&path, 0.1).unwrap().oversampling, oversampling);
        }
        for (parts, problem) in [(0.3, "or a half, a third"), (0.0, "OVERSAMP is 0, but must be positive")] {
            let (_folder, path) = file_with(&[("PSF", &[("OVERSAMP", parts)])]);
            let error = PsfKernel::read(&path, 0.1).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
    }

    #[test]
    fn negative_pixels_of_a_kernel_are_counted() {
        let note = note_on_negative_pixels(&[0.5, -0.25, 4.0, -0.25]).unwrap();
        assert!(note.starts_with("2 pixels of the PSF are negative, -1.25e-1 of its sum"), "{note}");
        assert_eq!(note_on_negative_pixels(&[0.5, 0.0]), None);
    }
}
