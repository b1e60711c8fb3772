//! The affine-invariant stretch move (Goodman & Weare 2010, CAMCoS 5, 65), the method of emcee.

use rand::{Rng, RngExt};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::moves::{Move, Moved, pick};
use super::slice::EnsembleSliceSettings;
use crate::inference::LatentLikelihood;
use crate::inference::sample::point::Point;

/// Settings of the stretch move.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StretchSettings {
    /// Independent ensembles, at least 2; R-hat compares them.
    pub ensembles: usize,
    /// Walkers of an ensemble per latent coordinate, at least 2.
    pub walkers_per_coordinate: usize,
    /// Steps thrown away.
    pub warmup_steps: usize,
    /// Steps between two looks at convergence, a multiple of `thin`.
    pub block_steps: usize,
    /// Steps of a walker after which sampling stops unconverged.
    pub max_steps: usize,
    /// Every so many steps a draw is kept.
    pub thin: usize,
    /// Walkers start this many standard deviations of the metric around a start point.
    pub start_spread: f64,
    /// Largest stretch a of the law g(s) ∝ s^(−1/2) on (1/a, a), above 1.
    pub scale: f64,
}

impl Default for StretchSettings {
    fn default() -> Self {
        Self {
            ensembles: 4,
            walkers_per_coordinate: 4,
            warmup_steps: 1000,
            block_steps: 500,
            max_steps: 50_000,
            thin: 10,
            start_spread: 1.0,
            scale: 2.0,
        }
    }
}

impl StretchSettings {
    /// What it has in common with ensemble slice sampling, and its move.
    pub(in crate::inference::sample) fn parts(&self) -> (EnsembleSliceSettings, Move) {
        let Self { ensembles, walkers_per_coordinate, warmup_steps, block_steps, max_steps, thin, .. } =
            *self;
        let (start_spread, scale) = (self.start_spread, self.scale);
        let common = EnsembleSliceSettings {
            ensembles,
            walkers_per_coordinate,
            warmup_steps,
            block_steps,
            max_steps,
            thin,
            start_spread,
        };
        (common, Move::Stretch { scale })
    }
}

/// X_k → X_j + s (X_k − X_j), accepted with s^(d−1) p(new)/p(old).
pub(super) fn stretch(
    likelihood: &dyn LatentLikelihood,
    walker: &Point,
    others: &[Point],
    scale: f64,
    rng: &mut impl Rng,
) -> Moved {
    let other = &others[pick(others.len(), rng)];
    let stretch = ((scale - 1.0) * rng.random::<f64>() + 1.0).powi(2) / scale;
    let z = other.z.iter().zip(&walker.z).map(|(fixed, moving)| fixed + stretch * (moving - fixed));
    let point = Point::new(likelihood, z.collect());
    let log_ratio = (walker.z.len() as f64 - 1.0) * stretch.ln() + point.log_density - walker.log_density;
    let is_accepted = rng.random::<f64>().ln() < log_ratio;
    Moved { point: is_accepted.then_some(point), expansions: 0, contractions: 0 }
}
