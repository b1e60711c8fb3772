//! Trajectories in the forces of the surrogate.

use nalgebra::DVector;
use rand::{Rng, RngExt};

use super::surrogate::Surrogate;

/// A step, and the edge of what is known, in posterior deviations.
const STEP: f64 = 0.1;
const EDGE: f64 = 8.0;

/// Leapfrog in the forces of the surrogate; `None` where they lead out of the region it knows.
pub(super) fn leapfrog(
    surrogate: &Surrogate,
    mut x: DVector<f64>,
    mut momentum: DVector<f64>,
    steps: usize,
) -> Option<(DVector<f64>, DVector<f64>)> {
    momentum += surrogate.force(&x) * (0.5 * STEP);
    for step in 1..=steps {
        x += &momentum * STEP;
        if x.iter().any(|x| x.is_nan() || x.abs() > EDGE) {
            return None;
        }
        momentum += surrogate.force(&x) * if step < steps { STEP } else { 0.5 * STEP };
    }
    Some((x, momentum))
}

/// Steps of a trajectory: mostly longer than a quarter of a period, so that draws depend little on one another; some short,
/// which leave places where the surrogate is poor.
pub(super) fn steps(rng: &mut impl Rng) -> usize {
    const SHORT: f64 = 0.15;
    if rng.random::<f64>() < SHORT { rng.random_range(1..=4) } else { rng.random_range(8..=40) }
}
