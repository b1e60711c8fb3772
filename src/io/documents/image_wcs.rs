//! The sky coordinates of an image: a tangent plane about RA = Dec = 0, x to the right.

use std::path::Path;

use fitskit::Header;

use crate::error::{Error, FileFault, Result};
use crate::io::containers::{arcsec_in, fits_file as fits};

/// Arcseconds in a degree.
const ARCSEC_PER_DEG: f64 = 3600.0;
/// Two statements of the scale are equal within this fraction; then the one with more digits, `PIXSCALE`, is taken.
const EXACT_TOLERANCE: f64 = 1e-6;
/// Within this fraction pixels count as square and axes as perpendicular, which moves no point of 100 pixels by 1% of one.
const SQUARE_TOLERANCE: f64 = 1e-4;
/// Two statements of the scale contradict each other beyond this fraction; within it one is rounded.
const ROUNDED_TOLERANCE: f64 = 1e-3;
/// Keywords that give the scale in arcsec: ours, that of space telescopes' PSF files, and that of ground-based surveys.
const DIRECT: [&str; 3] = ["PIXSCALE", "PIXELSCL", "SECPIX"];

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

/// The side of a pixel from `CDi_j`, `PCi_j` × `CDELTi`, `CDELTi` or `PIXSCALE`; `None` where none is stated.
///
/// Only the scale is taken: haloray works in pixels, x to the right, whichever way the sky lies.
///
/// # Errors
/// Statements that contradict each other, with both values; pixels that are not square; units that are no angle.
pub(super) fn pixel_scale_arcsec(path: &Path, header: &Header) -> Result<Option<f64>> {
    tell_of_distortion(path, header);
    let fault = |problem: String| Err(Error::file(FileFault::Content, path, problem));
    let mut stated: Vec<(&str, f64)> = Vec::new();
    let has_pc = matrix(path, header, "PC", 1.0)?.is_some();
    let by_steps = if has_pc { "PCi_j and CDELTi" } else { "CDELTi" };
    for (name, matrix) in [("CDi_j", cd_matrix(path, header)?), (by_steps, pc_matrix(path, header)?)] {
        let Some([[a, b], [c, d]]) = matrix else { continue };
        let (x, y) = (a.hypot(c), b.hypot(d));
        if (x - y).abs() > SQUARE_TOLERANCE * x.max(y) {
            return fault(format!("the pixels are not square: {} by {} arcsec", rounded(x), rounded(y)));
        }
        if (a * b + c * d).abs() > SQUARE_TOLERANCE * x * y {
            return fault(format!("the pixels are sheared: {name} = [[{a}, {b}], [{c}, {d}]] arcsec"));
        }
        stated.push((name, if x == y { x } else { (x * y).sqrt() }));
    }
    for name in DIRECT {
        stated.extend(fits::number(path, header, name)?.map(|scale| (name, scale)));
    }
    if let Some((name, scale)) = stated.iter().find(|(_, scale)| !(scale.is_finite() && *scale > 0.0)) {
        return fault(format!("the pixel scale by {name} is {scale} arcsec, but must be > 0"));
    }
    let Some(&(first_name, first)) = stated.first() else { return Ok(None) };
    let differs = |by: f64| move |(_, scale): &&(&str, f64)| (scale - first).abs() > by * first;
    if let Some((name, scale)) = stated.iter().find(differs(ROUNDED_TOLERANCE)) {
        let (first, scale) = (rounded(first), rounded(*scale));
        let two = format!("the pixel scales {first} arcsec by {first_name} and {scale} arcsec by {name}");
        return fault(format!("{two} contradict each other; leave out the wrong one"));
    }
    let exact = stated.iter().rev().find(|&one| DIRECT.contains(&one.0) && !differs(EXACT_TOLERANCE)(&one));
    Ok(Some(exact.map_or(first, |(_, scale)| *scale)))
}

/// Says of a WCS with a distortion that the scale is that of its linear part.
fn tell_of_distortion(path: &Path, header: &Header) {
    /// What `CTYPEi` ends in where polynomials or tables bend the axes (SIP, TPV, TNX, ZPX).
    const BENT: [&str; 4] = ["-SIP", "TPV", "TNX", "ZPX"];
    let kind = header.get_string("CTYPE1").unwrap_or_default();
    if BENT.iter().any(|end| kind.trim().ends_with(end)) {
        log::warn!(
            "{}: the distortion of its WCS ({}) is not applied: pixels are taken to be square, of the scale at the reference pixel",
            path.display(),
            kind.trim()
        );
    }
}

/// Where north (or a latitude's pole) lies in the image, if the header says so: degrees from the pixels' y axis, positive
/// against the clock as the pixels are drawn, x to the right.
///
/// `CROTA2` turns `CDELTi` alone (Calabretta & Greisen 2002, equation 189).
pub(super) fn rotation_deg(path: &Path, header: &Header) -> Result<Option<f64>> {
    let stated = cd_matrix(path, header)?;
    let is_plain = stated.is_none() && matrix(path, header, "PC", 1.0)?.is_none();
    let Some([first, second]) = stated.or(pc_matrix(path, header)?) else { return Ok(None) };
    let axis = header.get_string("CTYPE1").map_or("", str::trim);
    let is_latitude = ["DEC", "GLAT", "ELAT"].iter().any(|name| axis.starts_with(name));
    let [mut x, mut y] = if is_latitude { first } else { second };
    if is_plain && let Some(old) = fits::number(path, header, "CROTA2")? {
        let (sin, cos) = old.to_radians().sin_cos();
        [x, y] = [first[0] * sin, second[1] * cos];
    }
    Ok(Some((-x).atan2(y).to_degrees()))
}

/// Without the digits that only arithmetic made.
pub(super) fn rounded(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap_or(value)
}

/// World coordinates in arcsec by pixel coordinates.
type Matrix = [[f64; 2]; 2];

/// `CDi_j`; beside it a `CDELTi` of 1 or 0 means nothing.
fn cd_matrix(path: &Path, header: &Header) -> Result<Option<Matrix>> {
    let Some(matrix) = matrix(path, header, "CD", 0.0)? else { return Ok(None) };
    in_arcsec(path, header, matrix).map(Some)
}

fn pc_matrix(path: &Path, header: &Header) -> Result<Option<Matrix>> {
    let pc = matrix(path, header, "PC", 1.0)?;
    let steps = [fits::number(path, header, "CDELT1")?, fits::number(path, header, "CDELT2")?];
    // What programs write that know no places of the pixels: the standard's values for what is left out.
    let is_empty = |name: &&str| header.get_string(name).is_none_or(|text| text.trim().is_empty());
    let is_identity = pc.is_none_or(|pc| pc == [[1.0, 0.0], [0.0, 1.0]]);
    if is_identity
        && steps.iter().all(|step| step.is_none_or(|step| step == 1.0))
        && ["CTYPE1", "CTYPE2", "CUNIT1", "CUNIT2"].iter().all(is_empty)
    {
        return Ok(None);
    }
    let (pc, [x, y]) = match (pc, steps) {
        (Some(pc), steps) => (pc, steps.map(|step| step.unwrap_or(1.0))),
        (None, [Some(x), Some(y)])
            if matrix(path, header, "CD", 0.0)?.is_none()
                || [x, y].iter().all(|s| ![0.0, 1.0].contains(s)) =>
        {
            ([[1.0, 0.0], [0.0, 1.0]], [x, y])
        }
        _ => return Ok(None),
    };
    in_arcsec(path, header, [pc[0].map(|element| x * element), pc[1].map(|element| y * element)]).map(Some)
}

/// The matrix `NAMEi_j`, if an element is there; what is missing is 0, or `diagonal` on the diagonal.
fn matrix(path: &Path, header: &Header, name: &str, diagonal: f64) -> Result<Option<Matrix>> {
    let number = |i, j| fits::number(path, header, &format!("{name}{i}_{j}"));
    let elements = [[number(1, 1)?, number(1, 2)?], [number(2, 1)?, number(2, 2)?]];
    let or = |element: Option<f64>, missing| element.unwrap_or(missing);
    let [[a, b], [c, d]] = elements;
    let is_there = elements.iter().flatten().any(Option::is_some);
    Ok(is_there.then(|| [[or(a, diagonal), or(b, 0.0)], [or(c, 0.0), or(d, diagonal)]]))
}

fn in_arcsec(path: &Path, header: &Header, matrix: Matrix) -> Result<Matrix> {
    let [x, y] = [unit_arcsec(path, header, 1)?, unit_arcsec(path, header, 2)?];
    Ok([matrix[0].map(|element| x * element), matrix[1].map(|element| y * element)])
}

/// Arcsec in the unit of a world axis, which is the degree where none is stated for a place on the sky.
fn unit_arcsec(path: &Path, header: &Header, axis: usize) -> Result<f64> {
    let fault = |problem: String| Err(Error::file(FileFault::Content, path, problem));
    let (unit, kind) = (format!("CUNIT{axis}"), format!("CTYPE{axis}"));
    let stated = header.get_string(&unit).map_or("", str::trim);
    if stated.is_empty() {
        let kind_of_axis = header.get_string(&kind).map_or("", str::trim);
        let is_sky =
            ["RA", "DEC", "GLON", "GLAT", "ELON", "ELAT"].iter().any(|sky| kind_of_axis.starts_with(sky));
        if !is_sky && !kind_of_axis.is_empty() {
            return fault(format!(
                "{kind} is '{kind_of_axis}' and states no {unit}, which must be an angle's: 'deg'"
            ));
        }
        return Ok(ARCSEC_PER_DEG);
    }
    match stated {
        "deg" => Ok(ARCSEC_PER_DEG),
        _ => match arcsec_in(stated) {
            Some(arcsec) => Ok(arcsec),
            None => {
                fault(format!("{unit} is '{stated}', but must be 'deg', 'arcmin', 'arcsec', 'mas' or 'rad'"))
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fitskit::HeaderValue;

    fn scale(keywords: &[(&str, f64)], unit: &str) -> std::result::Result<Option<f64>, String> {
        let mut header = Header::new();
        for &(name, value) in keywords {
            header.set(name, HeaderValue::Float(value), None);
        }
        for name in ["CUNIT1", "CUNIT2"] {
            header.set(name, HeaderValue::String(unit.into()), None);
        }
        pixel_scale_arcsec(Path::new("i.fits"), &header).map_err(|error| error.to_string())
    }

    #[test]
    fn steps_of_one_without_a_unit_or_a_kind_of_axis_state_no_scale() {
        let ones = [("CDELT1", 1.0), ("CDELT2", 1.0)];
        assert_eq!(scale(&ones, ""), Ok(None));
        assert_eq!(scale(&[("PC1_1", 1.0), ("PC2_2", 1.0)], ""), Ok(None));
        assert_eq!(scale(&[ones[0], ones[1], ("PIXSCALE", 0.1)], ""), Ok(Some(0.1)));
        assert_eq!(scale(&ones, "arcsec"), Ok(Some(1.0)));
        let error = scale(&[("CDELT1", 0.1), ("CDELT2", 0.1), ("PIXSCALE", 0.1)], "").unwrap_err();
        assert!(error.contains("360 arcsec by CDELTi and 0.1 arcsec by PIXSCALE"), "{error}");
    }

    #[test]
    fn north_lies_where_every_way_to_state_it_says() {
        let (step, (sin, cos)) = (0.08 / 3600.0, 20_f64.to_radians().sin_cos());
        let cd = |[[a, b], [c, d]]: Matrix| [("CD1_1", a), ("CD1_2", b), ("CD2_1", c), ("CD2_2", d)];
        let turned = [[-step * cos, -step * sin], [-step * sin, step * cos]];
        let [latitude, longitude] = [turned[1], turned[0]];
        let old = vec![("CDELT1", -step), ("CDELT2", step), ("CROTA2", 20.0)];
        let pc = [("PC1_1", cos), ("PC1_2", sin), ("PC2_1", -sin), ("PC2_2", cos)];
        let north = |keywords: &[(&str, f64)], kinds: [&str; 2]| {
            let mut header = Header::new();
            for &(name, value) in keywords {
                header.set(name, HeaderValue::Float(value), None);
            }
            for (name, kind) in ["CTYPE1", "CTYPE2"].into_iter().zip(kinds) {
                header.set(name, HeaderValue::String(kind.into()), None);
            }
            rotation_deg(Path::new("i.fits"), &header).unwrap().unwrap()
        };
        let usual = ["RA---TAN", "DEC--TAN"];
        for keywords in [
            old.clone(),
            cd(turned).to_vec(),
            // CROTA2 beside CD repeats it.
            [&cd(turned)[..], &old[2..]].concat(),
            [&pc.map(|(name, value)| (name, value))[..], &[("CDELT1", -step), ("CDELT2", step)]].concat(),
        ] {
            assert!((north(&keywords, usual) - 20.0).abs() < 1e-9, "{keywords:?}");
        }
        assert!((north(&cd([latitude, longitude]), ["DEC--TAN", "RA---TAN"]) - 20.0).abs() < 1e-9);
        assert!(north(&cd([[-step, 0.0], [0.0, step]]), usual).abs() < 1e-9);
    }

    #[test]
    fn every_way_to_state_the_scale_is_understood() {
        let close = |keywords: &[(&str, f64)], unit| {
            let found = scale(keywords, unit).unwrap().unwrap();
            assert!((found - 0.08).abs() < 1e-12, "{keywords:?}: {found}");
        };
        let step = 0.08 / 3600.0;
        close(&[("CDELT1", -step), ("CDELT2", step)], "deg");
        close(&[("CDELT1", -step), ("CDELT2", step), ("CROTA2", 30.0)], "");
        close(&[("CDELT1", 0.08), ("CDELT2", 0.08)], "arcsec");
        close(&[("CDELT1", 80.0), ("CDELT2", 80.0)], "mas");
        close(&[("CDELT1", 0.08 / 60.0), ("CDELT2", 0.08 / 60.0)], "arcmin");
        let (sin, cos) = 0.3_f64.sin_cos();
        let rotated = |name: &str, step: f64| -> Vec<(String, f64)> {
            let elements = [("1_1", -cos), ("1_2", sin), ("2_1", sin), ("2_2", cos)];
            elements.map(|(index, value)| (format!("{name}{index}"), step * value)).to_vec()
        };
        for (name, of_matrix, of_cdelt) in
            [("CD", step, None), ("PC", step, Some(1.0)), ("PC", step, None), ("PC", 1.0, Some(step))]
        {
            let matrix = rotated(name, of_matrix);
            let mut keywords: Vec<(&str, f64)> =
                matrix.iter().map(|(name, value)| (name.as_str(), *value)).collect();
            keywords.extend(of_cdelt.iter().flat_map(|step| [("CDELT1", *step), ("CDELT2", *step)]));
            close(&keywords, "deg");
            // A leftover CDELT beside CD means nothing.
            if name == "CD" {
                keywords.extend([("CDELT1", 1.0), ("CDELT2", 1.0)]);
                close(&keywords, "deg");
            }
        }
        close(
            &[
                ("PC1_2", 1.0),
                ("PC2_1", -1.0),
                ("PC1_1", 0.0),
                ("PC2_2", 0.0),
                ("CDELT1", step),
                ("CDELT2", step),
            ],
            "deg",
        );
        close(&[("PIXSCALE", 0.08)], "");
        close(&[("PIXELSCL", 0.08)], "");
        close(&[("SECPIX", 0.08)], "");
        assert_eq!(scale(&[("CDELT1", 1e-5)], "deg").unwrap(), None);
    }

    #[test]
    fn the_exact_scale_is_taken_where_it_agrees_with_the_wcs_and_contradictions_are_refused_with_both() {
        let step = 0.08 / 3600.0;
        let both = |direct| scale(&[("CDELT1", step), ("CDELT2", step), ("PIXSCALE", direct)], "deg");
        assert_eq!(both(0.080_000_000_1).unwrap(), Some(0.080_000_000_1));
        assert!((both(0.080_04).unwrap().unwrap() - 0.08).abs() < 1e-12);
        let fault = both(0.09).unwrap_err();
        assert!(fault.contains("0.09 arcsec by PIXSCALE contradict each other"), "{fault}");
        let beside = [("CD1_1", -step), ("CD2_2", step), ("CDELT1", -2.0 * step), ("CDELT2", 2.0 * step)];
        let fault = scale(&beside, "deg").unwrap_err();
        assert!(fault.contains("0.08 arcsec by CDi_j and 0.16 arcsec by CDELTi contradict"), "{fault}");
        let two = [
            ("CD1_1", step),
            ("CD2_2", step),
            ("PC1_1", 1.0),
            ("CDELT1", 2.0 * step),
            ("CDELT2", 2.0 * step),
        ];
        let fault = scale(&two, "deg").unwrap_err();
        assert!(
            fault.contains("0.08 arcsec by CDi_j and 0.16 arcsec by PCi_j and CDELTi contradict"),
            "{fault}"
        );
    }

    #[test]
    fn what_cannot_be_used_is_named() {
        let fault = |keywords: &[(&str, f64)], unit| scale(keywords, unit).unwrap_err();
        assert!(
            fault(&[("CDELT1", 1e-5), ("CDELT2", 2e-5)], "deg").contains("the pixels are not square: 0.036")
        );
        let sheared = [("CD1_1", 1e-5), ("CD1_2", 1e-5), ("CD2_1", 0.0), ("CD2_2", 1e-9)];
        assert!(fault(&sheared, "deg").contains("the pixels are sheared"));
        assert!(fault(&[("CDELT1", 1e-5), ("CDELT2", 1e-5)], "m").contains("CUNIT1 is 'm'"));
        assert!(fault(&[("PIXSCALE", 0.0)], "").contains("by PIXSCALE is 0 arcsec, but must be > 0"));
        assert!(fault(&[("CD1_1", 0.0)], "deg").contains("is 0 arcsec"));
        let mut header = Header::new();
        for (name, value) in [("CDELT1", 1.0), ("CDELT2", 1.0)] {
            header.set(name, HeaderValue::Float(value), None);
        }
        header.set("CTYPE1", HeaderValue::String("LINEAR".into()), None);
        let error = pixel_scale_arcsec(Path::new("i.fits"), &header).unwrap_err().to_string();
        assert!(error.contains("CTYPE1 is 'LINEAR' and states no CUNIT1"), "{error}");
    }
}
