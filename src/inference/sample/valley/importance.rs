//! How t is drawn at one s: about the conditional maximum, by the normal distribution that the curvature there gives, or about
//! the maxima of the stiffest directions given the others.

use nalgebra::{DMatrix, DVector};
use rand::Rng;
use rand_distr::{Distribution, Exp1};
use serde::{Deserialize, Serialize};

use crate::inference::LatentLikelihood;
use crate::inference::optimise::{Axes, ConditionalMaximum};
use crate::inference::sample::normal::normal;

/// How many t are drawn at each s, and of how many of the stiffest directions each has its own maximum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct ImportanceDraws {
    pub tries: usize,
    nested: usize,
    /// How many the others displace.
    displaced: usize,
}

const FEWEST_TRIES: f64 = 3.0;
const MOST_TRIES: usize = 8;

impl ImportanceDraws {
    /// Normal draws.
    pub const fn normal(tries: usize) -> Self {
        Self { tries, nested: 0, displaced: 0 }
    }

    /// A first number of normal draws about a maximum.
    ///
    /// The stiffest directions bend along the others. A path of a radius of curvature of one, in units of priors' widths, departs from its tangent by
    /// half the square of the way: narrower directions than that of the widest are displaced by more than a deviation, and one at least is taken as such.
    pub fn about(maximum: &ConditionalMaximum) -> Self {
        let widths: Vec<f64> = maximum.factor.row_iter().map(|row| row.norm().recip()).collect();
        let widest = widths.iter().copied().fold(0.0, f64::max);
        let displaced = widths.iter().filter(|width| **width < 0.5 * widest * widest).count();
        Self { tries: MOST_TRIES, nested: 0, displaced: displaced.max(1).min(widths.len()) }
    }

    /// As many draws as keep the variance of their mean weight near 10%, by that of one weight.
    pub fn for_variance(self, variance: f64) -> Self {
        const OF_MEAN: f64 = 0.1;
        let tries = (variance / OF_MEAN).ceil().clamp(FEWEST_TRIES, MOST_TRIES as f64);
        Self { tries: tries as usize, ..self }
    }

    /// Whether draws can be made of so many stiff directions.
    pub fn fits(self, stiff: usize) -> bool {
        self.tries > 0 && self.nested <= stiff && self.displaced <= stiff
    }

    /// With maxima of the stiffest directions for each draw if even the most draws are too few.
    pub fn or_nested(self) -> Self {
        Self { nested: if self.tries == MOST_TRIES { self.displaced } else { self.nested }, ..self }
    }
}

/// The density that t is drawn from at one s: N(t̂, H⁻¹); or, with t = (b, a) and b the stiffest directions, a as that has it and
/// b about its own maximum given (s, a), both of Student's kind.
///
/// Over a deviation of a the maximum b̂(s, a) moves by up to a hundred deviations of b, on a bent path: a line along which b
/// moves with a leaves the posterior at once. Student's tails cover those of kinks, where the density falls exponentially.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct StiffDensity {
    /// t̂.
    middle: DVector<f64>,
    /// C of H = C Cᵀ.
    factor: DMatrix<f64>,
    /// Coordinates b.
    nested: usize,
}

/// Degrees of freedom over two. Of 12 normal coordinates the variance of one weight is 0.3.
const HALF_DEGREES: usize = 4;
/// ln of √(2π) times the height of that density.
const LN_PEAK: f64 = -0.031_170_078_945_558_28;

impl StiffDensity {
    /// About a maximum.
    pub fn about(maximum: &ConditionalMaximum, importance: ImportanceDraws) -> Self {
        Self { middle: maximum.stiff.clone(), factor: maximum.factor.clone(), nested: importance.nested }
    }

    /// A draw in units.
    pub fn draw(&self, rng: &mut impl Rng) -> DVector<f64> {
        let mut unit = normal(self.middle.len(), rng);
        if self.nested > 0 {
            for u in unit.iter_mut() {
                let square: f64 = (0..HALF_DEGREES).map(|_| -> f64 { Exp1.sample(rng) }).sum();
                *u /= (square / HALF_DEGREES as f64).sqrt();
            }
        }
        unit
    }

    /// t of units, and ln of the density there over the height of the normal one.
    pub fn at(
        &self,
        likelihood: &dyn LatentLikelihood,
        axes: &Axes,
        s: &DVector<f64>,
        unit: &DVector<f64>,
    ) -> (DVector<f64>, f64) {
        let (mut t, factor, log_narrower) = self.given_rest(likelihood, axes, s, unit);
        let mut own = unit.rows(0, self.nested).into_owned();
        // The factor of a positive-definite matrix has no zero on its diagonal.
        factor.tr_solve_lower_triangular_mut(&mut own);
        let mut rows = t.rows_mut(0, self.nested);
        rows += own;
        (t, self.log_of_units(unit) + log_narrower)
    }

    /// The units of t, and ln of the density there over the height of the normal one.
    pub fn units(
        &self,
        likelihood: &dyn LatentLikelihood,
        axes: &Axes,
        s: &DVector<f64>,
        t: &DVector<f64>,
    ) -> (DVector<f64>, f64) {
        let mut unit = self.factor.tr_mul(&(t - &self.middle));
        let (middle, factor, log_narrower) = self.given_rest(likelihood, axes, s, &unit);
        let from = t.rows(0, self.nested) - middle.rows(0, self.nested);
        unit.rows_mut(0, self.nested).copy_from(&factor.tr_mul(&from));
        let log_density = self.log_of_units(&unit) + log_narrower;
        (unit, log_density)
    }

    /// The middle of t given its coordinates a in units, C of the precision of b, and ln of how much narrower b is than by H.
    fn given_rest(
        &self,
        likelihood: &dyn LatentLikelihood,
        axes: &Axes,
        s: &DVector<f64>,
        unit: &DVector<f64>,
    ) -> (DVector<f64>, DMatrix<f64>, f64) {
        let mut t = unit.clone();
        t.rows_mut(0, self.nested).fill(0.0);
        self.factor.tr_solve_lower_triangular_mut(&mut t);
        t += &self.middle;
        let by_curvature = self.factor.view((0, 0), (self.nested, self.nested)).into_owned();
        if self.nested == 0 {
            return (t, by_curvature, 0.0);
        }
        let Some((own, factor)) = axes.nested_maximum(likelihood, s, &t, self.nested) else {
            return (t, by_curvature, 0.0);
        };
        t.rows_mut(0, self.nested).copy_from(&own);
        let half_log_determinant = |c: &DMatrix<f64>| c.diagonal().iter().map(|d| d.ln()).sum::<f64>();
        let log_narrower = half_log_determinant(&factor) - half_log_determinant(&by_curvature);
        (t, factor, log_narrower)
    }

    /// ln of the density of units over the height of the normal one.
    pub fn log_of_units(&self, unit: &DVector<f64>) -> f64 {
        const DEGREES: f64 = 2.0 * HALF_DEGREES as f64;
        let student = |u: &f64| LN_PEAK - 0.5 * (DEGREES + 1.0) * (u * u / DEGREES).ln_1p();
        if self.nested == 0 { -0.5 * unit.norm_squared() } else { unit.iter().map(student).sum() }
    }

    /// Whether it is of so many stiff directions.
    pub fn fits(&self, stiff: usize) -> bool {
        self.middle.len() == stiff && self.factor.shape() == (stiff, stiff) && self.nested <= stiff
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::likelihood::known::Known;
    use crate::numerics::random::{Stage, stream};

    const WIDTHS: [f64; 2] = [1e-6, 0.01];
    const CURVATURE: f64 = 2.0;

    /// s ~ N(0, 1), a ~ N(0, 0.01²) and b ~ N(a², 1e-6²): a moves b by 200 of its deviations.
    const BENT: Known = Known {
        dimension: 3,
        log_likelihood: |z| {
            let [b, a] = units(z);
            0.5 * (z[1] * z[1] + z[2] * z[2] - a * a - b * b)
        },
        slope_and_metric: |z| {
            let [b, a] = units(z);
            let rows = [
                1.0,
                0.0,
                0.0,
                0.0,
                1.0 / WIDTHS[0],
                -CURVATURE * z[2] / WIDTHS[0],
                0.0,
                0.0,
                1.0 / WIDTHS[1],
            ];
            let jacobian = DMatrix::from_row_slice(3, 3, &rows);
            (-jacobian.tr_mul(&DVector::from_vec(vec![z[0], b, a])), jacobian.tr_mul(&jacobian))
        },
    };

    fn units(z: &[f64]) -> [f64; 2] {
        [(z[1] - 0.5 * CURVATURE * z[2] * z[2]) / WIDTHS[0], z[2] / WIDTHS[1]]
    }

    fn bent() -> (Axes, DVector<f64>, ConditionalMaximum) {
        let axes = Axes::split(&[0.0; 3], &BENT.curvature(&[0.0; 3]).unwrap().metric, 1);
        let s = DVector::from_element(1, 0.4);
        let maximum = axes.maximum(&BENT, &s, DVector::zeros(2), 30).unwrap();
        (axes, s, maximum)
    }

    #[test]
    fn more_tries_where_weights_vary() {
        let normal = ImportanceDraws::normal(8);
        assert_eq!(
            [0.0, 0.3, 0.55, 1.0, 3.0].map(|of_one| normal.for_variance(of_one).tries),
            [3, 3, 6, 8, 8]
        );
    }

    #[test]
    fn maxima_are_nested_where_the_most_tries_are_too_few_and_stay_so() {
        let draws = ImportanceDraws::about(&bent().2);
        assert_eq!((draws.nested, draws.displaced), (0, 1));
        let after = |variance: f64| draws.for_variance(variance).or_nested();
        assert_eq!([0.3, 0.6, 3.0].map(|variance| after(variance).nested), [0, 0, 1]);
        assert_eq!(after(3.0).for_variance(0.3).or_nested(), ImportanceDraws { tries: 3, ..after(3.0) });
    }

    #[test]
    fn draws_follow_a_bend_and_have_the_density_that_is_said() {
        let (axes, s, maximum) = bent();
        let plain = ImportanceDraws::about(&maximum);
        let rng = &mut stream(1, 0, Stage::Sampling, 0);
        // The mean weight is 1: the integral is that of Laplace's method.
        let mut weights = |importance: ImportanceDraws| {
            let density = StiffDensity::about(&maximum, importance);
            let weight = |_| {
                let unit = density.draw(rng);
                let (t, log_drawn) = density.at(&BENT, &axes, &s, &unit);
                let (same, again) = density.units(&BENT, &axes, &s, &t);
                assert!((again - log_drawn).abs() < 1e-6 * (1.0 + log_drawn.abs()), "{again} {log_drawn}");
                assert!((same - &unit).amax() < 1e-6 * (1.0 + unit.amax()), "{unit}");
                let z = axes.at(&s, &t);
                let log_density = BENT.log_likelihood(z.as_slice()) - 0.5 * z.norm_squared();
                (log_density - maximum.log_density - log_drawn).exp()
            };
            let weights: Vec<f64> = (0..20_000).map(weight).collect();
            let mean = weights.iter().sum::<f64>() / 20_000.0;
            (mean, weights.iter().map(|w| (w / mean - 1.0).powi(2)).sum::<f64>() / 20_000.0)
        };
        let (_, variance) = weights(plain);
        assert!(variance > 5.0, "{variance}");
        let (mean, variance) = weights(plain.for_variance(9.0).or_nested());
        assert!((mean - 1.0).abs() < 0.01 && variance < 0.1, "{mean} {variance}");
    }
}
