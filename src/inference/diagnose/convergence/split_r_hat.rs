//! Rank-normalised split R-hat (Vehtari et al. 2021, equations 3 and 14, and its folded form).

use super::moments::{mean, split, variance};
use super::ranks::normal_scores;
use crate::inference::diagnose::quantile_of_sorted;

/// The larger of R-hat of the ranks and of the ranks of |x − median|; chains of at least 4 draws.
pub(super) fn rank_normalised(chains: &[Vec<f64>]) -> f64 {
    let slices: Vec<&[f64]> = chains.iter().map(Vec::as_slice).collect();
    let halves = split(&slices);
    let mut sorted = halves.concat();
    sorted.sort_unstable_by(f64::total_cmp);
    let median = quantile_of_sorted(&sorted, 0.5);
    let folded: Vec<Vec<f64>> =
        halves.iter().map(|half| half.iter().map(|value| (value - median).abs()).collect()).collect();
    r_hat(&normal_scores(&halves)).max(r_hat(&normal_scores(&folded)))
}

/// √(((n − 1)/n·W + B/n)/W), with W the mean variance of a chain and B/n the variance of the chains' means.
fn r_hat(chains: &[Vec<f64>]) -> f64 {
    let draws = chains[0].len() as f64;
    let means: Vec<f64> = chains.iter().map(|chain| mean(chain)).collect();
    let within = mean(&chains.iter().map(|chain| variance(chain)).collect::<Vec<_>>());
    ((draws - 1.0) / draws + variance(&means) / within).sqrt()
}
