//! Bulk and tail effective sample size (Vehtari et al. 2021, equations 10–13 and 15; Geyer 1992, Stat. Sci. 7, 473).

use nalgebra::DVectorView;

use super::moments::{mean, split, variance};
use super::ranks::normal_scores;
use crate::inference::diagnose::quantile_of_sorted;

/// Effective size of the rank-normalised draws.
pub(super) fn bulk(chains: &[&[f64]]) -> f64 {
    effective_size(&normal_scores(&split(chains)))
}

/// The smaller effective size of the indicators x ≤ q at the 5% and 95% quantiles q.
pub(super) fn tail(chains: &[&[f64]]) -> f64 {
    let mut sorted = chains.concat();
    sorted.sort_unstable_by(f64::total_cmp);
    let halves = split(chains);
    let at = |probability: f64| {
        let quantile = quantile_of_sorted(&sorted, probability);
        let below = |half: &&[f64]| half.iter().map(|value| f64::from(*value <= quantile)).collect();
        effective_size(&halves.iter().map(below).collect::<Vec<Vec<f64>>>())
    };
    at(0.05).min(at(0.95))
}

/// All draws divided by the autocorrelation time, from Geyer's initial monotone sequence of pairs of lags.
fn effective_size(chains: &[Vec<f64>]) -> f64 {
    let draws = chains[0].len();
    let count = (chains.len() * draws) as f64;
    let centred: Vec<Vec<f64>> = chains
        .iter()
        .map(|chain| {
            let mean = mean(chain);
            chain.iter().map(|value| value - mean).collect()
        })
        .collect();
    let autocovariance = |lag: usize| {
        let of = |chain: &Vec<f64>| {
            let earlier = DVectorView::from_slice(chain, draws - lag);
            earlier.dot(&DVectorView::from_slice(&chain[lag..], draws - lag))
        };
        centred.iter().map(of).sum::<f64>() / count
    };
    let unbiased = draws as f64 / (draws as f64 - 1.0);
    let within = autocovariance(0) * unbiased;
    let between = variance(&chains.iter().map(|chain| mean(chain)).collect::<Vec<_>>());
    let total = within / unbiased + between;
    if total == 0.0 {
        return count;
    }
    let correlation = |lag: usize| 1.0 - (within - autocovariance(lag)) / total;
    // Sums of pairs of lags: positive, and never larger than the pair before. The pair that ends the sequence,
    // by its sign or as the last there is, counts with its even lag alone and once.
    let (mut even, mut pair) = (1.0, 1.0 + correlation(1));
    let (mut sum, mut shrunk, mut lag) = (0.0, pair, 2);
    while pair > 0.0 && lag + 2 < draws {
        shrunk = pair.min(shrunk);
        sum += shrunk;
        even = correlation(lag);
        pair = even + correlation(lag + 1);
        lag += 2;
    }
    let time = (2.0 * sum - 1.0 + even.max(0.0)).max(1.0 / count.log10());
    count / time
}
