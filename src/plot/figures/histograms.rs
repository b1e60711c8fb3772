//! How strongly single haloes act: distributions of convergence, shear, and Δ_h on the axis.

use crate::plot::{
    Anchor, Axis, Colour, Figure, Histogram, Mark, Panel, Rule, RuleAt, Scale, Stroke, Text, TextAt,
};

/// What the figure shows; one entry per halo.
#[derive(Debug, Clone, Copy)]
pub struct HaloEffects<'a> {
    /// Convergence κ_h on the axis.
    pub convergence: &'a [f64],
    /// Modulus of the shear |γ_h| on the axis.
    pub shear: &'a [f64],
    /// Δ_h, the change of the shear over the image.
    pub delta: &'a [f64],
    /// Where the dashed line in the third panel stands.
    pub delta_threshold: f64,
}

/// Bins per decade; the label of the ordinate says their width.
const BINS_PER_DECADE: f64 = 8.0;

/// Draws the three distributions over the full page.
pub fn histograms(data: &HaloEffects) -> Figure {
    let stroke = Stroke::dashed(Colour::BLACK, 0.9);
    let threshold = [
        Mark::Rule(Rule { at: RuleAt::X(data.delta_threshold), stroke }),
        Mark::Text(Text {
            at: TextAt::DataFraction(data.delta_threshold, 0.93),
            text: format!("  Δ_{{h}} = {}", data.delta_threshold),
            anchor: Anchor::Start,
            colour: Colour::BLACK,
            halo: Some(Colour::WHITE),
        }),
    ];
    let columns = [
        (data.convergence, "κ_{h}", Colour::BLUE, vec![]),
        (data.shear, "|γ_{h}|", Colour::GREEN, vec![]),
        (data.delta, "Δ_{h}", Colour::RED, threshold.to_vec()),
    ];
    let tallest = columns.iter().flat_map(|(values, ..)| log_bins(values).1).fold(1.0, f64::max);
    let panels = columns.into_iter().enumerate().map(|(column, (values, label, colour, lines))| {
        let (edges, counts) = log_bins(values);
        let steps = Histogram { edges, counts, stroke: Stroke::solid(colour, 0.9), legend: String::new() };
        let y = Axis {
            limits: Some((0.5, 3.0 * tallest)),
            tick_labels: column == 0,
            ..Axis::log(if column == 0 { "haloes per 0.125 dex" } else { "" })
        };
        let marks = [Mark::Histogram(steps)].into_iter().chain(lines).collect();
        Panel { marks, ..Panel::new(Axis::log(label), y) }
    });
    Figure {
        columns: 3,
        panel_aspect: 0.9,
        panels: panels.collect(),
        ..Figure::full_width("Distributions of halo effects")
    }
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

    #[test]
    fn extreme_values_do_not_panic() {
        let figure = histograms(&HaloEffects {
            convergence: &[f64::MIN_POSITIVE, f64::MAX],
            shear: &[],
            delta: &[0.1],
            delta_threshold: 0.1,
        });
        assert!(figure.to_svg().contains("no data"));
    }
}
