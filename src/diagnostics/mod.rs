//! What the line of sight does: per-halo tidal variation, od/os/ds/LOS tensors, maps, images of points, critical curves.

mod best_model;
mod critical_curves;
mod critical_mesh;
mod critical_points;
mod distortion;
mod effective;
mod halo_tidal;
mod image_cells;
mod maps;
mod point_images;
mod ring_and_disc;
mod sky_window;
mod variation;
mod winding;

pub use crate::mapping::tidal::Tidal;
pub use best_model::{BestModel, WeightedRays};
pub use critical_curves::{CriticalCurve, CriticalCurves, CurveKind};
pub use distortion::Distortion;
pub use effective::EffectiveLineOfSight;
pub use halo_tidal::{HaloTidal, JudgedHaloes, los_shear_in_disc, shear_variation};
pub use maps::{MapGrid, TidalMaps};
pub use point_images::{ImageKind, PointImage, PointImages, SingularPoint};
pub use ring_and_disc::{Averaged, RingAndDisc};
pub use sky_window::SkyWindow;
pub use variation::{ShearVariation, flexion_regime_variation, total_variation};
