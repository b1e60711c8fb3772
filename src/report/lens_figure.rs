//! The figure of a lens model: critical curves and caustics with the images of a source.

use crate::diagnostics::{CriticalCurves, CurveKind, PointImages};
use crate::plot::Figure;
use crate::plot::figures::{CurveData, CurvesData, curves};

/// Critical curves with the images on the left, caustics with the source on the right.
pub fn curve_figure(
    found: &CriticalCurves,
    images: &PointImages,
    source_arcsec: [f64; 2],
    half_width_arcsec: f64,
) -> Figure {
    let theta: Vec<[f64; 2]> = images.images.iter().map(|image| image.theta_arcsec).collect();
    let images = Some((theta.as_slice(), source_arcsec));
    curves(&CurvesData { curves: &curve_data(found), images, half_width_arcsec })
}

/// Curves as the plots take them.
pub(super) fn curve_data(found: &CriticalCurves) -> Vec<CurveData<'_>> {
    let data = |curve: &'_ crate::diagnostics::CriticalCurve| -> (bool, bool) {
        (curve.kind == CurveKind::Radial, curve.closed)
    };
    found
        .curves
        .iter()
        .map(|curve| {
            let (radial, closed) = data(curve);
            CurveData { radial, closed, theta_arcsec: &curve.theta_arcsec, beta_arcsec: &curve.beta_arcsec }
        })
        .collect()
}
