//! Where a chain is: s, and one of several draws of t about the floor, weighed by the true density.

use nalgebra::{DMatrix, DVector};
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use super::importance::ImportanceDraws;
use crate::inference::optimise::{Axes, ConditionalMaximum};
use crate::inference::sample::point::log_prior;
use crate::inference::{LatentLikelihood, bits};

/// s with several t, one of which is the chain's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Position {
    #[serde(with = "bits::matrix")]
    pub s: DVector<f64>,
    /// z of the chain's t.
    #[serde(with = "bits::matrix")]
    pub z: DVector<f64>,
    /// ln L(z).
    #[serde(with = "bits::number")]
    pub log_likelihood: f64,
    /// ln m(s).
    #[serde(with = "bits::number")]
    pub log_marginal: f64,
    /// t̂, ln p there, and C of the precision C Cᵀ of t.
    #[serde(with = "bits::matrix")]
    stiff: DVector<f64>,
    #[serde(with = "bits::number")]
    log_floor: f64,
    #[serde(with = "bits::matrix")]
    factor: DMatrix<f64>,
    /// Cᵀ(t − t̂) of the chain's t.
    #[serde(with = "bits::matrix")]
    unit: DVector<f64>,
    /// How the t were drawn, and ln of the sum of the weights of those that are not the chain's.
    across: ImportanceDraws,
    #[serde(with = "bits::number")]
    log_rest: f64,
}

impl Position {
    /// Draws of t about the floor at s, one of them chosen by weight, and the deviation of ln w.
    pub fn draw(
        likelihood: &dyn LatentLikelihood,
        axes: &Axes,
        s: DVector<f64>,
        floor: &ConditionalMaximum,
        across: ImportanceDraws,
        rng: &mut impl Rng,
    ) -> (Self, f64) {
        let mut place = Self {
            unit: DVector::zeros(floor.stiff.len()),
            z: axes.at(&s, &floor.stiff),
            s,
            log_likelihood: f64::NEG_INFINITY,
            log_marginal: floor.log_marginal(),
            stiff: floor.stiff.clone(),
            log_floor: floor.log_density,
            factor: floor.factor.clone(),
            across,
            log_rest: f64::NEG_INFINITY,
        };
        let tries = across.tries;
        let drawn: Vec<Self> = (0..tries)
            .map(|_| {
                let unit = across.draw(place.unit.len(), rng);
                place.at(likelihood, axes, unit)
            })
            .collect();
        let own: Vec<f64> = drawn.iter().map(Self::log_own_weight).collect();
        let all = log_sum(own.iter().copied());
        let mut rest = rng.random::<f64>();
        let chosen = own.iter().position(|weight| {
            rest -= (weight - all).exp();
            rest < 0.0
        });
        let chosen = chosen.unwrap_or(0);
        place = drawn.into_iter().nth(chosen).unwrap_or(place);
        place.log_rest =
            log_sum(own.iter().enumerate().filter(|(i, _)| *i != chosen).map(|(_, weight)| *weight));
        let mean = own.iter().sum::<f64>() / tries as f64;
        let variance = own.iter().map(|w| (w - mean).powi(2)).sum::<f64>() / (tries as f64 - 1.0).max(1.0);
        (place, variance.sqrt())
    }

    /// The same with another t.
    fn at(&self, likelihood: &dyn LatentLikelihood, axes: &Axes, unit: DVector<f64>) -> Self {
        let mut t = unit.clone();
        // The factor of a positive-definite matrix has no zero on its diagonal.
        self.factor.tr_solve_lower_triangular_mut(&mut t);
        let z = axes.at(&self.s, &(t + &self.stiff));
        Self { log_likelihood: likelihood.log_likelihood(z.as_slice()), z, unit, ..self.clone() }
    }

    /// ln p(s, t) of the chain's t.
    fn log_density(&self) -> f64 {
        self.log_likelihood + log_prior(self.z.as_slice())
    }

    /// ln w of the chain's t.
    fn log_own_weight(&self) -> f64 {
        let normal = -0.5 * self.unit.norm_squared();
        self.log_density() - self.log_floor - normal - self.across.log_excess(&self.unit)
    }

    /// ln of the mean weight.
    pub fn log_weight(&self) -> f64 {
        log_sum([self.log_rest, self.log_own_weight()]) - (self.across.tries as f64).ln()
    }

    /// A step of the chain's t, accepted by the true density.
    pub fn step(&mut self, likelihood: &dyn LatentLikelihood, axes: &Axes, rng: &mut impl Rng) {
        /// Best step for a normal distribution in one dimension (Roberts, Gelman & Gilks 1997, Ann. Appl. Probab. 7, 110),
        /// and how much smaller it may be: what is steep here may be narrow.
        const STEP: f64 = 2.4;
        const SMALLEST: f64 = 0.08;
        let dimension = self.unit.len();
        let scale = STEP / (dimension as f64).sqrt() * SMALLEST.powf(rng.random());
        let there = self.at(likelihood, axes, &self.unit + normal(dimension, rng) * scale);
        if rng.random::<f64>().ln() < there.log_density() - self.log_density() {
            *self = there;
        }
    }
}

/// Standard normal numbers.
pub(super) fn normal(count: usize, rng: &mut impl Rng) -> DVector<f64> {
    DVector::from_fn(count, |_, _| StandardNormal.sample(rng))
}

/// ln Σ exp; −∞ of nothing.
pub(super) fn log_sum(logarithms: impl IntoIterator<Item = f64> + Clone) -> f64 {
    let top = logarithms.clone().into_iter().fold(f64::NEG_INFINITY, f64::max);
    if top == f64::NEG_INFINITY {
        return top;
    }
    top + logarithms.into_iter().map(|l| (l - top).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::Curvature;
    use crate::numerics::random::{Stage, stream};

    /// s ~ N(0, 1) and t logistic of width 0.01, whose tails are heavier than those of the normal about its top.
    struct Logistic;

    const WIDTH: f64 = 0.01;

    impl LatentLikelihood for Logistic {
        fn dimension(&self) -> usize {
            2
        }

        fn log_likelihood(&self, z: &[f64]) -> f64 {
            let t = z[1].abs() / WIDTH;
            0.5 * z[1] * z[1] - t - 2.0 * (-t).exp().ln_1p()
        }

        fn log_likelihood_gradient(&self, _: &[f64], _: &mut [f64]) -> f64 {
            unreachable!("only curvatures are asked for")
        }

        fn curvature(&self, z: &[f64]) -> Option<Curvature> {
            let tanh = (0.5 * z[1] / WIDTH).tanh();
            let by_t = 0.5 * (1.0 - tanh * tanh) / (WIDTH * WIDTH);
            Some(Curvature {
                log_posterior: self.log_likelihood(z) + log_prior(z),
                gradient: DVector::from_vec(vec![-z[0], -tanh / WIDTH]),
                metric: DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, by_t])),
            })
        }
    }

    fn drawn(across: ImportanceDraws, rng: &mut impl Rng) -> (Axes, Position, f64) {
        let metric = Logistic.curvature(&[0.0, 0.0]).unwrap().metric;
        let axes = Axes::split(&[0.0, 0.0], &metric, 1);
        let s = DVector::from_vec(vec![0.7]);
        let floor = axes.floor(&Logistic, &s, DVector::zeros(1), 30, &mut 0).unwrap();
        let (place, spread) = Position::draw(&Logistic, &axes, s, &floor, across, rng);
        (axes, place, spread)
    }

    #[test]
    fn the_mean_weight_is_the_ratio_of_the_integrals() {
        // ∫p dt = WIDTH and Laplace's integral is √(2π · 2) WIDTH times the height ¼, for the same s.
        let ratio = 1.0 / (0.25 * (4.0 * std::f64::consts::PI).sqrt());
        let rng = &mut stream(1, 0, Stage::Sampling, 0);
        let normal = drawn(ImportanceDraws::normal(200_000), rng).1.log_weight();
        assert!((normal - ratio.ln()).abs() < 0.02, "{normal} {}", ratio.ln());
        let across = ImportanceDraws::normal(16).or_with_tails();
        let tailed: Vec<f64> = (0..20_000).map(|_| drawn(across, rng).1.log_weight()).collect();
        let tailed = log_sum(tailed.iter().copied()) - 20_000_f64.ln();
        assert!((tailed - ratio.ln()).abs() < 0.02, "{tailed} {}", ratio.ln());
    }

    #[test]
    fn steps_keep_the_true_density_and_the_other_draws() {
        let mut rng = stream(2, 0, Stage::Sampling, 0);
        let (axes, mut place, _) = drawn(ImportanceDraws::normal(3), &mut rng);
        let rest = place.log_rest;
        const STEPS: usize = 100_000;
        let squares: f64 = (0..STEPS)
            .map(|_| {
                place.step(&Logistic, &axes, &mut rng);
                (place.z[1] / WIDTH).powi(2)
            })
            .sum();
        let variance = squares / STEPS as f64;
        assert!((variance / (std::f64::consts::PI.powi(2) / 3.0) - 1.0).abs() < 0.06, "{variance}");
        assert_eq!(place.log_rest, rest);
    }

    #[test]
    fn a_draw_without_weight_is_no_place_to_go() {
        assert_eq!(log_sum([f64::NEG_INFINITY; 2]), f64::NEG_INFINITY);
        assert!((log_sum([0.0, 0.0, f64::NEG_INFINITY]) - 2f64.ln()).abs() < 1e-15);
    }
}
