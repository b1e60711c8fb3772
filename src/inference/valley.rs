//! Coordinates in which a curved, narrow posterior is straight: what the samplers move in.
//!
//! Lens models have directions that the image hardly constrains, and others that it constrains to 1e-3; the valley of
//! good models bends along the first by many widths of the second, and a sampler has to creep. With the eigenvectors of
//! the metric at the maximum, scaled to unit posterior width, z = z₀ + B·x; the first `slow` coordinates of x are those
//! of the weakest directions. y is x with the fast coordinates counted from the floor of the valley,
//!
//! x_slow = y_slow,   x_fast = y_fast + P(y_slow),
//!
//! P a cubic polynomial through points where the posterior was maximised over the fast coordinates. The map is one-to-one
//! with a constant determinant for any P: it changes how fast a sampler is, never what it samples.

use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::image_likelihood::ImageLikelihood;
use super::latent::LatentLikelihood;
use super::start::Start;
use crate::error::{Error, Result};
use crate::numerics::random::{self, stream};

/// The coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Valley {
    origin: DVector<f64>,
    /// Columns: directions of unit posterior width, the weakest first.
    basis: DMatrix<f64>,
    slow: usize,
    /// Coefficients of P: one row a fast coordinate, one column a monomial.
    floor: DMatrix<f64>,
}

/// Directions count as slow if the posterior is wider than this along them, in prior standard deviations.
const SLOW_WIDTH: f64 = 0.08;
/// More would need too many points for a cubic.
const MOST_SLOW: usize = 7;
/// Points of the design beyond the number of monomials, as a multiple of it.
const POINTS_A_MONOMIAL: f64 = 1.0;
/// The valley is followed outwards in steps of these fractions of the way.
const STAGES: [f64; 3] = [0.4, 0.7, 1.0];
/// Iterations at each of them.
const ITERATIONS: usize = 4;
/// Spread of the design in posterior standard deviations, and the farthest of its coordinates.
const SPREAD: f64 = 1.3;
const FARTHEST: f64 = 2.6;

/// A point on the floor and how much better the maximum is.
struct FloorPoint {
    slow: Vec<f64>,
    fast: DVector<f64>,
    drop: f64,
}

impl Valley {
    /// Straight coordinates along the eigenvectors of the metric at `start`.
    ///
    /// # Errors
    /// A metric that is not positive definite.
    fn straight(start: &Start) -> Result<Self> {
        let eigen = start.metric.clone().symmetric_eigen();
        let mut order: Vec<usize> = (0..start.latent.len()).collect();
        order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
        if order.first().is_some_and(|first| !(eigen.eigenvalues[*first] > 0.0)) {
            return Err(Error::out_of_range("the metric at the start", "indefinite", "positive definite"));
        }
        let widths: Vec<f64> = order.iter().map(|i| eigen.eigenvalues[*i].sqrt().recip()).collect();
        let columns: Vec<DVector<f64>> =
            order.iter().zip(&widths).map(|(i, width)| eigen.eigenvectors.column(*i) * *width).collect();
        let slow = widths.iter().filter(|width| **width > SLOW_WIDTH).count().min(MOST_SLOW);
        let fast = start.latent.len() - slow;
        Ok(Self {
            origin: DVector::from_column_slice(&start.latent),
            basis: DMatrix::from_columns(&columns),
            slow,
            floor: DMatrix::zeros(fast, monomials(&vec![0.0; slow]).0.len()),
        })
    }

    /// Follows the valley of `likelihood` away from its maximum `start`; the same for any number of threads.
    ///
    /// # Errors
    /// A metric that is not positive definite.
    pub fn around(likelihood: &ImageLikelihood, start: &Start, seed: u64) -> Result<Self> {
        let mut valley = Self::straight(start)?;
        if valley.slow == 0 || valley.floor.nrows() == 0 {
            return Ok(valley);
        }
        let points = (valley.floor.ncols() as f64 * POINTS_A_MONOMIAL).ceil() as u64;
        let found: Vec<FloorPoint> = (0..points)
            .into_par_iter()
            .flat_map_iter(|i| {
                let mut rng = stream(seed, i, random::Stage::Valley, 0);
                let mut draw = || -> f64 {
                    let normal: f64 = StandardNormal.sample(&mut rng);
                    (SPREAD * normal).clamp(-FARTHEST, FARTHEST)
                };
                let slow: Vec<f64> = (0..valley.slow).map(|_| draw()).collect();
                valley.follow(likelihood, start.log_posterior, &slow)
            })
            .collect();
        if let Some(floor) = valley.fitted(&found) {
            valley.floor = floor;
        }
        Ok(valley)
    }

    /// The floor along the way out to `slow`.
    fn follow(&self, likelihood: &ImageLikelihood, best: f64, slow: &[f64]) -> Vec<FloorPoint> {
        let fast_basis = self.basis.columns(self.slow, self.floor.nrows()).into_owned();
        let mut fast = DVector::zeros(self.floor.nrows());
        let mut points = Vec::new();
        let mut before = (0.0, fast.clone());
        for stage in STAGES {
            let here: Vec<f64> = slow.iter().map(|s| s * stage).collect();
            // On along the parabola through the maximum and the last point.
            if before.0 > 0.0 {
                fast = &before.1 * (stage / before.0 as f64).powi(2);
            }
            let at = |fast: &DVector<f64>| {
                let x = DVector::from_iterator(self.origin.len(), here.iter().chain(fast.iter()).copied());
                likelihood.curvature((&self.origin + &self.basis * x).as_slice())
            };
            let Some(mut curvature) = at(&fast).or_else(|| at(&before.1)) else { break };
            let mut damping = 1e-3;
            for _ in 0..ITERATIONS {
                let mut matrix = fast_basis.tr_mul(&(&curvature.metric * &fast_basis));
                for i in 0..matrix.nrows() {
                    matrix[(i, i)] *= 1.0 + damping;
                }
                let Some(factor) = matrix.cholesky() else { break };
                let moved = &fast + factor.solve(&fast_basis.tr_mul(&curvature.gradient));
                match at(&moved) {
                    Some(there) if there.log_posterior > curvature.log_posterior => {
                        let gain = there.log_posterior - curvature.log_posterior;
                        (fast, curvature, damping) = (moved, there, 0.1 * damping);
                        if gain < 0.05 {
                            break;
                        }
                    }
                    _ => damping = (10.0 * damping).max(1e-2),
                }
            }
            points.push(FloorPoint { slow: here, fast: fast.clone(), drop: best - curvature.log_posterior });
            before = (stage, fast.clone());
        }
        points
    }

    /// The cubic through the points, those far below the maximum counting little; `None` if there are too few.
    fn fitted(&self, points: &[FloorPoint]) -> Option<DMatrix<f64>> {
        /// Drop in ln p per slow coordinate at which a point counts by e⁻¹.
        const TEMPERATURE: f64 = 2.0;
        const RIDGE: f64 = 1e-3;
        let count = self.floor.ncols();
        let mut left = DMatrix::identity(count, count) * RIDGE;
        let mut right = DMatrix::zeros(count, self.floor.nrows());
        for point in points {
            let weight = (-point.drop.max(0.0) / (TEMPERATURE * self.slow as f64)).exp();
            let row = DVector::from_vec(monomials(&point.slow).0);
            left.ger(weight, &row, &row, 1.0);
            right.ger(weight, &row, &point.fast, 1.0);
        }
        Some(left.cholesky()?.solve(&right).transpose())
    }

    /// z of y.
    pub fn latent(&self, y: &[f64]) -> Vec<f64> {
        let (slow, fast) = y.split_at(self.slow);
        let floor = &self.floor * DVector::from_vec(monomials(slow).0);
        let fast = fast.iter().zip(floor.iter()).map(|(y, floor)| y + floor);
        let x = DVector::from_iterator(y.len(), slow.iter().copied().chain(fast));
        (&self.origin + &self.basis * x).as_slice().to_vec()
    }

    /// Derivatives by y from those by z.
    fn pull_back(&self, y: &[f64], by_latent: &DVector<f64>) -> DVector<f64> {
        let mut by_x = self.basis.tr_mul(by_latent);
        let by_monomial = self.floor.tr_mul(&by_x.rows(self.slow, self.floor.nrows()));
        let slopes = monomials(&y[..self.slow]).1;
        for (i, slopes) in slopes.iter().enumerate() {
            by_x[i] += slopes.iter().zip(by_monomial.iter()).map(|(s, b)| s * b).sum::<f64>();
        }
        by_x
    }
}

/// Monomials of second and third degree, and of each variable their derivatives.
///
/// The maximum lies on the floor and the eigenvectors are conjugate, so that P has no constant and no linear term.
fn monomials(s: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let k = s.len();
    let (mut values, mut slopes) = (Vec::new(), vec![Vec::new(); k]);
    for a in 0..k {
        for b in a..k {
            values.push(s[a] * s[b]);
            for (i, slopes) in slopes.iter_mut().enumerate() {
                let of = |own: usize, other: f64| if own == i { other } else { 0.0 };
                slopes.push(of(a, s[b]) + of(b, s[a]));
            }
            for c in b..k {
                values.push(s[a] * s[b] * s[c]);
                for (i, slopes) in slopes.iter_mut().enumerate() {
                    let of = |own: usize, other: f64| if own == i { other } else { 0.0 };
                    slopes.push(of(a, s[b] * s[c]) + of(b, s[a] * s[c]) + of(c, s[a] * s[b]));
                }
            }
        }
    }
    (values, slopes)
}

/// A likelihood in the coordinates of a valley, with the standard normal prior of the samplers taken out again.
pub(super) struct InValley<'a> {
    pub likelihood: &'a ImageLikelihood,
    pub valley: &'a Valley,
}

impl InValley<'_> {
    /// ½|y|² − ½|z|²: what turns ln L(z) into the likelihood over y.
    pub fn prior_ratio(y: &[f64], z: &[f64]) -> f64 {
        let half_square = |v: &[f64]| 0.5 * v.iter().map(|v| v * v).sum::<f64>();
        half_square(y) - half_square(z)
    }
}

impl LatentLikelihood for InValley<'_> {
    fn dimension(&self) -> usize {
        self.valley.origin.len()
    }

    fn log_likelihood(&self, y: &[f64]) -> f64 {
        let z = self.valley.latent(y);
        self.likelihood.log_likelihood(&z) + Self::prior_ratio(y, &z)
    }

    fn log_likelihood_gradient(&self, y: &[f64], gradient: &mut [f64]) -> f64 {
        let z = self.valley.latent(y);
        let value = self.likelihood.log_likelihood_gradient(&z, gradient);
        let by_latent = DVector::from_iterator(z.len(), gradient.iter().zip(&z).map(|(g, z)| g - z));
        let by_y = self.valley.pull_back(y, &by_latent);
        for ((gradient, by_y), y) in gradient.iter_mut().zip(by_y.iter()).zip(y) {
            *gradient = by_y + y;
        }
        value + Self::prior_ratio(y, &z)
    }
}
