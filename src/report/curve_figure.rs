//! Critical curves and caustics: on their own with the images of a source, or over another figure.

use crate::diagnostics::{CriticalCurves, PointImages};
use crate::plot::figures::{curves, overlay};
use crate::plot::{Colour, Figure, Panel};

/// Critical curves with the images on the left, caustics with the source on the right.
pub fn curve_figure(
    found: &CriticalCurves,
    images: &PointImages,
    source_arcsec: [f64; 2],
    half_width_arcsec: f64,
) -> Figure {
    let theta: Vec<[f64; 2]> = images.images.iter().map(|image| image.theta_arcsec).collect();
    curves(&found.curves, Some((theta.as_slice(), source_arcsec)), half_width_arcsec)
}

/// Draws critical curves and, finer, caustics into a panel.
pub(super) fn lay_over(panel: &mut Panel, found: &CriticalCurves, colour: Colour) {
    panel.marks.extend(overlay(&found.curves, colour));
}
