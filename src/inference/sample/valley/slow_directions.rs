//! Which directions are slow, and which are integrated over.

use nalgebra::{DMatrix, DVector};
use rand::Rng;

use super::importance::ImportanceDraws;
use super::position::Position;
use crate::inference::LatentLikelihood;
use crate::inference::optimise::{Axes, ConditionalMaximum, MOST_CURVATURES};
use crate::inference::sample::normal::log_prior;

/// Most directions taken as slow; while they are few, the next ones too if wider than a share of what
/// counts as wide: in few dimensions the surrogate follows them at no cost.
const MOST_SLOW: usize = 12;
const FEW_SLOW: (usize, f64) = (7, 1.0 / 3.0);
/// Variance of one weight, over the square of their mean, above which another direction is followed.
const MOST_VARIANCE: f64 = 0.6;

/// Number of principal axes to follow: those wider than `width`, and more where they are few.
pub(super) fn widest(width: f64, metric: &DMatrix<f64>) -> usize {
    let (few, share) = FEW_SLOW;
    let wide = Axes::wider_than(width, metric);
    wide.max(Axes::wider_than(share * width, metric).min(few)).clamp(1, metric.nrows().min(MOST_SLOW))
}

/// The axes with more directions taken as slow, each the one along which the posterior is least normal, until the integral
/// over the rest is good, and the maximum at their origin.
pub(super) fn slow_directions(
    likelihood: &dyn LatentLikelihood,
    mut axes: Axes,
    rng: &mut impl Rng,
) -> Option<(Axes, ConditionalMaximum)> {
    /// Draws of t that tell how good the integral is.
    const TRIALS: usize = 32;
    loop {
        let origin = DVector::zeros(axes.slow_dimension());
        let guess = DVector::zeros(axes.stiff_dimension());
        let direction = match axes.maximum(likelihood, &origin, guess, MOST_CURVATURES) {
            Some(maximum) => {
                let trials = ImportanceDraws::normal(TRIALS);
                let (_, variance) = Position::draw(likelihood, &axes, origin, &maximum, trials, rng);
                if variance < MOST_VARIANCE || axes.slow_dimension() >= MOST_SLOW {
                    return Some((axes, maximum));
                }
                least_normal(likelihood, &axes, &maximum)
            }
            // The widest.
            None => axes.stiff_dimension().checked_sub(1)?,
        };
        axes = axes.with_slow(direction);
    }
}

/// The stiff direction along which ln w is furthest from zero on both sides of the maximum at the origin.
fn least_normal(likelihood: &dyn LatentLikelihood, axes: &Axes, maximum: &ConditionalMaximum) -> usize {
    const DEVIATIONS: f64 = 1.5;
    let origin = DVector::zeros(axes.slow_dimension());
    let log_weight = |direction: usize, side: f64| {
        let mut t = maximum.stiff.clone();
        t[direction] += side * DEVIATIONS / maximum.factor.row(direction).norm();
        let z = axes.at(&origin, &t);
        let log_density = likelihood.log_likelihood(z.as_slice()) + log_prior(z.as_slice());
        log_density - maximum.log_density + 0.5 * DEVIATIONS * DEVIATIONS
    };
    let misfits = (0..axes.stiff_dimension()).map(|i| log_weight(i, -1.0).abs() + log_weight(i, 1.0).abs());
    DVector::from_iterator(axes.stiff_dimension(), misfits).imax()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::likelihood::known::Known;
    use crate::numerics::random::{Stage, stream};

    /// (a, b) measured normally, and (x, y) on an arc of radius 0.01 about (0, −0.01) that is half a radian long.
    const ARC: Known = Known {
        dimension: 4,
        log_likelihood: |z| -0.5 * residuals(z).0.norm_squared(),
        slope_and_metric: |z| {
            let (residuals, jacobian) = residuals(z);
            let prior = DVector::from_column_slice(z);
            let metric = jacobian.tr_mul(&jacobian) + DMatrix::identity(4, 4);
            (-jacobian.tr_mul(&residuals) - prior, metric)
        },
    };

    const RADIUS: f64 = 0.01;

    /// Residuals and their Jacobian.
    fn residuals(z: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let (x, y) = (z[2], z[3] + RADIUS);
        let (r, angle) = (x.hypot(y), x.atan2(y));
        let residuals = DVector::from_vec(vec![z[0], z[1] / 0.02, angle / 0.5, (r - RADIUS) / 1e-4]);
        let mut jacobian = DMatrix::zeros(4, 4);
        (jacobian[(0, 0)], jacobian[(1, 1)]) = (1.0, 1.0 / 0.02);
        (jacobian[(2, 2)], jacobian[(2, 3)]) = (y / (r * r) / 0.5, -x / (r * r) / 0.5);
        (jacobian[(3, 2)], jacobian[(3, 3)]) = (x / r / 1e-4, y / r / 1e-4);
        (residuals, jacobian)
    }

    #[test]
    fn a_bent_direction_is_followed_before_wider_straight_ones() {
        let metric = ARC.curvature(&[0.0; 4]).unwrap().metric;
        let mut rng = stream(1, 0, Stage::Sampling, 0);
        let (axes, _) = slow_directions(&ARC, Axes::split(&[0.0; 4], &metric, 1), &mut rng).unwrap();
        assert_eq!(axes.slow_dimension(), 2);
        let along = axes.at(&DVector::from_vec(vec![0.0, 1.0]), &DVector::zeros(2));
        assert!((along[2].abs() - 1.0).abs() < 1e-9, "{along}");
    }

    #[test]
    fn more_directions_are_followed_where_few_are_wide() {
        let metric = |widths: &[f64]| {
            DMatrix::from_diagonal(&DVector::from_iterator(widths.len(), widths.iter().map(|w| w.powi(-2))))
        };
        assert_eq!(widest(0.03, &metric(&[0.5, 0.02, 0.015, 0.009, 1e-4])), 3);
        assert_eq!(widest(0.03, &metric(&[[0.5; 6], [0.02; 6]].concat())), 7);
        assert_eq!(widest(0.03, &metric(&[[0.5; 9], [0.02; 9]].concat())), 9);
        assert_eq!(widest(0.03, &metric(&[0.5; 20])), 12);
        assert_eq!(widest(0.03, &metric(&[1e-3; 2])), 1);
    }
}
