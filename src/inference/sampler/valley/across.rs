//! Across the valley: normal draws of t about the floor, weighed by the true density.

use nalgebra::DVector;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::inference::LatentLikelihood;
use crate::inference::floor::{Axes, Floor};
use crate::inference::sampler::target::log_prior;

/// Several t at one s.
pub(super) struct Across {
    /// One z, drawn by weight, and its ln L.
    pub z: DVector<f64>,
    pub log_likelihood: f64,
    /// ln of the mean weight.
    pub log_weight: f64,
    /// Deviation of ln w.
    pub spread: f64,
}

impl Across {
    /// `tries` draws of t about the floor at s.
    pub fn draw(
        likelihood: &dyn LatentLikelihood,
        axes: &Axes,
        s: &DVector<f64>,
        floor: &Floor,
        tries: usize,
        rng: &mut impl Rng,
    ) -> Self {
        let mut drawn: Vec<(f64, DVector<f64>, f64)> = (0..tries)
            .map(|_| {
                let unit = normal(floor.stiff.len(), rng);
                let mut t = unit.clone();
                // The factor of a positive-definite matrix has no zero on its diagonal.
                floor.factor.tr_solve_lower_triangular_mut(&mut t);
                let z = axes.at(s, &(t + &floor.stiff));
                let log_likelihood = likelihood.log_likelihood(z.as_slice());
                let log_density = log_likelihood + log_prior(z.as_slice());
                (log_density - floor.log_density + 0.5 * unit.norm_squared(), z, log_likelihood)
            })
            .collect();
        let top = drawn.iter().map(|d| d.0).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = drawn.iter().map(|d| (d.0 - top).exp()).collect();
        let sum: f64 = weights.iter().sum();
        let mut rest = rng.random::<f64>() * sum;
        let chosen = weights.iter().position(|weight| {
            rest -= weight;
            rest < 0.0
        });
        let count = tries as f64;
        let mean = drawn.iter().map(|d| d.0).sum::<f64>() / count;
        let variance = drawn.iter().map(|d| (d.0 - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        let log_weight = if top.is_finite() { top + (sum / count).ln() } else { f64::NEG_INFINITY };
        let (_, z, log_likelihood) = drawn.swap_remove(chosen.unwrap_or(0));
        Self { z, log_likelihood, log_weight, spread: variance.sqrt() }
    }
}

/// Draws of t that keep the variance of the mean weight near 10%: that of one is exp(spread²) − 1.
pub(super) fn tries_for(spread: f64) -> usize {
    const VARIANCE: f64 = 0.1;
    const FEWEST: f64 = 3.0;
    const MOST: f64 = 16.0;
    ((spread * spread).exp_m1() / VARIANCE).ceil().clamp(FEWEST, MOST) as usize
}

/// Standard normal numbers.
pub(super) fn normal(count: usize, rng: &mut impl Rng) -> DVector<f64> {
    DVector::from_fn(count, |_, _| StandardNormal.sample(rng))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_tries_where_weights_spread() {
        assert_eq!([0.0, 0.3, 0.6, 1.0, 3.0].map(tries_for), [3, 3, 5, 16, 16]);
    }
}
