//! Rank histograms of a calibration study, and the coverage of its intervals.

use crate::plot::ticks::power_of_ten;
use crate::plot::{Anchor, Axis, Caption, Colour, Figure, Mark, Panel, Rule, Shape, Stroke};

/// What one panel shows.
#[derive(Debug, Clone)]
pub struct RankHistogram {
    /// The parameter as it stands on an axis.
    pub label: String,
    /// Number of fits per bin of rank.
    pub counts: Vec<f64>,
    /// Probability of a larger χ² for uniform ranks.
    pub p_value: f64,
    /// Fraction of the 68% intervals that hold the truth.
    pub coverage: f64,
}

/// Deviation of the coverage from 68% that is tolerated, shown as a band.
const COVERAGE_TOLERANCE: f64 = 0.07;
const COVERAGE: f64 = 0.68;

/// Draws one histogram a parameter with the range of three standard deviations for uniform ranks, then all coverages.
pub fn calibration(parameters: &[RankHistogram]) -> Figure {
    const COLUMNS: usize = 4;
    let tallest = parameters.iter().flat_map(|p| &p.counts).copied().fold(1.0, f64::max);
    let ranks = (0..).zip(parameters).map(|(i, p)| rank_panel(p, tallest, i % COLUMNS == 0));
    let panels = ranks.chain([coverage_panel(parameters)]);
    Figure::full_width("Calibration of the fits", 0.75, COLUMNS, panels)
}

/// A grey band from `low` to `high` over the whole panel.
fn band(right: f64, low: f64, high: f64) -> Mark {
    Shape::Band { edges: vec![[0.0, low, high], [right, low, high]], colour: Colour::GREY }.into()
}

fn captioned(panel: Panel, text: String) -> Panel {
    Panel { captions: vec![Caption { text, colour: Colour::BLACK, anchor: Anchor::Start }], ..panel }
}

fn rank_panel(parameter: &RankHistogram, tallest: f64, is_first: bool) -> Panel {
    let bins = parameter.counts.len().max(1) as f64;
    let fits: f64 = parameter.counts.iter().sum();
    let (mean, sd) = (fits / bins, (fits / bins * (1.0 - 1.0 / bins)).sqrt());
    let steps = Shape::Histogram {
        edges: (0..=parameter.counts.len()).map(|i| i as f64 / bins).collect(),
        counts: parameter.counts.clone(),
        stroke: Stroke::solid(Colour::BLUE, 0.9),
    };
    let top = f64::max(1.45 * tallest, mean + 4.0 * sd);
    let y = Axis::linear("fits per bin").between(0.0, top).outer(is_first);
    let x = Axis::linear("rank of the truth, fraction").between(0.0, 1.0);
    let p = parameter.p_value;
    let p = if p < 0.01 { small_text(p) } else { format!("{p:.2}") };
    let text = format!("{}: p = {p}, {:.0}%", parameter.label, 100.0 * parameter.coverage);
    let expected = band(1.0, (mean - 3.0 * sd).max(0.0), mean + 3.0 * sd);
    captioned(Panel::new(x, y, [expected, steps.into()]), text)
}

/// One digit and its power of ten.
fn small_text(value: f64) -> String {
    let text = format!("{value:.0e}");
    match text.split_once('e').and_then(|(digit, power)| Some((digit, power.parse().ok()?))) {
        Some((digit, power)) => format!("{digit}×{}", power_of_ten(power)),
        None => text,
    }
}

fn coverage_panel(parameters: &[RankHistogram]) -> Panel {
    /// So that a dot on the edge is whole.
    const ROOM: f64 = 0.03;
    let right = parameters.len() as f64 + 1.0;
    let points = (1..).zip(parameters).map(|(i, p)| [f64::from(i), p.coverage]).collect();
    let dots = Shape::Dots { points, colour: Colour::RED, radius_pt: 1.5, opacity: 1.0 };
    let marks = [
        band(right, COVERAGE - COVERAGE_TOLERANCE, COVERAGE + COVERAGE_TOLERANCE),
        Mark::rule(Rule::Y(COVERAGE), Stroke::dashed(Colour::BLACK, 0.8)),
        dots.into(),
    ];
    let x = Axis::linear("number of the panel").between(0.0, right);
    // The caption says what it is: a label would move the panel away from the others.
    let lowest = parameters.iter().map(|p| p.coverage - ROOM).fold(0.4, f64::min);
    let y = Axis::linear("").between(lowest, 1.0 + ROOM);
    captioned(Panel::new(x, y, marks), "coverage of 68% intervals".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_has_its_panel() {
        let one = RankHistogram { label: "γ".into(), counts: vec![3.0, 5.0], p_value: 0.5, coverage: 0.7 };
        let rare = RankHistogram { p_value: 0.0026, ..one.clone() };
        let figure = calibration(&[one, rare]);
        assert_eq!(figure.panels.len(), 3);
        let svg = figure.to_svg();
        assert!(svg.contains("p = 0.50, 70%") && svg.contains("p = 3×10"));
    }
}
