//! Ensembles of walkers that propose moves along the differences of one another: no gradients, no metric needed.
//!
//! Walkers of one half move at once, along the other half (Foreman-Mackey et al. 2013, PASP 125, 306). Several
//! ensembles run independently, since walkers of one ensemble are not independent and R-hat among them would
//! flatter. The two crates that offer such moves (ganesh, hammer-and-sample) can be neither stopped and
//! continued nor given our random streams.

mod moves;
mod slice;
mod stretch;

use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use slice::EnsembleSliceSettings;
pub use stretch::StretchSettings;

pub(crate) use self::moves::Move;
use self::moves::Moved;
use super::chains::Chains;
use super::point::Point;
use super::problem::Problem;
use super::sampler::Sampler;
use crate::error::Result;
use crate::inference::LatentLikelihood;
use crate::numerics::random::{Stage, stream};

/// Everything a block of steps starts from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ensembles {
    pub settings: EnsembleSliceSettings,
    pub step: Move,
    ensembles: Vec<Ensemble>,
}

/// Walkers and the length of their moves.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Ensemble {
    walkers: Vec<Point>,
    /// Length scale μ of slice moves.
    length: f64,
}

impl Ensembles {
    pub fn start(
        (settings, step): (EnsembleSliceSettings, Move),
        seed: u64,
        problem: &Problem,
    ) -> Result<Self> {
        settings.check(step.checked_name()?)?;
        let whitening = problem.whitening()?;
        let walkers = settings.walkers(problem.likelihood.dimension());
        let point = |number: usize| {
            let mut rng = stream(seed, number as u64, Stage::Sampling, 0);
            // Whole ensembles start around one start point, so that R-hat sees whether they find the same
            // posterior.
            let z = problem.scattered(number / walkers, settings.start_spread, &whitening, &mut rng)?;
            Ok(Point::new(problem.likelihood, z))
        };
        let ensemble = |first: usize| {
            let walkers: Result<Vec<Point>> = (first..first + walkers).map(point).collect();
            Ok(Ensemble { walkers: walkers?, length: 1.0 })
        };
        let ensembles: Result<Vec<Ensemble>> =
            (0..settings.ensembles).map(|number| ensemble(number * walkers)).collect();
        Ok(Self { settings, step, ensembles: ensembles? })
    }

    /// Whether the draws of that block are thrown away.
    fn is_warming_up(&self, block: u64) -> bool {
        (block.saturating_sub(1) as usize) * self.settings.block_steps < self.settings.warmup_steps
    }
}

impl Sampler for Ensembles {
    fn empty_chains(&self, dimension: usize) -> Chains {
        let walkers = self.settings.walkers(dimension);
        Chains::new(dimension, walkers * self.settings.ensembles, walkers)
    }

    fn advance(&mut self, likelihood: &dyn LatentLikelihood, seed: u64, block: u64, chains: &mut Chains) {
        let (settings, move_of, tunes) = (self.settings, self.step, self.is_warming_up(block));
        let dimension = chains.dimension;
        let numbered = self.ensembles.par_iter_mut().enumerate();
        let drawn: Vec<Chains> = numbered
            .map(|(number, ensemble)| {
                let count = ensemble.walkers.len();
                let stream_of =
                    |walker: usize| stream(seed, (number * count + walker) as u64, Stage::Sampling, block);
                let mut rngs: Vec<ChaCha8Rng> = (0..count).map(stream_of).collect();
                let mut drawn = Chains::new(dimension, count, count);
                for step in (1..=settings.block_steps).take_while(|_| !likelihood.is_cancelled()) {
                    ensemble.step(likelihood, move_of, tunes, &mut rngs);
                    if !tunes && step % settings.thin == 0 {
                        let walkers = ensemble.walkers.iter().zip(&mut drawn.chains);
                        walkers.for_each(|(point, chain)| chain.push(&point.z, point.log_likelihood));
                    }
                }
                drawn
            })
            .collect();
        let drawn = drawn.into_iter().flat_map(|drawn| drawn.chains);
        chains.chains.iter_mut().zip(drawn).for_each(|(chain, drawn)| chain.append(drawn));
    }

    fn max_draws(&self) -> Option<usize> {
        Some(self.settings.max_steps.div_ceil(self.settings.thin))
    }

    fn fits(&self, dimension: usize) -> bool {
        let walkers = self.settings.walkers(dimension);
        let of_walkers = |ensemble: &Ensemble| {
            ensemble.walkers.len() == walkers
                && ensemble.walkers.iter().all(|point| point.z.len() == dimension)
        };
        self.ensembles.len() == self.settings.ensembles && self.ensembles.iter().all(of_walkers)
    }
}

impl Ensemble {
    /// Moves both halves, one after the other.
    fn step(&mut self, likelihood: &dyn LatentLikelihood, step: Move, tunes: bool, rngs: &mut [ChaCha8Rng]) {
        let half = self.walkers.len() / 2;
        let (mut expansions, mut contractions, length) = (0, 0, self.length);
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
                expansions += moved.expansions;
                contractions += moved.contractions;
                if let Some(point) = moved.point {
                    *walker = point;
                }
            }
        }
        if tunes {
            self.length = slice::tuned(length, expansions, contractions);
        }
    }
}
