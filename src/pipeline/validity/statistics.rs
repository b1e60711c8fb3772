//! Biases, scatter and coverage of fitted shears against a definition, with errors from sightlines drawn again.

use nalgebra::{Complex, Matrix2, Vector2};
use rand::RngExt;
use serde::Serialize;

use crate::numerics::random::{Stage, stream};

/// dᵀC⁻¹d below which 68% of a normal distribution in two dimensions lie, −2 ln 0.32.
pub const WITHIN_68: f64 = 2.278_868_566_376_729_6;

/// A part of a number of cases, with the binomial standard error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Share {
    /// The part; not a number of no cases.
    pub part: f64,
    /// √(p(1 − p)/n), p being a case off zero and one.
    pub error: f64,
    /// How many cases.
    pub of: usize,
}

impl Share {
    /// Of those for which something holds.
    pub fn of(cases: impl IntoIterator<Item = bool>) -> Self {
        let (hits, of) =
            cases.into_iter().fold((0_usize, 0_usize), |(h, n), is| (h + usize::from(is), n + 1));
        let n = of as f64;
        // Laplace's rule keeps the error of none and of all above zero.
        let p = (hits as f64 + 1.0) / (n + 2.0);
        Self { part: hits as f64 / n, error: (p * (1.0 - p) / n).sqrt(), of }
    }
}

/// A fitted shear beside what a definition says it should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// γ by the definition.
    pub defined: [f64; 2],
    /// γ of the fit.
    pub fitted: [f64; 2],
    /// Covariance of the fit (11, 12, 22).
    pub covariance: [f64; 3],
}

impl Deviation {
    /// dᵀC⁻¹d; not a number where the covariance is singular.
    pub fn squared(&self) -> f64 {
        let [c11, c12, c22] = self.covariance;
        let d = Vector2::from([0, 1].map(|i| self.fitted[i] - self.defined[i]));
        Matrix2::new(c11, c12, c12, c22).try_inverse().map_or(f64::NAN, |inverse| d.dot(&(inverse * d)))
    }

    /// √(dᵀC⁻¹d/2): 1 for a deviation of one σ in each component.
    pub fn sigmas(&self) -> f64 {
        (0.5 * self.squared()).sqrt()
    }

    fn is_finite(&self) -> bool {
        let numbers = self.defined.iter().chain(&self.fitted).chain(&self.covariance);
        numbers.into_iter().all(|number| number.is_finite()) && self.squared().is_finite()
    }
}

/// γ_fit = (1 + m) γ + c + scatter, each number with its standard error from 400 samples of the sightlines drawn again.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Biases {
    /// Fits that have all numbers.
    pub number: usize,
    /// m of both components together, by least squares.
    pub multiplicative: [f64; 2],
    /// c₁.
    pub additive1: [f64; 2],
    /// c₂.
    pub additive2: [f64; 2],
    /// Root mean square a component of γ_fit − γ about its mean.
    pub scatter: [f64; 2],
    /// √(scatter² − ⟨σ²⟩), σ the error of a fit; 0 where fits scatter less than their errors say.
    pub scatter_beyond_errors: [f64; 2],
    /// Part of the fits with dᵀC⁻¹d below that of 68% of a normal distribution.
    pub coverage: Share,
    /// Median of √(dᵀC⁻¹d/2); 0.83 where the errors are right.
    pub median_sigmas: f64,
}

impl Biases {
    /// Of fits of independent sightlines; those without a number are left out.
    pub fn of(fits: &[Deviation]) -> Self {
        /// Samples drawn again.
        const SAMPLES: usize = 400;
        let fits: Vec<Deviation> = fits.iter().filter(|fit| fit.is_finite()).copied().collect();
        let values = line(&fits);
        let mut samples: [Vec<f64>; 5] = Default::default();
        let mut rng = stream(0, 0, Stage::Bootstrap, fits.len() as u64);
        for _ in 0..SAMPLES {
            let again: Vec<Deviation> =
                (0..fits.len()).map(|_| fits[rng.random_range(0..fits.len())]).collect();
            // A sample of one sightline alone has no slope.
            for (own, value) in samples.iter_mut().zip(line(&again)) {
                own.extend(Some(value).filter(|value| value.is_finite()));
            }
        }
        let error = |own: &[f64]| {
            let n = own.len() as f64;
            let mean = own.iter().sum::<f64>() / n;
            (own.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n).sqrt()
        };
        let [multiplicative, additive1, additive2, scatter, scatter_beyond_errors] =
            std::array::from_fn(|i| [values[i], error(&samples[i])]);
        let mut sigmas: Vec<f64> = fits.iter().map(Deviation::sigmas).collect();
        sigmas.sort_by(f64::total_cmp);
        Self {
            number: fits.len(),
            multiplicative,
            additive1,
            additive2,
            scatter,
            scatter_beyond_errors,
            coverage: Share::of(fits.iter().map(|fit| fit.squared() <= WITHIN_68)),
            median_sigmas: sigmas.get(sigmas.len() / 2).copied().unwrap_or(f64::NAN),
        }
    }
}

/// m, c₁, c₂, scatter and what of it is beyond the errors.
fn line(fits: &[Deviation]) -> [f64; 5] {
    let n = fits.len() as f64;
    let [x, y] = [|fit: &Deviation| fit.defined, |fit: &Deviation| fit.fitted]
        .map(|of| fits.iter().map(|fit| Complex::from_pair(of(fit))).collect::<Vec<_>>());
    let mean = |values: &[Complex<f64>]| values.iter().sum::<Complex<f64>>() / n;
    let (x_mean, y_mean) = (mean(&x), mean(&y));
    let product: f64 = x.iter().zip(&y).map(|(x, y)| ((y - y_mean) * (x - x_mean).conj()).re).sum();
    let square: f64 = x.iter().map(|x| (x - x_mean).norm_sqr()).sum();
    let slope = product / square;
    let additive = y_mean - x_mean * slope;
    let apart = y_mean - x_mean;
    let scatter2 = x.iter().zip(&y).map(|(x, y)| (y - x - apart).norm_sqr()).sum::<f64>() / (2.0 * n);
    let errors2 = fits.iter().map(|fit| fit.covariance[0] + fit.covariance[2]).sum::<f64>() / (2.0 * n);
    [slope - 1.0, additive.re, additive.im, scatter2.sqrt(), (scatter2 - errors2).max(0.0).sqrt()]
}

trait FromPair {
    fn from_pair(pair: [f64; 2]) -> Self;
}

impl FromPair for Complex<f64> {
    fn from_pair([re, im]: [f64; 2]) -> Self {
        Self::new(re, im)
    }
}

/// Spearman's rank correlation of pairs, those that are not finite left out; equal values share their mean rank.
pub fn rank_correlation(pairs: &[[f64; 2]]) -> f64 {
    let pairs: Vec<[f64; 2]> =
        pairs.iter().filter(|pair| pair.iter().all(|v| v.is_finite())).copied().collect();
    let ranks = |column: usize| -> Vec<f64> {
        let value = |i: &usize| pairs[*i][column];
        let mut order: Vec<usize> = (0..pairs.len()).collect();
        order.sort_by(|a, b| value(a).total_cmp(&value(b)));
        let mut ranks = vec![0.0; pairs.len()];
        let mut start = 0;
        while start < order.len() {
            let equal = order[start..].iter().take_while(|i| value(i) == value(&order[start])).count();
            let rank = start as f64 + 0.5 * (equal - 1) as f64;
            order[start..start + equal].iter().for_each(|&i| ranks[i] = rank);
            start += equal;
        }
        ranks
    };
    let (x, y, middle) = (ranks(0), ranks(1), 0.5 * (pairs.len() as f64 - 1.0));
    let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - middle) * (b - middle)).sum::<f64>();
    sum(&x, &y) / (sum(&x, &x) * sum(&y, &y)).sqrt()
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Fits of known biases whose errors are right but for a factor, beside a scatter of their own.
    fn fits(number: usize, (m, c): (f64, [f64; 2]), (sigma, told, own): (f64, f64, f64)) -> Vec<Deviation> {
        let mut rng = stream(11, 0, Stage::Sampling, 0);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        (0..number)
            .map(|_| {
                let defined = [0.03 * normal(), 0.03 * normal()];
                let fitted =
                    [0, 1].map(|i| (1.0 + m) * defined[i] + c[i] + sigma * normal() + own * normal());
                Deviation { defined, fitted, covariance: [told * told, 0.0, told * told] }
            })
            .collect()
    }

    #[test]
    fn known_biases_are_found_within_their_errors() {
        let biases = Biases::of(&fits(4000, (-0.2, [0.002, -0.001]), (0.003, 0.003, 0.0)));
        let is_near =
            |[value, error]: [f64; 2], wanted: f64| (value - wanted).abs() < 4.0 * error && error > 0.0;
        assert!(is_near(biases.multiplicative, -0.2) && biases.multiplicative[1] < 0.003, "{biases:?}");
        assert!(is_near(biases.additive1, 0.002) && is_near(biases.additive2, -0.001), "{biases:?}");
        // √(0.003² + (0.2·0.03)²): what the slope leaves counts as scatter.
        assert!(is_near(biases.scatter, 45e-6f64.sqrt()), "{biases:?}");
        assert!(is_near(biases.scatter_beyond_errors, 0.006), "{biases:?}");
    }

    #[test]
    fn errors_that_are_right_cover_and_those_that_are_not_do_not() {
        let of = |told: f64| Biases::of(&fits(4000, (0.0, [0.0; 2]), (0.003, told, 0.0)));
        let right = of(0.003);
        assert!((right.coverage.part - 0.68).abs() < 4.0 * right.coverage.error, "{right:?}");
        assert!((right.coverage.error - 0.0074).abs() < 2e-4 && right.coverage.of == 4000);
        // The median of χ² with two degrees of freedom is 2 ln 2.
        assert!((right.median_sigmas - 2f64.ln().sqrt()).abs() < 0.03, "{right:?}");
        // With half the error told, dᵀC⁻¹d is four times as large: 1 − 0.32^¼ lie within.
        let small = of(0.0015);
        assert!((small.coverage.part - (1.0 - 0.32f64.powf(0.25))).abs() < 0.03, "{small:?}");
    }

    #[test]
    fn gaps_are_left_out_and_nothing_is_no_fault() {
        let gap = Deviation { defined: [f64::NAN; 2], fitted: [0.0; 2], covariance: [1.0, 0.0, 1.0] };
        let singular = Deviation { defined: [0.0; 2], covariance: [1.0, 1.0, 1.0], ..gap };
        let biases = Biases::of(&[gap, singular]);
        assert!(biases.number == 0 && biases.multiplicative[0].is_nan() && biases.coverage.part.is_nan());
        let few = Biases::of(&fits(3, (0.1, [0.0; 2]), (0.003, 0.003, 0.0)));
        assert!(few.multiplicative[1] > 0.0 && few.additive1[1] > 0.0, "{few:?}");
        let none = Share::of([false; 8]);
        assert!(none.part == 0.0 && (none.error - (0.1f64 * 0.9 / 8.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn rank_correlations_are_those_of_scipy() {
        // scipy.stats.spearmanr([1, 2, 3, 4, 5], [5, 6, 7, 8, 7]).
        let pairs = [[1.0, 5.0], [2.0, 6.0], [3.0, 7.0], [4.0, 8.0], [5.0, 7.0], [f64::NAN, 0.0]];
        assert!((rank_correlation(&pairs) - 0.820_782_681_668_123_3).abs() < 1e-14);
        assert!(rank_correlation(&[]).is_nan());
    }
}
