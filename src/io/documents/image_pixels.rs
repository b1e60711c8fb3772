//! Pixels of a FITS unit.

use std::path::Path;

use fitskit::{Hdu, HduData, PixelData};

use crate::error::{Error, FileFault, Result};
use crate::io::containers::{fits_file as fits, other_method};

/// True for a unit that holds an image, read or not.
pub(super) fn is_image(unit: &&Hdu) -> bool {
    matches!(&unit.data, HduData::Image(_)) || other_method(&unit.header).is_some()
}

/// Scaled pixels with the two axes; further axes must have length 1. Integers that are BLANK are not numbers.
pub(super) fn pixels(path: &Path, unit: &Hdu, what: &str) -> Result<(Vec<f64>, usize, usize)> {
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
