//! Posteriors with known answers for the samplers.

use haloray::inference::{Curvature, LatentLikelihood, NoCurvature};
use nalgebra::{DMatrix, DVector};

/// A normal likelihood exp(−½(z − m)ᵀP(z − m)) in many correlated dimensions.
pub struct Normal {
    precision: DMatrix<f64>,
    centre: DVector<f64>,
}

impl Normal {
    /// Widths from 0.003 to about 1, correlations up to 0.99 and more.
    pub fn correlated(dimension: usize) -> Self {
        let width = |i: usize| 0.003 * (300.0_f64).powf(i as f64 / dimension as f64);
        let root = DMatrix::from_fn(dimension, dimension, |i, j| match i.cmp(&j) {
            std::cmp::Ordering::Greater => 0.9_f64.powi((i - j) as i32) / width(j),
            std::cmp::Ordering::Equal => 1.0 / width(i),
            std::cmp::Ordering::Less => 0.0,
        });
        let centre = DVector::from_fn(dimension, |i, _| (i as f64).sin());
        Self { precision: &root * root.transpose(), centre }
    }

    /// Precision of the posterior: that of the likelihood and of the prior.
    pub fn metric(&self) -> DMatrix<f64> {
        let dimension = self.centre.len();
        &self.precision + DMatrix::identity(dimension, dimension)
    }

    /// Covariance of the posterior.
    pub fn covariance(&self) -> DMatrix<f64> {
        self.metric().try_inverse().unwrap()
    }

    /// Mean of the posterior.
    pub fn mean(&self) -> DVector<f64> {
        self.covariance() * &self.precision * &self.centre
    }

    /// Analytic evidence: ln ∫ L N(z; 0, 1) dz.
    pub fn log_evidence(&self) -> f64 {
        let (mean, metric) = (self.mean(), self.metric());
        let at_mode = self.log_likelihood(mean.as_slice()) - 0.5 * mean.norm_squared();
        at_mode - 0.5 * metric.symmetric_eigenvalues().iter().map(|value| value.ln()).sum::<f64>()
    }
}

impl LatentLikelihood for Normal {
    fn dimension(&self) -> usize {
        self.centre.len()
    }

    fn log_likelihood(&self, latent: &[f64]) -> f64 {
        self.log_likelihood_gradient(latent, &mut vec![0.0; latent.len()])
    }

    fn log_likelihood_gradient(&self, latent: &[f64], gradient: &mut [f64]) -> f64 {
        let offset = DVector::from_column_slice(latent) - &self.centre;
        let slope = &self.precision * &offset;
        gradient.iter_mut().zip(slope.iter()).for_each(|(g, s)| *g = -s);
        -0.5 * offset.dot(&slope)
    }

    fn curvature(&self, latent: &[f64]) -> Result<Curvature, NoCurvature> {
        curvature(self, latent, self.metric())
    }
}

/// The curvature of a likelihood where its Fisher matrix plus one is known.
fn curvature(
    likelihood: &dyn LatentLikelihood,
    latent: &[f64],
    metric: DMatrix<f64>,
) -> Result<Curvature, NoCurvature> {
    let z = DVector::from_column_slice(latent);
    let mut gradient = vec![0.0; latent.len()];
    let log_likelihood = likelihood.log_likelihood_gradient(latent, &mut gradient);
    let log_posterior = log_likelihood - 0.5 * z.norm_squared();
    let expanded = || Curvature { log_posterior, gradient: DVector::from_vec(gradient) - z, metric };
    log_posterior.is_finite().then(expanded).ok_or(NoCurvature::ZeroLikelihood)
}

/// A ridge bent by 0.6 z₀² with a width of 0.3, over two coordinates.
pub struct Banana;

const WIDTH: f64 = 0.3;
const BEND: f64 = 0.6;

impl LatentLikelihood for Banana {
    fn dimension(&self) -> usize {
        2
    }

    fn log_likelihood(&self, z: &[f64]) -> f64 {
        -0.5 * ((z[1] - BEND * z[0] * z[0]) / WIDTH).powi(2)
    }

    fn log_likelihood_gradient(&self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let offset = (z[1] - BEND * z[0] * z[0]) / (WIDTH * WIDTH);
        gradient.copy_from_slice(&[2.0 * BEND * z[0] * offset, -offset]);
        self.log_likelihood(z)
    }

    fn curvature(&self, z: &[f64]) -> Result<Curvature, NoCurvature> {
        let row = DVector::from_vec(vec![-2.0 * BEND * z[0], 1.0]);
        curvature(self, z, &row * row.transpose() / (WIDTH * WIDTH) + DMatrix::identity(2, 2))
    }
}

/// A valley a thousandth wide that bends by hundreds of its widths: z₁ = ½z₀² and z₂ = 0.3z₀ + 0.1z₀³.
pub struct Gorge;

impl Gorge {
    const WIDTHS: [f64; 2] = [1e-3, 2e-3];

    /// The floor at z₀.
    pub fn floor(a: f64) -> [f64; 2] {
        [0.5 * a * a, 0.3 * a + 0.1 * a.powi(3)]
    }

    fn offsets(z: &[f64]) -> [f64; 2] {
        let floor = Self::floor(z[0]);
        [0, 1].map(|i| (z[1 + i] - floor[i]) / Self::WIDTHS[i])
    }

    /// ∂ of each offset.
    fn rows(z: &[f64]) -> [DVector<f64>; 2] {
        let [b, c] = Self::WIDTHS;
        let slopes = [z[0], 0.3 + 0.3 * z[0] * z[0]];
        [vec![-slopes[0] / b, 1.0 / b, 0.0], vec![-slopes[1] / c, 0.0, 1.0 / c]].map(DVector::from_vec)
    }
}

impl LatentLikelihood for Gorge {
    fn dimension(&self) -> usize {
        3
    }

    fn log_likelihood(&self, z: &[f64]) -> f64 {
        -0.5 * Self::offsets(z).iter().map(|o| o * o).sum::<f64>()
    }

    fn log_likelihood_gradient(&self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let [b, c] = Self::offsets(z);
        let [row_b, row_c] = Self::rows(z);
        gradient.copy_from_slice((row_b * -b - row_c * c).as_slice());
        self.log_likelihood(z)
    }

    fn curvature(&self, z: &[f64]) -> Result<Curvature, NoCurvature> {
        let outer = Self::rows(z).map(|row| &row * row.transpose());
        curvature(self, z, &outer[0] + &outer[1] + DMatrix::identity(3, 3))
    }
}

/// Two equal normal peaks of width 0.1 at ±(1, 0.5), of unit area each.
pub struct TwoPeaks;

/// Width of each peak.
pub const PEAK_WIDTH: f64 = 0.1;
/// Place of the first peak; the second lies opposite.
pub const PEAK: [f64; 2] = [1.0, 0.5];

impl TwoPeaks {
    /// Each peak convolved with the prior: a normal of variance 1 + s² at zero.
    pub fn log_evidence() -> f64 {
        let variance = 1.0 + PEAK_WIDTH * PEAK_WIDTH;
        let square: f64 = PEAK.iter().map(|m| m * m).sum();
        -0.5 * square / variance - (std::f64::consts::TAU * variance).ln()
    }
}

impl LatentLikelihood for TwoPeaks {
    fn dimension(&self) -> usize {
        2
    }

    fn log_likelihood(&self, z: &[f64]) -> f64 {
        let square = |sign: f64| z.iter().zip(PEAK).map(|(z, m)| (z - sign * m).powi(2)).sum::<f64>();
        let exponent = |sign| -0.5 * square(sign) / PEAK_WIDTH.powi(2);
        let (a, b): (f64, f64) = (exponent(1.0), exponent(-1.0));
        let sum = a.max(b) + (-(a - b).abs()).exp().ln_1p();
        sum - (2.0 * std::f64::consts::TAU * PEAK_WIDTH.powi(2)).ln()
    }

    fn log_likelihood_gradient(&self, _: &[f64], _: &mut [f64]) -> f64 {
        unreachable!("gradient samplers are not meant for separate peaks")
    }
}

/// A likelihood that forbids z₀ < 0 and is otherwise a normal of width 0.5 around (0.2, 0).
pub struct Truncated;

impl LatentLikelihood for Truncated {
    fn dimension(&self) -> usize {
        2
    }

    fn log_likelihood(&self, z: &[f64]) -> f64 {
        let inside = -2.0 * ((z[0] - 0.2).powi(2) + z[1] * z[1]);
        if z[0] < 0.0 { f64::NEG_INFINITY } else { inside }
    }

    fn log_likelihood_gradient(&self, z: &[f64], gradient: &mut [f64]) -> f64 {
        gradient.copy_from_slice(&[-4.0 * (z[0] - 0.2), -4.0 * z[1]]);
        self.log_likelihood(z)
    }

    fn curvature(&self, z: &[f64]) -> Result<Curvature, NoCurvature> {
        curvature(self, z, DMatrix::identity(2, 2) * 5.0)
    }
}

/// A likelihood that is zero everywhere.
pub struct Nowhere;

impl LatentLikelihood for Nowhere {
    fn dimension(&self) -> usize {
        2
    }

    fn log_likelihood(&self, _: &[f64]) -> f64 {
        f64::NEG_INFINITY
    }

    fn log_likelihood_gradient(&self, _: &[f64], _: &mut [f64]) -> f64 {
        f64::NEG_INFINITY
    }
}

/// Mean, standard deviation and kurtosis (3 of a normal) of every coordinate of a posterior.
pub struct Moments {
    pub means: Vec<f64>,
    pub deviations: Vec<f64>,
    pub kurtoses: Vec<f64>,
}

impl Moments {
    /// Those of places with weights.
    pub fn of<const N: usize>(weighted: impl Iterator<Item = ([f64; N], f64)> + Clone) -> Self {
        let total: f64 = weighted.clone().map(|(_, weight)| weight).sum();
        let sum =
            |of: &dyn Fn([f64; N]) -> f64| weighted.clone().map(|(z, weight)| weight * of(z)).sum::<f64>();
        let means: Vec<f64> = (0..N).map(|i| sum(&|z| z[i]) / total).collect();
        let central = |power: i32| -> Vec<f64> {
            (0..N).map(|i| sum(&|z| (z[i] - means[i]).powi(power)) / total).collect()
        };
        let (second, fourth) = (central(2), central(4));
        let deviations = second.iter().map(|square| square.sqrt()).collect();
        let kurtoses = second.iter().zip(&fourth).map(|(two, four)| four / (two * two)).collect();
        Self { means, deviations, kurtoses }
    }

    /// Those of the posterior of a normal likelihood.
    pub fn of_normal(normal: &Normal) -> Self {
        let covariance = normal.covariance();
        let deviations: Vec<f64> = covariance.diagonal().iter().map(|square| square.sqrt()).collect();
        Self { means: normal.mean().as_slice().to_vec(), kurtoses: vec![3.0; deviations.len()], deviations }
    }
}

/// Moments and log-evidence of a posterior over two coordinates, by quadrature on a fine grid.
pub fn by_quadrature(likelihood: &dyn LatentLikelihood) -> (Moments, f64) {
    const STEP: f64 = 0.01;
    let at = |i: i32| (f64::from(i) + 0.5) * STEP;
    let weighted: Vec<([f64; 2], f64)> = (-600..600)
        .flat_map(|i| (-600..600).map(move |j| [at(i), at(j)]))
        .map(|[x, y]| ([x, y], (likelihood.log_likelihood(&[x, y]) - 0.5 * (x * x + y * y)).exp()))
        .collect();
    let sum: f64 = weighted.iter().map(|(_, density)| density).sum();
    (Moments::of(weighted.iter().copied()), (sum * STEP * STEP / std::f64::consts::TAU).ln())
}
