//! The moves of a walker of an ensemble, and what one of them brings.

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use crate::error::{Domain, Result};
use crate::inference::sample::point::Point;

/// The move of a walker.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) enum Move {
    Slice,
    Stretch { scale: f64 },
}

/// What one walker made of one step.
pub(super) struct Moved {
    /// `None` where the walker stays.
    pub point: Option<Point>,
    pub expansions: u64,
    pub contractions: u64,
}

impl Move {
    /// The sampler's name, if it can be moved so.
    pub fn checked_name(self) -> Result<&'static str> {
        if let Self::Stretch { scale } = self {
            Domain::above(1.0).check("scale of stretch", scale)?;
            return Ok("stretch");
        }
        Ok("ensemble-slice")
    }
}

/// A member of a half, all equally likely.
pub(super) fn pick(count: usize, rng: &mut impl Rng) -> usize {
    rng.random_range(0..count as u32) as usize
}
