//! One nested-sampling run: the lowest live point dies and a new one is found above it.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, Exp1, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::inference::LatentLikelihood;
use crate::inference::sample::normal::log_prior;
use crate::inference::sample::whitening::{Whitening, pooled_covariance};

/// First width of a slice in standard deviations of the live points: as wide as a uniform distribution of that
/// spread.
const SLICE_WIDTH: f64 = 4.0;
/// Draws from the prior a live point may cost before the priors count as excluding everything.
const MAX_PRIOR_DRAWS: u64 = 1000;

/// A run between two blocks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct NestedRun {
    pub live: Vec<LivePoint>,
    pub dead: Vec<LivePoint>,
    /// ln Z of the dead points.
    log_evidence: f64,
    /// ln of the fraction of the prior that has any likelihood.
    pub log_allowed_fraction: f64,
    pub has_ended: bool,
}

/// A point with its likelihood and the likelihood above which it was born.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct LivePoint {
    pub z: Vec<f64>,
    pub log_likelihood: f64,
    /// ln L above which it was born.
    pub birth: f64,
}

impl NestedRun {
    /// Live points from the prior; `None` if it has next to no likelihood anywhere.
    pub fn start(likelihood: &dyn LatentLikelihood, live_points: usize, rng: &mut impl Rng) -> Option<Self> {
        let mut drawn = 0;
        let mut live = Vec::with_capacity(live_points);
        while live.len() < live_points {
            if drawn == MAX_PRIOR_DRAWS * live_points as u64 || likelihood.is_cancelled() {
                return None;
            }
            let z: Vec<f64> = (0..likelihood.dimension()).map(|_| StandardNormal.sample(rng)).collect();
            let log_likelihood = likelihood.log_likelihood(&z);
            drawn += 1;
            if log_likelihood.is_finite() {
                live.push(LivePoint { z, log_likelihood, birth: f64::NEG_INFINITY });
            }
        }
        // Unbiased for draws made until so many have succeeded.
        let fraction = (live_points as f64 - 1.0) / (drawn as f64 - 1.0);
        let (log_evidence, log_allowed_fraction) = (f64::NEG_INFINITY, fraction.ln());
        Some(Self { live, dead: Vec::new(), log_evidence, log_allowed_fraction, has_ended: false })
    }

    /// ln of the prior volume above the last dead point, as a fraction of what has any likelihood.
    fn log_volume(&self) -> f64 {
        -(self.dead.len() as f64) / self.live.len() as f64
    }

    /// ln(1 + L_max X / Z).
    pub fn remaining_log_evidence(&self) -> f64 {
        let highest = self.live.iter().map(|point| point.log_likelihood).fold(f64::NEG_INFINITY, f64::max);
        let excess = highest + self.log_volume() - self.log_evidence;
        // ln(1 + e^x) for any x.
        excess.max(0.0) + (-excess.abs()).exp().ln_1p()
    }

    /// Replaces as many points as are alive, or fewer if the run ends.
    pub fn advance(
        &mut self,
        likelihood: &dyn LatentLikelihood,
        slices: usize,
        tolerance: f64,
        rng: &mut impl Rng,
    ) {
        let count = self.live.len();
        let mut whitening = Whitening::identity(likelihood.dimension());
        for step in 0..count {
            self.has_ended |= self.remaining_log_evidence() < tolerance;
            if self.has_ended || likelihood.is_cancelled() {
                return;
            }
            if step % (count / 5) == 0 {
                whitening = self.whitening().unwrap_or(whitening);
            }
            let lowest = self.lowest();
            let threshold = self.live[lowest].log_likelihood;
            let above: Vec<usize> = (0..count).filter(|&i| self.live[i].log_likelihood > threshold).collect();
            if above.is_empty() {
                // A plateau: every live point has the highest likelihood there is.
                self.has_ended = true;
                return;
            }
            let start = &self.live[above[rng.random_range(0..above.len() as u32) as usize]];
            let point = climbed(likelihood, start, threshold, &whitening, slices, rng);
            let log_weight = threshold + self.log_volume() - (count as f64).ln();
            self.dead.push(std::mem::replace(&mut self.live[lowest], point));
            let (high, low) = (self.log_evidence.max(log_weight), self.log_evidence.min(log_weight));
            self.log_evidence = high + (low - high).exp().ln_1p();
        }
    }

    /// Whether there are so many live points of that dimension, and all dead ones are of it.
    pub fn fits(&self, live_points: usize, dimension: usize) -> bool {
        self.live.len() == live_points
            && self.live.iter().chain(&self.dead).all(|point| point.z.len() == dimension)
    }

    fn lowest(&self) -> usize {
        let order =
            |&a: &usize, &b: &usize| self.live[a].log_likelihood.total_cmp(&self.live[b].log_likelihood);
        (0..self.live.len()).min_by(order).unwrap_or(0)
    }

    fn whitening(&self) -> Option<Whitening> {
        let points: Vec<f64> = self.live.iter().flat_map(|point| &point.z).copied().collect();
        pooled_covariance(&[points], self.live[0].z.len())
            .and_then(|covariance| Whitening::from_covariance(&covariance))
    }
}

/// A draw from the prior above the threshold: slices along one random basis of whitened directions after the
/// other, shrunk from a fixed width (Neal 2003, Ann. Stat. 31, 705).
fn climbed(
    likelihood: &dyn LatentLikelihood,
    start: &LivePoint,
    threshold: f64,
    whitening: &Whitening,
    slices: usize,
    rng: &mut impl Rng,
) -> LivePoint {
    let (mut z, mut log_likelihood) = (start.z.clone(), start.log_likelihood);
    let mut basis = Vec::new();
    for _ in 0..slices {
        if basis.is_empty() {
            basis = random_basis(z.len(), rng);
        }
        let Some(unit) = basis.pop() else { break };
        let direction: Vec<f64> = whitening.push(&unit).iter().map(|x| x * SLICE_WIDTH).collect();
        let height: f64 = Exp1.sample(rng);
        let prior_level = log_prior(&z) - height;
        let mut low = -rng.random::<f64>();
        let mut high = low + 1.0;
        while high - low > f64::EPSILON {
            let t = low + rng.random::<f64>() * (high - low);
            let trial: Vec<f64> = z.iter().zip(&direction).map(|(z, direction)| z + t * direction).collect();
            // The prior costs nothing, so it is asked first.
            if log_prior(&trial) > prior_level {
                let value = likelihood.log_likelihood(&trial);
                if value > threshold {
                    (z, log_likelihood) = (trial, value);
                    break;
                }
            }
            if t < 0.0 { low = t } else { high = t }
        }
    }
    LivePoint { z, log_likelihood, birth: threshold }
}

/// Orthonormal vectors in random directions (Gram & Schmidt on normal deviates).
fn random_basis(dimension: usize, rng: &mut impl Rng) -> Vec<Vec<f64>> {
    let mut basis: Vec<Vec<f64>> = Vec::with_capacity(dimension);
    for _ in 0..dimension {
        let mut vector: Vec<f64> = (0..dimension).map(|_| StandardNormal.sample(rng)).collect();
        for unit in &basis {
            let along: f64 = vector.iter().zip(unit).map(|(a, b)| a * b).sum();
            vector.iter_mut().zip(unit).for_each(|(v, u)| *v -= along * u);
        }
        let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
        vector.iter_mut().for_each(|x| *x /= length);
        basis.push(vector);
    }
    basis
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_random_basis_is_orthonormal() {
        let mut rng = crate::numerics::random::stream(1, 0, crate::numerics::random::Stage::Sampling, 0);
        let basis = random_basis(12, &mut rng);
        for (i, a) in basis.iter().enumerate() {
            for (j, b) in basis.iter().enumerate() {
                let product: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-10, "{i} {j} {product}");
            }
        }
    }
}
