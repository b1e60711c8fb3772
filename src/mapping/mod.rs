//! The one trait θ ↦ β with first and second derivatives, and its implementations.
//!
//! Maps, images and fits see only [`Mapping`]: they cannot tell a tidal model from 34,000 planes.

mod centre;
mod halo_sight;
pub mod multiplane;
mod rays;
pub mod tidal;

use rayon::prelude::*;

pub use halo_sight::HaloSight;
pub(crate) use rays::{HaloBlock, HaloExpansion, Rays};

use crate::error::Result;
use crate::monitor::{Monitor, Silent};

/// How many derivatives of the mapping to compute.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Order {
    /// β only.
    Position,
    /// β and the Jacobian A = ∂β/∂θ.
    Jacobian,
    /// β, A and the second derivatives b_ijk = ∂²β_i/∂θ_j∂θ_k (flexion).
    SecondDerivatives,
}

/// Where a bundle of rays comes from, column by column; columns beyond the order asked for are empty.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RayBundle {
    /// β in arcsec, one pair (x, y) a ray.
    pub beta_arcsec: Vec<[f64; 2]>,
    /// A = ∂β/∂θ as (a_xx, a_xy, a_yx, a_yy), a_ij = ∂β_i/∂θ_j.
    pub jacobian: Vec<[f64; 4]>,
    /// (b_xxx, b_xxy, b_xyy, b_yxx, b_yxy, b_yyy) per arcsec, b_ijk = ∂²β_i/∂θ_j∂θ_k.
    pub second_per_arcsec: Vec<[f64; 6]>,
}

impl RayBundle {
    /// Traces blocks of at most `rays` rays side by side; says so of each, and stops between them when told to.
    fn in_blocks(
        theta_arcsec: &[[f64; 2]],
        rays: usize,
        monitor: &dyn Monitor,
        trace: impl Fn(&[[f64; 2]]) -> Self + Sync,
    ) -> Result<Self> {
        let trace = |theta: &[[f64; 2]]| {
            monitor.check()?;
            let block = trace(theta);
            monitor.advance(theta.len() as u64);
            Ok(block)
        };
        // Few rays are not worth the way to other threads.
        if (1..=rays).contains(&theta_arcsec.len()) {
            return trace(theta_arcsec);
        }
        Self::joined(theta_arcsec.par_chunks(rays).map(trace).collect())
    }

    /// Blocks one after another, or the first error. (Rayon gathers into a `Result` by way of lists; places of their own are
    /// faster by a hundredth of a trace.)
    fn joined(blocks: Vec<Result<Self>>) -> Result<Self> {
        fn column<T: Copy>(blocks: &[RayBundle], of: impl Fn(&RayBundle) -> &[T]) -> Vec<T> {
            blocks.iter().map(of).collect::<Vec<_>>().concat()
        }
        let blocks: Vec<Self> = blocks.into_iter().collect::<Result<_>>()?;
        Ok(Self {
            beta_arcsec: column(&blocks, |block| &block.beta_arcsec),
            jacobian: column(&blocks, |block| &block.jacobian),
            second_per_arcsec: column(&blocks, |block| &block.second_per_arcsec),
        })
    }
}

/// A lens mapping from the observed direction θ to the source position β.
pub trait Mapping: Sync {
    /// Maps every ray θ (arcsec) to β and as many derivatives as `order` asks for; tells `monitor` of each ray once.
    ///
    /// # Errors
    /// [`Error::Cancelled`](crate::Error::Cancelled) alone, soon after `monitor` says so.
    fn trace(&self, theta_arcsec: &[[f64; 2]], order: Order, monitor: &dyn Monitor) -> Result<RayBundle>;

    /// [`Self::trace`] with nobody watching, for few rays.
    fn map(&self, theta_arcsec: &[[f64; 2]], order: Order) -> RayBundle {
        // Nobody cancels.
        self.trace(theta_arcsec, order, &Silent).unwrap_or_default()
    }

    /// Arrival-time delay of every ray in days against the unlensed straight path to the same β.
    ///
    /// Differences between the images of one source are observable; the zero point is not.
    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64>;
}
