//! How a long run tells where it is.

use crate::mapping::{Mapping, Order, RayBundle};

/// Somebody who watches the run: a progress bar, a log, nobody.
pub trait Progress: Sync {
    /// A stage begins; `units` is how many it will take, if known.
    fn begin(&self, stage: &str, units: Option<u64>);
    /// So many more units are done.
    fn advance(&self, units: u64);
    /// The stage is over.
    fn end(&self);
}

/// Nobody watches.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&self, _: &str, _: Option<u64>) {}
    fn advance(&self, _: u64) {}
    fn end(&self) {}
}

/// A mapping that reports the rays it has traced.
#[derive(Clone, Copy)]
pub struct Tracked<'a, M> {
    /// The mapping itself.
    pub mapping: &'a M,
    /// Who is told.
    pub progress: &'a dyn Progress,
}

/// Rays between two reports: enough to keep all threads busy, and for adaptive tracing a whole image of most kinds.
const RAYS_A_REPORT: usize = 16_384;

impl<M: Mapping> Mapping for Tracked<'_, M> {
    fn map(&self, theta_arcsec: &[[f64; 2]], order: Order) -> RayBundle {
        let parts = theta_arcsec.chunks(RAYS_A_REPORT).map(|chunk| {
            let part = self.mapping.map(chunk, order);
            self.progress.advance(chunk.len() as u64);
            part
        });
        RayBundle::concatenate(parts.collect())
    }

    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        self.mapping.delay_days(theta_arcsec)
    }
}
