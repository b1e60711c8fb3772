//! How t is drawn about a conditional maximum, in units of the normal distribution that the curvature there gives.

use nalgebra::DVector;
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use crate::inference::sample::normal::{log_sum, normal};

/// Several independent draws, all normal, or with Cauchy tails along the widest directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct ImportanceDraws {
    pub tries: usize,
    has_tails: bool,
}

/// Directions with tails, the share of draws of each that lie in them, and their width.
const TAILED: usize = 3;
const SHARE: f64 = 0.3;
const WIDTH: f64 = 3.0;

const FEWEST_TRIES: f64 = 3.0;
const MOST_TRIES: usize = 16;

impl ImportanceDraws {
    /// Normal draws.
    pub const fn normal(tries: usize) -> Self {
        Self { tries, has_tails: false }
    }

    /// As many normal draws as keep the variance of their mean weight near 10%, when ln w deviates by `spread`: that of one
    /// is exp(spread²) − 1. Tails once there stay.
    pub fn for_spread(self, spread: f64) -> Self {
        const VARIANCE: f64 = 0.1;
        if self.has_tails {
            return self;
        }
        let tries = ((spread * spread).exp_m1() / VARIANCE).ceil();
        Self::normal(tries.clamp(FEWEST_TRIES, MOST_TRIES as f64) as usize)
    }

    /// With tails if even the most draws are too few. At the kink of a steep source the curvature tells little of how far the
    /// density stays high, and a chain far out where no draw gets to would be held there.
    pub fn or_with_tails(self) -> Self {
        Self { has_tails: self.tries == MOST_TRIES, ..self }
    }

    /// One draw.
    pub fn draw(&self, dimension: usize, rng: &mut impl Rng) -> DVector<f64> {
        let mut unit = normal(dimension, rng);
        for u in unit.iter_mut().take(self.tailed()) {
            if rng.random::<f64>() < SHARE {
                *u = WIDTH * (std::f64::consts::PI * rng.random::<f64>()).tan();
            }
        }
        unit
    }

    /// ln of the density of draws over that of normal ones.
    pub fn log_excess(&self, unit: &DVector<f64>) -> f64 {
        unit.iter().take(self.tailed()).map(|u| log_tailed(*u)).sum()
    }

    fn tailed(&self) -> usize {
        if self.has_tails { TAILED } else { 0 }
    }
}

/// ln of [0.7 N(u; 0, 1) + 0.3 Cauchy(u; 0, 3)]/N(u; 0, 1).
fn log_tailed(u: f64) -> f64 {
    const LN_SQRT_TAU: f64 = 0.918_938_533_204_672_8;
    let tails = -(std::f64::consts::PI * WIDTH * (1.0 + (u / WIDTH) * (u / WIDTH))).ln();
    let normal = -0.5 * u * u - LN_SQRT_TAU;
    log_sum([(1.0 - SHARE).ln(), SHARE.ln() + tails - normal])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::{Stage, stream};

    #[test]
    fn more_tries_where_weights_spread() {
        assert_eq!(
            [0.0, 0.3, 0.6, 1.0, 3.0].map(|spread| ImportanceDraws::normal(8).for_spread(spread).tries),
            [3, 3, 5, 16, 16]
        );
    }

    #[test]
    fn tails_are_for_the_most_tries_and_stay() {
        let after = |spread: f64| ImportanceDraws::normal(8).for_spread(spread).or_with_tails();
        assert_eq!([0.0, 0.6, 3.0].map(|spread| after(spread).has_tails), [false, false, true]);
        assert_eq!(after(3.0).for_spread(0.0).or_with_tails(), after(3.0));
    }

    #[test]
    fn draws_have_the_density_that_is_said() {
        // Of draws weighted to normal ones: mean weight, and the fraction within a deviation, of the first and the last.
        let importance = ImportanceDraws::normal(MOST_TRIES).or_with_tails();
        let mut rng = stream(1, 0, Stage::Sampling, 0);
        let draws: Vec<_> = (0..200_000).map(|_| importance.draw(4, &mut rng)).collect();
        let mean = |of: &dyn Fn(&DVector<f64>) -> bool| {
            let weight = |u: &&DVector<f64>| (-importance.log_excess(u)).exp();
            draws.iter().filter(|u| of(u)).map(|u| weight(&u)).sum::<f64>() / draws.len() as f64
        };
        assert!((mean(&|_| true) - 1.0).abs() < 0.005);
        for i in [0, 3] {
            assert!((mean(&|u| u[i].abs() < 1.0) - 0.6827).abs() < 0.005, "{i}");
        }
        let far = |i: usize| draws.iter().filter(|u| u[i].abs() > 10.0).count() as f64 / draws.len() as f64;
        // 30% of the Cauchy distribution's 2/π · arctan(3/10).
        assert!((far(0) - 0.0557).abs() < 0.003 && far(3) == 0.0, "{} {}", far(0), far(3));
    }
}
