//! Evidence with its error from all runs merged, and equal-weight draws from each run.

use rand::seq::SliceRandom;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, Exp1};
use serde::{Deserialize, Serialize};

use super::live_points::{LivePoint, NestedRun};
use crate::inference::sample::chains::Chain;
use crate::numerics::random::{Stage, stream};

/// Simulated shrinkages behind the error of the log-evidence.
const SIMULATIONS: usize = 200;

/// The evidence of a model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// ln Z = ln ∫ L π: Z is normalised over the prior, with the likelihood's own constants.
    pub log_evidence: f64,
    /// Standard deviation of ln Z when the unknown shrinkage of each step is drawn anew (Skilling 2006), with
    /// that of the fraction of the prior that has any likelihood.
    pub log_evidence_error: f64,
    /// Information H = ∫ p ln(p/π) in nats: how much the data tell; √(H/live points) is the classical error.
    pub information_nats: f64,
    /// Kish's effective number (Σw)²/Σw² of weighted draws, of all runs. It leaves out that the weights
    /// themselves are uncertain: means scatter by up to 1.7 times what it says.
    pub effective_draws: f64,
}

/// Merged evidence, and a chain of equal-weight draws for every run, all of one length.
pub(super) fn conclude(climbs: &[NestedRun], seed: u64) -> (Evidence, Vec<Chain>) {
    let merged = Ladder::new(climbs.iter().flat_map(|climb| climb.dead.iter().chain(&climb.live)).collect());
    let expected = merged.log_weights(|live| 1.0 / live);
    let log_evidence = log_sum(&expected);
    let fraction = climbs.iter().map(NestedRun::log_allowed_fraction).sum::<f64>() / climbs.len() as f64;
    // Of a negative binomial number of draws, averaged over the runs.
    let fraction_variance = climbs
        .iter()
        .map(|climb| (1.0 - climb.log_allowed_fraction().exp()) / climb.live.len() as f64)
        .sum::<f64>()
        / (climbs.len() as f64).powi(2);
    let information = merged.points.iter().zip(&expected).map(|(point, log_weight)| {
        let share = (log_weight - log_evidence).exp();
        if share > 0.0 { share * (point.log_likelihood() - log_evidence - fraction) } else { 0.0 }
    });
    let information_nats = information.sum();
    let mut rng = stream(seed, 0, Stage::Evidence, 0);
    let simulated: Vec<f64> = (0..SIMULATIONS)
        .map(|_| {
            // −ln t of the largest of n uniform numbers is exponential with mean 1/n.
            log_sum(&merged.log_weights(|live| {
                let unit: f64 = Exp1.sample(&mut rng);
                unit / live
            }))
        })
        .collect();
    let mean = simulated.iter().sum::<f64>() / SIMULATIONS as f64;
    let variance = simulated.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (SIMULATIONS - 1) as f64;

    let ladders: Vec<Ladder> =
        climbs.iter().map(|climb| Ladder::new(climb.dead.iter().chain(&climb.live).collect())).collect();
    let shares: Vec<Vec<f64>> = ladders
        .iter()
        .map(|ladder| {
            let log_weights = ladder.log_weights(|live| 1.0 / live);
            let total = log_sum(&log_weights);
            log_weights.iter().map(|log_weight| (log_weight - total).exp()).collect()
        })
        .collect();
    let effective: Vec<f64> =
        shares.iter().map(|shares| 1.0 / shares.iter().map(|share| share * share).sum::<f64>()).collect();
    let draws = effective.iter().copied().fold(f64::INFINITY, f64::min) as usize;
    let chains = ladders
        .iter()
        .zip(&shares)
        .enumerate()
        .map(|(run, (ladder, shares))| {
            ladder.equal_weight(shares, draws, &mut stream(seed, run as u64, Stage::Evidence, 1))
        })
        .collect();
    let evidence = Evidence {
        log_evidence: log_evidence + fraction,
        log_evidence_error: (variance + fraction_variance).sqrt(),
        information_nats,
        effective_draws: effective.iter().sum(),
    };
    (evidence, chains)
}

/// Points in the order of their deaths, with the number alive just before each.
struct Ladder<'a> {
    points: Vec<&'a LivePoint>,
    live: Vec<f64>,
}

impl<'a> Ladder<'a> {
    /// Live points at the end die without successors, so fewer and fewer remain.
    fn new(mut points: Vec<&'a LivePoint>) -> Self {
        points.sort_by(|a, b| a.log_likelihood().total_cmp(&b.log_likelihood()));
        let mut births: Vec<f64> = points.iter().map(|point| point.birth()).collect();
        births.sort_by(f64::total_cmp);
        let live = |(dead, point): (usize, &&LivePoint)| {
            (births.partition_point(|birth| *birth < point.log_likelihood()) - dead) as f64
        };
        let live = points.iter().enumerate().map(live).collect();
        Self { points, live }
    }

    /// ln(L_i (X_{i−1} − X_i)), where each death shrinks ln X by `shrinkage` of the number alive.
    fn log_weights(&self, mut shrinkage: impl FnMut(f64) -> f64) -> Vec<f64> {
        let mut log_volume = 0.0;
        let weight = |(point, live): (&&LivePoint, &f64)| {
            let step = shrinkage(live.max(1.0));
            let log_shell = log_volume + (-(-step).exp_m1()).ln();
            log_volume -= step;
            point.log_likelihood() + log_shell
        };
        self.points.iter().zip(&self.live).map(weight).collect()
    }

    /// Systematic resampling to that many draws, in random order.
    fn equal_weight(&self, shares: &[f64], draws: usize, rng: &mut impl Rng) -> Chain {
        let offset: f64 = rng.random();
        let (mut picked, mut reached) = (Vec::with_capacity(draws), 0.0);
        for (point, share) in self.points.iter().zip(shares) {
            reached += share * draws as f64;
            while picked.len() < draws && picked.len() as f64 + offset < reached {
                picked.push(*point);
            }
        }
        // Rounding may leave the last one out.
        picked.extend(self.points.last().filter(|_| picked.len() < draws));
        picked.shuffle(rng);
        let mut chain = Chain::default();
        picked.iter().for_each(|point| chain.push(&point.z, point.log_likelihood()));
        chain
    }
}

fn log_sum(values: &[f64]) -> f64 {
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    high + values.iter().map(|value| (value - high).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_exponentials_do_not_overflow() {
        assert!((log_sum(&[1000.0, 1000.0]) - 1000.0 - 2.0_f64.ln()).abs() < 1e-12);
        assert_eq!(log_sum(&[f64::NEG_INFINITY, 3.0]), 3.0);
    }
}
