//! What the floors found so far say of others: polynomials fitted to all of them, and what the nearest say of their error.

use multiversion::multiversion;
use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::least_squares::LeastSquares;
use super::monomials::Monomials;
use crate::inference::bits;
use crate::inference::floor::Floor;

/// What is remembered of a floor while the surrogate is made.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Known {
    #[serde(with = "bits::matrix")]
    s: DVector<f64>,
    /// ln p and ½ ln det on the floor.
    #[serde(with = "bits")]
    heights: Vec<f64>,
    #[serde(with = "bits::matrix")]
    slope: DVector<f64>,
    #[serde(with = "bits::matrix")]
    stiff: DVector<f64>,
    #[serde(with = "bits::matrix")]
    bend: DMatrix<f64>,
}

impl Known {
    pub fn new(s: DVector<f64>, floor: &Floor) -> Self {
        Self {
            s,
            heights: vec![floor.log_density, floor.half_log_determinant()],
            slope: floor.slope.clone(),
            stiff: floor.stiff.clone(),
            bend: floor.bend.clone(),
        }
    }
}

/// Polynomials of x = F⁻¹(s − c): ln p along the floor and t̂ up to degree 6, fitted to values and slopes; ½ ln det up to
/// degree 2, fitted to values. The floors they were fitted to are kept: their error there is interpolated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Surrogate {
    /// ln p that the polynomials count from.
    #[serde(with = "bits::number")]
    top: f64,
    #[serde(with = "bits::matrix")]
    centre: DVector<f64>,
    #[serde(with = "bits::matrix")]
    factor: DMatrix<f64>,
    floor_terms: Monomials,
    /// A column for ln p, then one for every t.
    #[serde(with = "bits::matrix")]
    floor: DMatrix<f64>,
    determinant_terms: Monomials,
    #[serde(with = "bits::matrix")]
    determinant: DMatrix<f64>,
    /// What the polynomials were fitted to, and x of each, a row a floor.
    known: Vec<Known>,
    #[serde(with = "bits::matrix")]
    anchors: DMatrix<f64>,
}

impl Surrogate {
    /// Least squares over what is known, `centre` and `factor` (lower triangular) giving the scale; `None` for matrices
    /// that are not positive definite.
    pub fn fit(centre: DVector<f64>, factor: DMatrix<f64>, known: Vec<Known>) -> Option<Self> {
        /// Equations for every coefficient, and coefficients that are still quickly fitted and evaluated.
        const EQUATIONS: f64 = 4.0;
        const MOST_EQUATIONS: usize = 16;
        const MOST_COEFFICIENTS: usize = 800;
        let d = centre.len();
        let degree_for = |highest: usize, equations: usize| {
            let is_enough = |degree: &usize| {
                let coefficients = Monomials::count(d, *degree);
                coefficients as f64 * EQUATIONS <= equations as f64 && coefficients <= MOST_COEFFICIENTS
            };
            (2..=highest).rev().find(is_enough)
        };
        let floor_terms = Monomials::new(d, degree_for(6, known.len() * (1 + d)).unwrap_or(2));
        let determinant_terms = Monomials::new(d, degree_for(2, known.len()).unwrap_or(1));
        let top = known.iter().map(|k| k.heights[0]).fold(f64::NEG_INFINITY, f64::max);
        let stiff = known.first()?.stiff.len();
        // Every so many floors determine the polynomials well enough.
        let stride = (known.len() * (1 + d)).div_ceil(MOST_EQUATIONS * floor_terms.degrees().len());
        let mut of_floor = LeastSquares::new(&floor_terms, known.len().div_ceil(stride) * (1 + d), 1 + stiff);
        let mut of_determinant = LeastSquares::new(&determinant_terms, known.len(), 1);
        let mut anchors = DMatrix::zeros(known.len(), d);
        for (i, k) in known.iter().enumerate() {
            let x = factor.solve_lower_triangular(&(&k.s - &centre))?;
            anchors.set_row(i, &x.transpose());
            if i % stride > 0 {
                continue;
            }
            // What lies far below the top hardly matters, and bends in its own way.
            let depth = (top - k.heights[0]) / d as f64;
            let weight = 1.0 / (1.0 + depth * depth);
            let values = floor_terms.values(x.as_slice());
            let slopes = floor_terms.slopes(x.as_slice(), &values);
            let (slope, bend) = (factor.tr_mul(&k.slope), &k.bend * &factor);
            let mut targets = vec![k.heights[0] - top];
            targets.extend(k.stiff.iter());
            of_floor.add(weight, &values, &targets);
            for a in 0..d {
                let terms: Vec<f64> = slopes.iter().skip(a).step_by(d).copied().collect();
                targets.clear();
                targets.push(slope[a]);
                targets.extend(bend.column(a).iter());
                of_floor.add(weight, &terms, &targets);
            }
            of_determinant.add(weight, &determinant_terms.values(x.as_slice()), &k.heights[1..]);
        }
        let floor = of_floor.solve(|degree| if degree > 2 { 0.05 } else { 1e-6 })?;
        let determinant = of_determinant.solve(|degree| if degree > 0 { 0.1 } else { 1e-6 })?;
        Some(Self { top, centre, factor, floor_terms, floor, determinant_terms, determinant, known, anchors })
    }

    /// Centre and scale: x = F⁻¹(s − c).
    pub fn scale(&self) -> (&DVector<f64>, &DMatrix<f64>) {
        (&self.centre, &self.factor)
    }

    /// s of x.
    pub fn s(&self, x: &DVector<f64>) -> DVector<f64> {
        &self.centre + &self.factor * x
    }

    /// x of s.
    pub fn x(&self, s: &DVector<f64>) -> DVector<f64> {
        let mut x = s - &self.centre;
        // The factor of a positive-definite matrix has no zero on its diagonal.
        self.factor.solve_lower_triangular_mut(&mut x);
        x
    }

    /// The polynomials' log-marginal up to a constant, and ∂/∂x of it.
    pub fn smooth(&self, x: &[f64]) -> (f64, DVector<f64>) {
        let (floor, by_floor) = self.floor_terms.polynomial(first_column(&self.floor), x);
        let (determinant, by_determinant) =
            self.determinant_terms.polynomial(first_column(&self.determinant), x);
        (floor - determinant, by_floor - by_determinant)
    }

    /// The log-marginal up to a constant: that of the polynomials, corrected by what the nearest floors say of their error.
    pub fn log_marginal(&self, x: &DVector<f64>) -> f64 {
        /// Larger errors are walls, which say nothing of what lies before them.
        const LARGEST: f64 = 6.0;
        let error = |(i, weight): (usize, f64)| {
            let (anchor, known) = (self.anchors.row(i).transpose(), &self.known[i]);
            let (smooth, by_x) = self.smooth(anchor.as_slice());
            let slope = self.factor.tr_mul(&known.slope) - by_x;
            let error =
                known.heights[0] - known.heights[1] - self.top - smooth + 0.5 * slope.dot(&(x - &anchor));
            weight * error.clamp(-LARGEST, LARGEST)
        };
        self.smooth(x.as_slice()).0 + self.nearest(x).into_iter().map(error).sum::<f64>()
    }

    /// t̂, about, corrected likewise.
    pub fn stiff(&self, x: &DVector<f64>) -> DVector<f64> {
        let of = |values: Vec<f64>| {
            self.floor.columns(1, self.floor.ncols() - 1).tr_mul(&DVector::from_vec(values))
        };
        let mut stiff = of(self.floor_terms.values(x.as_slice()));
        for (i, weight) in self.nearest(x) {
            let (anchor, known) = (self.anchors.row(i).transpose(), &self.known[i]);
            let half = (x - &anchor) * 0.5;
            let mut values = self.floor_terms.values(anchor.as_slice());
            let slopes = self.floor_terms.slopes(anchor.as_slice(), &values);
            for (value, slope) in values.iter_mut().zip(slopes.chunks_exact(half.len())) {
                *value += slope.iter().zip(half.iter()).map(|(slope, x)| slope * x).sum::<f64>();
            }
            stiff += (&known.stiff + &known.bend * (&self.factor * half) - of(values)) * weight;
        }
        stiff
    }

    /// The floors nearest to x, with weights that fall with distance and add up to one.
    ///
    /// An error interpolated between two floors from their values and half of their slopes is that of Hermite's cubic
    /// halfway between them.
    fn nearest(&self, x: &DVector<f64>) -> Vec<(usize, f64)> {
        const NEIGHBOURS: usize = 8;
        const TINY: f64 = 1e-12;
        let mut nearest: Vec<(usize, f64)> = Vec::with_capacity(NEIGHBOURS + 1);
        let mut farthest = f64::INFINITY;
        for (i, squared) in squared_distances(self.anchors.as_slice(), x.as_slice()).into_iter().enumerate() {
            if squared < farthest {
                nearest.insert(nearest.partition_point(|(_, nearer)| *nearer <= squared), (i, squared));
                nearest.truncate(NEIGHBOURS);
                farthest = nearest.get(NEIGHBOURS - 1).map_or(f64::INFINITY, |last| last.1);
            }
        }
        nearest.iter_mut().for_each(|(_, weight)| *weight = (*weight + TINY).powi(-2));
        let sum: f64 = nearest.iter().map(|(_, weight)| weight).sum();
        nearest.iter_mut().for_each(|(_, weight)| *weight /= sum);
        nearest
    }

    /// The floors it was fitted to.
    pub fn known(&self) -> &[Known] {
        &self.known
    }
}

fn first_column(matrix: &DMatrix<f64>) -> &[f64] {
    &matrix.as_slice()[..matrix.nrows()]
}

/// Squared distances of points from x; `points` holds all first coordinates, then all second ones, and so on.
#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn squared_distances(points: &[f64], x: &[f64]) -> Vec<f64> {
    let n = points.len() / x.len();
    let mut squared = vec![0.0; n];
    for (coordinates, x) in points.chunks_exact(n).zip(x) {
        for (squared, coordinate) in squared.iter_mut().zip(coordinates) {
            *squared += (coordinate - x) * (coordinate - x);
        }
    }
    squared
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_found_again() {
        // ln p = −x₀² − x₁⁴ and t = x₀ x₁² of x = (s₀/2, s₁), known at a grid of points.
        let factor = DMatrix::from_diagonal(&DVector::from_vec(vec![2.0, 1.0]));
        let known: Vec<Known> = (0..49)
            .map(|i| {
                let (x, y) = (f64::from(i % 7) / 3.0 - 1.0, f64::from(i / 7) / 3.0 - 1.0);
                Known {
                    s: DVector::from_vec(vec![2.0 * x, y]),
                    heights: vec![-x * x - y.powi(4), 0.2 * x],
                    slope: DVector::from_vec(vec![-x, -4.0 * y.powi(3)]),
                    stiff: DVector::from_vec(vec![x * y * y]),
                    bend: DMatrix::from_row_slice(1, 2, &[0.5 * y * y, 2.0 * x * y]),
                }
            })
            .collect();
        let surrogate = Surrogate::fit(DVector::zeros(2), factor, known).unwrap();
        let x = DVector::from_vec(vec![0.4, -0.5]);
        let want = [-2.0 * 0.4 - 0.2, 4.0 * 0.125];
        let (value, force) = surrogate.smooth(x.as_slice());
        assert!((0..2).all(|a| (force[a] - want[a]).abs() < 0.02), "{force}");
        let want = -0.4 * 0.4 - 0.0625 - 0.2 * 0.4;
        assert!((value - surrogate.smooth(&[0.0, 0.0]).0 - want).abs() < 0.02, "{value}");
        assert!((surrogate.stiff(&x)[0] - 0.4 * 0.25).abs() < 1e-3);
        assert!((surrogate.x(&surrogate.s(&x)) - &x).amax() < 1e-15);
        let text = serde_json::to_string(&surrogate).unwrap();
        assert_eq!(serde_json::from_str::<Surrogate>(&text).unwrap(), surrogate);
    }

    #[test]
    fn floors_nearby_correct_what_no_polynomial_follows() {
        // ln p = cos 5x and t = sin 5x, known three times a period.
        let known: Vec<Known> = (-15..=15)
            .map(|i| {
                let x = 0.4 * f64::from(i);
                let (sin, cos) = (5.0 * x).sin_cos();
                Known {
                    s: DVector::from_vec(vec![x]),
                    heights: vec![cos, 0.0],
                    slope: DVector::from_vec(vec![-5.0 * sin]),
                    stiff: DVector::from_vec(vec![sin]),
                    bend: DMatrix::from_vec(1, 1, vec![5.0 * cos]),
                }
            })
            .collect();
        let surrogate = Surrogate::fit(DVector::zeros(1), DMatrix::identity(1, 1), known).unwrap();
        let zero = surrogate.log_marginal(&DVector::zeros(1));
        let error =
            |x: f64| surrogate.log_marginal(&DVector::from_vec(vec![x])) - zero - ((5.0 * x).cos() - 1.0);
        assert!((-10..10).all(|i| error(0.4 * f64::from(i)).abs() < 1e-6));
        assert!((-10..10).all(|i| error(0.4 * f64::from(i) + 0.2).abs() < 0.3));
        assert!((-10..10).all(|i| {
            let x = 0.4 * f64::from(i) + 0.2;
            (surrogate.stiff(&DVector::from_vec(vec![x]))[0] - (5.0 * x).sin()).abs() < 0.3
        }));
    }
}
