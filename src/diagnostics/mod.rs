//! What the line of sight does: per-halo tidal variation, od/os/ds/LOS tensors, maps.

mod distortion;
mod effective;
mod halo_tidal;
mod maps;
mod variation;

pub use crate::mapping::tidal::Tidal;
pub use distortion::Distortion;
pub use effective::EffectiveLineOfSight;
pub use halo_tidal::HaloTidal;
pub use maps::{MapGrid, TidalMaps};
pub use variation::{ShearVariation, flexion_regime_variation, total_variation};
