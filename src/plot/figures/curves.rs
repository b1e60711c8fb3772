//! Critical curves and caustics: on their own with the images of a source, or laid over an image.

use crate::plot::{Axis, Colour, Figure, Line, Mark, Panel, Scatter, Stroke};

/// A critical curve with its caustic.
#[derive(Debug, Clone, Copy)]
pub struct CurveData<'a> {
    /// Radial, else tangential.
    pub radial: bool,
    /// Whether the last point joins the first.
    pub closed: bool,
    /// The critical curve, arcsec.
    pub theta_arcsec: &'a [[f64; 2]],
    /// The caustic, arcsec.
    pub beta_arcsec: &'a [[f64; 2]],
}

/// What the figure shows.
#[derive(Debug, Clone, Copy)]
pub struct CurvesData<'a> {
    /// The curves.
    pub curves: &'a [CurveData<'a>],
    /// Images of a source and the source itself, arcsec.
    pub images: Option<(&'a [[f64; 2]], [f64; 2])>,
    /// Half the side of the window of the critical curves.
    pub half_width_arcsec: f64,
}

/// Critical curves with the images on the left, caustics with the source on the right.
pub fn curves(data: &CurvesData) -> Figure {
    let half = data.half_width_arcsec;
    let extent = data.curves.iter().flat_map(|c| c.beta_arcsec).chain(data.images.as_ref().map(|(_, s)| s));
    let reach = extent.flatten().fold(0.0_f64, |m, v| if v.is_finite() { m.max(v.abs()) } else { m });
    let caustic_half = if reach > 0.0 { 1.45 * reach.min(half) } else { half };
    let panel =
        |half: f64, symbol: &str, pick: &dyn Fn(&CurveData) -> Line, points: Vec<[f64; 2]>, legend: &str| {
            let axis = |c: &str| Axis {
                limits: Some((-half, half)),
                ..Axis::linear(&format!("{symbol}_{{{c}}} [arcsec]"))
            };
            let mut marks: Vec<Mark> = data.curves.iter().map(|c| Mark::Line(pick(c))).collect();
            name_first_of_each(&mut marks, data.curves);
            if !points.is_empty() {
                marks.push(Mark::Scatter(Scatter {
                    x: points.iter().map(|p| p[0]).collect(),
                    y: points.iter().map(|p| p[1]).collect(),
                    colour: Colour::BLACK,
                    radius_pt: 2.2,
                    opacity: 1.0,
                    legend: legend.into(),
                }));
            }
            Panel { marks, ..Panel::new(axis("x"), axis("y")) }
        };
    let (images, source) = data.images.map_or((Vec::new(), Vec::new()), |(i, s)| (i.to_vec(), vec![s]));
    let panels = vec![
        panel(half, "θ", &|c| line(c.theta_arcsec, c, Colour::BLACK), images, "images"),
        panel(caustic_half, "β", &|c| line(c.beta_arcsec, c, Colour::BLACK), source, "source"),
    ];
    Figure { columns: 2, panel_aspect: 1.0, panels, ..Figure::full_width("Critical curves and caustics") }
}

/// Critical curves (and, dashed fine, caustics) to be drawn over a map or an image.
pub fn overlay(curves: &[CurveData], colour: Colour) -> Vec<Mark> {
    let critical = curves.iter().map(|c| line(c.theta_arcsec, c, colour));
    let caustics = curves.iter().map(|c| {
        let plain = line(c.beta_arcsec, c, colour);
        Line { stroke: Stroke { width_pt: 0.5, ..plain.stroke }, ..plain }
    });
    critical.chain(caustics).map(Mark::Line).collect()
}

fn line(points: &[[f64; 2]], curve: &CurveData, colour: Colour) -> Line {
    let again = curve.closed.then(|| points.first()).flatten();
    let all = || points.iter().chain(again);
    let stroke = if curve.radial { Stroke::dashed(colour, 0.9) } else { Stroke::solid(colour, 0.9) };
    Line::new(all().map(|p| p[0]).collect(), all().map(|p| p[1]).collect(), stroke)
}

/// Colours and legend entries: tangential blue and solid, radial orange and dashed.
fn name_first_of_each(marks: &mut [Mark], curves: &[CurveData]) {
    let mut named = [false; 2];
    for (mark, curve) in marks.iter_mut().zip(curves) {
        let Mark::Line(line) = mark else { continue };
        line.stroke.colour = if curve.radial { Colour::ORANGE } else { Colour::BLUE };
        let named = &mut named[usize::from(curve.radial)];
        if !*named {
            line.legend = if curve.radial { "radial" } else { "tangential" }.into();
            *named = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_are_closed_and_nothing_at_all_is_drawn_without_failing() {
        let ring = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]];
        let one = CurveData { radial: true, closed: true, theta_arcsec: &ring, beta_arcsec: &ring };
        assert_eq!(line(&ring, &one, Colour::BLACK).x.len(), 4);
        assert_eq!(overlay(&[one, one], Colour::WHITE).len(), 4);
        let images: &[[f64; 2]] = &ring;
        let data = CurvesData { curves: &[one], images: Some((images, [0.0, 0.1])), half_width_arcsec: 2.0 };
        assert!(curves(&data).to_svg().contains("radial"));
        let empty = CurvesData { curves: &[], images: None, half_width_arcsec: 2.0 };
        assert!(!curves(&empty).to_svg().contains("NaN"));
    }
}
