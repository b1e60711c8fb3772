//! Images as they are read: which extension is the image, what its header inherits, which pixels are numbers, its MASK.

use std::path::Path;

use fitskit::{Hdu, HduData, Header};

use super::exposure_keywords::ExposureKeywords;
use super::flux_unit;
use super::image_fits::ImageFile;
use super::image_pixels::{is_image, pixels};
use super::image_wcs::{pixel_scale_arcsec, rotation_deg, rounded};
use super::psf_reading::read_psf;
use crate::error::{Error, FileFault, Result};
use crate::io::containers::fits_file as fits;

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

fn check_finite(path: &Path, data: &mut [f64], nx: usize, mask: Option<&[bool]>) -> Result<()> {
    for (i, value) in data.iter_mut().enumerate().filter(|(_, value)| !value.is_finite()) {
        if mask.is_none_or(|mask| mask[i]) {
            let problem = format!(
                "pixel x = {}, y = {} (counted from 1) is {value}; finite numbers only (BLANK is none), \
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

#[cfg(test)]
mod tests {
    use super::*;
    use fitskit::{HeaderValue, ImageData, PixelData};

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
