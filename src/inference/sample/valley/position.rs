//! Where a chain is: s, and one of several draws of t about the maximum there, weighed by the true density.

use nalgebra::DVector;
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use super::importance::{ImportanceDraws, StiffDensity};
use crate::inference::LatentLikelihood;
use crate::inference::optimise::{Axes, ConditionalMaximum};
use crate::inference::sample::normal::{log_prior, log_sum, normal};

/// s with several t, one of which is the chain's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Position {
    pub s: DVector<f64>,
    /// z of the chain's t.
    pub z: DVector<f64>,
    /// ln L(z).
    pub log_likelihood: f64,
    /// ln m(s).
    pub log_marginal: f64,
    /// ln p(s, t̂).
    log_maximum: f64,
    /// What the t were drawn from, the chain's t in its units, and ln of the density there.
    density: StiffDensity,
    unit: DVector<f64>,
    log_drawn: f64,
    /// How many were drawn, and ln of the sum of the weights of those that are not the chain's.
    tries: usize,
    log_rest: f64,
}

impl Position {
    /// Draws of t about the maximum at s, one of them chosen by weight, and the variance of one weight over the square of their mean.
    pub fn draw(
        likelihood: &dyn LatentLikelihood,
        axes: &Axes,
        s: DVector<f64>,
        maximum: &ConditionalMaximum,
        importance: ImportanceDraws,
        rng: &mut impl Rng,
    ) -> (Self, f64) {
        let mut position = Self::of(axes, s, maximum, importance);
        let drawn = position.others(likelihood, axes, importance.tries, rng);
        let own: Vec<f64> = drawn.iter().map(Self::log_own_weight).collect();
        let all = log_sum(own.iter().copied());
        let mut rest = rng.random::<f64>();
        let chosen = own.iter().position(|weight| {
            rest -= (weight - all).exp();
            rest < 0.0
        });
        let chosen = chosen.unwrap_or(0);
        position = drawn.into_iter().nth(chosen).unwrap_or(position);
        position.log_rest =
            log_sum(own.iter().enumerate().filter(|(i, _)| *i != chosen).map(|(_, weight)| *weight));
        let log_squares = log_sum(own.iter().map(|weight| 2.0 * weight));
        // As large as it can be where all weights are zero.
        let share = if all == f64::NEG_INFINITY { 1.0 } else { (log_squares - 2.0 * all).exp() };
        (position, importance.tries as f64 * share - 1.0)
    }

    /// The same s and t, seen from a maximum at s that has been sought anew and among other draws about that: how (s, t) are
    /// distributed does not change, as the others are independent of the chain's.
    pub fn renewed(
        self,
        likelihood: &dyn LatentLikelihood,
        axes: &Axes,
        maximum: &ConditionalMaximum,
        importance: ImportanceDraws,
        rng: &mut impl Rng,
    ) -> Self {
        let [_, t] = axes.coordinates(self.z.as_slice());
        let position = Self::of(axes, self.s, maximum, importance);
        let others = position.others(likelihood, axes, importance.tries - 1, rng);
        let (unit, log_drawn) = position.density.units(likelihood, axes, &position.s, &t);
        Self {
            unit,
            log_drawn,
            z: self.z,
            log_likelihood: self.log_likelihood,
            log_rest: log_sum(others.iter().map(Self::log_own_weight)),
            ..position
        }
    }

    /// Moves one coordinate of t at the same s, by Metropolis's rule: a t in a tail that few draws come near to would hold the chain. Steps
    /// of Cauchy's kind are as long as any tail.
    pub fn move_across(&mut self, likelihood: &dyn LatentLikelihood, axes: &Axes, rng: &mut impl Rng) {
        if self.unit.is_empty() {
            return;
        }
        let mut unit = self.unit.clone();
        // The ratio of two normal numbers is Cauchy's.
        let ratio = normal(2, rng);
        unit[rng.random_range(0..self.unit.len())] += ratio[0] / ratio[1];
        let there = self.at(likelihood, axes, unit);
        // The others are independent of the chain's t, and stay.
        if rng.random::<f64>().ln() < there.log_density_of_units() - self.log_density_of_units() {
            *self = there;
        }
    }

    /// At the maximum itself, before any t is drawn.
    fn of(axes: &Axes, s: DVector<f64>, maximum: &ConditionalMaximum, importance: ImportanceDraws) -> Self {
        Self {
            z: axes.at(&s, &maximum.stiff),
            s,
            log_likelihood: f64::NEG_INFINITY,
            log_marginal: maximum.log_marginal(),
            log_maximum: maximum.log_density,
            density: StiffDensity::about(maximum, importance),
            unit: DVector::zeros(maximum.stiff.len()),
            log_drawn: 0.0,
            tries: importance.tries,
            log_rest: f64::NEG_INFINITY,
        }
    }

    /// Independent draws of t.
    fn others(
        &self,
        likelihood: &dyn LatentLikelihood,
        axes: &Axes,
        tries: usize,
        rng: &mut impl Rng,
    ) -> Vec<Self> {
        (0..tries).map(|_| self.at(likelihood, axes, self.density.draw(rng))).collect()
    }

    /// Another t at the same s.
    fn at(&self, likelihood: &dyn LatentLikelihood, axes: &Axes, unit: DVector<f64>) -> Self {
        let (t, log_drawn) = self.density.at(likelihood, axes, &self.s, &unit);
        let z = axes.at(&self.s, &t);
        Self { log_likelihood: likelihood.log_likelihood(z.as_slice()), z, unit, log_drawn, ..self.clone() }
    }

    /// Whether it is of a problem of that dimension, with so many slow and stiff directions.
    pub fn fits(&self, dimension: usize, slow: usize, stiff: usize) -> bool {
        (self.z.len(), self.s.len(), self.unit.len()) == (dimension, slow, stiff) && self.density.fits(stiff)
    }

    /// ln p(s, t) of the chain's t.
    fn log_density(&self) -> f64 {
        self.log_likelihood + log_prior(self.z.as_slice())
    }

    /// ln p of the units of t, up to what depends on s.
    fn log_density_of_units(&self) -> f64 {
        self.log_own_weight() + self.density.log_of_units(&self.unit)
    }

    /// ln w of the chain's t.
    fn log_own_weight(&self) -> f64 {
        self.log_density() - self.log_maximum - self.log_drawn
    }

    /// ln of the mean weight.
    pub fn log_weight(&self) -> f64 {
        log_sum([self.log_rest, self.log_own_weight()]) - (self.tries as f64).ln()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::inference::likelihood::known::Known;
    use crate::numerics::random::{Stage, stream};

    /// s ~ N(0, 1) and t logistic of width 0.01, whose tails are heavier than those of the normal about its top.
    const LOGISTIC: Known = Known {
        dimension: 2,
        log_likelihood: |z| {
            let t = z[1].abs() / WIDTH;
            0.5 * z[1] * z[1] - t - 2.0 * (-t).exp().ln_1p()
        },
        slope_and_metric: |z| {
            let tanh = (0.5 * z[1] / WIDTH).tanh();
            let by_t = 0.5 * (1.0 - tanh * tanh) / (WIDTH * WIDTH);
            let metric = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, by_t]));
            (DVector::from_vec(vec![-z[0], -tanh / WIDTH]), metric)
        },
    };

    const WIDTH: f64 = 0.01;

    fn valley() -> (Axes, DVector<f64>, ConditionalMaximum) {
        let metric = LOGISTIC.curvature(&[0.0, 0.0]).unwrap().metric;
        let axes = Axes::split(&[0.0, 0.0], &metric, 1);
        let s = DVector::from_vec(vec![0.7]);
        let maximum = axes.maximum(&LOGISTIC, &s, DVector::zeros(1), 30).unwrap();
        (axes, s, maximum)
    }

    /// Of normal draws, and of ones about nested maxima.
    fn both(tries: usize, maximum: &ConditionalMaximum) -> [ImportanceDraws; 2] {
        let first = ImportanceDraws::about(maximum);
        [first, first.for_variance(9.0).or_nested()].map(|mut draws| {
            draws.tries = tries;
            draws
        })
    }

    #[test]
    fn the_mean_weight_is_the_ratio_of_the_integrals() {
        // ∫p dt = WIDTH and Laplace's integral is √(2π · 2) WIDTH times the height ¼, for the same s.
        let ratio = 1.0 / (0.25 * (4.0 * std::f64::consts::PI).sqrt());
        let rng = &mut stream(1, 0, Stage::Sampling, 0);
        let (axes, s, maximum) = valley();
        for importance in both(200_000, &maximum) {
            let (position, _) = Position::draw(&LOGISTIC, &axes, s.clone(), &maximum, importance, rng);
            let log_weight = position.log_weight();
            assert!((log_weight - ratio.ln()).abs() < 0.02, "{log_weight} {} {importance:?}", ratio.ln());
        }
    }

    #[test]
    fn a_renewed_position_of_exact_t_has_one_over_the_integral_as_the_mean_of_one_over_its_weight() {
        let rng = &mut stream(3, 0, Stage::Sampling, 0);
        let (axes, s, mut maximum) = valley();
        let [importance, _] = both(3, &maximum);
        let (position, _) = Position::draw(&LOGISTIC, &axes, s, &maximum, importance, rng);
        // As another search may have ended: beside the top, and of another width.
        maximum.stiff[0] += 0.5 * WIDTH;
        maximum.factor *= 0.6;
        const TIMES: usize = 40_000;
        for importance in both(3, &maximum) {
            let mut mean = 0.0;
            for _ in 0..TIMES {
                let u: f64 = rng.random();
                let t = DVector::from_vec(vec![WIDTH * (u / (1.0 - u)).ln()]);
                let z = axes.at(&position.s, &t);
                let log_likelihood = LOGISTIC.log_likelihood(z.as_slice());
                let exact = Position { z, log_likelihood, ..position.clone() };
                let renewed = exact.renewed(&LOGISTIC, &axes, &maximum, importance, rng);
                mean += (-renewed.log_weight()).exp() / TIMES as f64;
            }
            // ∫p dt = WIDTH over the height ¼ times √(2π · 2) WIDTH/0.6, weights in units of what the normal's top has.
            let integral = 0.6 / (0.25 * (4.0 * std::f64::consts::PI).sqrt());
            assert!((mean * integral - 1.0).abs() < 0.02, "{mean} {integral} {importance:?}");
        }
    }
}
