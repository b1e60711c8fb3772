//! Rank histograms of a calibration study, and the coverage of its intervals.

use crate::plot::{
    Anchor, Axis, Band, Caption, Colour, Figure, Histogram, Mark, Panel, Rule, RuleAt, Scatter, Stroke,
};

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
    let panels = ranks.chain([coverage_panel(parameters)]).collect();
    Figure { columns: COLUMNS, panel_aspect: 0.75, panels, ..Figure::full_width("Calibration of the fits") }
}

fn rank_panel(parameter: &RankHistogram, tallest: f64, is_first: bool) -> Panel {
    let bins = parameter.counts.len().max(1) as f64;
    let fits: f64 = parameter.counts.iter().sum();
    let (mean, sd) = (fits / bins, (fits / bins * (1.0 - 1.0 / bins)).sqrt());
    let expected = Band {
        x: vec![0.0, 1.0],
        low: vec![(mean - 3.0 * sd).max(0.0); 2],
        high: vec![mean + 3.0 * sd; 2],
        colour: Colour::GREY,
    };
    let steps = Histogram {
        edges: (0..=parameter.counts.len()).map(|i| i as f64 / bins).collect(),
        counts: parameter.counts.clone(),
        stroke: Stroke::solid(Colour::BLUE, 0.9),
        legend: String::new(),
    };
    let top = f64::max(1.45 * tallest, mean + 4.0 * sd);
    let y = Axis {
        limits: Some((0.0, top)),
        tick_labels: is_first,
        ..Axis::linear(if is_first { "fits per bin" } else { "" })
    };
    let x = Axis { limits: Some((0.0, 1.0)), ..Axis::linear("rank of the truth / 100") };
    let p = parameter.p_value;
    let p = if p < 0.01 { format!("{p:.0e}") } else { format!("{p:.2}") };
    let text = format!("{}: p = {p}, {:.0}%", parameter.label, 100.0 * parameter.coverage);
    Panel {
        marks: vec![Mark::Band(expected), Mark::Histogram(steps)],
        captions: vec![Caption { text, colour: Colour::BLACK, anchor: Anchor::Start }],
        ..Panel::new(x, y)
    }
}

fn coverage_panel(parameters: &[RankHistogram]) -> Panel {
    let n = parameters.len() as f64;
    let tolerated = Band {
        x: vec![0.0, n + 1.0],
        low: vec![COVERAGE - COVERAGE_TOLERANCE; 2],
        high: vec![COVERAGE + COVERAGE_TOLERANCE; 2],
        colour: Colour::GREY,
    };
    let dots = Scatter {
        x: (1..=parameters.len()).map(|i| i as f64).collect(),
        y: parameters.iter().map(|p| p.coverage).collect(),
        colour: Colour::RED,
        radius_pt: 1.5,
        opacity: 1.0,
        legend: String::new(),
    };
    let line = Rule { at: RuleAt::Y(COVERAGE), stroke: Stroke::dashed(Colour::BLACK, 0.8) };
    let x = Axis { limits: Some((0.0, n + 1.0)), ..Axis::linear("number of the panel") };
    let y = Axis { limits: Some((0.4, 1.0)), ..Axis::linear("share of the fits") };
    let text = "coverage of 68% intervals".into();
    let captions = vec![Caption { text, colour: Colour::BLACK, anchor: Anchor::Start }];
    Panel {
        marks: vec![Mark::Band(tolerated), Mark::Rule(line), Mark::Scatter(dots)],
        captions,
        ..Panel::new(x, y)
    }
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
        assert!(svg.contains("p = 0.50, 70%") && svg.contains("p = 3e-3"));
        assert!(!calibration(&[]).to_svg().contains("NaN"));
    }
}
