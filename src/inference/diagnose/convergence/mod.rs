//! Whether chains have converged: rank-normalised split R-hat, bulk and tail effective sample size.
//!
//! Vehtari, Gelman, Simpson, Carpenter & Bürkner (2021, Bayesian Analysis 16, 667), equations 3–15. The numbers
//! agree with ArviZ 0.22 (`tests/reference/convergence.rs`).

mod autocorrelation_time;
mod effective_size;
mod moments;
mod ranks;
mod split_r_hat;

use serde::{Deserialize, Serialize};

pub use autocorrelation_time::autocorrelation_time;

/// R-hat that counts as converged, from Vehtari et al. 2021.
pub const R_HAT_LIMIT: f64 = 1.01;
/// Effective draws (bulk and tail) that count as enough, from Vehtari et al. 2021.
pub const ESS_LIMIT: f64 = 400.0;

/// How well one quantity has been sampled. NaN, which is not converged, where there are too few or constant
/// draws.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Convergence {
    /// Rank-normalised split R-hat, the larger of bulk and folded.
    pub r_hat: f64,
    /// Effective number of draws for the centre of the distribution.
    pub ess_bulk: f64,
    /// Effective number of draws for its 5% and 95% quantiles, the smaller of the two.
    pub ess_tail: f64,
}

impl Convergence {
    /// Diagnoses the draws of one quantity, a slice a chain, all of equal length.
    ///
    /// `group_size` consecutive chains move together (the walkers of an ensemble, else 1). R-hat compares
    /// groups, as only they are independent; the effective size follows every chain for itself.
    ///
    /// ```
    /// use haloray::inference::diagnose::Convergence;
    /// let (up, down): (Vec<f64>, Vec<f64>) = (0..100).map(|i| (f64::from(i), f64::from(-i))).unzip();
    /// assert!(Convergence::of(&[up, down], 1).r_hat > 2.0);
    /// ```
    pub fn of<C: AsRef<[f64]>>(chains: &[C], group_size: usize) -> Self {
        let unknown = Self { r_hat: f64::NAN, ess_bulk: f64::NAN, ess_tail: f64::NAN };
        let chains: Vec<&[f64]> = chains.iter().map(AsRef::as_ref).collect();
        let draws = chains.first().map_or(0, |chain| chain.len());
        let finite = chains.iter().all(|c| c.len() == draws && c.iter().all(|value| value.is_finite()));
        let pooled = chains.concat();
        if draws < 4 || !finite || pooled.iter().all(|value| *value == pooled[0]) {
            return unknown;
        }
        let groups: Vec<Vec<f64>> =
            chains.chunks(group_size.max(1)).map(|group| interleaved(group, draws)).collect();
        let r_hat = if groups.len() > 1 { split_r_hat::rank_normalised(&groups) } else { f64::NAN };
        Self { r_hat, ess_bulk: effective_size::bulk(&chains), ess_tail: effective_size::tail(&chains) }
    }

    /// R-hat < 1.01 and both effective sizes > 400.
    pub fn is_converged(&self) -> bool {
        self.r_hat < R_HAT_LIMIT && self.ess_bulk > ESS_LIMIT && self.ess_tail > ESS_LIMIT
    }

    /// The worst of several quantities; NaN wins.
    pub fn worst(of: &[Self]) -> Self {
        let extreme = |value: fn(&Self) -> f64, pick: fn(f64, f64) -> f64| {
            let worse = |a: f64, b: f64| if a.is_nan() || b.is_nan() { f64::NAN } else { pick(a, b) };
            of.iter().map(value).reduce(worse).unwrap_or(f64::NAN)
        };
        Self {
            r_hat: extreme(|c| c.r_hat, f64::max),
            ess_bulk: extreme(|c| c.ess_bulk, f64::min),
            ess_tail: extreme(|c| c.ess_tail, f64::min),
        }
    }
}

/// One chain of a group that moves together: all of its members at the first draw, then at the second, ….
fn interleaved(group: &[&[f64]], draws: usize) -> Vec<f64> {
    (0..draws).flat_map(|draw| group.iter().map(move |chain| chain[draw])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::{Stage, stream};
    use rand_distr::{Distribution, StandardNormal};

    fn normal_chains(chains: u64, draws: usize) -> Vec<Vec<f64>> {
        let chain = |number| {
            let mut rng = stream(11, number, Stage::Sampling, 0);
            (0..draws).map(|_| StandardNormal.sample(&mut rng)).collect()
        };
        (0..chains).map(chain).collect()
    }

    #[test]
    fn independent_draws_converge_and_count_in_full() {
        let convergence = Convergence::of(&normal_chains(4, 1000), 1);
        assert!(convergence.is_converged(), "{convergence:?}");
        assert!((convergence.ess_bulk / 4000.0 - 1.0).abs() < 0.1, "{convergence:?}");
    }

    #[test]
    fn a_chain_stuck_elsewhere_or_of_other_width_is_seen() {
        let mut shifted = normal_chains(4, 1000);
        shifted[2].iter_mut().for_each(|value| *value += 0.5);
        assert!(Convergence::of(&shifted, 1).r_hat > 1.02);
        let mut wide = normal_chains(4, 1000);
        wide[2].iter_mut().for_each(|value| *value *= 2.0);
        assert!(Convergence::of(&wide, 1).r_hat > 1.03);
        let mut frozen = normal_chains(4, 1000);
        frozen[0].fill(0.3);
        assert!(!Convergence::of(&frozen, 1).is_converged());
        let mut drifting = normal_chains(1, 1000);
        drifting[0].iter_mut().enumerate().for_each(|(i, value)| *value += i as f64 / 300.0);
        drifting.push(drifting[0].clone());
        assert!(Convergence::of(&drifting, 1).r_hat > 1.1);
    }

    #[test]
    fn groups_are_compared_and_not_their_members() {
        // Members differ for ever, but both groups hold the same mixture.
        let mut chains = normal_chains(8, 500);
        chains.iter_mut().step_by(2).for_each(|c| c.iter_mut().for_each(|value| *value += 1.0));
        assert!(Convergence::of(&chains, 1).r_hat > 1.05);
        let grouped = Convergence::of(&chains, 4);
        assert!(grouped.r_hat < 1.01 && grouped.ess_bulk < 100.0, "{grouped:?}");
    }

    #[test]
    fn what_cannot_be_judged_is_not_converged() {
        let judged = |chains: &[Vec<f64>]| Convergence::of(chains, 1);
        for chains in [vec![], vec![vec![1.0; 3]; 2], vec![vec![1.0; 100]; 4], vec![vec![f64::NAN; 100]; 4]] {
            assert!(judged(&chains).r_hat.is_nan() && !judged(&chains).is_converged());
        }
        assert!(!judged(&normal_chains(1, 1000)).is_converged(), "one chain cannot be compared");
        let good = judged(&normal_chains(4, 1000));
        let bad = Convergence { ess_tail: f64::NAN, ..good };
        assert!(!Convergence::worst(&[good, bad]).is_converged() && Convergence::worst(&[good]) == good);
    }
}
