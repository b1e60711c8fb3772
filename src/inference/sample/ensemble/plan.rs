//! What an ensemble of walkers is told, and what one of its moves brings.

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use crate::error::{Domain, Error, Result};
use crate::inference::sample::point::Point;

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

/// What one walker made of one step.
pub(super) struct Moved {
    /// `None` where the walker stays.
    pub point: Option<Point>,
    pub expansions: u64,
    pub contractions: u64,
}

impl Plan {
    pub fn check(&self, name: &str) -> Result<()> {
        for (what, value, least) in [
            ("ensembles", self.ensembles, 2.0),
            ("walkers_per_coordinate", self.walkers_per_coordinate, 2.0),
            ("block_steps", self.block_steps, 1.0),
            ("max_steps", self.max_steps, 4.0),
            ("thin", self.thin, 1.0),
        ] {
            Domain::at_least(least).check(&format!("{what} of {name}"), value as f64)?;
        }
        if !self.block_steps.is_multiple_of(self.thin) {
            let allowed = format!("a multiple of thin = {}", self.thin);
            return Err(Error::out_of_range(&format!("block_steps of {name}"), self.block_steps, &allowed));
        }
        // Walkers must differ.
        Domain::POSITIVE.check(&format!("start_spread of {name}"), self.start_spread)?;
        Ok(())
    }

    /// Walkers of one ensemble: an even number, and enough for many directions in few dimensions.
    pub fn walkers(&self, dimension: usize) -> usize {
        (self.walkers_per_coordinate * dimension).next_multiple_of(2).max(LEAST_WALKERS)
    }
}

/// A member of a half, all equally likely.
pub(super) fn pick(count: usize, rng: &mut impl Rng) -> usize {
    rng.random_range(0..count as u32) as usize
}
