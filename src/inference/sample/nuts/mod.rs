//! The No-U-Turn sampler: chains in parallel, a short warm-up for the step size, a metric shared by all chains.
//!
//! The metric is the caller's (the Fisher matrix at the mode) and is refined from the draws of all chains
//! together while they warm up, so that few draws suffice and a run without a metric works too.

mod step_size;
mod trajectory;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::step_size::DualAveraging;
use self::trajectory::{Draw, Integrator};
use super::chains::{Chain, Chains};
use super::point::Point;
use super::problem::Problem;
use super::sampler::Sampler;
use super::whitening::{Whitening, pooled_covariance};
use crate::error::{Domain, Error, Result};
use crate::inference::LatentLikelihood;
use crate::numerics::random::{Stage, stream};

/// Draws a coordinate needs in one round of warm-up before the metric is taken from them.
const DRAWS_FOR_METRIC: usize = 8;

/// Settings of the No-U-Turn sampler.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct NutsSettings {
    /// Independent chains, at least 2.
    pub chains: usize,
    /// Draws a chain spends on finding step size and metric, at least 20; they are thrown away. A quarter finds
    /// a first step size, a half the metric, the last quarter the step size for that metric.
    pub warmup_draws: usize,
    /// Draws of a chain between two looks at convergence.
    pub block_draws: usize,
    /// Draws of a chain after which sampling stops unconverged.
    pub max_draws: usize,
    /// Gradients of all chains after which sampling stops unconverged, at the end of a block.
    pub max_gradients: u64,
    /// Mean acceptance probability that the step size aims at, in (0.5, 1).
    pub target_acceptance: f64,
    /// Doublings after which a trajectory ends, 1 to 20.
    pub max_tree_depth: u8,
    /// Chains start this many standard deviations of the metric around their start points.
    pub start_spread: f64,
}

impl Default for NutsSettings {
    fn default() -> Self {
        Self {
            chains: 4,
            warmup_draws: 200,
            block_draws: 250,
            max_draws: 10_000,
            max_gradients: 600_000,
            target_acceptance: 0.8,
            max_tree_depth: 8,
            start_spread: 1.0,
        }
    }
}

impl NutsSettings {
    fn check(&self) -> Result<()> {
        for (what, value, domain) in [
            ("chains", self.chains as f64, Domain::at_least(2.0)),
            ("warmup_draws", self.warmup_draws as f64, Domain::at_least(20.0)),
            ("block_draws", self.block_draws as f64, Domain::at_least(1.0)),
            ("max_draws", self.max_draws as f64, Domain::at_least(4.0)),
            ("target_acceptance", self.target_acceptance, Domain::inside(0.5, 1.0)),
            ("max_tree_depth", f64::from(self.max_tree_depth), Domain::from_to(1.0, 20.0)),
            ("start_spread", self.start_spread, Domain::NON_NEGATIVE),
        ] {
            domain.check(&format!("{what} of nuts"), value)?;
        }
        Ok(())
    }

    /// Draws of the three rounds of warm-up.
    fn rounds(&self) -> [usize; 3] {
        let quarter = self.warmup_draws / 4;
        [quarter, self.warmup_draws - 2 * quarter, quarter]
    }
}

/// Everything a block of draws starts from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Nuts {
    pub settings: NutsSettings,
    whitening: Whitening,
    /// Where every chain stands.
    points: Vec<Point>,
    /// The step of every chain.
    steps: Vec<f64>,
}

/// What one chain brings back from a block.
struct ChainBlock {
    point: Point,
    step: f64,
    chain: Chain,
}

impl Nuts {
    pub fn start(settings: NutsSettings, seed: u64, problem: &Problem) -> Result<Self> {
        settings.check()?;
        let whitening = problem.whitening()?;
        let points: Result<Vec<Point>> = (0..settings.chains)
            .map(|chain| {
                let mut rng = stream(seed, chain as u64, Stage::Sampling, 0);
                let z = problem.scattered(chain, settings.start_spread, &whitening, &mut rng)?;
                Ok(Point::with_gradient(problem.likelihood, z))
            })
            .collect();
        let points = points?;
        if points.iter().any(|point| !point.log_density.is_finite()) {
            let what = "the gradient of the log-likelihood at a start point";
            return Err(Error::out_of_range(what, "not finite", "finite where the log-likelihood is"));
        }
        let steps = vec![first_step(problem.likelihood.dimension()); settings.chains];
        Ok(Self { settings, whitening, points, steps })
    }

    /// Whether the draws of that block are thrown away.
    fn is_warming_up(&self, block: u64) -> bool {
        block <= self.settings.rounds().len() as u64
    }

    /// The draws of one chain; its step size is sought during warm-up and kept afterwards.
    fn chain_block(
        &self,
        likelihood: &dyn LatentLikelihood,
        chain: usize,
        mut rng: impl rand::Rng,
        round: Option<usize>,
    ) -> ChainBlock {
        let (max_depth, whitening) = (self.settings.max_tree_depth, &self.whitening);
        let mut search = DualAveraging::new(self.steps[chain], self.settings.target_acceptance);
        let mut done = ChainBlock {
            point: self.points[chain].clone(),
            step: self.steps[chain],
            chain: Chain::default(),
        };
        for _ in 0..round.unwrap_or(self.settings.block_draws) {
            let integrator = Integrator { likelihood, whitening, step: done.step, max_depth };
            if likelihood.is_cancelled() {
                break;
            }
            let draw = integrator.draw(&done.point, &mut rng);
            if round.is_some() {
                search.update(draw.acceptance);
                done.step = search.step();
            }
            done.chain.note(&draw);
            done.point = draw.point;
        }
        if round.is_some() {
            done.step = search.averaged();
        }
        done
    }

    /// Pools the step sizes, and before the last round takes the metric from the draws where they are enough
    /// for it.
    fn tune(&mut self, drawn: &[Chain], dimension: usize, block: u64) {
        // The chains of the first round still come from their starts.
        let skipped = if block == 1 { drawn[0].len() / 2 } else { 0 };
        let draws: Vec<Vec<f64>> =
            drawn.iter().map(|chain| chain.z[skipped * dimension..].to_vec()).collect();
        let are_enough = drawn.len() * (drawn[0].len() - skipped) >= DRAWS_FOR_METRIC * dimension;
        let metric = (are_enough && self.is_warming_up(block + 1))
            .then(|| pooled_covariance(&draws, dimension))
            .flatten()
            .and_then(|covariance| Whitening::from_covariance(&covariance));
        let pooled = match metric {
            Some(whitening) => {
                self.whitening = whitening;
                // In units of a new metric the old steps mean nothing.
                first_step(dimension)
            }
            None => (self.steps.iter().map(|step| step.ln()).sum::<f64>() / drawn.len() as f64).exp(),
        };
        self.steps.fill(pooled);
    }
}

impl Sampler for Nuts {
    fn empty_chains(&self, dimension: usize) -> Chains {
        Chains::new(dimension, self.settings.chains, 1)
    }

    fn advance(&mut self, likelihood: &dyn LatentLikelihood, seed: u64, block: u64, chains: &mut Chains) {
        let round = self.settings.rounds().get(block as usize - 1).copied();
        let done: Vec<ChainBlock> = (0..self.points.len())
            .into_par_iter()
            .map(|chain| {
                let rng = stream(seed, chain as u64, Stage::Sampling, block);
                self.chain_block(likelihood, chain, rng, round)
            })
            .collect();
        if likelihood.is_cancelled() {
            return;
        }
        self.steps = done.iter().map(|chain| chain.step).collect();
        self.points = done.iter().map(|chain| chain.point.clone()).collect();
        let drawn: Vec<Chain> = done.into_iter().map(|chain| chain.chain).collect();
        match round {
            Some(_) => self.tune(&drawn, chains.dimension, block),
            None => chains.chains.iter_mut().zip(drawn).for_each(|(chain, drawn)| chain.append(drawn)),
        }
    }

    fn max_draws(&self) -> Option<usize> {
        Some(self.settings.max_draws)
    }

    fn is_exhausted(&self, evaluations: u64) -> bool {
        evaluations >= self.settings.max_gradients
    }

    fn fits(&self, dimension: usize) -> bool {
        let chains = self.settings.chains;
        (self.points.len(), self.steps.len()) == (chains, chains)
            && self.whitening.fits(dimension)
            && self.points.iter().all(|point| (point.z.len(), point.gradient.len()) == (dimension, dimension))
    }
}

/// A step that a whitened normal posterior accepts with about 0.8.
fn first_step(dimension: usize) -> f64 {
    (dimension as f64).powf(-0.25)
}

impl Chain {
    fn note(&mut self, draw: &Draw) {
        self.push(&draw.point.z, draw.point.log_likelihood);
        self.energy.push(draw.energy);
        self.acceptance.push(draw.acceptance);
        self.divergent.push(draw.divergent);
        self.tree_depth.push(draw.depth);
    }
}
