//! Critical curves and caustics: on their own with the images of a source, or laid over an image.

use crate::diagnostics::{CriticalCurve, CurveKind};
use crate::plot::{Axis, Colour, Figure, Mark, Panel, Shape, Stroke};

/// Critical curves with the images (of a source, if one is given with them) on the left, caustics with the source on the
/// right; all in arcsec, the window of the critical curves so wide.
pub fn curves(
    curves: &[CriticalCurve],
    images: Option<(&[[f64; 2]], [f64; 2])>,
    half_width_arcsec: f64,
) -> Figure {
    let extent = curves.iter().flat_map(|c| &c.beta_arcsec).chain(images.as_ref().map(|(_, source)| source));
    let reach = extent.flatten().fold(0.0_f64, |m, v| if v.is_finite() { m.max(v.abs()) } else { m });
    let caustic_half = if reach > 0.0 { 1.45 * reach.min(half_width_arcsec) } else { half_width_arcsec };
    let panel = |half: f64,
                 symbol: &str,
                 pick: fn(&CriticalCurve) -> &[[f64; 2]],
                 (points, legend): (Vec<_>, &str)| {
        let axis = |c: &str| Axis::linear(&format!("{symbol}_{{{c}}} [arcsec]")).between(-half, half);
        let names = [(CurveKind::Tangential, "tangential"), (CurveKind::Radial, "radial")];
        let first = names.map(|(kind, name)| (curves.iter().position(|c| c.kind == kind), name));
        let named = |(i, curve): (usize, &CriticalCurve)| {
            let name = first.iter().find(|(first, _)| *first == Some(i)).map_or("", |(_, name)| *name);
            let colour = if curve.kind == CurveKind::Radial { Colour::ORANGE } else { Colour::BLUE };
            line(pick(curve), curve, colour, WIDTH_PT).named(name)
        };
        let (colour, radius_pt, opacity) = (Colour::BLACK, 2.2, 1.0);
        let dots = (!points.is_empty()).then_some(Shape::Dots { points, colour, radius_pt, opacity });
        let dots = dots.map(|dots| Mark::from(dots).named(legend));
        Panel::new(axis("x"), axis("y"), curves.iter().enumerate().map(named).chain(dots))
    };
    let (images, source) = images.map_or((Vec::new(), Vec::new()), |(i, s)| (i.to_vec(), vec![s]));
    let panels = [
        panel(half_width_arcsec, "θ", |c| &c.theta_arcsec, (images, "images")),
        panel(caustic_half, "β", |c| &c.beta_arcsec, (source, "source")),
    ];
    Figure::full_width("Critical curves and caustics", 1.0, 2, panels)
}

/// Critical curves (and, dashed fine, caustics) to be drawn over a map or an image.
pub fn overlay(curves: &[CriticalCurve], colour: Colour) -> Vec<Mark> {
    let critical = curves.iter().map(|c| line(&c.theta_arcsec, c, colour, WIDTH_PT));
    critical.chain(curves.iter().map(|c| line(&c.beta_arcsec, c, colour, 0.5))).collect()
}

const WIDTH_PT: f64 = 0.9;

/// Solid where tangential, dashed where radial.
fn line(points: &[[f64; 2]], curve: &CriticalCurve, colour: Colour, width_pt: f64) -> Mark {
    let again = curve.closed.then(|| points.first()).flatten();
    let points: Vec<[f64; 2]> = points.iter().chain(again).copied().collect();
    Mark::line(points, Stroke { colour, width_pt, is_dashed: curve.kind == CurveKind::Radial })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_closed_and_named_once() {
        let ring = vec![[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];
        let (kind, closed) = (CurveKind::Radial, true);
        let one = CriticalCurve { kind, closed, theta_arcsec: ring.clone(), beta_arcsec: ring.clone() };
        let two = [one.clone(), one];
        let marks = overlay(&two, Colour::WHITE);
        assert_eq!((marks.len(), marks[0].points().len()), (4, 4));
        let figure = curves(&two, Some((&ring, [0.0, 0.1])), 2.0);
        let legends: Vec<&str> = figure.panels[0].marks.iter().map(|mark| mark.legend.as_str()).collect();
        assert_eq!(legends, ["radial", "", "images"]);
    }
}
