//! How strongly single haloes act: distributions of convergence, shear, and Δ_h on the axis.

use crate::plot::{Axis, Colour, Corner, Figure, Mark, Panel, Rule, Scale, Shape, Stroke};

/// Bins per decade; the label of the ordinate says their width.
const BINS_PER_DECADE: f64 = 8.0;

/// Draws the distributions of κ_h, |γ_h| and Δ_h of all haloes over the full page, the last with a line at a threshold and beside
/// the Δ_h of averages over a disc.
pub fn histograms(effects: [&[f64]; 3], delta_of_disc: &[f64], delta_threshold: f64) -> Figure {
    let colours = [Colour::BLUE, Colour::GREEN, Colour::RED];
    let bins = effects.map(log_bins);
    let tallest = bins.iter().flat_map(|(_, counts)| counts).copied().fold(1.0, f64::max);
    let labels = ["κ_{h}", "|γ_{h}|", "Δ_{h}"];
    let panels = bins.into_iter().zip(colours).enumerate().map(|(column, ((edges, counts), colour))| {
        let y = Axis::log("haloes per 0.125 dex").between(0.5, 100.0 * tallest).outer(column == 0);
        let steps = Shape::Histogram { edges, counts, stroke: Stroke::solid(colour, 0.9) };
        Panel::new(Axis::log(labels[column]), y, [steps.into()])
    });
    let mut figure = Figure::full_width("Distributions of halo effects", 0.9, 3, panels);
    let (edges, counts) = log_bins(delta_of_disc);
    let over_disc = Shape::Histogram { edges, counts, stroke: Stroke::solid(Colour::BLACK, 0.6) };
    let threshold = Mark::rule(Rule::X(delta_threshold), Stroke::dashed(Colour::BLACK, 0.9));
    // To the left of the threshold, whose line it must not hide.
    figure.panels[2].legend = Corner::TopLeft;
    figure.panels[2].marks[0].legend = "at two points".into();
    figure.panels[2].marks.extend([
        Mark::from(over_disc).named("over a disc"),
        threshold.named(format!("Δ_{{h}} = {delta_threshold}")),
    ]);
    figure
}

/// Edges and counts of logarithmic bins that take in every positive finite value.
fn log_bins(values: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let bin = |value: f64| (value.log10() * BINS_PER_DECADE).floor() as i32;
    let Some((low, high)) = Scale::Log.range(values.iter().copied()) else { return Default::default() };
    let (first, last) = (bin(low), bin(high));
    let mut counts = vec![0.0; (last - first + 1) as usize];
    for &value in values.iter().filter(|value| value.is_finite() && **value > 0.0) {
        counts[(bin(value) - first) as usize] += 1.0;
    }
    let edges = (first..=last + 1).map(|k| 10f64.powf(f64::from(k) / BINS_PER_DECADE)).collect();
    (edges, counts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_positive_value_is_counted_in_its_bin() {
        let (edges, counts) = log_bins(&[1.0, 1.1, 10.5, f64::NAN, 0.0, -1.0, f64::INFINITY]);
        assert_eq!(edges.len(), counts.len() + 1);
        assert_eq!((counts[0], counts[8], counts.iter().sum::<f64>()), (2.0, 1.0, 3.0));
        assert!(edges[0] <= 1.0 && *edges.last().unwrap() > 10.5);
    }
}
