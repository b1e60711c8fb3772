//! Polynomials fitted to the floors found so far: forces for trajectories, and where to look for the next floor.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

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
/// degree 2, fitted to values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Surrogate {
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
}

impl Surrogate {
    /// Least squares over what is known, `centre` and `factor` (lower triangular) giving the scale; `None` for matrices
    /// that are not positive definite.
    pub fn fit(centre: DVector<f64>, factor: DMatrix<f64>, known: &[Known]) -> Option<Self> {
        /// Equations for every coefficient, and coefficients that are still quickly evaluated.
        const EQUATIONS: f64 = 4.0;
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
        let mut of_floor = LeastSquares::new(&floor_terms, known.len() * (1 + d), 1 + stiff);
        let mut of_determinant = LeastSquares::new(&determinant_terms, known.len(), 1);
        for k in known {
            let x = factor.solve_lower_triangular(&(&k.s - &centre))?;
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
        Some(Self { centre, factor, floor_terms, floor, determinant_terms, determinant })
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

    /// ∂/∂x of the log-marginal.
    pub fn force(&self, x: &DVector<f64>) -> DVector<f64> {
        let slope = |terms: &Monomials, coefficients: &DMatrix<f64>| {
            let slopes = terms.slopes(x.as_slice(), &terms.values(x.as_slice()));
            let mut sum = DVector::zeros(x.len());
            for (row, coefficient) in slopes.chunks_exact(x.len()).zip(coefficients.column(0).iter()) {
                sum.iter_mut().zip(row).for_each(|(sum, slope): (&mut f64, _)| *sum += coefficient * slope);
            }
            sum
        };
        slope(&self.floor_terms, &self.floor) - slope(&self.determinant_terms, &self.determinant)
    }

    /// t̂, about.
    pub fn stiff(&self, x: &DVector<f64>) -> DVector<f64> {
        let values = DVector::from_vec(self.floor_terms.values(x.as_slice()));
        self.floor.columns(1, self.floor.ncols() - 1).tr_mul(&values)
    }
}

/// Weighted equations for the coefficients of a polynomial.
struct LeastSquares<'a> {
    terms: &'a Monomials,
    /// A column an equation.
    design: DMatrix<f64>,
    targets: DMatrix<f64>,
    equations: usize,
}

impl<'a> LeastSquares<'a> {
    fn new(terms: &'a Monomials, equations: usize, targets: usize) -> Self {
        let design = DMatrix::zeros(terms.degrees().len(), equations);
        Self { terms, design, targets: DMatrix::zeros(targets, equations), equations: 0 }
    }

    fn add(&mut self, weight: f64, terms: &[f64], targets: &[f64]) {
        for (matrix, values) in [(&mut self.design, terms), (&mut self.targets, targets)] {
            matrix.column_mut(self.equations).iter_mut().zip(values).for_each(|(m, v)| *m = weight * v);
        }
        self.equations += 1;
    }

    /// Coefficients, a column a target, held near zero by a penalty that depends on the degree.
    fn solve(&self, penalty: impl Fn(usize) -> f64) -> Option<DMatrix<f64>> {
        let mut normal = &self.design * self.design.transpose();
        for (i, degree) in self.terms.degrees().iter().enumerate() {
            normal[(i, i)] += penalty(*degree);
        }
        Some(normal.cholesky()?.solve(&(&self.design * self.targets.transpose())))
    }
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
        let surrogate = Surrogate::fit(DVector::zeros(2), factor, &known).unwrap();
        let x = DVector::from_vec(vec![0.4, -0.5]);
        let want = [-2.0 * 0.4 - 0.2, 4.0 * 0.125];
        let force = surrogate.force(&x);
        assert!((0..2).all(|a| (force[a] - want[a]).abs() < 0.02), "{force}");
        assert!((surrogate.stiff(&x)[0] - 0.4 * 0.25).abs() < 1e-3);
        assert!((surrogate.x(&surrogate.s(&x)) - &x).amax() < 1e-15);
        let text = serde_json::to_string(&surrogate).unwrap();
        assert_eq!(serde_json::from_str::<Surrogate>(&text).unwrap(), surrogate);
    }
}
