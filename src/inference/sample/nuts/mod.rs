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
use super::point::{Point, Problem};
use super::whitening::{Whitening, pooled_covariance};
use crate::error::{Error, Result, require};
use crate::inference::LatentLikelihood;
use crate::inference::bits;
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
    pub(super) fn check(&self) -> Result<()> {
        let at_least = |what: &str, value: usize, least: usize| {
            let allowed = format!("at least {least}");
            require(value >= least, &format!("{what} of nuts"), value as f64, &allowed)
        };
        at_least("chains", self.chains, 2)?;
        at_least("warmup_draws", self.warmup_draws, 20)?;
        at_least("block_draws", self.block_draws, 1)?;
        at_least("max_draws", self.max_draws, 4)?;
        let (target, depth, spread) =
            (self.target_acceptance, f64::from(self.max_tree_depth), self.start_spread);
        require(0.5 < target && target < 1.0, "target_acceptance of nuts", target, "in (0.5, 1)")?;
        require((1.0..=20.0).contains(&depth), "max_tree_depth of nuts", depth, "in 1..=20")?;
        require(spread >= 0.0, "start_spread of nuts", spread, "not negative")
    }

    /// Draws of the three rounds of warm-up.
    fn rounds(&self) -> [usize; 3] {
        let quarter = self.warmup_draws / 4;
        [quarter, self.warmup_draws - 2 * quarter, quarter]
    }
}

/// Everything a block of draws starts from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct NutsState {
    settings: NutsSettings,
    whitening: Whitening,
    places: Vec<Point>,
    /// The step of every chain.
    #[serde(with = "bits")]
    steps: Vec<f64>,
    pub evaluations: u64,
}

/// What one chain brings back from a block.
struct ChainBlock {
    place: Point,
    step: f64,
    gradients: u64,
    chain: Chain,
}

impl NutsState {
    pub fn start(settings: NutsSettings, seed: u64, problem: &Problem) -> Result<Self> {
        settings.check()?;
        let whitening = problem.whitening()?;
        let places: Result<Vec<Point>> = (0..settings.chains)
            .map(|chain| {
                let mut rng = stream(seed, chain as u64, Stage::Sampling, 0);
                let z = problem.scattered(chain, settings.start_spread, &whitening, &mut rng)?;
                Ok(Point::with_gradient(problem.likelihood, z))
            })
            .collect();
        let places = places?;
        if places.iter().any(|place| !place.log_density().is_finite()) {
            let what = "the gradient of the log-likelihood at a start point";
            return Err(Error::out_of_range(what, "not finite", "finite where the log-likelihood is"));
        }
        let steps = vec![first_step(problem.likelihood.dimension()); settings.chains];
        let evaluations = 2 * settings.chains as u64;
        Ok(Self { settings, whitening, places, steps, evaluations })
    }

    /// Draws of a chain after which sampling stops.
    pub fn max_draws(&self) -> usize {
        self.settings.max_draws
    }

    /// Whether the gradients allowed are used up.
    pub fn is_exhausted(&self) -> bool {
        self.evaluations >= self.settings.max_gradients
    }

    /// Whether the draws of that block are thrown away.
    fn is_warming_up(&self, block: u64) -> bool {
        block <= self.settings.rounds().len() as u64
    }

    /// One round of warm-up or one block of draws.
    pub fn advance(&mut self, likelihood: &dyn LatentLikelihood, seed: u64, block: u64, chains: &mut Chains) {
        let round = self.settings.rounds().get(block as usize - 1).copied();
        let legs: Vec<ChainBlock> = (0..self.places.len())
            .into_par_iter()
            .map(|chain| {
                self.leg(likelihood, chain, stream(seed, chain as u64, Stage::Sampling, block), round)
            })
            .collect();
        self.evaluations += legs.iter().map(|leg| leg.gradients).sum::<u64>();
        self.steps = legs.iter().map(|leg| leg.step).collect();
        self.places = legs.iter().map(|leg| leg.place.clone()).collect();
        let legs: Vec<Chain> = legs.into_iter().map(|leg| leg.chain).collect();
        match round {
            Some(_) => self.tune(&legs, chains.dimension, block),
            None => chains.chains.iter_mut().zip(legs).for_each(|(chain, leg)| chain.append(leg)),
        }
    }

    /// The draws of one chain; its step size is sought during warm-up and kept afterwards.
    fn leg(
        &self,
        likelihood: &dyn LatentLikelihood,
        chain: usize,
        mut rng: impl rand::Rng,
        round: Option<usize>,
    ) -> ChainBlock {
        let (max_depth, whitening) = (self.settings.max_tree_depth, &self.whitening);
        let mut search = DualAveraging::new(self.steps[chain], self.settings.target_acceptance);
        let mut leg = ChainBlock {
            place: self.places[chain].clone(),
            step: self.steps[chain],
            gradients: 0,
            chain: Chain::default(),
        };
        for _ in 0..round.unwrap_or(self.settings.block_draws) {
            let integrator = Integrator { likelihood, whitening, step: leg.step, max_depth };
            let draw = integrator.draw(&leg.place, &mut rng);
            if round.is_some() {
                search.update(draw.acceptance);
                leg.step = search.step();
            }
            leg.gradients += draw.gradients;
            leg.chain.note(&draw);
            leg.place = draw.place;
        }
        if round.is_some() {
            leg.step = search.averaged();
        }
        leg
    }

    /// Pools the step sizes, and before the last round takes the metric from the draws where they are enough
    /// for it.
    fn tune(&mut self, legs: &[Chain], dimension: usize, block: u64) {
        // The chains of the first round still come from their starts.
        let skipped = if block == 1 { legs[0].len() / 2 } else { 0 };
        let draws: Vec<Vec<f64>> = legs.iter().map(|leg| leg.z[skipped * dimension..].to_vec()).collect();
        let are_enough = legs.len() * (legs[0].len() - skipped) >= DRAWS_FOR_METRIC * dimension;
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
            None => (self.steps.iter().map(|step| step.ln()).sum::<f64>() / legs.len() as f64).exp(),
        };
        self.steps.fill(pooled);
    }
}

/// A step that a whitened normal posterior accepts with about 0.8.
fn first_step(dimension: usize) -> f64 {
    (dimension as f64).powf(-0.25)
}

impl Chain {
    fn note(&mut self, draw: &Draw) {
        self.push(&draw.place.z, draw.place.log_likelihood());
        self.energy.push(draw.energy);
        self.acceptance.push(draw.acceptance);
        self.divergent.push(draw.divergent);
        self.tree_depth.push(draw.depth);
    }
}
