//! Where a chain on the surrogate alone goes, which costs no likelihood.

use nalgebra::DVector;
use rand::{Rng, RngExt};

use super::kernel_density::KernelDensity;
use super::surrogate::Surrogate;
use super::transport_map::TransportMap;
use crate::inference::sample::normal::normal;

/// Where several moves on the surrogate have led.
pub(super) struct Moved {
    pub s: DVector<f64>,
    /// By how much ln of the surrogate is larger there than at the start.
    pub gain: f64,
}

/// Several moves on the surrogate, each accepted by the surrogate itself: steps x′ = √(1 − b²) x + b ξ with ξ ~ N(0, 1) in the coordinates of
/// the map, which leave N(0, 1) as it is (preconditioned Crank–Nicolson: Cotter, Roberts, Stuart & White 2013, Statistical
/// Science 28, 424), and, once it is known where chains have been, as many leaps to such places.
pub(super) fn transition(
    (surrogate, map): (&Surrogate, &TransportMap),
    density: Option<&KernelDensity>,
    start: &DVector<f64>,
    rng: &mut impl Rng,
) -> Moved {
    const MOVES: usize = 40;
    /// ln of the shortest b; how long a step may be differs from place to place, so that b has all sizes up to one.
    const SHORTEST: f64 = -4.0;
    let (mut s, mut x, mut log_density) = (start.clone(), map.x(start), surrogate.log_marginal(start));
    let first = log_density;
    // Where no step has been since, from the leap before.
    let mut drawn_here = None;
    // Every move is drawn alike: leaps and steps in a fixed order would not be as likely backwards.
    for _ in 0..MOVES {
        if let Some(density) = density.filter(|_| rng.random()) {
            let there = density.draw(rng);
            let drawn_there = density.log_density(&there);
            let before = *drawn_here.get_or_insert_with(|| density.log_density(&s));
            let log_there = surrogate.log_marginal(&there);
            if rng.random::<f64>().ln() < log_there - log_density - (drawn_there - before) {
                (x, s, log_density, drawn_here) = (map.x(&there), there, log_there, Some(drawn_there));
            }
            continue;
        }
        let b = (SHORTEST * rng.random::<f64>()).exp();
        let x_there = &x * (1.0 - b * b).sqrt() + normal(x.len(), rng) * b;
        let there = map.s(&x_there);
        let log_there = surrogate.log_marginal(&there);
        let by_normal = 0.5 * (x_there.norm_squared() - x.norm_squared());
        if rng.random::<f64>().ln() < log_there - log_density + by_normal {
            (x, s, log_density, drawn_here) = (x_there, there, log_there, None);
        }
    }
    Moved { s, gain: log_density - first }
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
    fn surrogate(known: impl Fn(f64) -> (f64, f64), curvature: f64, apart: f64) -> (Surrogate, TransportMap) {
        let known = (-20..=20).map(|i| {
            let s = apart * f64::from(i);
            let (log_density, slope) = known(s);
            let floor = ConditionalMaximum {
                stiff: DVector::zeros(0),
                log_density,
                slope: DVector::from_vec(vec![slope]),
                bend: DMatrix::zeros(0, 1),
                metric: DMatrix::from_element(1, 1, curvature),
                factor: DMatrix::zeros(0, 0),
            };
            KnownMaximum::new(DVector::from_vec(vec![s]), &floor)
        });
        let known: Vec<_> = known.collect();
        let map = TransportMap::fit(&known.iter().map(|known| (known, 1.0)).collect::<Vec<_>>()).unwrap();
        (Surrogate::fit(known).unwrap(), map)
    }

    fn drawn(
        (surrogate, map): &(Surrogate, TransportMap),
        density: &KernelDensity,
        wanted: impl Fn(f64) -> f64,
    ) -> Vec<f64> {
        let mut rng = stream(1, 0, Stage::Sampling, 0);
        let mut here = DVector::from_vec(vec![0.5]);
        let step = |_| {
            let moved = transition((surrogate, map), Some(density), &here, &mut rng);
            if rng.random::<f64>().ln() < wanted(moved.s[0]) - wanted(here[0]) - moved.gain {
                here = moved.s;
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
    fn leaps_join_modes_that_no_step_joins() {
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
