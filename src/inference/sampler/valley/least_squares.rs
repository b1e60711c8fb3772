//! Weighted least squares for the coefficients of polynomials.

use nalgebra::DMatrix;

use super::monomials::Monomials;

/// Weighted equations for the coefficients of a polynomial.
pub(super) struct LeastSquares<'a> {
    terms: &'a Monomials,
    /// A column an equation.
    design: DMatrix<f64>,
    targets: DMatrix<f64>,
    equations: usize,
}

impl<'a> LeastSquares<'a> {
    /// None yet; room for so many.
    pub fn new(terms: &'a Monomials, equations: usize, targets: usize) -> Self {
        let design = DMatrix::zeros(terms.degrees().len(), equations);
        Self { terms, design, targets: DMatrix::zeros(targets, equations), equations: 0 }
    }

    /// One more equation: the sum of `terms` times the coefficients is each target.
    pub fn add(&mut self, weight: f64, terms: &[f64], targets: &[f64]) {
        for (matrix, values) in [(&mut self.design, terms), (&mut self.targets, targets)] {
            matrix.column_mut(self.equations).iter_mut().zip(values).for_each(|(m, v)| *m = weight * v);
        }
        self.equations += 1;
    }

    /// Coefficients, a column a target, held near zero by a penalty that depends on the degree.
    pub fn solve(&self, penalty: impl Fn(usize) -> f64) -> Option<DMatrix<f64>> {
        let mut normal = &self.design * self.design.transpose();
        for (i, degree) in self.terms.degrees().iter().enumerate() {
            normal[(i, i)] += penalty(*degree);
        }
        Some(normal.cholesky()?.solve(&(&self.design * self.targets.transpose())))
    }
}
