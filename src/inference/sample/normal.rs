//! Standard normal numbers, their density, and sums of densities given by their logarithms.

use nalgebra::DVector;
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

/// Standard normal numbers.
pub(super) fn normal(count: usize, rng: &mut impl Rng) -> DVector<f64> {
    DVector::from_fn(count, |_, _| StandardNormal.sample(rng))
}

/// −½|z|², the prior of latent coordinates without its constant.
pub(super) fn log_prior(z: &[f64]) -> f64 {
    -0.5 * z.iter().map(|z| z * z).sum::<f64>()
}

/// ln Σ exp; −∞ of nothing.
pub(super) fn log_sum(logarithms: impl IntoIterator<Item = f64> + Clone) -> f64 {
    let top = logarithms.clone().into_iter().fold(f64::NEG_INFINITY, f64::max);
    if top == f64::NEG_INFINITY {
        return top;
    }
    top + logarithms.into_iter().map(|l| (l - top).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_exponentials_neither_overflow_nor_vanish() {
        assert!((log_sum([1000.0, 1000.0]) - 1000.0 - 2.0_f64.ln()).abs() < 1e-12);
        assert_eq!(log_sum([f64::NEG_INFINITY, 3.0]), 3.0);
        assert_eq!(log_sum([f64::NEG_INFINITY; 2]), f64::NEG_INFINITY);
        assert!((log_sum([0.0, 0.0, f64::NEG_INFINITY]) - 2f64.ln()).abs() < 1e-15);
    }
}
