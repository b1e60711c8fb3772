//! Adaptive tracing: rays meet the haloes they pass closely one by one, all others as one smooth map.
//!
//! The field is quartered into tiles. A hundred rays through a tile, traced exactly or through a wider tile, show
//! where rays meet each rough plane and how smooth haloes pass a kick on; both vary smoothly over the tile and are
//! interpolated. Rays of the tile then meet the rough planes alone. Through the main lens there are no tiles: smooth haloes are
//! gathered onto a few planes. docs/ADAPTIVE_TRACING.md derives the errors.

mod accuracy;
mod all_planes;
mod build;
mod chebyshev;
mod field;
mod gathered;
mod kicks;
mod outline;
mod phase_space;
mod report;
mod sample;
mod tile;
mod tree;

pub use accuracy::{Accuracy, Exact};
pub use field::Field;
pub use report::AccuracyReport;

use std::sync::{Mutex, PoisonError};

use rand::RngExt;

use super::segment::Segment;
use crate::error::Result;
use crate::mapping::{Mapping, Order, RayBundle};
use crate::monitor::{Monitor, Uncounted};
use crate::numerics::random::{Stage, stream};
use gathered::{Call, Gathered, MANY_RAYS};
use tree::{FEW_RAYS, Part, Traced, Tree};

/// A segment traced to a stated accuracy instead of exactly.
///
/// Tiles, and behind the main lens gathered fields, carry a bound on the error of β; rays outside the field, rays that none of
/// them holds, and delays are traced exactly. Every call compares random rays with the exact recursion, and traces all rays exactly if one of
/// them is off by more than the accuracy.
pub struct AdaptiveSegment {
    exact: Segment,
    /// The accuracy in arcsec and what keeps it; none where exact tracing is asked for or cheaper.
    quicker: Option<(f64, Quicker)>,
    report: Mutex<AccuracyReport>,
}

/// What traces rays with less work than the exact recursion.
enum Quicker {
    /// Without a main lens.
    Tiles(Box<Tree>),
    /// Through one, with the whole field gathered at once unless it has too many rays.
    Gathered(Option<Box<Gathered>>),
}

impl Quicker {
    /// Fewer rays are traced exactly.
    fn few_rays(&self) -> usize {
        match self {
            Self::Gathered(Some(_)) => 3 * COMPARED,
            Self::Tiles(_) | Self::Gathered(None) => FEW_RAYS,
        }
    }
}

/// Random rays compared with the exact recursion: what one tile of it holds.
const COMPARED: usize = 48;
/// Rounding of the interpolated maps is below this; finer accuracies are traced exactly.
const FINEST_ARCSEC: f64 = 1e-11;

impl Segment {
    /// Prepares tracing of about `rays` rays inside `field` to a stated accuracy.
    ///
    /// Everything is traced exactly without a field, for few rays, and for accuracies that are not above 1e-11″.
    pub fn adaptive(&self, accuracy: Accuracy, field: Option<Field>, rays: usize) -> AdaptiveSegment {
        let quicker = match (accuracy, field) {
            (Accuracy::WithinArcsec(arcsec), Some(field))
                if arcsec >= FINEST_ARCSEC && rays >= FEW_RAYS && field.is_extended() =>
            {
                let quicker = match &self.lens {
                    None => Some(Quicker::Tiles(Tree::new(self.clone(), &field, arcsec).into())),
                    Some(_) if rays > MANY_RAYS => Some(Quicker::Gathered(None)),
                    Some(_) => {
                        Gathered::new(self, &field, arcsec).map(|own| Quicker::Gathered(Some(own.into())))
                    }
                };
                quicker.map(|quicker| (arcsec, quicker))
            }
            _ => None,
        };
        AdaptiveSegment { exact: self.clone(), quicker, report: Mutex::default() }
    }
}

impl AdaptiveSegment {
    /// How accurate the calls of [`Mapping::trace`] so far were.
    pub fn report(&self) -> AccuracyReport {
        *self.report.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, new: &AccuracyReport) {
        let mut sum = self.report.lock().unwrap_or_else(PoisonError::into_inner);
        *sum = sum.and(new);
    }

    fn all_exactly(
        &self,
        theta_arcsec: &[[f64; 2]],
        order: Order,
        monitor: &dyn Monitor,
    ) -> Result<RayBundle> {
        let rays = theta_arcsec.len();
        let planes_met = rays * self.exact.planes().len();
        self.note(&AccuracyReport {
            rays,
            rays_traced_exactly: rays,
            planes_met,
            ..AccuracyReport::default()
        });
        self.exact.trace(theta_arcsec, order, monitor)
    }

    /// Every ray from the tree or, where that refused it, from the exact recursion.
    fn complete(
        &self,
        theta: &[[f64; 2]],
        order: Order,
        traced: Traced,
        monitor: &dyn Monitor,
    ) -> Result<RayBundle> {
        let again: Vec<[f64; 2]> = traced.refused.iter().map(|&i| theta[i as usize]).collect();
        let exact = Part { bundle: self.exact.trace(&again, order, monitor)?, rays: traced.refused };
        let mut parts = traced.parts;
        parts.push(exact);
        Ok(RayBundle {
            beta_arcsec: gather(theta.len(), &parts, |bundle| &bundle.beta_arcsec),
            jacobian: gather(theta.len(), &parts, |bundle| &bundle.jacobian),
            second_per_arcsec: gather(theta.len(), &parts, |bundle| &bundle.second_per_arcsec),
        })
    }
}

/// Values of one kind in the order of the rays; empty when nothing of the kind was traced.
fn gather<T: Copy + Default>(n: usize, parts: &[Part], of: impl Fn(&RayBundle) -> &[T]) -> Vec<T> {
    if parts.iter().all(|part| of(&part.bundle).is_empty()) {
        return Vec::new();
    }
    let mut all = vec![T::default(); n];
    for part in parts {
        for (&ray, value) in part.rays.iter().zip(of(&part.bundle)) {
            all[ray as usize] = *value;
        }
    }
    all
}

impl Mapping for AdaptiveSegment {
    fn trace(&self, theta_arcsec: &[[f64; 2]], order: Order, monitor: &dyn Monitor) -> Result<RayBundle> {
        let n = theta_arcsec.len();
        let is_worth_it = |(_, quicker): &&(f64, Quicker)| n >= quicker.few_rays();
        let Some((accuracy_arcsec, quicker)) = self.quicker.as_ref().filter(is_worth_it) else {
            return self.all_exactly(theta_arcsec, order, monitor);
        };
        let mut rng = stream(n as u64, 0, Stage::AccuracyCheck, 0);
        let chosen: Vec<usize> = (0..COMPARED).map(|_| rng.random_range(0..n)).collect();
        let some: Vec<[f64; 2]> = chosen.iter().map(|&i| theta_arcsec[i]).collect();
        let trace = || match quicker {
            Quicker::Tiles(tree) => tree.trace(theta_arcsec, order, monitor),
            Quicker::Gathered(gathered) => {
                let (segment, accuracy_arcsec) = (&self.exact, *accuracy_arcsec);
                let call = Call { segment, accuracy_arcsec, theta_arcsec, order, monitor };
                call.trace(gathered.as_deref(), (0..n as u32).collect(), 0)
            }
        };
        let (exact, traced) = rayon::join(|| self.exact.map(&some, order), trace);
        let traced = traced?;
        let report = AccuracyReport {
            bound_arcsec: traced.bound_arcsec,
            rays: n,
            rays_traced_exactly: traced.refused.len(),
            planes_met: traced.met + traced.refused.len() * self.exact.planes().len(),
            ..AccuracyReport::default()
        };
        let rays = self.complete(theta_arcsec, order, traced, monitor)?;
        let report = report.compared(&rays, &chosen, &exact);
        if !report.is_within(*accuracy_arcsec) {
            return self.all_exactly(theta_arcsec, order, &Uncounted(monitor));
        }
        self.note(&report);
        Ok(rays)
    }

    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        self.exact.delay_days(theta_arcsec)
    }
}
