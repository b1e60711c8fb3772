//! Adaptive tracing: rays meet the haloes they pass closely one by one, all others as one smooth map.
//!
//! The field is quartered into tiles. A hundred rays through a tile, traced exactly or through a wider tile, show
//! where rays meet each rough plane and what smooth haloes do to a kick; both vary smoothly over the tile and are
//! interpolated. Rays of the tile then meet the rough planes alone. docs/ADAPTIVE_TRACING.md derives the errors.

mod build;
mod chebyshev;
mod field;
mod kick;
mod survey;
mod tile;
mod tree;
mod vacuum;
mod way;

pub use field::Field;

use std::sync::Mutex;

use rand::RngExt;

use super::segment::Segment;
use crate::error::{Result, require};
use crate::mapping::{Mapping, Order, RayBundle};
use crate::numerics::random::{Stage, stream};
use tree::{FEW, Traced, Tree};

/// A segment traced to a stated accuracy instead of exactly.
///
/// Tiles carry a bound on the error of β; rays outside the field, rays that no accurate tile holds, and delays are
/// traced exactly. Every call compares random rays with the exact recursion and falls back to it for all rays if one
/// is off by more than the accuracy.
pub struct AdaptiveSegment<'a> {
    exact: Segment<'a>,
    accuracy_arcsec: f64,
    /// None where exact tracing is cheaper.
    tree: Option<Tree<'a>>,
    report: Mutex<AccuracyReport>,
}

/// How accurate adaptive traces were, over all calls so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct AccuracyReport {
    /// Largest bound of |β − β_exact| over the rays, arcsec; 0 when all were traced exactly.
    pub bound_arcsec: f64,
    /// Largest |β − β_exact| over the random rays, arcsec.
    pub measured_arcsec: f64,
    /// Largest difference of an element of the Jacobian over the random rays, where one was asked for.
    pub measured_jacobian: f64,
    /// Rays, those of them traced exactly, and random rays compared with the exact recursion.
    pub rays: usize,
    /// Rays traced exactly.
    pub rays_traced_exactly: usize,
    /// Random rays compared with the exact recursion.
    pub rays_compared: usize,
    /// Halo planes met one by one, summed over the rays.
    pub planes_met: usize,
}

/// Random rays compared with the exact recursion: what one tile of it holds.
const COMPARED: usize = 48;
/// Fewer rays than this are traced exactly: a survey of all planes costs as much.
const FEWEST_RAYS: usize = 4 * FEW;
/// Rounding of the interpolated maps; accuracies finer than a hundred times that are traced exactly.
const FINEST_ARCSEC: f64 = 1e-11;

impl<'a> Segment<'a> {
    /// Prepares adaptive tracing of about `rays` rays inside `field`, |β − β_exact| ≤ `accuracy_arcsec` for each.
    ///
    /// # Errors
    /// Unless the accuracy is a positive number.
    pub fn adaptive(&self, field: Field, accuracy_arcsec: f64, rays: usize) -> Result<AdaptiveSegment<'a>> {
        require(accuracy_arcsec > 0.0, "accuracy_arcsec", accuracy_arcsec, "a positive number")?;
        let extended = field.half_arcsec.iter().all(|h| h.is_finite()) && field.half_arcsec != [0.0; 2];
        let worthwhile = rays >= FEWEST_RAYS && accuracy_arcsec >= FINEST_ARCSEC && extended;
        let tree = worthwhile.then(|| Tree::new(*self, &field, accuracy_arcsec));
        Ok(AdaptiveSegment { exact: *self, accuracy_arcsec, tree, report: Mutex::default() })
    }
}

impl AdaptiveSegment<'_> {
    /// How accurate the calls of [`Mapping::map`] so far were.
    pub fn report(&self) -> AccuracyReport {
        *self.report.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn note(&self, new: AccuracyReport) {
        let mut sum = self.report.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        *sum = AccuracyReport {
            bound_arcsec: sum.bound_arcsec.max(new.bound_arcsec),
            measured_arcsec: sum.measured_arcsec.max(new.measured_arcsec),
            measured_jacobian: sum.measured_jacobian.max(new.measured_jacobian),
            rays: sum.rays + new.rays,
            rays_traced_exactly: sum.rays_traced_exactly + new.rays_traced_exactly,
            rays_compared: sum.rays_compared + new.rays_compared,
            planes_met: sum.planes_met + new.planes_met,
        };
    }

    fn all_exactly(&self, theta_arcsec: &[[f64; 2]], order: Order) -> RayBundle {
        let rays = theta_arcsec.len();
        let planes_met = rays * self.exact.planes.len();
        self.note(AccuracyReport { rays, rays_traced_exactly: rays, planes_met, ..AccuracyReport::default() });
        self.exact.map(theta_arcsec, order)
    }

    /// Every ray from the tree or, where that refused it, from the exact recursion.
    fn complete(&self, theta: &[[f64; 2]], order: Order, traced: Traced) -> RayBundle {
        let again: Vec<[f64; 2]> = traced.refused.iter().map(|&i| theta[i as usize]).collect();
        let exact = self.exact.map(&again, order);
        let (n, ours, theirs) = (theta.len(), &traced.rays, &traced.refused);
        let bundle = traced.bundle;
        RayBundle {
            beta_arcsec: scatter(n, ours, bundle.beta_arcsec, theirs, exact.beta_arcsec),
            jacobian: scatter(n, ours, bundle.jacobian, theirs, exact.jacobian),
            second_per_arcsec: scatter(n, ours, bundle.second_per_arcsec, theirs, exact.second_per_arcsec),
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

/// Largest of some differences; not a number counts as infinite.
fn largest(differences: impl Iterator<Item = f64>) -> f64 {
    differences.fold(0.0, |most, d| if d <= most { most } else if d.is_nan() { f64::INFINITY } else { d })
}

impl Mapping for AdaptiveSegment<'_> {
    fn map(&self, theta_arcsec: &[[f64; 2]], order: Order) -> RayBundle {
        let n = theta_arcsec.len();
        let tree = match &self.tree {
            Some(tree) if n >= FEW => tree,
            _ => return self.all_exactly(theta_arcsec, order),
        };
        let mut rng = stream(n as u64, 0, Stage::AccuracyCheck, 0);
        let chosen: Vec<usize> = (0..COMPARED).map(|_| rng.random_range(0..n)).collect();
        let some: Vec<[f64; 2]> = chosen.iter().map(|&i| theta_arcsec[i]).collect();
        let (exact, traced) =
            rayon::join(|| self.exact.map(&some, order), || tree.trace(theta_arcsec, order));
        let report = AccuracyReport {
            bound_arcsec: traced.bound_arcsec,
            rays: n,
            rays_traced_exactly: traced.refused.len(),
            rays_compared: COMPARED,
            planes_met: traced.met + traced.refused.len() * self.exact.planes.len(),
            ..AccuracyReport::default()
        };
        let rays = self.complete(theta_arcsec, order, traced);
        let pairs = || chosen.iter().enumerate();
        let measured_arcsec = largest(pairs().map(|(k, &i)| {
            let (ours, exact) = (rays.beta_arcsec[i], exact.beta_arcsec[k]);
            (ours[0] - exact[0]).hypot(ours[1] - exact[1])
        }));
        if !(measured_arcsec <= self.accuracy_arcsec) {
            return self.all_exactly(theta_arcsec, order);
        }
        let measured_jacobian = if rays.jacobian.is_empty() {
            0.0
        } else {
            largest(pairs().flat_map(|(k, &i)| {
                rays.jacobian[i].into_iter().zip(exact.jacobian[k]).map(|(a, b)| (a - b).abs())
            }))
        };
        self.note(AccuracyReport { measured_arcsec, measured_jacobian, ..report });
        rays
    }

    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        self.exact.delay_days(theta_arcsec)
    }
}
