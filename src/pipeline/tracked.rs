//! A mapping that reports the rays it has traced.

use crate::mapping::{Mapping, Order, RayBundle};
use crate::monitor::Monitor;

/// A mapping that reports the rays it has traced.
#[derive(Clone, Copy)]
pub struct Tracked<'a, M> {
    /// The mapping itself.
    pub mapping: &'a M,
    /// Who is told.
    pub monitor: &'a dyn Monitor,
}

/// Rays between two reports: enough to keep all threads busy, and for adaptive tracing a whole image of most kinds.
const RAYS_A_REPORT: usize = 16_384;

impl<M: Mapping> Mapping for Tracked<'_, M> {
    fn map(&self, theta_arcsec: &[[f64; 2]], order: Order) -> RayBundle {
        let parts = theta_arcsec.chunks(RAYS_A_REPORT).map(|chunk| {
            let part = self.mapping.map(chunk, order);
            self.monitor.advance(chunk.len() as u64);
            part
        });
        RayBundle::concatenate(parts.collect())
    }

    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        self.mapping.delay_days(theta_arcsec)
    }
}
