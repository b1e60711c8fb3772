//! Many sightlines: how their quantities are distributed, and how sums over them settle with their number.

use crate::plot::{
    Anchor, Axis, Caption, Colour, Corner, Figure, Mark, Panel, Scale, Shape, Stroke, quantile,
};

/// Distributions of one kind, laid over one another.
#[derive(Debug, Clone, PartialEq)]
pub struct Distributions<'a> {
    /// Label of the abscissa in markup.
    pub label: &'a str,
    /// Whether the abscissa is logarithmic; values that are not positive are then left out.
    pub is_log: bool,
    /// Names in the legend and values.
    pub sets: Vec<(&'a str, Vec<f64>)>,
}

/// Draws histograms of as many kinds, two in a row.
pub fn distributions(kinds: &[Distributions]) -> Figure {
    Figure::full_width("Distributions over the sightlines", 0.7, 2, kinds.iter().map(panel))
}

/// Draws which part of the sightlines lies below a value, two kinds in a row.
pub fn cumulative(kinds: &[Distributions]) -> Figure {
    Figure::full_width(
        "Cumulative distributions over the sightlines",
        0.7,
        2,
        kinds.iter().map(cumulative_panel),
    )
}

fn cumulative_panel(kind: &Distributions) -> Panel {
    const POINTS: usize = 400;
    let curve = |(i, (name, values)): (usize, &(&str, Vec<f64>))| {
        let at = |k: usize| k as f64 / POINTS as f64;
        let points = (0..=POINTS).filter_map(|k| Some([quantile(values, at(k))?, at(k)]));
        Mark::line(points.collect::<Vec<_>>(), Stroke::of_curve(i, 1.0)).named(*name)
    };
    let x = if kind.is_log { Axis::log(kind.label) } else { Axis::linear(kind.label) };
    let y = Axis::linear("part of the sightlines below").between(0.0, 1.0);
    let marks: Vec<Mark> = kind.sets.iter().enumerate().map(curve).collect();
    Panel { legend: Corner::BottomRight, ..Panel::new(x, y, marks) }
}

fn panel(kind: &Distributions) -> Panel {
    let scale = if kind.is_log { Scale::Log } else { Scale::Linear };
    let edges = edges(kind, scale);
    let outline = |(i, (name, values)): (usize, &(&str, Vec<f64>))| {
        let stroke = Stroke::solid(Colour::of_curve(i), 1.0);
        let counts = counts(values, &edges);
        Mark::from(Shape::Histogram { edges: edges.clone(), counts, stroke }).named(*name)
    };
    let marks: Vec<Mark> = kind.sets.iter().enumerate().map(outline).collect();
    let tallest = marks.iter().flat_map(Mark::points).map(|[_, y]| y).fold(1.0, f64::max);
    let x = if kind.is_log { Axis::log(kind.label) } else { Axis::linear(kind.label) };
    // Room for the legend.
    let top = 1.45 * tallest;
    // Counts are whole numbers.
    let y = Axis { most_intervals: (top as usize).min(7), ..Axis::linear("sightlines").between(0.0, top) };
    let mut panel = Panel { legend: Corner::TopLeft, ..Panel::new(x, y, marks) };
    let outside = kind.sets.iter().map(|(_, values)| outside(values, &edges, scale)).max().unwrap_or(0);
    if outside > 0 {
        let text = format!("up to {outside} outside");
        panel.captions.push(Caption { text, colour: Colour::GREY, anchor: Anchor::End });
    }
    panel
}

/// Edges of equal bins over the middle 98% of the values and a quarter of that on both sides, but no farther than the
/// values go: a few far ones do not press all others into one bin.
fn edges(kind: &Distributions, scale: Scale) -> Vec<f64> {
    const BINS: usize = 40;
    const IN_SIGHT: [f64; 2] = [0.01, 0.99];
    const ROOM: f64 = 0.25;
    let all: Vec<f64> =
        kind.sets.iter().flat_map(|(_, values)| values).filter_map(|v| scale.forward(*v)).collect();
    let [least, low, high, most] = [0.0, IN_SIGHT[0], IN_SIGHT[1], 1.0].map(|part| quantile(&all, part));
    let Some((low, high)) = low.zip(high).filter(|(low, high)| low < high) else { return Vec::new() };
    let room = ROOM * (high - low);
    let low = least.map_or(low, |least| least.max(low - room));
    let high = most.map_or(high, |most| most.min(high + room));
    let at = |i: usize| low + (high - low) * i as f64 / BINS as f64;
    (0..=BINS).map(|i| if kind.is_log { 10f64.powf(at(i)) } else { at(i) }).collect()
}

/// How many values that have a place on the axis lie beyond its bins.
fn outside(values: &[f64], edges: &[f64], scale: Scale) -> usize {
    let Some((first, last)) = edges.first().zip(edges.last()) else { return 0 };
    values.iter().filter(|v| scale.forward(**v).is_some() && (**v < *first || **v > *last)).count()
}

fn counts(values: &[f64], edges: &[f64]) -> Vec<f64> {
    let mut counts = vec![0.0; edges.len().saturating_sub(1)];
    for value in values.iter().filter(|value| value.is_finite()) {
        let after = edges.partition_point(|edge| edge <= value);
        if (1..edges.len()).contains(&after) {
            counts[after - 1] += 1.0;
        } else if edges.last() == Some(value)
            && let Some(last) = counts.last_mut()
        {
            *last += 1.0;
        }
    }
    counts
}

/// Draws how an average over the first N sightlines settles: (N, average, standard error) of each curve.
pub fn settling(label: &str, curves: &[(&str, Vec<[f64; 3]>)]) -> Figure {
    let panel = Panel::new(Axis::log("sightlines"), Axis::linear(label), with_errors(curves));
    Figure::one_column("Convergence with the number of sightlines", 0.8, panel)
}

/// Draws how the spread of γ_LOS falls with the radius in arcsec over which it is averaged: (radius, σ, standard error).
pub fn smoothing(curves: &[(&str, Vec<[f64; 3]>)]) -> Figure {
    let x = Axis::log("averaged over, radius [arcsec]");
    let highest = curves.iter().flat_map(|(_, steps)| steps).map(|[_, sigma, error]| sigma + error);
    // Room for the legend.
    let top = 1.5 * highest.filter(|v| v.is_finite()).fold(f64::MIN_POSITIVE, f64::max);
    let y = Axis::linear("σ of a component of γ^{LOS}").between(0.0, top);
    let panel = Panel { legend: Corner::TopRight, ..Panel::new(x, y, with_errors(curves)) };
    Figure::one_column("What smoothing leaves of γ_LOS", 0.8, panel)
}

fn with_errors(curves: &[(&str, Vec<[f64; 3]>)]) -> Vec<Mark> {
    let marks = curves.iter().enumerate().flat_map(|(i, (name, steps))| {
        let colour = Colour::of_curve(i);
        let band = Shape::Band {
            edges: steps.iter().map(|[n, value, error]| [*n, value - error, value + error]).collect(),
            colour,
        };
        let line: Vec<[f64; 2]> = steps.iter().map(|[n, value, _]| [*n, *value]).collect();
        [band.into(), Mark::line(line, Stroke::of_curve(i, 1.0)).named(*name)]
    });
    marks.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_in_sight_is_counted_in_its_bin() {
        let edges = [0.0, 1.0, 2.0];
        assert_eq!(counts(&[-1.0, 0.0, 0.5, 1.0, 1.9, 2.0, 2.1, f64::NAN], &edges), [2.0, 3.0]);
        assert!(counts(&[1.0], &[]).is_empty());
        let values: Vec<f64> = (1..=1000).map(f64::from).collect();
        let kind = Distributions { label: "Δ", is_log: true, sets: vec![("two points", values)] };
        let figure = distributions(&[kind]);
        let Shape::Histogram { edges, counts, .. } = &figure.panels[0].marks[0].shape else { panic!() };
        let inside: f64 = counts.iter().sum();
        assert!(edges.len() == 41 && inside > 980.0 && figure.panels[0].captions.len() < 2, "{inside}");
        let mut far: Vec<f64> = (1..=1000).map(|i| f64::from(i) / 1000.0).collect();
        far.extend([-40.0, 90.0]);
        let kind = Distributions { label: "κ", is_log: false, sets: vec![("axis", far)] };
        let figure = distributions(&[kind]);
        let Shape::Histogram { edges, .. } = &figure.panels[0].marks[0].shape else { panic!() };
        assert!(edges[0] > -0.3 && edges[40] < 1.3 && figure.panels[0].captions[0].text == "up to 2 outside");
    }
}
