//! The sky coordinates of an image: a tangent plane about RA = Dec = 0, x to the right.

use std::path::Path;

use fitskit::Header;

use crate::error::{Error, FileFault, Result};
use crate::io::containers::fits_file as fits;

/// Arcseconds in a degree.
const ARCSEC_PER_DEG: f64 = 3600.0;
/// Pixels count as square, and two statements of the scale as equal, within this fraction; survey
/// headers carry six digits and more.
const SCALE_TOLERANCE: f64 = 1e-6;

/// Appends a gnomonic (TAN) WCS with the grid's centre at RA = Dec = 0.
///
/// `CDELT1` is positive: world coordinates are haloray's own (x, y) in degrees, x to the right.
/// Astronomers draw RA to the left; such an image is the mirror image of this one on the sky.
/// `PIXSCALE` repeats the scale in arcsec with all its digits.
pub(super) fn push_wcs(header: &mut Header, nx: usize, ny: usize, pixel_scale_arcsec: f64) {
    let step_deg = pixel_scale_arcsec / ARCSEC_PER_DEG;
    fits::push_text(header, "CTYPE1", "RA---TAN", "x to the right, tangent plane");
    fits::push_text(header, "CTYPE2", "DEC--TAN", "y up, tangent plane");
    let axes = [(1, nx, "deg, > 0: haloray's x is to the right"), (2, ny, "deg, y is up")];
    for (axis, length, direction) in axes {
        let centre = (length as f64 + 1.0) / 2.0;
        fits::push_f64(header, &format!("CRPIX{axis}"), centre, "centre of the grid");
        fits::push_f64(header, &format!("CRVAL{axis}"), 0.0, "deg");
        fits::push_f64(header, &format!("CDELT{axis}"), step_deg, direction);
        fits::push_text(header, &format!("CUNIT{axis}"), "deg", "unit of CRVAL and CDELT");
    }
    fits::push_f64(header, "PIXSCALE", pixel_scale_arcsec, "arcsec, side of a pixel");
}

/// The side of a pixel from `CDi_j`, or from `CDELTi` (with or without rotation), or `PIXSCALE`.
///
/// Only the scale is taken: haloray works in pixels, x to the right, whichever way the sky lies.
pub(super) fn pixel_scale_arcsec(path: &Path, header: &Header) -> Result<f64> {
    let number = |name: &str| fits::number(path, header, name);
    let matrix = [number("CD1_1")?, number("CD1_2")?, number("CD2_1")?, number("CD2_2")?];
    let steps = if matrix.iter().any(Option::is_some) {
        let [a, b, c, d] = matrix.map(|element| element.unwrap_or(0.0));
        Some((a.hypot(c), b.hypot(d)))
    } else {
        number("CDELT1")?.zip(number("CDELT2")?).map(|(x, y)| (x.abs(), y.abs()))
    };
    let direct = number("PIXSCALE")?;
    let scale = match (steps, direct) {
        (Some((x, y)), _) if (x - y).abs() > SCALE_TOLERANCE * x.max(y) => {
            return Err(Error::file(
                FileFault::Content,
                path,
                format!("the pixels are not square: {x} by {y} deg"),
            ));
        }
        (Some((x, _)), direct) => {
            let from_wcs = x * unit_arcsec(path, header)?;
            direct
                .filter(|direct| (direct - from_wcs).abs() <= SCALE_TOLERANCE * from_wcs)
                .unwrap_or(from_wcs)
        }
        (None, Some(direct)) => direct,
        (None, None) => {
            let problem = "has no pixel scale; CDELT1 and CDELT2 (deg), CD1_1 … CD2_2 (deg) or PIXSCALE (arcsec) is wanted";
            return Err(Error::file(FileFault::Content, path, problem));
        }
    };
    if scale > 0.0 {
        Ok(scale)
    } else {
        Err(Error::file(
            FileFault::Content,
            path,
            format!("the pixel scale is {scale} arcsec, but must be > 0"),
        ))
    }
}

fn unit_arcsec(path: &Path, header: &Header) -> Result<f64> {
    match header.get_string("CUNIT1").map_or("deg", str::trim) {
        "" | "deg" | "degree" | "degrees" => Ok(ARCSEC_PER_DEG),
        "arcsec" => Ok(1.0),
        other => Err(Error::file(
            FileFault::Content,
            path,
            format!("CUNIT1 is '{other}', but must be 'deg' or 'arcsec'"),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fitskit::HeaderValue;

    fn scale(keywords: &[(&str, f64)], unit: &str) -> std::result::Result<f64, String> {
        let mut header = Header::new();
        for &(name, value) in keywords {
            header.set(name, HeaderValue::Float(value), None);
        }
        header.set("CUNIT1", HeaderValue::String(unit.into()), None);
        pixel_scale_arcsec(Path::new("i.fits"), &header).map_err(|error| error.to_string())
    }

    #[test]
    fn every_way_to_state_the_scale_is_understood() {
        let close = |got: std::result::Result<f64, String>| (got.unwrap() - 0.08).abs() < 1e-12;
        let step = 0.08 / 3600.0;
        assert!(close(scale(&[("CDELT1", -step), ("CDELT2", step)], "deg")));
        assert!(close(scale(&[("CDELT1", 0.08), ("CDELT2", 0.08)], "arcsec")));
        let (sin, cos) = 0.3_f64.sin_cos();
        let rotated =
            [("CD1_1", -step * cos), ("CD1_2", step * sin), ("CD2_1", step * sin), ("CD2_2", step * cos)];
        assert!(close(scale(&rotated, "deg")));
        assert!(close(scale(&[("PIXSCALE", 0.08)], "")));
    }

    #[test]
    fn the_exact_scale_is_taken_only_where_it_agrees_with_the_wcs() {
        let step = 0.08 / 3600.0;
        let both =
            |direct| scale(&[("CDELT1", step), ("CDELT2", step), ("PIXSCALE", direct)], "deg").unwrap();
        assert_eq!(both(0.080_000_000_1), 0.080_000_000_1);
        assert!((both(0.09) - 0.08).abs() < 1e-12);
    }

    #[test]
    fn what_cannot_be_used_is_named() {
        let fault = |keywords: &[(&str, f64)], unit| scale(keywords, unit).unwrap_err();
        assert!(fault(&[("CDELT1", 1e-5), ("CDELT2", 2e-5)], "deg").contains("the pixels are not square"));
        assert!(fault(&[("CDELT1", 1e-5), ("CDELT2", 1e-5)], "m").contains("CUNIT1 is 'm'"));
        assert!(fault(&[("PIXSCALE", 0.0)], "").contains("the pixel scale is 0 arcsec, but must be > 0"));
        assert!(fault(&[("CDELT1", 1e-5)], "deg").contains("has no pixel scale; CDELT1 and CDELT2 (deg)"));
    }
}
