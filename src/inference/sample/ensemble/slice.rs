//! Ensemble slice sampling (Karamanis & Beutler 2021, Stat. Comput. 31, 61), the method of the paper's zeus.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, Exp1};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::moves::{Moved, pick};
use crate::error::{Domain, Error, Result};
use crate::inference::LatentLikelihood;
use crate::inference::sample::point::Point;

/// Expansions of one slice at most, both sides together.
const MAX_EXPANSIONS: u32 = 1000;

/// Settings of ensemble slice sampling.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EnsembleSliceSettings {
    /// Independent ensembles, at least 2; R-hat compares them.
    pub ensembles: usize,
    /// Walkers of an ensemble per latent coordinate, at least 2.
    pub walkers_per_coordinate: usize,
    /// Steps thrown away, in which the length of the moves is tuned.
    pub warmup_steps: usize,
    /// Steps between two looks at convergence, a multiple of `thin`.
    pub block_steps: usize,
    /// Steps of a walker after which sampling stops unconverged.
    pub max_steps: usize,
    /// Every so many steps a draw is kept.
    pub thin: usize,
    /// Walkers start this many standard deviations of the metric around a start point.
    pub start_spread: f64,
}

impl Default for EnsembleSliceSettings {
    fn default() -> Self {
        Self {
            ensembles: 4,
            walkers_per_coordinate: 4,
            warmup_steps: 200,
            block_steps: 100,
            max_steps: 10_000,
            thin: 2,
            start_spread: 1.0,
        }
    }
}

/// Walkers of an ensemble in however few dimensions: a half of 8 spans 28 directions.
const LEAST_WALKERS: usize = 16;

impl EnsembleSliceSettings {
    /// Checks every number of the sampler of that name.
    pub(super) fn check(&self, name: &str) -> Result<()> {
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
    pub(super) fn walkers(&self, dimension: usize) -> usize {
        (self.walkers_per_coordinate * dimension).next_multiple_of(2).max(LEAST_WALKERS)
    }
}

/// One slice along η = 2μ(X_l − X_m) through a walker, stepped out and shrunk (Neal 2003, Ann. Stat. 31, 705).
pub(super) fn slice(
    likelihood: &dyn LatentLikelihood,
    walker: &Point,
    others: &[Point],
    length: f64,
    rng: &mut impl Rng,
) -> Moved {
    let l = pick(others.len(), rng);
    // Any other than l.
    let m = (l + 1 + pick(others.len() - 1, rng)) % others.len();
    let difference = |(a, b): (&f64, &f64)| 2.0 * length * (a - b);
    let direction: Vec<f64> = others[l].z.iter().zip(&others[m].z).map(difference).collect();
    let height: f64 = Exp1.sample(rng);
    let level = walker.log_density - height;
    let at = |t: f64| {
        let z = walker.z.iter().zip(&direction).map(|(z, direction)| z + t * direction);
        Point::new(likelihood, z.collect())
    };
    let mut low = -rng.random::<f64>();
    let mut high = low + 1.0;
    let lower_expansions = rng.random_range(0..MAX_EXPANSIONS);
    let (mut expansions, mut contractions) = (0_u64, 0_u64);
    for (end, sign, allowed) in
        [(&mut low, -1.0, lower_expansions), (&mut high, 1.0, MAX_EXPANSIONS - 1 - lower_expansions)]
    {
        for _ in 0..allowed {
            if at(*end).log_density <= level {
                break;
            }
            *end += sign;
            expansions += 1;
        }
    }
    loop {
        let t = low + rng.random::<f64>() * (high - low);
        let point = at(t);
        if point.log_density > level {
            return Moved { point: Some(point), expansions, contractions };
        }
        contractions += 1;
        if t < 0.0 {
            low = t
        } else {
            high = t
        }
        if high - low <= f64::EPSILON {
            return Moved { point: None, expansions, contractions };
        }
    }
}

/// The length μ after one step: expansions and contractions shall be equally many (Karamanis & Beutler 2021,
/// equation 9).
pub(super) fn tuned(length: f64, expansions: u64, contractions: u64) -> f64 {
    let expansions = expansions.max(1) as f64;
    length * 2.0 * expansions / (expansions + contractions as f64)
}
