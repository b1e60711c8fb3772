//! The configuration: one TOML schema, two embedded presets, errors with line and column.

mod load;
mod schema;

pub use load::{Preset, load};
pub use schema::{
    Config, DiagnosticsConfig, Draw, HALO_MASS_DEFINITION, HaloConfig, HaloEffects, HaloProfile, ImageConfig,
    LensConfig, LightConfig, LineOfSightConfig, SheetModel, json_schema,
};
