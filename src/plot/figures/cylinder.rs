//! The haloes in projection: where along the line of sight they lie, and which of them matter beyond shear.

use crate::plot::ticks;
use crate::plot::{
    Anchor, Axis, Colour, Corner, Figure, Mark, Panel, Rule, RuleAt, Scatter, Stroke, Text, TextAt, TopAxis,
    quantile,
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
    /// Comoving distance of the main lens.
    pub lens_distance_cmpc: f64,
    /// Comoving distance of the source.
    pub source_distance_cmpc: f64,
    /// Redshifts, increasing, that label the upper axis…
    pub redshift: &'a [f64],
    /// …and the comoving distances they belong to.
    pub redshift_distance_cmpc: &'a [f64],
}

/// Draws the projected cylinder over the full page.
pub fn cylinder(data: &CylinderData) -> Figure {
    let (mut smooth, mut rough) = (Vec::new(), Vec::new());
    for ((&x, &y), &delta) in data.distance_cmpc.iter().zip(data.transverse_cmpc).zip(data.delta) {
        if delta >= data.delta_threshold { rough.push((x, y)) } else { smooth.push((x, y)) }
    }
    let stride = data.stride.max(1);
    let smooth: Vec<(f64, f64)> = smooth.into_iter().step_by(stride).collect();
    let share = if stride == 1 { String::new() } else { format!(" (1 in {stride} shown)") };
    let threshold = data.delta_threshold;
    let mut marks = vec![
        scatter(&smooth, Colour::BLUE, 0.55, format!("Δ_{{h}} < {threshold}{share}")),
        scatter(&rough, Colour::RED, 0.75, format!("Δ_{{h}} ≥ {threshold}")),
    ];
    marks.extend(plane(data.lens_distance_cmpc, "lens", Anchor::Start));
    marks.extend(plane(data.source_distance_cmpc, "source", Anchor::End));

    let farthest = data.distance_cmpc.iter().copied().chain([data.source_distance_cmpc]);
    let end = farthest.filter(|distance| distance.is_finite()).fold(0.0, f64::max);
    let half = half_height(data.transverse_cmpc);
    let x = Axis {
        limits: Some((0.0, 1.03 * end)),
        ..Axis::linear("comoving distance along the line of sight [Mpc]")
    };
    let y = Axis { limits: half.map(|half| (-half, half)), ..Axis::linear("transverse distance [Mpc]") };
    let panel = Panel { marks, top: redshift_axis(data), legend: Corner::TopLeft, ..Panel::new(x, y) };
    Figure { panels: vec![panel], panel_aspect: 0.42, ..Figure::full_width("Haloes along the line of sight") }
}

/// The largest |y| with room for the legend; `None` without any.
fn half_height(transverse_cmpc: &[f64]) -> Option<f64> {
    let distances: Vec<f64> = transverse_cmpc.iter().map(|y| y.abs()).collect();
    quantile(&distances, 1.0).filter(|&largest| largest > 0.0).map(|largest| 1.4 * largest)
}

fn scatter(points: &[(f64, f64)], colour: Colour, radius_pt: f64, legend: String) -> Mark {
    let (x, y) = points.iter().copied().unzip();
    Mark::Scatter(Scatter { x, y, colour, radius_pt, opacity: 1.0, legend })
}

/// A dashed line at a plane with its name at the lower end.
fn plane(distance_cmpc: f64, name: &str, anchor: Anchor) -> [Mark; 2] {
    let stroke = Stroke::dashed(Colour::BLACK, 0.9);
    let aside = if anchor == Anchor::Start { format!(" {name}") } else { format!("{name} ") };
    let (at, colour, halo) = (TextAt::DataFraction(distance_cmpc, 0.06), Colour::BLACK, Some(Colour::WHITE));
    [
        Mark::Rule(Rule { at: RuleAt::X(distance_cmpc), stroke }),
        Mark::Text(Text { at, text: aside, anchor, colour, halo }),
    ]
}

/// Round redshifts at their distances, read off the tabulated relation.
fn redshift_axis(data: &CylinderData) -> Option<TopAxis> {
    let (first, last) = (data.redshift.first()?, data.redshift.last()?);
    let chosen = ticks::linear(*first, *last, 7);
    let distance = |z: f64| interpolate(data.redshift, data.redshift_distance_cmpc, z);
    Some(TopAxis {
        label: "redshift".into(),
        major: chosen.major.into_iter().filter_map(|(z, label)| Some((distance(z)?, label))).collect(),
        minor: chosen.minor.into_iter().filter_map(distance).collect(),
    })
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

    fn data<'a>(columns: [&'a [f64]; 3]) -> CylinderData<'a> {
        CylinderData {
            distance_cmpc: columns[0],
            transverse_cmpc: columns[1],
            delta: columns[2],
            delta_threshold: 0.1,
            stride: 2,
            lens_distance_cmpc: 1950.0,
            source_distance_cmpc: 4450.0,
            redshift: &[0.0, 1.0, 2.0],
            redshift_distance_cmpc: &[0.0, 3300.0, 5200.0],
        }
    }

    #[test]
    fn every_rough_halo_and_every_second_smooth_one_is_drawn() {
        let figure =
            cylinder(&data([&[1.0, 2.0, 3.0, 4.0, 5.0], &[0.1; 5], &[0.0, 0.2, 0.05, 0.1, f64::NAN]]));
        let drawn = |i: usize| match &figure.panels[0].marks[i] {
            Mark::Scatter(scatter) => scatter.x.clone(),
            other => panic!("{other:?}"),
        };
        assert_eq!(drawn(0), [1.0, 5.0]);
        assert_eq!(drawn(1), [2.0, 4.0]);
    }

    #[test]
    fn redshift_ticks_follow_the_table() {
        let top = redshift_axis(&data([&[], &[], &[]])).unwrap();
        assert!(top.major.contains(&(1650.0, "0.5".into())));
        assert_eq!(interpolate(&[0.0, 1.0], &[0.0, 10.0], 1.5), None);
        assert_eq!(interpolate(&[0.0, 1.0], &[0.0, 10.0], 0.0), Some(0.0));
    }

    #[test]
    fn no_haloes_still_make_a_figure() {
        assert!(cylinder(&data([&[], &[], &[]])).to_svg().contains("no data"));
    }
}
