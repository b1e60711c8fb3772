//! The haloes in projection: where along the line of sight they lie, and which of them matter beyond shear.

use crate::plot::ticks::{self, Ticks};
use crate::plot::{
    Anchor, At, Axis, Colour, Corner, Figure, Mark, Panel, Rule, Shape, Stroke, TopAxis, points, quantile,
};

/// What the figure shows; the halo columns have one entry per halo.
#[derive(Debug, Clone, Copy)]
pub struct CylinderData<'a> {
    /// Comoving distance of each halo along the line of sight.
    pub distance_cmpc: &'a [f64],
    /// Transverse comoving distance of each halo along one axis, with its sign.
    pub transverse_cmpc: &'a [f64],
    /// Δ_h of each halo.
    pub delta: &'a [f64],
    /// Haloes with Δ_h at or above this are drawn in red, all of them.
    pub delta_threshold: f64,
    /// Of the other haloes every n-th is drawn.
    pub stride: usize,
    pub lens_distance_cmpc: f64,
    pub source_distance_cmpc: f64,
    /// Redshifts, increasing, that label the upper axis…
    pub redshift: &'a [f64],
    /// …and the comoving distances they belong to.
    pub redshift_distance_cmpc: &'a [f64],
}

/// Draws the projected cylinder over the full page.
pub fn cylinder(data: &CylinderData) -> Figure {
    let all = points(data.distance_cmpc, data.transverse_cmpc).into_iter().zip(data.delta);
    let (rough, smooth): (Vec<_>, Vec<_>) = all.partition(|(_, delta)| **delta >= data.delta_threshold);
    let stride = data.stride.max(1);
    let share = if stride == 1 { String::new() } else { format!(" (1 in {stride} shown)") };
    let threshold = data.delta_threshold;
    let scatter = |haloes: Vec<([f64; 2], &f64)>, every: usize, colour, radius_pt| {
        let points = haloes.into_iter().step_by(every).map(|(at, _)| at).collect();
        Mark::from(Shape::Dots { points, colour, radius_pt, opacity: 1.0 })
    };
    let marks = [
        scatter(smooth, stride, Colour::BLUE, 0.55).named(format!("Δ_{{h}} < {threshold}{share}")),
        scatter(rough, 1, Colour::RED, 0.75).named(format!("Δ_{{h}} ≥ {threshold}")),
    ];
    let lens = plane(data.lens_distance_cmpc, "lens", Anchor::Start);
    let source = plane(data.source_distance_cmpc, "source", Anchor::End);

    let farthest = data.distance_cmpc.iter().copied().chain([data.source_distance_cmpc]);
    let end = farthest.filter(|distance| distance.is_finite()).fold(0.0, f64::max);
    // The largest |y| with room for the legend.
    let sizes: Vec<f64> = data.transverse_cmpc.iter().map(|y| y.abs()).collect();
    let half = quantile(&sizes, 1.0).filter(|&largest| largest > 0.0).map(|largest| 1.4 * largest);
    let x = Axis::linear("comoving distance χ along the line of sight [Mpc]").between(0.0, 1.03 * end);
    let y = Axis { limits: half.map(|half| (-half, half)), ..Axis::linear("comoving y = χ θ_{y} [Mpc]") };
    let panel = Panel::new(x, y, marks.into_iter().chain(lens).chain(source));
    let panel = Panel { top: redshift_axis(data), legend: Corner::TopLeft, ..panel };
    Figure::full_width("Haloes along the line of sight", 0.42, 1, [panel])
}

/// A dashed line at a plane with its name at the lower end.
fn plane(distance_cmpc: f64, name: &str, anchor: Anchor) -> [Mark; 2] {
    let (at, colour, halo) = (At::DataFraction(distance_cmpc, 0.06), Colour::BLACK, Some(Colour::WHITE));
    // A space that no line ends at keeps the letters off the line.
    let text = if anchor == Anchor::Start { format!("\u{a0}{name}") } else { format!("{name}\u{a0}") };
    [
        Mark::rule(Rule::X(distance_cmpc), Stroke::dashed(Colour::BLACK, 0.9)),
        Shape::Text { at, text, anchor, colour, halo }.into(),
    ]
}

/// Round redshifts at their distances, read off the tabulated relation.
fn redshift_axis(data: &CylinderData) -> Option<TopAxis> {
    let (first, last) = (data.redshift.first()?, data.redshift.last()?);
    let Ticks { major, minor, exponent } = ticks::linear(*first, *last, 7);
    let distance = |z: f64| interpolate(data.redshift, data.redshift_distance_cmpc, z);
    let major = major.into_iter().filter_map(|(z, label)| Some((distance(z)?, label))).collect();
    let minor = minor.into_iter().filter_map(distance).collect();
    Some(TopAxis { label: "redshift".into(), ticks: Ticks { major, minor, exponent } })
}

/// Linear interpolation between tabulated points; `None` outside.
fn interpolate(x: &[f64], y: &[f64], at: f64) -> Option<f64> {
    let upper = x.iter().position(|&x| x >= at)?;
    if upper == 0 {
        return (x[0] == at).then_some(*y.first()?);
    }
    let (x0, x1, y0, y1) = (x[upper - 1], x[upper], y.get(upper - 1)?, y.get(upper)?);
    Some(y0 + (at - x0) / (x1 - x0) * (y1 - y0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rough_halo_and_every_second_smooth_one_is_drawn_below_round_redshifts() {
        let figure = cylinder(&CylinderData {
            distance_cmpc: &[1.0, 2.0, 3.0, 4.0, 5.0],
            transverse_cmpc: &[0.1; 5],
            delta: &[0.0, 0.2, 0.05, 0.1, f64::NAN],
            delta_threshold: 0.1,
            stride: 2,
            lens_distance_cmpc: 1950.0,
            source_distance_cmpc: 4450.0,
            redshift: &[0.0, 1.0, 2.0],
            redshift_distance_cmpc: &[0.0, 3300.0, 5200.0],
        });
        let marks = &figure.panels[0].marks;
        assert_eq!(marks[0].points(), [[1.0, 0.1], [5.0, 0.1]]);
        assert_eq!(marks[1].points(), [[2.0, 0.1], [4.0, 0.1]]);
        assert!(figure.panels[0].top.as_ref().unwrap().ticks.major.contains(&(1650.0, "0.5".into())));
        assert_eq!(interpolate(&[0.0, 1.0], &[0.0, 10.0], 1.5), None);
        assert_eq!(interpolate(&[0.0, 1.0], &[0.0, 10.0], 0.0), Some(0.0));
    }
}
