//! Where a sightline of a light cone points.

use crate::halo::lightcone::{Direction, LensHalo};

/// Where a sightline is to point, and the halo that it is centred on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Aim {
    pub(super) number: u64,
    pub(super) direction: Direction,
    pub(super) lens_halo: Option<LensHalo>,
}
