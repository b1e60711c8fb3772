//! Where a chain on the surrogate alone goes, which costs no likelihood.

use std::ops::RangeInclusive;

use nalgebra::DVector;
use rand::{Rng, RngExt};

use super::kernel_density::KernelDensity;
use super::neighbours::Vicinity;
use super::surrogate::Surrogate;
use crate::inference::sample::normal::normal;

/// The longest and the shortest step of a trajectory in posterior deviations.
pub(super) const LONGEST_STEP: f64 = 0.1;
pub(super) const SHORTEST_STEP: f64 = 0.005;

/// Where several moves on the surrogate have led.
pub(super) struct Moved {
    pub x: DVector<f64>,
    /// By how much ln of the surrogate is larger there than at the start.
    pub gain: f64,
    /// With what probabilities trajectories were accepted.
    pub accepted: Vec<f64>,
}

/// Several moves on the surrogate: Hamiltonian trajectories in steps of `step` and, once it is known where chains have been, as
/// many leaps to such places, all accepted by the surrogate itself.
pub(super) fn transition(
    surrogate: &Surrogate,
    density: Option<&KernelDensity>,
    start: &DVector<f64>,
    step: f64,
    rng: &mut impl Rng,
) -> Moved {
    const MOVES: usize = 8;
    /// About a quarter of a period and more, so that draws depend little on one another.
    const LENGTHS: RangeInclusive<f64> = 0.8..=4.0;
    let mut vicinity = Vicinity::empty();
    let first = SurrogatePoint::at(surrogate, start.clone(), None);
    let mut here = first.clone();
    let mut accepted = vec![];
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
        let steps = (rng.random_range(LENGTHS) / step).round() as usize;
        let end = leapfrog(surrogate, here.clone(), momentum, step, steps, &mut vicinity);
        let gain = |(there, momentum): &(SurrogatePoint, DVector<f64>)| {
            there.log_density - 0.5 * momentum.norm_squared() - before
        };
        let gain = end.as_ref().map(gain).filter(|gain| !gain.is_nan());
        let probability = gain.map_or(0.0, |gain| gain.exp().min(1.0));
        accepted.push(probability);
        if let Some((there, _)) = end.filter(|_| rng.random::<f64>() < probability) {
            (here, drawn_here) = (there, None);
        }
    }
    Moved { x: here.x, gain: here.log_density - first.log_density, accepted }
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
    step: f64,
    steps: usize,
    vicinity: &mut Vicinity,
) -> Option<(SurrogatePoint, DVector<f64>)> {
    for _ in 0..steps {
        momentum.axpy(0.5 * step, &point.slope, 1.0);
        let x = point.x + &momentum * step;
        if !surrogate.reaches(&x) {
            return None;
        }
        point = SurrogatePoint::at(surrogate, x, Some(vicinity));
        momentum.axpy(0.5 * step, &point.slope, 1.0);
    }
    Some((point, momentum))
}

/// The step of trajectories on the surrogate after the `block`th block: shorter where few of them are accepted, and changed by
/// ever less (Robbins & Monro 1951, Ann. Math. Stat. 22, 400).
pub(super) fn adapted(step: f64, accepted: &[f64], block: u64) -> f64 {
    /// Of the four of a proposal, on average, between one and two.
    const WANTED: f64 = 0.35;
    if accepted.is_empty() {
        return step;
    }
    let mean = accepted.iter().sum::<f64>() / accepted.len() as f64;
    let gain = 2.0 / (block as f64).sqrt();
    (step * (gain * (mean - WANTED)).exp()).clamp(SHORTEST_STEP, LONGEST_STEP)
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::inference::optimise::ConditionalMaximum;
    use crate::inference::sample::normal::log_sum;
    use crate::inference::sample::valley::known_maximum::KnownMaximum;
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
            let moved = transition(surrogate, Some(density), &here, LONGEST_STEP, &mut rng);
            if rng.random::<f64>().ln() < wanted(moved.x[0]) - wanted(here[0]) - moved.gain {
                here = moved.x;
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
    fn steps_are_shorter_where_few_trajectories_are_accepted_and_settle() {
        assert_eq!(adapted(0.02, &[], 1), 0.02);
        assert_eq!(adapted(LONGEST_STEP, &[0.9, 1.0], 1), LONGEST_STEP);
        let [first, later] = [1, 100].map(|block| adapted(0.1, &[0.1, 0.0], block));
        assert!(first < 0.06 && later > 0.09 && later < 0.1, "{first} {later}");
        // Accepted as exp(−step/0.02): 35% at 0.021.
        let settled =
            (1..400).fold(LONGEST_STEP, |step, block| adapted(step, &[(-step / 0.02).exp()], block));
        assert!((settled - 0.021).abs() < 1e-4, "{settled}");
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
