//! Ensembles of walkers that propose moves along the differences of one another: no gradients, no metric needed.
//!
//! Walkers of one half move at once, along the other half (Foreman-Mackey et al. 2013, PASP 125, 306). Several
//! ensembles run independently, since walkers of one ensemble are not independent and R-hat among them would
//! flatter. The two crates that offer such moves (ganesh, hammer-and-sample) can be neither stopped and
//! continued nor given our random streams.

mod slice;
mod stretch;

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use slice::EnsembleSliceSettings;
pub use stretch::StretchSettings;

use super::chains::Chains;
use super::point::{Point, Problem};
use crate::error::{Result, require};
use crate::inference::LatentLikelihood;
use crate::numerics::random::{Stage, stream};

/// Walkers of an ensemble in however few dimensions: a half of 8 spans 28 directions.
const LEAST_WALKERS: usize = 16;

/// The move of a walker.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum Move {
    Slice,
    Stretch { scale: f64 },
}

/// What both kinds of ensembles are told.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Plan {
    pub step: Move,
    pub ensembles: usize,
    pub walkers_per_coordinate: usize,
    pub warmup_steps: usize,
    pub block_steps: usize,
    pub max_steps: usize,
    pub thin: usize,
    pub start_spread: f64,
}

/// Everything a block of steps starts from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct EnsembleState {
    pub plan: Plan,
    ensembles: Vec<Ensemble>,
    pub evaluations: u64,
}

/// Walkers and the length of their moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Ensemble {
    walkers: Vec<Point>,
    /// Length scale μ of slice moves, bits of an f64.
    length_bits: u64,
}

/// What one walker made of one step.
struct Moved {
    /// `None` where the walker stays.
    place: Option<Point>,
    evaluations: u64,
    expansions: u64,
    contractions: u64,
}

impl Plan {
    fn check(&self, name: &str) -> Result<()> {
        for (what, value, least) in [
            ("ensembles", self.ensembles, 2),
            ("walkers_per_coordinate", self.walkers_per_coordinate, 2),
            ("block_steps", self.block_steps, 1),
            ("max_steps", self.max_steps, 4),
            ("thin", self.thin, 1),
        ] {
            let allowed = format!("at least {least}");
            require(value >= least, &format!("{what} of {name}"), value as f64, &allowed)?;
        }
        require(
            self.block_steps.is_multiple_of(self.thin),
            &format!("block_steps of {name}"),
            self.block_steps as f64,
            &format!("a multiple of thin = {}", self.thin),
        )?;
        let spread = self.start_spread;
        require(spread > 0.0, &format!("start_spread of {name}"), spread, "positive, as walkers must differ")
    }

    /// Walkers of one ensemble: an even number, and enough for many directions in few dimensions.
    pub fn walkers(&self, dimension: usize) -> usize {
        (self.walkers_per_coordinate * dimension).next_multiple_of(2).max(LEAST_WALKERS)
    }

    /// Recorded draws of a walker after which sampling stops.
    pub fn max_draws(&self) -> usize {
        self.max_steps.div_ceil(self.thin)
    }
}

impl EnsembleState {
    pub fn start(plan: Plan, name: &str, seed: u64, problem: &Problem) -> Result<Self> {
        plan.check(name)?;
        let whitening = problem.whitening()?;
        let walkers = plan.walkers(problem.likelihood.dimension());
        let place = |number: usize| {
            let mut rng = stream(seed, number as u64, Stage::Sampling, 0);
            // Whole ensembles start around one start point, so that R-hat sees whether they find the same
            // posterior.
            let z = problem.scattered(number / walkers, plan.start_spread, &whitening, &mut rng)?;
            Ok(Point::new(problem.likelihood, z))
        };
        let ensemble = |first: usize| {
            let walkers: Result<Vec<Point>> = (first..first + walkers).map(place).collect();
            Ok(Ensemble { walkers: walkers?, length_bits: 1.0_f64.to_bits() })
        };
        let ensembles: Result<Vec<Ensemble>> =
            (0..plan.ensembles).map(|number| ensemble(number * walkers)).collect();
        Ok(Self { plan, ensembles: ensembles?, evaluations: 2 * (walkers * plan.ensembles) as u64 })
    }

    /// Whether the draws of that block are thrown away.
    fn is_warming_up(&self, block: u64) -> bool {
        (block.saturating_sub(1) as usize) * self.plan.block_steps < self.plan.warmup_steps
    }

    /// One block of steps of all walkers.
    pub fn advance(&mut self, likelihood: &dyn LatentLikelihood, seed: u64, block: u64, chains: &mut Chains) {
        let (plan, tunes) = (self.plan, self.is_warming_up(block));
        let numbered = self.ensembles.par_iter_mut().enumerate();
        let legs: Vec<(u64, Chains)> = numbered
            .map(|(number, ensemble)| {
                let count = ensemble.walkers.len();
                let stream_of =
                    |walker: usize| stream(seed, (number * count + walker) as u64, Stage::Sampling, block);
                let mut rngs: Vec<ChaCha8Rng> = (0..count).map(stream_of).collect();
                let mut leg = Chains::new(chains.dimension, count, count);
                let mut evaluations = 0;
                for step in 1..=plan.block_steps {
                    evaluations += ensemble.step(likelihood, plan.step, tunes, &mut rngs);
                    if !tunes && step % plan.thin == 0 {
                        let walkers = ensemble.walkers.iter().zip(&mut leg.chains);
                        walkers.for_each(|(place, chain)| chain.push(&place.z, place.log_likelihood()));
                    }
                }
                (evaluations, leg)
            })
            .collect();
        self.evaluations += legs.iter().map(|(evaluations, _)| evaluations).sum::<u64>();
        let legs = legs.into_iter().flat_map(|(_, leg)| leg.chains);
        chains.chains.iter_mut().zip(legs).for_each(|(chain, leg)| chain.append(leg));
    }
}

impl Ensemble {
    /// Moves both halves, one after the other, and returns the number of evaluations.
    fn step(
        &mut self,
        likelihood: &dyn LatentLikelihood,
        step: Move,
        tunes: bool,
        rngs: &mut [ChaCha8Rng],
    ) -> u64 {
        let half = self.walkers.len() / 2;
        let (mut evaluations, mut expansions, mut contractions) = (0, 0, 0);
        let length = f64::from_bits(self.length_bits);
        for is_first in [true, false] {
            let (first, second) = self.walkers.split_at_mut(half);
            let (active, others) = if is_first { (first, &*second) } else { (second, &*first) };
            let rngs = if is_first { &mut rngs[..half] } else { &mut rngs[half..] };
            let moves: Vec<Moved> = active
                .par_iter()
                .zip(rngs)
                .map(|(walker, rng)| match step {
                    Move::Slice => slice::slice(likelihood, walker, others, length, rng),
                    Move::Stretch { scale } => stretch::stretch(likelihood, walker, others, scale, rng),
                })
                .collect();
            for (walker, moved) in active.iter_mut().zip(moves) {
                evaluations += moved.evaluations;
                expansions += moved.expansions;
                contractions += moved.contractions;
                if let Some(place) = moved.place {
                    *walker = place;
                }
            }
        }
        if tunes {
            self.length_bits = slice::tuned(length, expansions, contractions).to_bits();
        }
        evaluations
    }
}

/// A member of a half, all equally likely.
fn pick(count: usize, rng: &mut impl Rng) -> usize {
    rand::RngExt::random_range(rng, 0..count as u32) as usize
}
