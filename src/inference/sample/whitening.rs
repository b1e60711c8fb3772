//! The linear map that makes a posterior round: z moves by L y, with L Lᵀ the covariance of the posterior.

use nalgebra::{Cholesky, DMatrix};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// The factor L. Products are plain loops: a matrix library would round differently on different processors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Whitening {
    dimension: usize,
    /// Row by row.
    factor: Vec<f64>,
}

impl Whitening {
    /// L = 1: right for the prior.
    pub fn identity(dimension: usize) -> Self {
        Self::of_matrix(&DMatrix::identity(dimension, dimension))
    }

    /// L Lᵀ = M⁻¹, from M = C Cᵀ as L = C⁻ᵀ.
    pub fn from_metric(metric: &DMatrix<f64>, dimension: usize) -> Result<Self> {
        let shape = format!("{} × {}", metric.nrows(), metric.ncols());
        if metric.shape() != (dimension, dimension) {
            let allowed = format!("{dimension} × {dimension}, one row a coordinate");
            return Err(Error::out_of_range("the shape of the metric", shape, &allowed));
        }
        cholesky(metric)
            .and_then(|lower| lower.solve_lower_triangular(&DMatrix::identity(dimension, dimension)))
            .map(|inverse| Self::of_matrix(&inverse.transpose()))
            .filter(|whitening| whitening.factor.iter().all(|value| value.is_finite()))
            .ok_or_else(|| Error::out_of_range("the metric", shape, "symmetric and positive definite"))
    }

    /// L Lᵀ = S; `None` unless S is positive definite.
    pub fn from_covariance(covariance: &DMatrix<f64>) -> Option<Self> {
        cholesky(covariance).map(|lower| Self::of_matrix(&lower))
    }

    fn of_matrix(matrix: &DMatrix<f64>) -> Self {
        Self { dimension: matrix.nrows(), factor: matrix.transpose().as_slice().to_vec() }
    }

    /// Whether it is of that dimension.
    pub fn fits(&self, dimension: usize) -> bool {
        self.dimension == dimension && self.factor.len() == dimension * dimension
    }

    /// L y.
    pub fn push(&self, y: &[f64]) -> Vec<f64> {
        let row = |row: &[f64]| row.iter().zip(y).map(|(l, y)| l * y).sum();
        self.factor.chunks_exact(self.dimension).map(row).collect()
    }

    /// Lᵀ g: a gradient in z, seen in whitened coordinates.
    pub fn pull(&self, gradient: &[f64]) -> Vec<f64> {
        let mut pulled = vec![0.0; self.dimension];
        for (row, g) in self.factor.chunks_exact(self.dimension).zip(gradient) {
            pulled.iter_mut().zip(row).for_each(|(sum, l)| *sum += l * g);
        }
        pulled
    }
}

/// The lower factor of a finite matrix with a positive diagonal.
fn cholesky(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let finite = matrix.iter().all(|value| value.is_finite());
    finite.then(|| Cholesky::new(matrix.clone())).flatten().map(|factors| factors.l())
}

/// The covariance of points given row by row about the mean of their group; `None` for too few of them.
pub(super) fn pooled_covariance(groups: &[Vec<f64>], dimension: usize) -> Option<DMatrix<f64>> {
    let mut sum = DMatrix::zeros(dimension, dimension);
    let mut freedom = 0_usize;
    for group in groups {
        let count = group.len() / dimension;
        let mean: Vec<f64> = (0..dimension)
            .map(|i| group.iter().skip(i).step_by(dimension).sum::<f64>() / count as f64)
            .collect();
        for point in group.chunks_exact(dimension) {
            for i in 0..dimension {
                for j in 0..=i {
                    sum[(i, j)] += (point[i] - mean[i]) * (point[j] - mean[j]);
                }
            }
        }
        freedom += count.saturating_sub(1);
    }
    sum.fill_upper_triangle_with_lower_triangle();
    (freedom > dimension).then(|| sum / freedom as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_squares_to_the_inverse_of_the_metric() {
        let metric = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 2.0]);
        let whitening = Whitening::from_metric(&metric, 2).unwrap();
        // L (Lᵀ M v) = v.
        let v = [0.3, -1.2];
        let mv = [4.0 * v[0] + v[1], v[0] + 2.0 * v[1]];
        let back = whitening.push(&whitening.pull(&mv));
        assert!(back.iter().zip(v).all(|(a, b)| (a - b).abs() < 1e-14), "{back:?}");
        let covariance = metric.try_inverse().unwrap();
        let direct = Whitening::from_covariance(&covariance).unwrap();
        let same = direct.push(&direct.pull(&mv));
        assert!(same.iter().zip(v).all(|(a, b)| (a - b).abs() < 1e-14), "{same:?}");
    }

    #[test]
    fn a_metric_that_is_none_is_refused() {
        let message = |metric: &DMatrix<f64>| Whitening::from_metric(metric, 2).unwrap_err().to_string();
        assert!(message(&DMatrix::identity(3, 3)).contains("3 × 3, but must be 2 × 2"));
        assert!(message(&-DMatrix::identity(2, 2)).contains("positive definite"));
        assert!(message(&(DMatrix::identity(2, 2) * f64::NAN)).contains("positive definite"));
    }

    #[test]
    fn the_covariance_is_taken_within_groups() {
        let far = |shift: f64| vec![shift, 0.0, shift + 2.0, 0.0, shift, 1.0, shift + 2.0, 1.0];
        let covariance = pooled_covariance(&[far(0.0), far(100.0)], 2).unwrap();
        assert!((covariance[(0, 0)] - 8.0 / 6.0).abs() < 1e-12);
        assert!((covariance[(1, 1)] - 2.0 / 6.0).abs() < 1e-12 && covariance[(0, 1)].abs() < 1e-12);
        assert!(pooled_covariance(&[vec![1.0, 2.0]], 2).is_none());
    }
}
