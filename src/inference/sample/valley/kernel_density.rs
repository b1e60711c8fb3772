//! Where the chains have been, as a density to propose from: leaps along bent valleys, and between modes that no step joins.

use nalgebra::{DMatrix, DVector};
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use crate::inference::sample::normal::{log_sum, normal};

/// Normal kernels about draws, each as wide as the floor there says the posterior is, times Scott's n^(−1/(d + 4)) (1992,
/// Multivariate Density Estimation, chapter 6): where a valley bends they follow it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct KernelDensity {
    kernels: Vec<Kernel>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Kernel {
    centre: DVector<f64>,
    /// C of the precision C Cᵀ, lower triangular.
    factor: DMatrix<f64>,
    /// ½ ln det of the precision.
    log_peak: f64,
}

impl KernelDensity {
    /// Every so many of `draws`, s and the metric −d² ln p/ds² there, at most 250; `None` of fewer than ten a coordinate.
    pub fn of(draws: &[(&DVector<f64>, &DMatrix<f64>)]) -> Option<Self> {
        const MOST: usize = 250;
        const FEWEST_A_COORDINATE: usize = 10;
        let dimension = draws.first()?.0.len();
        if draws.len() < FEWEST_A_COORDINATE * dimension {
            return None;
        }
        let kept = draws.iter().step_by(draws.len().div_ceil(MOST));
        let width = (kept.len() as f64).powf(-1.0 / (dimension as f64 + 4.0));
        let kernel = |(centre, metric): &(&DVector<f64>, &DMatrix<f64>)| {
            let factor = (*metric).clone().cholesky()?.l() / width;
            let log_peak = factor.diagonal().iter().map(|d| d.ln()).sum();
            Some(Kernel { centre: (*centre).clone(), factor, log_peak })
        };
        let kernels: Vec<_> = kept.filter_map(kernel).collect();
        (!kernels.is_empty()).then_some(Self { kernels })
    }

    /// Whether there are kernels, all of that dimension.
    pub fn fits(&self, slow: usize) -> bool {
        let of_kernel =
            |kernel: &Kernel| kernel.centre.len() == slow && kernel.factor.shape() == (slow, slow);
        !self.kernels.is_empty() && self.kernels.iter().all(of_kernel)
    }

    /// A draw of the density.
    pub fn draw(&self, rng: &mut impl Rng) -> DVector<f64> {
        let Kernel { centre, factor, .. } = &self.kernels[rng.random_range(0..self.kernels.len())];
        let mut from = normal(centre.len(), rng);
        // The factor of a positive-definite matrix has no zero on its diagonal.
        factor.tr_solve_lower_triangular_mut(&mut from);
        from + centre
    }

    /// Its logarithm, up to a constant.
    pub fn log_density(&self, s: &DVector<f64>) -> f64 {
        let of = |kernel: &Kernel| kernel.log_peak - 0.5 * kernel.squared_distance(s);
        log_sum(self.kernels.iter().map(of).collect::<Vec<_>>())
    }
}

impl Kernel {
    /// Of s from the centre, in deviations.
    fn squared_distance(&self, s: &DVector<f64>) -> f64 {
        let from = s - &self.centre;
        let along = |(j, column): (usize, &[f64])| -> f64 {
            column[j..].iter().zip(&from.as_slice()[j..]).map(|(c, x)| c * x).sum()
        };
        self.factor.as_slice().chunks_exact(s.len()).enumerate().map(along).map(|x| x * x).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::{Stage, stream};

    #[test]
    fn draws_have_the_density_that_is_given() {
        let (wide, narrow) = (DMatrix::from_element(1, 1, 1.0), DMatrix::from_element(1, 1, 25.0));
        let (left, right) = (DVector::zeros(1), DVector::from_vec(vec![3.0]));
        let draws: Vec<_> = [(&left, &wide), (&right, &narrow)].into_iter().cycle().take(40).collect();
        let memory = KernelDensity::of(&draws).unwrap();
        let mut rng = stream(1, 0, Stage::Sampling, 0);
        let draws: Vec<_> = (0..100_000).map(|_| memory.draw(&mut rng)[0]).collect();
        let at = |x: f64| memory.log_density(&DVector::from_vec(vec![x]));
        let count = |x: f64| draws.iter().filter(|draw| (*draw - x).abs() < 0.03).count() as f64;
        for x in [1.0, 2.9, 3.0] {
            let ratio = (count(0.0) / count(x)).ln();
            assert!((ratio - (at(0.0) - at(x))).abs() < 0.1, "{x} {ratio} {}", at(0.0) - at(x));
        }
    }

    #[test]
    fn few_draws_are_no_memory() {
        let (centre, metric) = (DVector::zeros(2), DMatrix::identity(2, 2));
        let of = |count| KernelDensity::of(&vec![(&centre, &metric); count]);
        assert_eq!(of(19), None);
        assert_eq!(of(0), None);
        assert_eq!(of(2_001).unwrap().kernels.len(), 223);
        assert_eq!(KernelDensity::of(&[(&centre, &-metric.clone()); 20]), None);
    }
}
