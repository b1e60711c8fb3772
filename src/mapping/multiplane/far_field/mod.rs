//! Adaptive tracing: the cost follows what varies across a bundle of rays, every ray carries a bound on its error.
//!
//! The field is quartered into ever narrower bundles. Haloes that are smooth across a bundle become part of its linear
//! map and of few merged polynomial kicks; rays meet only the others one by one. docs/ADAPTIVE_TRACING.md derives it.

mod bundle;
mod correction;
mod event;
mod field;
mod polynomial;
mod rays;
mod taylor;
mod tree;

pub use field::Field;

use rand::RngExt;

use super::segment::Segment;
use crate::error::{Result, require};
use crate::mapping::{Mapping, Order, RayBundle};
use crate::numerics::random::{Stage, stream};
use event::Way;
use tree::Root;

/// A segment traced to a stated accuracy instead of exactly.
///
/// Every ray of the field carries a bound on the error of its β; a ray whose bound exceeds the accuracy, rays outside
/// the field and delays are traced exactly. Derivatives come from the same expansions.
pub struct AdaptiveSegment<'a> {
    exact: Segment<'a>,
    field: Field,
    /// None where exact tracing is cheaper.
    root: Option<Root<'a>>,
}

/// Rays traced adaptively, with what is known of their errors.
#[derive(Debug, Clone, PartialEq)]
pub struct AdaptiveRays {
    /// β and derivatives of every ray.
    pub rays: RayBundle,
    /// Largest bound of |β − β_exact|, arcsec; 0 when all were traced exactly.
    pub bound_arcsec: f64,
    /// Haloes met one by one, on average over the rays.
    pub haloes_met: f64,
    /// Rays traced exactly.
    pub traced_exactly: usize,
}

/// How accurate an adaptive trace was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccuracyReport {
    /// Largest bound of |β − β_exact| over the rays, arcsec; 0 when all were traced exactly.
    pub bound_arcsec: f64,
    /// Largest |β − β_exact| over the random rays, arcsec.
    pub measured_arcsec: f64,
    /// Largest difference of an element of the Jacobian over the random rays; 0 when it was not asked for.
    pub measured_jacobian: f64,
    /// Random rays compared.
    pub rays_compared: usize,
    /// Haloes met one by one, on average over the rays.
    pub haloes_met: f64,
    /// Rays traced exactly.
    pub rays_traced_exactly: usize,
}

/// Fewer rays than this are traced exactly: the way through all planes would cost as much.
const FEWEST_RAYS: usize = 64;
/// The bounds hold for expansions, not for rounding; accuracies below are traced exactly.
const FINEST_ARCSEC: f64 = 1e-11;

impl<'a> Segment<'a> {
    /// Prepares adaptive tracing of about `rays` rays inside `field`, |β − β_exact| ≤ `accuracy_arcsec` for each.
    ///
    /// # Errors
    /// Unless the accuracy is a positive number.
    pub fn adaptive(&self, field: Field, accuracy_arcsec: f64, rays: usize) -> Result<AdaptiveSegment<'a>> {
        require(accuracy_arcsec > 0.0, "accuracy_arcsec", accuracy_arcsec, "a positive number")?;
        let bounded = field.half_arcsec.iter().all(|h| h.is_finite());
        let worthwhile = rays >= FEWEST_RAYS && accuracy_arcsec >= FINEST_ARCSEC && bounded;
        let root = worthwhile.then(|| Root::new(self, self.way(), field, accuracy_arcsec));
        Ok(AdaptiveSegment { exact: *self, field, root })
    }

    fn way(&self) -> Way<'a> {
        let strength = |chi: f64| self.chi_source_cmpc / (self.chi_source_cmpc - chi);
        Way {
            chi_start: self.chi_start,
            chi_end: self.chi_end,
            x_start: self.x_start,
            s_start: self.s_start,
            x_axis_end: self.x_axis_end,
            lens: self.lens.map(|lens| (lens.chi_cmpc, strength(lens.chi_cmpc), lens.profile)),
        }
    }
}

impl AdaptiveSegment<'_> {
    /// False when every ray is traced exactly.
    pub fn is_adaptive(&self) -> bool {
        self.root.is_some()
    }

    /// Traces rays; those outside the field and those whose bound is too large exactly.
    pub fn trace(&self, theta_arcsec: &[[f64; 2]], order: Order) -> AdaptiveRays {
        let Some(root) = &self.root else {
            return AdaptiveRays {
                rays: self.exact.map(theta_arcsec, order),
                bound_arcsec: 0.0,
                haloes_met: self.exact.planes.len() as f64,
                traced_exactly: theta_arcsec.len(),
            };
        };
        let traced = root.trace(theta_arcsec, order);
        let again: Vec<[f64; 2]> = traced.refused.iter().map(|&i| theta_arcsec[i as usize]).collect();
        let exact = self.exact.map(&again, order);
        let met = traced.met + traced.refused.len() * self.exact.planes.len();
        let n = theta_arcsec.len();
        let rays = RayBundle {
            beta_arcsec: scatter(
                n,
                &traced.rays,
                traced.bundle.beta_arcsec,
                &traced.refused,
                exact.beta_arcsec,
            ),
            jacobian: scatter(n, &traced.rays, traced.bundle.jacobian, &traced.refused, exact.jacobian),
            second_per_arcsec: scatter(
                n,
                &traced.rays,
                traced.bundle.second_per_arcsec,
                &traced.refused,
                exact.second_per_arcsec,
            ),
        };
        AdaptiveRays {
            rays,
            bound_arcsec: traced.bound_arcsec,
            haloes_met: met as f64 / n.max(1) as f64,
            traced_exactly: traced.refused.len(),
        }
    }

    /// Compares with the exact recursion on `rays` random rays of the field; says what `traced` was promised.
    pub fn report(&self, traced: &AdaptiveRays, order: Order, rays: usize, seed: u64) -> AccuracyReport {
        let mut rng = stream(seed, 0, Stage::AccuracyCheck, 0);
        let mut coordinate = |c: usize| {
            self.field.centre_arcsec[c] + self.field.half_arcsec[c] * (2.0 * rng.random::<f64>() - 1.0)
        };
        let theta: Vec<[f64; 2]> = (0..rays).map(|_| [coordinate(0), coordinate(1)]).collect();
        let (ours, exact) = (self.trace(&theta, order).rays, self.exact.map(&theta, order));
        let errors =
            ours.beta_arcsec.iter().zip(&exact.beta_arcsec).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
        let elements = ours.jacobian.iter().flatten().zip(exact.jacobian.iter().flatten());
        AccuracyReport {
            bound_arcsec: traced.bound_arcsec,
            measured_arcsec: errors.fold(0.0, f64::max),
            measured_jacobian: elements.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max),
            rays_compared: rays,
            haloes_met: traced.haloes_met,
            rays_traced_exactly: traced.traced_exactly,
        }
    }
}

/// Values in the order of the rays, from two sets with their indices; empty when nothing of the kind was traced.
fn scatter<T: Copy + Default>(n: usize, a: &[u32], of_a: Vec<T>, b: &[u32], of_b: Vec<T>) -> Vec<T> {
    if of_a.is_empty() && of_b.is_empty() {
        return Vec::new();
    }
    let mut all = vec![T::default(); n];
    for (&i, value) in a.iter().zip(of_a).chain(b.iter().zip(of_b)) {
        all[i as usize] = value;
    }
    all
}

impl Mapping for AdaptiveSegment<'_> {
    fn map(&self, theta_arcsec: &[[f64; 2]], order: Order) -> RayBundle {
        self.trace(theta_arcsec, order).rays
    }

    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        self.exact.delay_days(theta_arcsec)
    }
}
