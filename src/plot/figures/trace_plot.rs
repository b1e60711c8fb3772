//! Trace plot: the draws of every chain in their order, and how each chain's ranks are spread.

use crate::plot::{Axis, Colour, Figure, Line, Mark, Panel, Rule, RuleAt, Stroke};

/// Chains shown at most, evenly chosen: more cannot be told apart.
const MOST_CHAINS: usize = 8;
/// Points of a trace at most.
const MOST_POINTS: usize = 600;
/// Bins of the ranks.
const RANK_BINS: usize = 20;

/// A parameter of a trace plot.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceParameter<'a> {
    /// Label in markup, with the unit in square brackets.
    pub label: &'a str,
    /// Draws of each chain, all of one length.
    pub chains: Vec<&'a [f64]>,
    /// The true value, where it is known.
    pub truth: Option<f64>,
}

/// Draws one row a parameter: traces on the left, on the right the share of each chain's draws per bin of ranks
/// among all draws, relative to an even spread (Vehtari et al. 2021, section 4.3).
pub fn trace_plot(parameters: &[TraceParameter]) -> Figure {
    let mut panels = Vec::new();
    for (row, parameter) in parameters.iter().enumerate() {
        let is_last = row + 1 == parameters.len();
        let mut traces =
            Panel::new(Axis::linear(if is_last { "draw" } else { "" }), Axis::linear(parameter.label));
        let mut ranks =
            Panel::new(Axis::linear(if is_last { "rank of draw" } else { "" }), Axis::linear("share"));
        traces.x.tick_labels = is_last;
        ranks.x.tick_labels = is_last;
        ranks.x.limits = Some((0.0, 1.0));
        let shares = rank_shares(&parameter.chains);
        let every = parameter.chains.len().div_ceil(MOST_CHAINS).max(1);
        for (place, chain) in (0..parameter.chains.len()).step_by(every).enumerate() {
            let stroke = Stroke::solid(colour(place), 0.45);
            traces.marks.push(Mark::Line(trace(parameter.chains[chain], stroke)));
            ranks.marks.push(Mark::Line(steps(&shares[chain], Stroke::solid(colour(place), 0.8))));
        }
        let truth = parameter.truth.map(|truth| {
            Mark::Rule(Rule { at: RuleAt::Y(truth), stroke: Stroke::dashed(Colour::BLACK, 0.8) })
        });
        traces.marks.extend(truth);
        let draws = parameter.chains.first().map_or(0, |chain| chain.len());
        traces.x.limits = (draws > 0).then_some((0.0, draws as f64));
        let highest = shares.concat().into_iter().fold(2.0, f64::max);
        ranks.y.limits = Some((0.0, highest));
        let even = Rule { at: RuleAt::Y(1.0), stroke: Stroke::dashed(Colour::GREY, 0.6) };
        ranks.marks.push(Mark::Rule(even));
        panels.extend([traces, ranks]);
    }
    let title = "Draws of every chain, and the spread of their ranks";
    Figure { columns: 2, panel_aspect: 0.26, panels, ..Figure::full_width(title) }
}

fn colour(place: usize) -> Colour {
    const MORE: [Colour; 3] = [Colour::RED, Colour::GREY, Colour(86, 180, 233)];
    if place < 5 { Colour::of_curve(place) } else { MORE[(place - 5) % MORE.len()] }
}

/// The draws, thinned evenly.
fn trace(draws: &[f64], stroke: Stroke) -> Line {
    let every = draws.len().div_ceil(MOST_POINTS).max(1);
    let (x, y) = draws.iter().enumerate().step_by(every).map(|(i, value)| (i as f64, *value)).unzip();
    Line::new(x, y, stroke)
}

/// A staircase over equal bins of (0, 1).
fn steps(shares: &[f64], stroke: Stroke) -> Line {
    let edge = |bin: usize| bin as f64 / shares.len() as f64;
    let ends =
        shares.iter().enumerate().flat_map(|(bin, share)| [(edge(bin), *share), (edge(bin + 1), *share)]);
    let (x, y) = ends.unzip();
    Line::new(x, y, stroke)
}

/// Per chain, the share of its draws in each bin of the ranks among all draws, times the number of bins.
fn rank_shares(chains: &[&[f64]]) -> Vec<Vec<f64>> {
    let mut order: Vec<(f64, usize)> = chains
        .iter()
        .enumerate()
        .flat_map(|(chain, draws)| draws.iter().map(move |draw| (*draw, chain)))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut shares = vec![vec![0.0; RANK_BINS]; chains.len()];
    for (rank, (_, chain)) in order.iter().enumerate() {
        let unit = RANK_BINS as f64 / chains[*chain].len() as f64;
        shares[*chain][rank * RANK_BINS / order.len()] += unit;
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_even_for_equal_chains_and_not_for_a_stuck_one() {
        let even: Vec<f64> = (0..2000).map(|i| f64::from(i * 7919 % 2000)).collect();
        let shares = rank_shares(&[&even, &even]);
        assert!(shares.concat().iter().all(|share| (share - 1.0).abs() < 0.05), "{shares:?}");
        let high = vec![1e9; 2000];
        let shares = rank_shares(&[&even, &high]);
        assert!(shares[0][RANK_BINS - 1] == 0.0 && (shares[1][RANK_BINS - 1] - 2.0).abs() < 1e-9);
    }

    #[test]
    fn one_row_a_parameter_and_few_of_many_chains() {
        let draws: Vec<f64> = (0..5000).map(|i| f64::from(i).sin()).collect();
        let parameter =
            TraceParameter { label: "θ_{E} [arcsec]", chains: vec![&draws; 160], truth: Some(0.2) };
        let figure = trace_plot(&[parameter.clone(), parameter]);
        assert_eq!((figure.panels.len(), figure.columns), (4, 2));
        assert_eq!(figure.panels[0].marks.len(), MOST_CHAINS + 1);
        assert!(figure.to_svg().len() < 400_000, "{}", figure.to_svg().len());
        trace_plot(&[TraceParameter { label: "", chains: vec![], truth: None }]).to_svg();
    }
}
