//! Evidence with its error from all runs merged, and equal-weight draws from each run.

use rand::seq::SliceRandom;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, Exp1};

use super::live_points::{LivePoint, NestedRun};
use crate::inference::sample::chains::Chain;
use crate::inference::sample::normal::log_sum;
use crate::inference::sample::sampler::Evidence;
use crate::numerics::random::{Stage, stream};

/// Simulated shrinkages behind the error of the log-evidence.
const SIMULATIONS: usize = 200;

/// Merged evidence, and a chain of equal-weight draws for every run, all of one length.
pub(super) fn conclude(runs: &[NestedRun], seed: u64) -> (Evidence, Vec<Chain>) {
    let merged = Ladder::new(runs.iter().flat_map(|run| run.dead.iter().chain(&run.live)).collect());
    let expected = merged.log_weights(|live| 1.0 / live);
    let log_evidence = log_sum(expected.iter().copied());
    let fraction = runs.iter().map(|run| run.log_allowed_fraction).sum::<f64>() / runs.len() as f64;
    // Of a negative binomial number of draws, averaged over the runs.
    let fraction_variance =
        runs.iter().map(|run| (1.0 - run.log_allowed_fraction.exp()) / run.live.len() as f64).sum::<f64>()
            / (runs.len() as f64).powi(2);
    let information = merged.points.iter().zip(&expected).map(|(point, log_weight)| {
        let share = (log_weight - log_evidence).exp();
        if share > 0.0 { share * (point.log_likelihood - log_evidence - fraction) } else { 0.0 }
    });
    let information_nats = information.sum();
    let mut rng = stream(seed, 0, Stage::Evidence, 0);
    let simulated: Vec<f64> = (0..SIMULATIONS)
        .map(|_| {
            // −ln t of the largest of n uniform numbers is exponential with mean 1/n.
            log_sum(merged.log_weights(|live| {
                let unit: f64 = Exp1.sample(&mut rng);
                unit / live
            }))
        })
        .collect();
    let mean = simulated.iter().sum::<f64>() / SIMULATIONS as f64;
    let variance = simulated.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (SIMULATIONS - 1) as f64;

    let ladders: Vec<Ladder> =
        runs.iter().map(|run| Ladder::new(run.dead.iter().chain(&run.live).collect())).collect();
    let shares: Vec<Vec<f64>> = ladders
        .iter()
        .map(|ladder| {
            let log_weights = ladder.log_weights(|live| 1.0 / live);
            let total = log_sum(log_weights.iter().copied());
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
        points.sort_by(|a, b| a.log_likelihood.total_cmp(&b.log_likelihood));
        let mut births: Vec<f64> = points.iter().map(|point| point.birth).collect();
        births.sort_by(f64::total_cmp);
        let live = |(dead, point): (usize, &&LivePoint)| {
            (births.partition_point(|birth| *birth < point.log_likelihood) - dead) as f64
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
            point.log_likelihood + log_shell
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
        picked.iter().for_each(|point| chain.push(&point.z, point.log_likelihood));
        chain
    }
}
