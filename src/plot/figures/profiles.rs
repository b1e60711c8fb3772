//! Profile likelihoods beside posterior densities.

use crate::plot::{Axis, Colour, Figure, Mark, Panel, Rule, Stroke, density};

/// One parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileCurve<'a> {
    /// Label in markup.
    pub label: &'a str,
    /// Unit, may be empty.
    pub unit: &'a str,
    /// (value, L/L_max).
    pub ratio: Vec<[f64; 2]>,
    /// Draws of the posterior.
    pub draws: &'a [f64],
    /// The true value, where it is known.
    pub truth: Option<f64>,
}

/// A panel a parameter: L/L_max where it is held, and the posterior's density over its highest.
pub fn profiles(curves: &[ProfileCurve]) -> Figure {
    /// L/L_max at the ends of the intervals of 68 and 95%.
    const LEVELS: [f64; 2] = [0.606_530_659_712_633_4, 0.135_335_283_236_612_7];
    let panel = |(place, curve): (usize, &ProfileCurve)| {
        let label = match curve.unit {
            "" => curve.label.to_owned(),
            unit => format!("{} [{unit}]", curve.label),
        };
        let levels = LEVELS.map(|level| Mark::rule(Rule::Y(level), Stroke::dashed(Colour::GREY, 0.6)));
        let posterior = density::curve(curve.draws).unwrap_or_default();
        let highest = posterior.iter().map(|point| point[1]).fold(f64::MIN_POSITIVE, f64::max);
        let posterior: Vec<[f64; 2]> = posterior.into_iter().map(|[x, y]| [x, y / highest]).collect();
        let lines = [
            Mark::line(curve.ratio.clone(), Stroke::solid(Colour::of_curve(1), 1.2))
                .named("profile likelihood"),
            Mark::line(posterior, Stroke::solid(Colour::of_curve(0), 1.2)).named("posterior"),
        ];
        let truth = curve
            .truth
            .map(|truth| Mark::rule(Rule::X(truth), Stroke::dashed(Colour::BLACK, 0.8)).named("truth"));
        let y = Axis::linear("relative to the highest").between(0.0, 1.35).outer(place % COLUMNS == 0);
        Panel::new(Axis::linear(&label), y, levels.into_iter().chain(lines).chain(truth))
    };
    let panels: Vec<Panel> = curves.iter().enumerate().map(panel).collect();
    let title = "Profile likelihood and posterior";
    match <[Panel; 1]>::try_from(panels) {
        Ok([panel]) => Figure::one_column(title, 0.75, panel),
        Err(panels) => Figure::full_width(title, 0.75, COLUMNS.min(panels.len()), panels),
    }
}

const COLUMNS: usize = 3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panel_a_parameter_with_both_curves() {
        let draws: Vec<f64> = (0..400).map(|i| f64::from(i).sin()).collect();
        let ratio: Vec<[f64; 2]> =
            (-10..=10).map(|i| f64::from(i) / 5.0).map(|x| [x, (-x * x).exp()]).collect();
        let curve = ProfileCurve { label: "θ_{E}", unit: "arcsec", ratio, draws: &draws, truth: Some(0.2) };
        for n in [1, 2, 5] {
            let figure = profiles(&vec![curve.clone(); n]);
            assert_eq!((figure.panels.len(), figure.columns), (n, n.min(3)));
            assert!(figure.to_svg().contains("profile likelihood"));
        }
    }
}
