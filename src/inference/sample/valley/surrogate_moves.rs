//! Where a chain on the surrogate alone goes, which costs no likelihood.

use std::ops::RangeInclusive;

use nalgebra::DVector;
use rand::{Rng, RngExt};

use super::kernel_density::KernelDensity;
use super::neighbours::Vicinity;
use super::surrogate::Surrogate;
use crate::inference::sample::normal::normal;

/// Where a chain on the surrogate is after several moves, and by how much ln of the surrogate is larger there than at the
/// start: Hamiltonian trajectories and, once it is known where chains have been, as many leaps to such places, all accepted by the
/// surrogate itself.
pub(super) fn transition(
    surrogate: &Surrogate,
    density: Option<&KernelDensity>,
    start: &DVector<f64>,
    rng: &mut impl Rng,
) -> (DVector<f64>, f64) {
    const MOVES: usize = 8;
    /// About a quarter of a period and more, so that draws depend little on one another.
    const STEPS: RangeInclusive<usize> = 8..=40;
    let mut vicinity = Vicinity::empty();
    let first = SurrogatePoint::at(surrogate, start.clone(), None);
    let mut here = first.clone();
    // Where no move has been since, from the leap before.
    let mut drawn_here = None;
    // Every move is drawn alike: leaps and trajectories in a fixed order would not be as likely backwards.
    for _ in 0..MOVES {
        if let Some(density) = density.filter(|_| rng.random()) {
            let s = density.draw(rng);
            let drawn_there = density.log_density(&s);
            let before = *drawn_here.get_or_insert_with(|| density.log_density(&surrogate.s(&here.x)));
            let there = SurrogatePoint::at(surrogate, surrogate.x(&s), None);
            if rng.random::<f64>().ln() < there.log_density - here.log_density - (drawn_there - before) {
                (here, drawn_here) = (there, Some(drawn_there));
            }
            continue;
        }
        let momentum = normal(start.len(), rng);
        let before = here.log_density - 0.5 * momentum.norm_squared();
        let steps = rng.random_range(STEPS);
        let end = leapfrog(surrogate, here.clone(), momentum, steps, &mut vicinity);
        let Some((there, momentum)) = end else { continue };
        if rng.random::<f64>().ln() < there.log_density - 0.5 * momentum.norm_squared() - before {
            (here, drawn_here) = (there, None);
        }
    }
    (here.x, here.log_density - first.log_density)
}

/// x with the logarithm of the surrogate and its slope.
#[derive(Clone)]
struct SurrogatePoint {
    x: DVector<f64>,
    log_density: f64,
    slope: DVector<f64>,
}

impl SurrogatePoint {
    fn at(surrogate: &Surrogate, x: DVector<f64>, vicinity: Option<&mut Vicinity>) -> Self {
        let (log_density, slope) = surrogate.log_marginal(&x, vicinity);
        Self { x, log_density, slope }
    }
}

/// Leapfrog; `None` where it leads out of the region that is known.
fn leapfrog(
    surrogate: &Surrogate,
    mut point: SurrogatePoint,
    mut momentum: DVector<f64>,
    steps: usize,
    vicinity: &mut Vicinity,
) -> Option<(SurrogatePoint, DVector<f64>)> {
    /// In posterior deviations, as is the edge of what is known.
    const STEP: f64 = 0.1;
    const EDGE: f64 = 14.0;
    for _ in 0..steps {
        momentum.axpy(0.5 * STEP, &point.slope, 1.0);
        let x = point.x + &momentum * STEP;
        if x.iter().any(|x| x.is_nan() || x.abs() > EDGE) {
            return None;
        }
        point = SurrogatePoint::at(surrogate, x, Some(vicinity));
        momentum.axpy(0.5 * STEP, &point.slope, 1.0);
    }
    Some((point, momentum))
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::inference::optimise::ConditionalMaximum;
    use crate::inference::sample::normal::log_sum;
    use crate::inference::sample::valley::surrogate::KnownMaximum;
    use crate::numerics::random::{Stage, stream};

    /// Of ln p and its slope, known at 41 points, and the curvature of −ln p.
    fn surrogate(known: impl Fn(f64) -> (f64, f64), curvature: f64, apart: f64) -> Surrogate {
        let known = (-20..=20).map(|i| {
            let x = apart * f64::from(i);
            let (log_density, slope) = known(x);
            let floor = ConditionalMaximum {
                stiff: DVector::zeros(0),
                log_density,
                slope: DVector::from_vec(vec![slope]),
                bend: DMatrix::zeros(0, 1),
                metric: DMatrix::from_element(1, 1, curvature),
                factor: DMatrix::zeros(0, 0),
            };
            KnownMaximum::new(DVector::from_vec(vec![x]), &floor)
        });
        Surrogate::fit(DVector::zeros(1), DMatrix::identity(1, 1), known.collect()).unwrap()
    }

    fn drawn(surrogate: &Surrogate, density: &KernelDensity, wanted: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut rng = stream(1, 0, Stage::Sampling, 0);
        let mut here = DVector::from_vec(vec![0.5]);
        let step = |_| {
            let (there, surrogate_gain) = transition(surrogate, Some(density), &here, &mut rng);
            if rng.random::<f64>().ln() < wanted(there[0]) - wanted(here[0]) - surrogate_gain {
                here = there;
            }
            here[0]
        };
        (0..10_000).map(step).collect()
    }

    fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
        let count = values.len() as f64;
        values.sum::<f64>() / count
    }

    fn density(draws: impl Iterator<Item = f64>) -> KernelDensity {
        let draws: Vec<_> = draws.map(|x| DVector::from_vec(vec![x])).collect();
        let metric = DMatrix::identity(1, 1);
        KernelDensity::of(&draws.iter().map(|x| (x, &metric)).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn a_wrong_surrogate_and_density_still_lead_to_the_right_distribution() {
        // What is known is ln p = −x²/3 with an edge; what is wanted is −x²/2 + x/2.
        let edge = |x: f64| if x > 1.0 { -1.0 } else { 0.0 };
        let surrogate = surrogate(|x| (-x * x / 3.0 + edge(x), -2.0 * x / 3.0), 2.0 / 3.0, 0.2);
        let density = density((0..30).map(|i| f64::from(i) / 10.0 - 2.0));
        let draws = drawn(&surrogate, &density, |x| -0.5 * x * x + 0.5 * x);
        let mean_draw = mean(draws.iter().copied());
        let variance = mean(draws.iter().map(|x| (x - mean_draw).powi(2)));
        assert!((mean_draw - 0.5).abs() < 0.08 && (variance - 1.0).abs() < 0.1, "{mean_draw} {variance}");
    }

    #[test]
    fn leaps_join_modes_that_no_trajectory_joins() {
        // 0.3 N(−5, ½) + 0.7 N(5, ½), of which half of what is remembered is on either side.
        let modes = |x: f64| [0.3f64.ln() - 2.0 * (x + 5.0).powi(2), 0.7f64.ln() - 2.0 * (x - 5.0).powi(2)];
        let wanted = |x| log_sum(modes(x));
        let slope = |x: f64| {
            let [left, right] = modes(x).map(|mode| (mode - wanted(x)).exp());
            -4.0 * (left * (x + 5.0) + right * (x - 5.0))
        };
        let surrogate = surrogate(|x| (wanted(x), slope(x)), 4.0, 0.4);
        let density = density((0..60).map(|i| f64::from(i / 2 - 15) / 15.0 + f64::from(i % 2 * 10 - 5)));
        let draws = drawn(&surrogate, &density, wanted);
        let right = mean(draws.iter().map(|x| f64::from(*x > 0.0)));
        assert!((right - 0.7).abs() < 0.02, "{right}");
    }
}
