//! Many sightlines: how their quantities are distributed, and how sums over them settle with their number.

use crate::plot::{Axis, Colour, Corner, Figure, Mark, Panel, Scale, Shape, Stroke, quantile};

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
    let y = Axis::linear("sightlines").between(0.0, 1.45 * tallest);
    Panel { legend: Corner::TopLeft, ..Panel::new(x, y, marks) }
}

/// Edges of equal bins that leave out the last thousandth on both sides.
fn edges(kind: &Distributions, scale: Scale) -> Vec<f64> {
    const BINS: usize = 40;
    const IN_SIGHT: [f64; 2] = [0.001, 0.999];
    let all: Vec<f64> =
        kind.sets.iter().flat_map(|(_, values)| values).filter_map(|v| scale.forward(*v)).collect();
    let [low, high] = IN_SIGHT.map(|part| quantile(&all, part));
    let Some((low, high)) = low.zip(high).filter(|(low, high)| low < high) else { return Vec::new() };
    let at = |i: usize| low + (high - low) * i as f64 / BINS as f64;
    (0..=BINS).map(|i| if kind.is_log { 10f64.powf(at(i)) } else { at(i) }).collect()
}

fn counts(values: &[f64], edges: &[f64]) -> Vec<f64> {
    let mut counts = vec![0.0; edges.len().saturating_sub(1)];
    for value in values.iter().filter(|value| value.is_finite()) {
        let after = edges.partition_point(|edge| edge <= value);
        if (1..edges.len()).contains(&after) {
            counts[after - 1] += 1.0;
        }
    }
    counts
}

/// Draws how an average over the first N sightlines settles: (N, average, standard error) of each curve.
pub fn settling(label: &str, curves: &[(&str, Vec<[f64; 3]>)]) -> Figure {
    let marks = curves.iter().enumerate().flat_map(|(i, (name, steps))| {
        let colour = Colour::of_curve(i);
        let band = Shape::Band {
            edges: steps.iter().map(|[n, value, error]| [*n, value - error, value + error]).collect(),
            colour,
        };
        let line: Vec<[f64; 2]> = steps.iter().map(|[n, value, _]| [*n, *value]).collect();
        [band.into(), Mark::line(line, Stroke::solid(colour, 1.0)).named(*name)]
    });
    let panel = Panel::new(Axis::log("sightlines"), Axis::linear(label), marks);
    Figure::one_column("Convergence with the number of sightlines", 0.8, panel)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_in_sight_is_counted_in_its_bin() {
        let edges = [0.0, 1.0, 2.0];
        assert_eq!(counts(&[-1.0, 0.0, 0.5, 1.0, 1.9, 2.0, f64::NAN], &edges), [2.0, 2.0]);
        assert!(counts(&[1.0], &[]).is_empty());
        let values: Vec<f64> = (1..=1000).map(f64::from).collect();
        let kind = Distributions { label: "Δ", is_log: true, sets: vec![("two points", values)] };
        let figure = distributions(&[kind]);
        let Shape::Histogram { edges, counts, .. } = &figure.panels[0].marks[0].shape else { panic!() };
        assert_eq!((edges.len(), counts.iter().sum::<f64>()), (41, 998.0));
    }
}
