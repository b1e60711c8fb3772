//! Corner plot of posteriors: contours of every pair of parameters, every parameter on the diagonal.

use std::cmp::Ordering;

use crate::inference::DrawStatistics;
use crate::plot::density;
use crate::plot::{Anchor, Axis, Caption, Colour, Figure, Mark, Panel, Rule, Shape, Stroke, quantile};

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
/// More parameters than these make the page wider, so that labels keep their room.
const MOST_ON_A_PAGE: usize = 8;
/// Width of a panel of such a page.
const PANEL_MM: f64 = 23.0;
/// Medians smaller than this are written with a power of ten.
const LEAST_PLAIN: f64 = 1e-3;

/// A parameter of a corner plot.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerParameter<'a> {
    /// Label in markup.
    pub label: &'a str,
    /// Unit; empty for pure numbers.
    pub unit: &'a str,
    /// Values that it should or might have, one a name of the legend; the first is the truth.
    pub values: Vec<Option<f64>>,
}

/// A posterior of a corner plot.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerPosterior<'a> {
    /// Text in the legend; empty for none.
    pub legend: &'a str,
    /// Draws of each parameter, all of equal length; empty for a parameter that this model lacks.
    pub draws: Vec<&'a [f64]>,
}

/// Draws the corner plot of parameters, from the left, and posteriors laid over one another, each in a colour of its own;
/// above each curve of the diagonal the median and the 68% highest-density interval. `values` names those of the parameters.
pub fn corner(parameters: &[CornerParameter], posteriors: &[CornerPosterior], values: &[&str]) -> Figure {
    let count = parameters.len();
    let axis = |i: usize, is_outer: bool| {
        let CornerParameter { label, unit, .. } = &parameters[i];
        let has_room = !unit.is_empty() && count <= MOST_WITH_UNITS;
        let label = if has_room { format!("{label} [{unit}]") } else { label.to_string() };
        let most_intervals = if count > 3 { 2 } else { 4 };
        let limits = limits(&parameters[i], posteriors, i);
        Axis { limits, most_intervals, ..Axis::linear(&label) }.outer(is_outer)
    };
    let mut panels = Vec::new();
    for (row, column) in (0..count).flat_map(|row| (0..count).map(move |column| (row, column))) {
        let x = axis(column, row + 1 == count);
        let mut panel = match column.cmp(&row) {
            Ordering::Less => {
                let lines =
                    [value_lines(&parameters[column], Rule::X), value_lines(&parameters[row], Rule::Y)];
                let marks = pair(posteriors, column, row).into_iter().chain(lines.concat());
                Panel::new(x, axis(row, column == 0), marks)
            }
            Ordering::Equal => {
                // Wide captions grow into the empty upper triangle, or to the left where that ends.
                let anchor = if 2 * row < count { Anchor::Start } else { Anchor::End };
                curves(x, &parameters[row], posteriors, row, anchor)
            }
            Ordering::Greater => Panel { x, ..Panel::blank() },
        };
        if row == 0 && column + 1 == count {
            panel.marks.extend(legend(parameters, posteriors, values));
        }
        panels.push(panel);
    }
    let title = "Posterior distributions of the parameters, pair by pair";
    let figure = Figure::full_width(title, 1.0, count, panels);
    match count {
        0..=3 => Figure { width_mm: Figure::ONE_COLUMN_MM, ..figure },
        _ if count <= MOST_ON_A_PAGE => figure,
        _ => Figure { width_mm: PANEL_MM * count as f64, ..figure },
    }
}

fn draws<'a>(posterior: &'a CornerPosterior, parameter: usize) -> &'a [f64] {
    posterior.draws.get(parameter).copied().unwrap_or_default()
}

/// What all posteriors and values of a parameter need.
fn limits(parameter: &CornerParameter, posteriors: &[CornerPosterior], i: usize) -> Option<(f64, f64)> {
    let range = |posterior: &CornerPosterior| {
        let draws = draws(posterior, i);
        quantile(draws, IN_SIGHT[0]).zip(quantile(draws, IN_SIGHT[1]))
    };
    let ranges = posteriors.iter().filter_map(range);
    let (low, high) = ranges.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let values = parameter.values.iter().flatten().filter(|value| value.is_finite());
    let (low, high) = values.fold((low, high), |(low, high), value| (low.min(*value), high.max(*value)));
    let room = ROOM * (high - low);
    Some((low - room, high + room))
}

/// A panel of the diagonal.
fn curves(
    x: Axis,
    parameter: &CornerParameter,
    posteriors: &[CornerPosterior],
    i: usize,
    anchor: Anchor,
) -> Panel {
    let CornerParameter { label, unit, .. } = parameter;
    let mut panel = Panel::new(x, Axis::linear("").between(0.0, 1.12).outer(false), []);
    for (number, posterior) in posteriors.iter().enumerate() {
        let (draws, colour) = (draws(posterior, i), Colour::of_curve(number));
        let Some(curve) = density::curve(draws) else { continue };
        let foot = |point: Option<&[f64; 2]>| point.map(|&[x, _]| [x, 0.0]);
        let ring = foot(curve.first()).into_iter().chain(curve.iter().copied()).chain(foot(curve.last()));
        let (rings, opacity) = (vec![ring.collect()], 0.5 * OPACITIES[1]);
        panel.marks.push(Shape::Region { rings, stroke: Stroke::solid(colour, 0.0), opacity }.into());
        panel.marks.push(Mark::line(curve, Stroke::solid(colour, 1.0)));
        let colour = if posteriors.len() > 1 { colour } else { Colour::BLACK };
        panel.captions.extend(DrawStatistics::of(draws).map(|statistics| Caption {
            text: format!("{label} = {} {unit}", interval(&statistics)),
            colour,
            anchor,
        }));
    }
    panel.marks.extend(value_lines(parameter, Rule::X));
    panel
}

/// Contours of two parameters, for a panel below the diagonal.
fn pair(posteriors: &[CornerPosterior], x: usize, y: usize) -> Vec<Mark> {
    let mut marks = Vec::new();
    for (number, posterior) in posteriors.iter().enumerate() {
        let contours = density::field(draws(posterior, x), draws(posterior, y), &FRACTIONS);
        let Some((field, levels)) = contours else { continue };
        let stroke = Stroke::solid(Colour::of_curve(number), 0.7);
        let regions = levels.iter().zip(OPACITIES).rev().map(|(level, opacity)| {
            Mark::from(Shape::Region { rings: field.rings_above(*level), stroke, opacity })
        });
        marks.extend(regions);
    }
    marks
}

/// The lines of the truth and of other values.
fn value_lines(parameter: &CornerParameter, at: fn(f64) -> Rule) -> Vec<Mark> {
    let line = |(k, value): (usize, &Option<f64>)| value.map(|value| Mark::rule(at(value), value_stroke(k)));
    parameter.values.iter().enumerate().filter_map(line).collect()
}

/// Black for the truth; other values have colours that the first posterior has not.
fn value_stroke(number: usize) -> Stroke {
    Stroke::dashed(if number == 0 { Colour::BLACK } else { Colour::of_curve(number) }, 0.6)
}

/// Samples for the legend, without anything drawn; one posterior alone needs none.
fn legend(parameters: &[CornerParameter], posteriors: &[CornerPosterior], values: &[&str]) -> Vec<Mark> {
    let sample = |(number, posterior): (usize, &CornerPosterior)| {
        let stroke = Stroke::solid(Colour::of_curve(number), 0.7);
        Mark::from(Shape::Region { rings: Vec::new(), stroke, opacity: OPACITIES[0] }).named(posterior.legend)
    };
    let several = posteriors.iter().enumerate().filter(|_| posteriors.len() > 1).map(sample);
    let is_known =
        |k: usize| parameters.iter().any(|parameter| matches!(parameter.values.get(k), Some(Some(_))));
    let known = values.iter().enumerate().filter(|(k, _)| is_known(*k));
    several.chain(known.map(|(k, name)| Mark::line([], value_stroke(k)).named(*name))).collect()
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
        let parameters = ["a", "b", "c"].map(|label| CornerParameter {
            label,
            unit: "arcsec",
            values: vec![Some(0.1), None, Some(0.2)],
        });
        let all = CornerPosterior { legend: "full", draws: draws.iter().map(Vec::as_slice).collect() };
        let few = CornerPosterior { legend: "minimal", draws: vec![&draws[0], &[], &draws[1]] };
        let figure = corner(&parameters, &[all, few], &["truth", "nowhere", "ring"]);
        assert_eq!((figure.panels.len(), figure.columns), (9, 3));
        let regions = |panel: usize| {
            let marks = figure.panels[panel].marks.iter();
            marks.filter(|mark| matches!(mark.shape, Shape::Region { .. })).count()
        };
        // Row by row; two contours a posterior, and the second posterior lacks b.
        assert_eq!([3, 6, 7].map(regions), [2, 4, 2]);
        assert_eq!([0, 4].map(|i| figure.panels[i].captions.len()), [2, 1]);
        assert!(figure.panels[1].is_blank && figure.panels[7].y.label.is_empty());
        assert_eq!(figure.panels[6].x.label, "a [arcsec]");
        let svg = figure.to_svg();
        assert!(
            svg.contains("minimal")
                && svg.contains("truth")
                && svg.contains("ring")
                && !svg.contains("nowhere")
        );
    }
}
