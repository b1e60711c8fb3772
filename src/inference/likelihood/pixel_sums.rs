//! The noise of pixels and the sums over them that amplitudes are solved with, in one pass over the images.

use nalgebra::{DMatrix, DVector};

use super::observation::Observation;
use crate::imaging::Noise;
use crate::numerics::dispatch::kernel;
use crate::numerics::elementary::Elementary;
use crate::numerics::real::{LANES, Lanes, Real};

/// The density of the data of a pixel given a model of it, by the noise that the model has.
#[derive(Clone, Copy)]
pub(super) struct PixelDensity(pub Noise);

impl PixelDensity {
    /// Variance at a model and its derivative by the model.
    #[inline(always)]
    fn variance(self, model: Lanes) -> [Lanes; 2] {
        let slope = Lanes::splat(1.0 / self.0.exposure_s).unless_below(model, f64::MIN_POSITIVE, 0.0);
        [self.0.variance(model), slope]
    }

    /// ℓ without the constant −½ ln 2π.
    #[inline(always)]
    pub fn log_density(self, data: Lanes, model: Lanes) -> Lanes {
        let [v, _] = self.variance(model);
        let r = data - model;
        (r * r / v + v.ln()) * -0.5
    }

    /// ℓ′ and −ℓ″.
    #[inline(always)]
    pub fn expand(self, data: Lanes, model: Lanes) -> [Lanes; 2] {
        let [v, dv] = self.variance(model);
        let (inverse, r) = (Lanes::splat(1.0) / v, data - model);
        let w = dv * inverse;
        let pull = r * inverse;
        let first = pull + (dv * pull * pull - w) * 0.5;
        let curvature = inverse + pull * w * 2.0 + pull * pull * dv * w - w * w * 0.5;
        [first, curvature]
    }

    /// 1/v of the data.
    #[inline(always)]
    pub fn weight(self, data: Lanes) -> Lanes {
        Lanes::splat(1.0) / self.variance(data)[0]
    }

    /// −½(d−m)²/v(m), its derivative by m, and 1/v(d).
    #[inline(always)]
    pub fn chi_squared(self, data: Lanes, model: Lanes) -> [Lanes; 3] {
        let [v, dv] = self.variance(model);
        let r = data - model;
        let pull = r / v;
        [r * pull * -0.5, pull + dv * pull * pull * 0.5, self.weight(data)]
    }

    /// f = 1/v + ½(v′/v)² and f′.
    #[inline(always)]
    pub fn information(self, model: Lanes) -> [Lanes; 2] {
        let [v, dv] = self.variance(model);
        let inverse = Lanes::splat(1.0) / v;
        let w = dv * inverse;
        [inverse + w * w * 0.5, -(inverse * w) - w * w * w]
    }
}

/// What the sums over pixels are weighted by.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Weights {
    /// 1/v of the data, as for least squares: d/v and 1/v.
    Data,
    /// ℓ′ and −ℓ″ of the model; the value is Σℓ if it is asked for.
    Expansion { with_value: bool },
    /// 0 and the Fisher information f of the model; the value is Σℓ.
    Information,
    /// −½∂χ²/∂m with the variance of the model, and 1/v of the data; the value is −½χ².
    ChiSquared,
}

/// Sums over the pixels in use: Σℓ or −½χ², Σ w₁B and Σ w₂BBᵀ.
pub(super) struct Sums {
    pub value: f64,
    pub linear: DVector<f64>,
    pub quadratic: DMatrix<f64>,
}

impl Sums {
    pub fn of(observation: &Observation, lights: &[Vec<f64>], amplitudes: &[f64], weights: Weights) -> Self {
        let k = lights.len();
        let mut sums = vec![Lanes::ZERO; 1 + k + k * k];
        sum_pixels(observation, lights, amplitudes, weights, &mut sums);
        let sums: Vec<f64> = sums.into_iter().map(Lanes::sum).collect();
        let (linear, quadratic) = sums[1..].split_at(k);
        Self {
            value: sums[0],
            linear: DVector::from_column_slice(linear),
            quadratic: DMatrix::from_fn(k, k, |i, j| quadratic[i.max(j) * k + i.min(j)]),
        }
    }
}

kernel! {
    /// The value, the vector and the lower half of the matrix of [`Sums`], in one pass over the images.
    fn sum_pixels(
        observation: &Observation,
        lights: &[Vec<f64>],
        amplitudes: &[f64],
        weights: Weights,
        sums: &mut [Lanes],
    ) {
        let noise = PixelDensity(observation.noise());
        let (value, rest) = sums.split_at_mut(1);
        let (linear, quadratic) = rest.split_at_mut(lights.len());
        for start in (0..observation.data_e_s.len()).step_by(LANES) {
            let data = Lanes::load(&observation.data_e_s, start);
            let mut model = Lanes::ZERO;
            for (light, a) in lights.iter().zip(amplitudes) {
                model += Lanes::load(light, start) * *a;
            }
            let weighed = match weights {
                Weights::Data => {
                    let weight = noise.weight(data);
                    [Lanes::ZERO, data * weight, weight]
                }
                Weights::ChiSquared => noise.chi_squared(data, model),
                Weights::Expansion { with_value } => {
                    let [first, curvature] = noise.expand(data, model);
                    let value = if with_value { noise.log_density(data, model) } else { Lanes::ZERO };
                    [value, first, curvature]
                }
                Weights::Information => {
                    [noise.log_density(data, model), Lanes::ZERO, noise.information(model)[0]]
                }
            };
            let used = Lanes::load_flags(&observation.used, start);
            let [own, first, second] = weighed.map(|v| v.unless_below(used, 1.0, 0.0));
            value[0] += own;
            for (i, light) in lights.iter().enumerate() {
                let light = Lanes::load(light, start);
                linear[i] += first * light;
                let scaled = second * light;
                for (other, sum) in lights.iter().zip(&mut quadratic[i * lights.len()..][..=i]) {
                    *sum += scaled * Lanes::load(other, start);
                }
            }
        }
    }
}

/// Aᵀ diag(w) A for the columns of A, one number for each pixel; the same bits on every processor.
pub(super) fn weighted_gram(weights: &[f64], columns: &[&[f64]]) -> DMatrix<f64> {
    let k = columns.len();
    let mut sums = vec![Lanes::ZERO; k * k];
    sum_products(weights, columns, &mut sums);
    DMatrix::from_fn(k, k, |i, j| sums[i.max(j) * k + i.min(j)].sum())
}

kernel! {
    /// The lower half of [`weighted_gram`], row by row.
    fn sum_products(weights: &[f64], columns: &[&[f64]], sums: &mut [Lanes]) {
        for start in (0..weights.len()).step_by(LANES) {
            let weight = Lanes::load_or_zero(weights, start);
            for (i, column) in columns.iter().enumerate() {
                let scaled = weight * Lanes::load(column, start);
                for (other, sum) in columns.iter().zip(&mut sums[i * columns.len()..][..=i]) {
                    *sum += scaled * Lanes::load(other, start);
                }
            }
        }
    }
}
