//! Trace plot: the draws of every chain in their order, and how each chain's ranks are spread.

use crate::plot::{Axis, Colour, Figure, Mark, Panel, Rule, Stroke};

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
    for (row, TraceParameter { label, chains, truth }) in parameters.iter().enumerate() {
        let is_last = row + 1 == parameters.len();
        let shares = rank_shares(chains);
        let every = chains.len().div_ceil(MOST_CHAINS).max(1);
        let shown = || (0..chains.len()).step_by(every).enumerate();
        let traces =
            shown().map(|(i, chain)| Mark::line(trace(chains[chain]), Stroke::solid(colour(i), 0.45)));
        let ranks =
            shown().map(|(i, chain)| Mark::line(steps(&shares[chain]), Stroke::solid(colour(i), 0.8)));
        let truth = truth.map(|truth| Mark::rule(Rule::Y(truth), Stroke::dashed(Colour::BLACK, 0.8)));
        let even = Mark::rule(Rule::Y(1.0), Stroke::dashed(Colour::GREY, 0.6));
        let draws = chains.first().map_or(0, |chain| chain.len());
        let limits = (draws > 0).then_some((0.0, draws as f64));
        let draw_axis = Axis { limits, ..Axis::linear("draw").outer(is_last) };
        let rank_axis = Axis::linear("rank of draw").between(0.0, 1.0).outer(is_last);
        let highest = 1.04 * shares.concat().into_iter().fold(2.0, f64::max);
        let share_axis = Axis::linear("share").between(0.0, highest);
        panels.push(Panel::new(draw_axis, Axis::linear(label), traces.chain(truth)));
        panels.push(Panel::new(rank_axis, share_axis, ranks.chain([even])));
    }
    Figure::full_width("Draws of every chain, and the spread of their ranks", 0.26, 2, panels)
}

fn colour(place: usize) -> Colour {
    const MORE: [Colour; 3] = [Colour::RED, Colour::GREY, Colour(86, 180, 233)];
    if place < 5 { Colour::of_curve(place) } else { MORE[(place - 5) % MORE.len()] }
}

/// The draws, thinned evenly.
fn trace(draws: &[f64]) -> Vec<[f64; 2]> {
    let every = draws.len().div_ceil(MOST_POINTS).max(1);
    draws.iter().enumerate().step_by(every).map(|(i, value)| [i as f64, *value]).collect()
}

/// A staircase over equal bins of (0, 1).
fn steps(shares: &[f64]) -> Vec<[f64; 2]> {
    let edge = |bin: usize| bin as f64 / shares.len() as f64;
    shares.iter().enumerate().flat_map(|(bin, y)| [[edge(bin), *y], [edge(bin + 1), *y]]).collect()
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
    }
}
