//! One trajectory of the No-U-Turn sampler with multinomial weights.
//!
//! Hoffman & Gelman (2014, JMLR 15, 1593) with the multinomial draw, the generalised U-turn criterion and
//! biased progressive sampling of Betancourt (2017, arXiv:1701.02434, appendix A), and the criterion across two
//! joined halves, without which resonant orbits in nearly normal posteriors are kept. Momenta live in whitened
//! coordinates, where the mass matrix is 1.

use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};

use crate::inference::LatentLikelihood;
use crate::inference::sample::point::Point;
use crate::inference::sample::whitening::Whitening;

/// Energy error beyond which the integrator counts as unstable.
const DIVERGENCE: f64 = 1000.0;

/// How trajectories are integrated.
#[derive(Clone, Copy)]
pub(super) struct Integrator<'a> {
    pub likelihood: &'a dyn LatentLikelihood,
    pub whitening: &'a Whitening,
    pub step: f64,
    pub max_depth: u8,
}

/// The next draw and what is noted about its trajectory.
pub(super) struct Draw {
    pub point: Point,
    pub energy: f64,
    pub acceptance: f64,
    pub divergent: bool,
    pub depth: u8,
}

/// A point of phase space; `force` is the gradient in whitened coordinates.
#[derive(Clone)]
struct Phase {
    point: Point,
    momentum: Vec<f64>,
    force: Vec<f64>,
}

/// A stretch of the trajectory, its ends ordered in the direction of growth.
struct Stretch {
    near: Phase,
    far: Phase,
    /// Sum of the momenta.
    rho: Vec<f64>,
    log_weight: f64,
    sample: Point,
}

/// What the leaves of a trajectory add up to.
struct Tally<'a, R> {
    integrator: Integrator<'a>,
    energy: f64,
    acceptance: f64,
    gradients: u64,
    divergent: bool,
    rng: &'a mut R,
}

impl Integrator<'_> {
    /// The draw that follows `from`.
    pub fn draw(self, from: &Point, rng: &mut impl Rng) -> Draw {
        let momentum: Vec<f64> = from.z.iter().map(|_| StandardNormal.sample(rng)).collect();
        let force = self.whitening.pull(&from.gradient);
        let start = Phase { point: from.clone(), momentum, force };
        let energy = start.energy();
        let mut tally =
            Tally { integrator: self, energy, acceptance: 0.0, gradients: 0, divergent: false, rng };
        let mut whole = Stretch::leaf(start, 0.0);
        let mut is_forward = true;
        let mut depth = 0;
        while depth < self.max_depth {
            if tally.rng.random::<bool>() != is_forward {
                is_forward = !is_forward;
                std::mem::swap(&mut whole.near, &mut whole.far);
            }
            depth += 1;
            let Some(new) = tally.grow(&whole.far, depth - 1, if is_forward { 1.0 } else { -1.0 }) else {
                break;
            };
            if tally.rng.random::<f64>().ln() < new.log_weight - whole.log_weight {
                whole.sample = new.sample.clone();
            }
            let turned = turns_between(&whole, &new);
            whole = whole.joined(new);
            if turned {
                break;
            }
        }
        let acceptance = tally.acceptance / tally.gradients.max(1) as f64;
        Draw { point: whole.sample, energy, acceptance, divergent: tally.divergent, depth }
    }

    /// One leapfrog step forward (+1) or backward (−1) in time.
    fn leapfrog(&self, from: &Phase, direction: f64) -> Phase {
        let half = 0.5 * direction * self.step;
        let kicked = |momentum: &[f64], force: &[f64]| -> Vec<f64> {
            momentum.iter().zip(force).map(|(p, f)| p + half * f).collect()
        };
        let momentum = kicked(&from.momentum, &from.force);
        let drift = self.whitening.push(&momentum);
        let z = from.point.z.iter().zip(&drift).map(|(z, drift)| z + 2.0 * half * drift).collect();
        let point = Point::with_gradient(self.likelihood, z);
        let force = self.whitening.pull(&point.gradient);
        Phase { momentum: kicked(&momentum, &force), point, force }
    }
}

impl<R: Rng> Tally<'_, R> {
    /// 2^depth further steps from `from`; `None` if they turn back or diverge, for then the trajectory ends
    /// here.
    fn grow(&mut self, from: &Phase, depth: u8, direction: f64) -> Option<Stretch> {
        if depth == 0 {
            let phase = self.integrator.leapfrog(from, direction);
            self.gradients += 1;
            let log_weight = self.energy - phase.energy();
            let is_stable = log_weight > -DIVERGENCE;
            self.divergent |= !is_stable;
            self.acceptance += if is_stable { log_weight.min(0.0).exp() } else { 0.0 };
            return is_stable.then(|| Stretch::leaf(phase, log_weight));
        }
        let mut inner = self.grow(from, depth - 1, direction)?;
        let outer = self.grow(&inner.far, depth - 1, direction)?;
        let log_weight = log_sum(inner.log_weight, outer.log_weight);
        if self.rng.random::<f64>().ln() < outer.log_weight - log_weight {
            inner.sample = outer.sample.clone();
        }
        (!turns_between(&inner, &outer)).then(|| inner.joined(outer))
    }
}

impl Phase {
    fn energy(&self) -> f64 {
        0.5 * dot(&self.momentum, &self.momentum) - self.point.log_density
    }
}

impl Stretch {
    fn leaf(phase: Phase, log_weight: f64) -> Self {
        let (rho, sample) = (phase.momentum.clone(), phase.point.clone());
        Self { near: phase.clone(), far: phase, rho, log_weight, sample }
    }

    /// This stretch and the one beyond it; the sample stays this one's.
    fn joined(self, beyond: Self) -> Self {
        let rho = sum(&self.rho, &beyond.rho);
        let log_weight = log_sum(self.log_weight, beyond.log_weight);
        Self { near: self.near, far: beyond.far, rho, log_weight, sample: self.sample }
    }
}

/// Whether two neighbouring stretches, or each of them with the first point of the other, begin to turn back.
fn turns_between(inner: &Stretch, outer: &Stretch) -> bool {
    let turns = |rho: &[f64], first: &Phase, last: &Phase| {
        dot(rho, &first.momentum) <= 0.0 || dot(rho, &last.momentum) <= 0.0
    };
    turns(&sum(&inner.rho, &outer.rho), &inner.near, &outer.far)
        || turns(&sum(&inner.rho, &outer.near.momentum), &inner.near, &outer.near)
        || turns(&sum(&inner.far.momentum, &outer.rho), &inner.far, &outer.far)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

/// ln(eᵃ + eᵇ).
fn log_sum(a: f64, b: f64) -> f64 {
    let high = a.max(b);
    high + (-(a - b).abs()).exp().ln_1p()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ln L = −½ Σ z² (s⁻² − 1), so that the posterior is N(0, s²).
    struct Narrow(f64);

    impl LatentLikelihood for Narrow {
        fn dimension(&self) -> usize {
            2
        }
        fn log_likelihood(&self, z: &[f64]) -> f64 {
            -0.5 * dot(z, z) * (self.0.powi(-2) - 1.0)
        }
        fn log_likelihood_gradient(&self, z: &[f64], gradient: &mut [f64]) -> f64 {
            gradient.iter_mut().zip(z).for_each(|(g, z)| *g = -z * (self.0.powi(-2) - 1.0));
            self.log_likelihood(z)
        }
    }

    fn start(likelihood: &Narrow) -> Phase {
        let point = Point::with_gradient(likelihood, vec![0.05, -0.1]);
        let momentum = vec![0.7, 0.3];
        Phase { force: point.gradient.clone(), point, momentum }
    }

    #[test]
    fn leapfrog_is_reversible_and_of_second_order() {
        let likelihood = Narrow(0.3);
        let whitening = Whitening::identity(2);
        let error = |step: f64| {
            let integrator =
                Integrator { likelihood: &likelihood, whitening: &whitening, step, max_depth: 10 };
            let start = start(&likelihood);
            let steps = (0.4 / step).round() as usize;
            let end = (0..steps).fold(start.clone(), |phase, _| integrator.leapfrog(&phase, 1.0));
            let back = (0..steps).fold(end.clone(), |phase, _| integrator.leapfrog(&phase, -1.0));
            assert!((back.point.z[0] - start.point.z[0]).abs() < 1e-13);
            // Exactly: z0 cos(t/s) + s p0 sin(t/s).
            let (sin, cos) = (0.4_f64 / 0.3).sin_cos();
            (end.point.z[0] - (0.05 * cos + 0.3 * 0.7 * sin)).abs()
        };
        let order = (error(0.02) / error(0.01)).log2();
        assert!((order - 2.0).abs() < 0.05, "{order}");
    }

    #[test]
    fn an_unstable_step_diverges_and_stays() {
        let likelihood = Narrow(1e-3);
        let whitening = Whitening::identity(2);
        let integrator =
            Integrator { likelihood: &likelihood, whitening: &whitening, step: 1.0, max_depth: 10 };
        let from = start(&likelihood).point;
        let mut rng = crate::numerics::random::stream(1, 0, crate::numerics::random::Stage::Sampling, 0);
        let draw = integrator.draw(&from, &mut rng);
        assert!(draw.divergent && draw.point == from && draw.depth == 1);
    }
}
