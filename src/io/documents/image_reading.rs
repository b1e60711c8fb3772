//! Images as they are read: which extension is the image, what its header inherits, which pixels are numbers, its PSF and MASK.

use std::path::Path;

use fitskit::{Hdu, HduData, Header, PixelData};

use super::exposure_keywords::ExposureKeywords;
use super::flux_unit;
use super::image_fits::{ImageFile, PsfKernel};
use super::image_wcs::{pixel_scale_arcsec, rotation_deg, rounded};
use crate::error::{Error, FileFault, Result};
use crate::io::containers::fits_file as fits;
use crate::io::containers::other_method;

/// Parts of an extension's name that say that it is no image of the sky, but goes with one; a number may follow.
const HELPERS: [&str; 15] =
    ["PSF", "WHT", "WGT", "ERR", "DQ", "RMS", "STD", "VAR", "UNC", "CTX", "CON", "BKG", "SKY", "EXP", "BPM"];
/// The same of words that come in several forms: what begins like one counts.
const HELPER_WORDS: [&str; 18] = [
    "MASK", "WEIGHT", "ERROR", "VARIANCE", "IVAR", "INVVAR", "UNCERT", "SIGMA", "NOISE", "STAT", "QUAL",
    "FLAG", "BADPIX", "BACKGR", "SAMP", "TIME", "AREA", "EXPOS",
];
/// Keywords of a primary header that describe its own data or the file, and hold for no extension.
const NOT_INHERITED: [&str; 12] = [
    "SIMPLE", "BITPIX", "EXTEND", "BLANK", "BSCALE", "BZERO", "PCOUNT", "GCOUNT", "CHECKSUM", "DATASUM",
    "EXTNAME", UNIT,
];
/// The unit of the pixels: that of a primary header without pixels is meant for the extensions.
const UNIT: &str = "BUNIT";

impl ImageFile {
    /// Reads an image, packed (`.gz`, tile-compressed) or not: the extension SCI, else the primary image, else the only
    /// one that is no weight, error, flag, PSF or MASK. Integer and scaled pixels are converted; BLANK is no number.
    ///
    /// A pixel that is not finite must be masked out, and is then returned as 0. An extension has the keywords of the
    /// primary header that it lacks, if it says INHERIT; without a word it has those of the exposure, which is logged.
    ///
    /// # Errors
    /// [`Error::Read`] or [`Error::File`], naming keyword, extension or pixel.
    pub fn read(path: &Path) -> Result<Self> {
        let units = fits::read(path)?;
        let unit = choose_image(path, &units)?;
        let extension = |name| fits::extension(path, &units, name);
        let (mut data, nx, ny) = pixels(path, unit, "the image")?;
        let header = header_of(path, unit, &units[0])?;
        flux_unit::check(path, &header)?;
        let mask = extension("MASK")?.map(|unit| read_mask(path, unit, (nx, ny))).transpose()?;
        check_finite(path, &mut data, nx, mask.as_deref())?;
        let keywords = ExposureKeywords::read(path, &header)?;
        let Some(pixel_scale_arcsec) = scale_of(path, unit, &header, &units[0])? else {
            let problem = "has no pixel scale; CDELT1 and CDELT2 (deg), CD1_1 … CD2_2 (deg) or PIXSCALE (arcsec) is wanted";
            return Err(Error::file(FileFault::Content, path, problem));
        };
        if let Some(angle) = rotation_deg(path, &header)?.filter(|angle| angle.abs() > 0.1) {
            let path = path.display();
            log::info!(
                "{path}: north lies {angle:.1} deg from the pixels' y axis, counter-clockwise; x and y of results are the pixels'"
            );
        }
        let psf = extension("PSF")?.map(|unit| read_psf(path, unit, pixel_scale_arcsec)).transpose()?;
        Ok(Self { data, nx, ny, pixel_scale_arcsec, keywords, psf, mask })
    }
}

/// The image among the units; what else there is goes into the log or the error.
fn choose_image<'a>(path: &Path, units: &'a [Hdu]) -> Result<&'a Hdu> {
    let images: Vec<&Hdu> = units.iter().filter(is_image).collect();
    let science: Vec<&Hdu> = images.iter().copied().filter(|unit| fits::is_called(unit, "SCI")).collect();
    let plain: Vec<&Hdu> = images.iter().copied().filter(|unit| !is_helper(unit)).collect();
    let primary = units.first().filter(is_image);
    let chosen = match (science.as_slice(), primary, plain.as_slice()) {
        ([only], ..) => only,
        ([], Some(primary), _) => primary,
        ([], None, [only]) => only,
        _ => {
            let names = list(units.iter().skip(1).collect());
            let problem = match images.as_slice() {
                [] => format!("holds no image; its extensions are: {names}"),
                _ => format!(
                    "does not say which image to take; give one alone EXTNAME = 'SCI'; its extensions are: {names}"
                ),
            };
            return Err(Error::file(FileFault::Content, path, problem));
        }
    };
    let is_used = |unit: &Hdu| {
        std::ptr::eq(unit, chosen) || fits::is_called(unit, "PSF") || fits::is_called(unit, "MASK")
    };
    let unused: Vec<&Hdu> = images.into_iter().filter(|unit| !is_used(unit)).collect();
    if !unused.is_empty() {
        log::info!("{}: the image {} is taken; not used: {}", path.display(), name(chosen), list(unused));
    }
    Ok(chosen)
}

fn is_image(unit: &&Hdu) -> bool {
    matches!(&unit.data, HduData::Image(_)) || other_method(&unit.header).is_some()
}

fn is_helper(unit: &Hdu) -> bool {
    let name = name(unit).to_ascii_uppercase();
    name.split(['_', '-', ' ']).any(|part| {
        HELPERS.contains(&part.trim_end_matches(|digit: char| digit.is_ascii_digit()))
            || HELPER_WORDS.iter().any(|word| part.starts_with(word))
    })
}

fn name(unit: &Hdu) -> &str {
    let unnamed = if unit.header.find("SIMPLE").is_some() { "(primary)" } else { "(unnamed)" };
    unit.header.get_string("EXTNAME").map_or(unnamed, str::trim)
}

fn list(units: Vec<&Hdu>) -> String {
    let names: Vec<&str> = units.into_iter().map(name).collect();
    if names.is_empty() { "none".into() } else { names.join(", ") }
}

/// The header of a unit with what it inherits from the primary one.
fn header_of(path: &Path, unit: &Hdu, primary: &Hdu) -> Result<Header> {
    let mut header = unit.header.clone();
    if std::ptr::eq(unit, primary) {
        return Ok(header);
    }
    let stated = header.get_bool("INHERIT");
    let exposure = ExposureKeywords::NAMES;
    let mut taken = Vec::new();
    for keyword in primary.header.iter().filter(|keyword| keyword.value.is_some()) {
        let own = keyword.name.as_str();
        let is_for_others = own == UNIT && matches!(primary.data, HduData::Empty);
        let holds = match stated {
            None | Some(true) if is_for_others => true,
            Some(true) => !NOT_INHERITED.contains(&own) && !own.starts_with("NAXIS"),
            Some(false) => false,
            None => exposure.contains(&own),
        };
        if holds && header.find(own).is_none() {
            header.push(keyword.clone());
            taken.push(own);
        }
    }
    if stated.is_none() && !taken.is_empty() {
        let (path, image, taken) = (path.display(), name(unit), taken.join(", "));
        log::info!("{path}: the image {image} has {taken} from the primary header");
    }
    Ok(header)
}

/// The pixel scale that the image states; without one that of a primary header without pixels, which is meant for it.
fn scale_of(path: &Path, unit: &Hdu, header: &Header, primary: &Hdu) -> Result<Option<f64>> {
    let own = pixel_scale_arcsec(path, header)?;
    let is_alone = unit.header.get_bool("INHERIT") == Some(false) || !matches!(primary.data, HduData::Empty);
    if own.is_some() || is_alone {
        return Ok(own);
    }
    let stated = pixel_scale_arcsec(path, &primary.header)?;
    if let Some(scale) = stated {
        let (path, image, scale) = (path.display(), name(unit), rounded(scale));
        log::info!("{path}: the image {image} has its pixel scale, {scale} arcsec, from the primary header");
    }
    Ok(stated)
}

/// Scaled pixels with the two axes; further axes must have length 1. Integers that are BLANK are not numbers.
fn pixels(path: &Path, unit: &Hdu, what: &str) -> Result<(Vec<f64>, usize, usize)> {
    let fault = |problem: String| Err(Error::file(FileFault::Content, path, problem));
    let HduData::Image(image) = &unit.data else {
        let why = other_method(&unit.header).unwrap_or_else(|| "has no pixels".into());
        return fault(format!("{what} {why}"));
    };
    let [nx, ny, rest @ ..] = image.axes.as_slice() else { return fault(format!("{what} has no two axes")) };
    if rest.iter().any(|&length| length != 1) {
        return fault(format!("{what} has the axes {:?}, but must have two", image.axes));
    }
    let number = |name| fits::number(path, &unit.header, name);
    let (scale, zero) = (number("BSCALE")?.unwrap_or(1.0), number("BZERO")?.unwrap_or(0.0));
    if scale == 0.0 {
        return fault(format!("BSCALE of {what} is 0, but must not be"));
    }
    let mut values = image.scaled_values(scale, zero);
    let blank = number("BLANK")?.or(number("ZBLANK")?);
    if let (Some(blank), false) = (blank, matches!(image.pixels, PixelData::F32(_) | PixelData::F64(_))) {
        let raw = image.scaled_values(1.0, 0.0);
        values.iter_mut().zip(raw).filter(|(_, raw)| *raw == blank).for_each(|(value, _)| *value = f64::NAN);
    }
    Ok((values, *nx, *ny))
}

fn check_finite(path: &Path, data: &mut [f64], nx: usize, mask: Option<&[bool]>) -> Result<()> {
    for (i, value) in data.iter_mut().enumerate().filter(|(_, value)| !value.is_finite()) {
        if mask.is_none_or(|mask| mask[i]) {
            let problem = format!(
                "pixel x = {}, y = {} (counted from 1) is {value}; finite numbers only, which BLANK is not, \
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
fn read_psf(path: &Path, unit: &Hdu, image_scale_arcsec: f64) -> Result<PsfKernel> {
    /// Pixel scales that differ by less than this are equal but for rounding.
    const SCALE_TOLERANCE: f64 = 1e-3;
    /// Finer kernels than this would have a side of tens of thousands of pixels.
    const FINEST: f64 = 64.0;
    let fault = |problem: String| Err(Error::file(FileFault::PsfKernel, path, problem));
    let own_scale =
        pixel_scale_arcsec(path, &unit.header).map_err(|e| e.in_file(FileFault::PsfKernel, path))?;
    let stated_parts = fits::number(path, &unit.header, "OVERSAMP")?;
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
    use super::*;
    use fitskit::{HeaderValue, ImageData};

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
        let (_folder, path) = file_with(&[("PSF", &[("OVERSAMP", 0.3)])]);
        assert!(PsfKernel::read(&path, 0.1).is_err());
    }

    #[test]
    fn negative_pixels_of_a_kernel_are_counted() {
        let note = note_on_negative_pixels(&[0.5, -0.25, 4.0, -0.25]).unwrap();
        assert!(note.starts_with("2 pixels of the PSF are negative, -1.25e-1 of its sum"), "{note}");
        assert_eq!(note_on_negative_pixels(&[0.5, 0.0]), None);
    }

    #[test]
    fn what_goes_with_an_image_is_no_image() {
        let named = |name: &str| {
            let mut header = Header::new();
            header.set("EXTNAME", HeaderValue::String(name.into()), None);
            Hdu::new(header, HduData::Empty)
        };
        for name in ["STAT", "INVVAR", "uncert", "VARIANCE", "ERR2", "sci_err", "WEIGHTS", "DQ", "BACKGROUND"]
        {
            assert!(is_helper(&named(name)), "{name}");
        }
        for name in ["SCI", "DATA", "F814W", "CONTSUB", "SERRANO", "STAR"] {
            assert!(!is_helper(&named(name)), "{name}");
        }
    }

    #[test]
    fn a_unit_in_a_primary_header_without_pixels_is_that_of_the_extensions() {
        let pixels = || HduData::Image(ImageData::new(vec![1, 1], PixelData::F64(vec![1.0])));
        let unit_with = |inherit: Option<bool>, primary: HduData| {
            let mut outer = Header::new();
            outer.set("BUNIT", HeaderValue::String("counts".into()), None);
            let mut own = Header::new();
            if let Some(inherit) = inherit {
                own.set("INHERIT", HeaderValue::Logical(inherit), None);
            }
            let header = header_of(Path::new("i.fits"), &Hdu::new(own, pixels()), &Hdu::new(outer, primary));
            header.unwrap().get_string("BUNIT").map(str::to_owned)
        };
        let counts = Some("counts".to_owned());
        assert_eq!(unit_with(Some(true), HduData::Empty), counts);
        assert_eq!(unit_with(None, HduData::Empty), counts);
        assert_eq!(unit_with(Some(false), HduData::Empty), None);
        assert_eq!(unit_with(None, pixels()), None);
    }
}
