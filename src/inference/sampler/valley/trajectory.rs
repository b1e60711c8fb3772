//! Where a chain on the surrogate alone goes, which costs no likelihood.

use nalgebra::DVector;
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use super::place::normal;
use super::surrogate::Surrogate;

/// A step, and the edge of what is known, in posterior deviations.
const STEP: f64 = 0.1;
const EDGE: f64 = 14.0;

/// How proposals are made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) enum Pace {
    /// Several trajectories, as long as the surrogate is learned.
    Learning,
    /// One, whose ends lie opposite to one another, where the surrogate can be trusted.
    Trusting,
    /// Several on the surrogate to a power from 1/2 to 1, which leads out to where it makes the posterior too low.
    Doubting,
}

/// The end of one or several Hamiltonian trajectories, each accepted by a power of the surrogate's own density, and by
/// how much the logarithm of that is larger there than at the start.
pub(super) fn transition(
    surrogate: &Surrogate,
    pace: Pace,
    start: &DVector<f64>,
    rng: &mut impl Rng,
) -> (DVector<f64>, f64) {
    const SINGLE: f64 = 0.3;
    const SEVERAL: usize = 10;
    const LEAST_POWER: f64 = 0.5;
    let is_single = pace == Pace::Trusting || rng.random::<f64>() < SINGLE;
    let trajectories = if is_single { 1 } else { SEVERAL };
    let power = if pace == Pace::Doubting { rng.random_range(LEAST_POWER..1.0) } else { 1.0 };
    let first = power * surrogate.log_marginal(start);
    let (mut here, mut log_density) = (start.clone(), first);
    for _ in 0..trajectories {
        let momentum = normal(start.len(), rng);
        let before = log_density - 0.5 * momentum.norm_squared();
        let end = leapfrog(surrogate, power, here.clone(), momentum, steps(rng));
        let Some((there, momentum)) = end else { continue };
        let there_density = power * surrogate.log_marginal(&there);
        if rng.random::<f64>().ln() < there_density - 0.5 * momentum.norm_squared() - before {
            (here, log_density) = (there, there_density);
        }
    }
    (here, log_density - first)
}

/// Leapfrog in the forces of the polynomials, times `power`; `None` where they lead out of the region that is known.
fn leapfrog(
    surrogate: &Surrogate,
    power: f64,
    mut x: DVector<f64>,
    mut momentum: DVector<f64>,
    steps: usize,
) -> Option<(DVector<f64>, DVector<f64>)> {
    let push = |x: &DVector<f64>, step: f64| surrogate.smooth(x.as_slice()).1 * (power * step);
    momentum += push(&x, 0.5 * STEP);
    for step in 1..=steps {
        x += &momentum * STEP;
        if x.iter().any(|x| x.is_nan() || x.abs() > EDGE) {
            return None;
        }
        momentum += push(&x, if step < steps { STEP } else { 0.5 * STEP });
    }
    Some((x, momentum))
}

/// Steps of a trajectory: mostly longer than a quarter of a period, so that draws depend little on one another; some short,
/// which leave places where the surrogate is poor.
fn steps(rng: &mut impl Rng) -> usize {
    const SHORT: f64 = 0.15;
    if rng.random::<f64>() < SHORT { rng.random_range(1..=4) } else { rng.random_range(8..=40) }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::inference::floor::Floor;
    use crate::inference::sampler::valley::surrogate::Known;
    use crate::numerics::random::{Stage, stream};

    #[test]
    fn a_wrong_surrogate_still_leads_to_the_right_distribution() {
        // What is known is ln p = −x²/3 with an edge; what is wanted is −x²/2 + x/2.
        let known = (-20..=20).map(|i| {
            let x = f64::from(i) / 5.0;
            let edge = if x > 1.0 { -1.0 } else { 0.0 };
            let floor = Floor {
                stiff: DVector::zeros(0),
                log_density: -x * x / 3.0 + edge,
                slope: DVector::from_vec(vec![-2.0 * x / 3.0]),
                bend: DMatrix::zeros(0, 1),
                metric: DMatrix::from_vec(1, 1, vec![2.0 / 3.0]),
                factor: DMatrix::zeros(0, 0),
            };
            Known::new(DVector::from_vec(vec![x]), &floor)
        });
        let surrogate = Surrogate::fit(DVector::zeros(1), DMatrix::identity(1, 1), known.collect()).unwrap();
        let wanted = |x: f64| -0.5 * x * x + 0.5 * x;
        let mut rng = stream(1, 0, Stage::Sampling, 0);
        let mut here = DVector::zeros(1);
        let mut draws = vec![];
        for _ in 0..40_000 {
            let (there, surrogate_gain) = transition(&surrogate, Pace::Doubting, &here, &mut rng);
            if rng.random::<f64>().ln() < wanted(there[0]) - wanted(here[0]) - surrogate_gain {
                here = there;
            }
            draws.push(here[0]);
        }
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let variance = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / draws.len() as f64;
        assert!((mean - 0.5).abs() < 0.03 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
    }
}
