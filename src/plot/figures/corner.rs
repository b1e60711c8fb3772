//! Corner plot of posteriors: contours of every pair of parameters, every parameter on the diagonal.

use crate::inference::DrawStatistics;
use crate::plot::density;
use crate::plot::{
    Anchor, Axis, Caption, Colour, Figure, Line, Mark, Panel, Region, Rule, RuleAt, Stroke, quantile,
};

/// Fractions of the draws inside the contours.
const FRACTIONS: [f64; 2] = [0.68, 0.95];
/// Opacity of the fill inside each contour; the inner one lies on the outer.
const OPACITIES: [f64; 2] = [0.35, 0.2];
/// Draws beyond these quantiles need not be in sight.
const IN_SIGHT: [f64; 2] = [0.002, 0.998];
/// Room beyond them, as a fraction of their distance.
const ROOM: f64 = 0.12;
/// The most parameters whose axis labels have room for units.
const MOST_WITH_UNITS: usize = 8;
/// Medians smaller than this are written with a power of ten.
const LEAST_PLAIN: f64 = 1e-3;

/// A parameter of a corner plot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CornerParameter<'a> {
    /// Label in markup.
    pub label: &'a str,
    /// Unit; empty for pure numbers.
    pub unit: &'a str,
    /// The true value, where it is known.
    pub truth: Option<f64>,
}

/// A posterior of a corner plot.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerPosterior<'a> {
    /// Text in the legend; empty for none.
    pub legend: &'a str,
    /// Draws of each parameter, all of equal length; empty for a parameter that this model lacks.
    pub draws: Vec<&'a [f64]>,
}

/// What a corner plot shows.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerData<'a> {
    /// Parameters, from the left.
    pub parameters: &'a [CornerParameter<'a>],
    /// Posteriors laid over one another, each in a colour of its own.
    pub posteriors: &'a [CornerPosterior<'a>],
}

/// Draws the corner plot; above each curve of the diagonal the median and the 68% highest-density interval.
pub fn corner(data: &CornerData) -> Figure {
    let count = data.parameters.len();
    let labels = labels(data);
    let limits: Vec<Option<(f64, f64)>> = (0..count).map(|i| limits(data, i)).collect();
    let mut panels = Vec::new();
    for row in 0..count {
        for column in 0..count {
            let mut panel = match column.cmp(&row) {
                std::cmp::Ordering::Less => pair(data, column, row),
                std::cmp::Ordering::Equal => curve(data, row),
                std::cmp::Ordering::Greater => Panel::blank(),
            };
            let axis = |parameter: usize, is_outer: bool| Axis {
                limits: limits[parameter],
                tick_labels: is_outer,
                ..Axis::linear(if is_outer { &labels[parameter] } else { "" })
            };
            panel.x = axis(column, row + 1 == count);
            if column < row {
                panel.y = axis(row, column == 0);
            }
            if row == 0 && column + 1 == count {
                panel.marks.extend(legend(data));
            }
            panels.push(panel);
        }
    }
    let title = "Posterior distributions of the parameters, pair by pair";
    let figure = if count <= 3 { Figure::one_column(title) } else { Figure::full_width(title) };
    Figure { columns: count.max(1), panel_aspect: 1.0, panels, ..figure }
}

/// Axis labels, with units where there is room; captions have them too.
fn labels(data: &CornerData) -> Vec<String> {
    let label = |parameter: &CornerParameter| match parameter.unit {
        unit if !unit.is_empty() && data.parameters.len() <= MOST_WITH_UNITS => {
            format!("{} [{unit}]", parameter.label)
        }
        _ => parameter.label.to_string(),
    };
    data.parameters.iter().map(label).collect()
}

fn draws<'a>(posterior: &'a CornerPosterior, parameter: usize) -> &'a [f64] {
    posterior.draws.get(parameter).copied().unwrap_or_default()
}

/// What all posteriors and the truth of a parameter need.
fn limits(data: &CornerData, parameter: usize) -> Option<(f64, f64)> {
    let range = |posterior: &CornerPosterior| {
        let draws = draws(posterior, parameter);
        quantile(draws, IN_SIGHT[0]).zip(quantile(draws, IN_SIGHT[1]))
    };
    let ranges = data.posteriors.iter().filter_map(range);
    let (low, high) = ranges.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let (low, high) = match data.parameters[parameter].truth.filter(|truth| truth.is_finite()) {
        Some(truth) => (low.min(truth), high.max(truth)),
        None => (low, high),
    };
    let room = ROOM * (high - low);
    Some((low - room, high + room))
}

/// A panel of the diagonal.
fn curve(data: &CornerData, parameter: usize) -> Panel {
    let mut panel = Panel::new(Axis::linear(""), Axis::linear(""));
    panel.y = Axis { limits: Some((0.0, 1.12)), tick_labels: false, ..Axis::linear("") };
    for (number, posterior) in data.posteriors.iter().enumerate() {
        let (draws, colour) = (draws(posterior, parameter), Colour::of_curve(number));
        let Some((x, y)) = density::curve(draws) else { continue };
        let foot = |x: Option<&f64>| x.map(|&x| (x, 0.0));
        let outline = x.iter().copied().zip(y.iter().copied());
        let ring = foot(x.first()).into_iter().chain(outline).chain(foot(x.last())).collect();
        panel.marks.push(Mark::Region(Region {
            rings: vec![ring],
            stroke: Stroke::solid(colour, 0.0),
            opacity: 0.5 * OPACITIES[1],
            legend: String::new(),
        }));
        panel.marks.push(Mark::Line(Line::new(x, y, Stroke::solid(colour, 1.0))));
        // Wide captions grow into the empty upper triangle, or to the left where that ends.
        let is_left = 2 * parameter < data.parameters.len();
        let anchor = if is_left { Anchor::Start } else { Anchor::End };
        let colour = if data.posteriors.len() > 1 { colour } else { Colour::BLACK };
        if let Some(statistics) = DrawStatistics::of(draws) {
            let CornerParameter { label, unit, .. } = data.parameters[parameter];
            let text = format!("{label} = {} {unit}", interval(&statistics));
            panel.captions.push(Caption { text, colour, anchor });
        }
    }
    panel.marks.extend(truth(data, parameter, RuleAt::X));
    panel
}

/// A panel below the diagonal.
fn pair(data: &CornerData, x: usize, y: usize) -> Panel {
    let mut panel = Panel::new(Axis::linear(""), Axis::linear(""));
    for (number, posterior) in data.posteriors.iter().enumerate() {
        let contours = density::field(draws(posterior, x), draws(posterior, y), &FRACTIONS);
        let Some((field, levels)) = contours else { continue };
        let colour = Colour::of_curve(number);
        for (level, opacity) in levels.iter().zip(OPACITIES).rev() {
            panel.marks.push(Mark::Region(Region {
                rings: field.rings_above(*level),
                stroke: Stroke::solid(colour, 0.7),
                opacity,
                legend: String::new(),
            }));
        }
    }
    panel.marks.extend(truth(data, x, RuleAt::X));
    panel.marks.extend(truth(data, y, RuleAt::Y));
    panel
}

/// The line of the truth.
fn truth(data: &CornerData, parameter: usize, at: impl Fn(f64) -> RuleAt) -> Option<Mark> {
    let truth = data.parameters[parameter].truth?;
    Some(Mark::Rule(Rule { at: at(truth), stroke: Stroke::dashed(Colour::BLACK, 0.6) }))
}

/// Samples for the legend, without anything drawn; one posterior alone needs none.
fn legend(data: &CornerData) -> Vec<Mark> {
    let sample = |(number, posterior): (usize, &CornerPosterior)| {
        let (stroke, legend) = (Stroke::solid(Colour::of_curve(number), 0.7), posterior.legend.to_string());
        Mark::Region(Region { rings: Vec::new(), stroke, opacity: OPACITIES[0], legend })
    };
    let several = data.posteriors.iter().enumerate().filter(|_| data.posteriors.len() > 1);
    let mut marks: Vec<Mark> = several.map(sample).collect();
    if data.parameters.iter().any(|parameter| parameter.truth.is_some()) {
        let stroke = Stroke::dashed(Colour::BLACK, 0.6);
        marks.push(Mark::Line(Line { x: Vec::new(), y: Vec::new(), stroke, legend: "truth".into() }));
    }
    marks
}

/// Median and distances to the ends of the interval, in markup: `0.0213^{+0.0015}_{−0.0018}`.
fn interval(statistics: &DrawStatistics) -> String {
    let up = statistics.hpd68_high - statistics.median;
    let down = statistics.median - statistics.hpd68_low;
    let least = up.abs().min(down.abs()).max(0.05 * up.abs().max(down.abs()));
    if least <= 0.0 {
        return format!("{}", statistics.median);
    }
    // Two digits of the smaller distance.
    let decimals = 1 - least.log10().floor() as i32;
    let size = statistics.median.abs().max(up);
    let exponent = if size < LEAST_PLAIN { size.log10().floor() as i32 } else { 0 };
    let scale = 10.0_f64.powi(-exponent);
    let digits = (decimals + exponent).max(0) as usize;
    let text = |value: f64| format!("{:.digits$}", value * scale).replace('-', "−");
    let signed = |sign: &str, value: f64| format!("{sign}{}", text(value.abs()));
    let (plus, minus) = (signed(if up < 0.0 { "−" } else { "+" }, up), signed("−", down));
    let number = format!("{}^{{{plus}}}_{{{minus}}}", text(statistics.median));
    if exponent == 0 {
        number
    } else {
        format!("{number} × 10^{{{}}}", exponent.to_string().replace('-', "−"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statistics(low: f64, median: f64, high: f64) -> DrawStatistics {
        let standard_deviation = 0.5 * (high - low);
        DrawStatistics { mean: median, median, standard_deviation, hpd68_low: low, hpd68_high: high }
    }

    #[test]
    fn intervals_have_two_digits_of_their_smaller_side() {
        assert_eq!(interval(&statistics(0.0195, 0.0213, 0.0228)), "0.0213^{+0.0015}_{−0.0018}");
        assert_eq!(interval(&statistics(-2.0, 1.0, 5.0)), "1.0^{+4.0}_{−3.0}");
        assert_eq!(interval(&statistics(-1.1e-7, -1e-7, -0.9e-7)), "−1.00^{+0.10}_{−0.10} × 10^{−7}");
        assert_eq!(interval(&statistics(100.0, 1234.0, 2000.0)), "1234^{+766}_{−1134}");
        assert_eq!(interval(&statistics(3.0, 3.0, 3.0)), "3");
    }

    #[test]
    fn every_pair_has_a_panel_with_its_contours() {
        let wave = |k: f64| -> Vec<f64> { (0..2000).map(|i| (k * f64::from(i)).sin()).collect() };
        let draws = [wave(0.1), wave(0.37), wave(0.91)];
        let parameter = |label| CornerParameter { label, unit: "arcsec", truth: Some(0.1) };
        let parameters = [parameter("a"), parameter("b"), parameter("c")];
        let all = CornerPosterior { legend: "full", draws: draws.iter().map(Vec::as_slice).collect() };
        let few = CornerPosterior { legend: "minimal", draws: vec![&draws[0], &[], &draws[1]] };
        let figure = corner(&CornerData { parameters: &parameters, posteriors: &[all, few] });
        assert_eq!((figure.panels.len(), figure.columns), (9, 3));
        let regions = |panel: usize| {
            figure.panels[panel].marks.iter().filter(|mark| matches!(mark, Mark::Region(_))).count()
        };
        // Row by row; two contours a posterior, and the second posterior lacks b.
        assert_eq!([3, 6, 7].map(regions), [2, 4, 2]);
        assert_eq!(figure.panels[0].captions.len(), 2);
        assert_eq!(figure.panels[4].captions.len(), 1);
        assert!(figure.panels[1].is_blank && figure.panels[7].y.label.is_empty());
        assert_eq!(figure.panels[6].x.label, "a [arcsec]");
        let svg = figure.to_svg();
        assert!(svg.contains("minimal") && svg.contains("truth") && !svg.contains("no data"));
    }

    #[test]
    fn nothing_and_constants_do_not_panic() {
        corner(&CornerData { parameters: &[], posteriors: &[] }).to_svg();
        let parameters = [CornerParameter { label: "a", unit: "", truth: None }; 2];
        let constant = CornerPosterior { legend: "", draws: vec![&[1.0, 1.0], &[f64::NAN]] };
        corner(&CornerData { parameters: &parameters, posteriors: &[constant] }).to_svg();
    }
}
