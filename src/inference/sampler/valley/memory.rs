//! Where the chains have been, as a density to propose from: leaps between modes that no trajectory joins.

use nalgebra::{DMatrix, DVector};
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use super::place::{log_sum, normal};
use super::surrogate::squared_distances;
use crate::inference::bits;

/// Normal kernels about draws, of Scott's width n^(−1/(d + 4)) in their deviations (1992, Multivariate Density Estimation,
/// chapter 6).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Memory {
    /// A row a draw, in coordinates x of unit covariance.
    #[serde(with = "bits::matrix")]
    draws: DMatrix<f64>,
}

impl Memory {
    /// Every so many of `draws`, given row by row, at most a thousand; `None` of fewer than ten a coordinate.
    pub fn of(draws: &[DVector<f64>]) -> Option<Self> {
        const MOST: usize = 1_000;
        const FEWEST_A_COORDINATE: usize = 10;
        let dimension = draws.first()?.len();
        if draws.len() < FEWEST_A_COORDINATE * dimension {
            return None;
        }
        let rows: Vec<_> = draws.iter().step_by(draws.len().div_ceil(MOST)).map(|x| x.transpose()).collect();
        Some(Self { draws: DMatrix::from_rows(&rows) })
    }

    fn width(&self) -> f64 {
        let (draws, dimension) = self.draws.shape();
        (draws as f64).powf(-1.0 / (dimension as f64 + 4.0))
    }

    /// A draw of the density.
    pub fn draw(&self, rng: &mut impl Rng) -> DVector<f64> {
        let (draws, dimension) = self.draws.shape();
        self.draws.row(rng.random_range(0..draws)).transpose() + normal(dimension, rng) * self.width()
    }

    /// Its logarithm, up to a constant.
    pub fn log_density(&self, x: &DVector<f64>) -> f64 {
        let exponent = -0.5 / self.width().powi(2);
        log_sum(squared_distances(self.draws.as_slice(), x.as_slice()).into_iter().map(|r2| exponent * r2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::{Stage, stream};

    #[test]
    fn draws_have_the_density_that_is_given() {
        let points: Vec<_> =
            [0.0, 3.0].into_iter().cycle().take(40).map(|x| DVector::from_vec(vec![x])).collect();
        let memory = Memory::of(&points).unwrap();
        let mut rng = stream(1, 0, Stage::Sampling, 0);
        let is_left = |x: &DVector<f64>| x[0].abs() < 0.1;
        let is_between = |x: &DVector<f64>| (x[0] - 1.0).abs() < 0.1;
        let draws: Vec<_> = (0..100_000).map(|_| memory.draw(&mut rng)).collect();
        let count = |is: &dyn Fn(&DVector<f64>) -> bool| draws.iter().filter(|x| is(x)).count() as f64;
        let ratio = (count(&is_left) / count(&is_between)).ln();
        let at = |x: f64| memory.log_density(&DVector::from_vec(vec![x]));
        assert!((ratio - (at(0.0) - at(1.0))).abs() < 0.1, "{ratio} {}", at(0.0) - at(1.0));
    }

    #[test]
    fn few_draws_are_no_memory() {
        assert_eq!(Memory::of(&vec![DVector::zeros(2); 19]), None);
        assert_eq!(Memory::of(&[]), None);
        assert_eq!(Memory::of(&vec![DVector::zeros(2); 2_001]).unwrap().draws.nrows(), 667);
    }
}
