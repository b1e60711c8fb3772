//! The configuration: one TOML schema, two embedded presets, errors with line and column.

mod explain;
mod haloes;
mod lightcone;
mod load;
mod schema;
mod toml_tables;

pub use explain::{KeyHelp, explain};
pub use haloes::{Draw, HALO_MASS_DEFINITION, HaloConfig, HaloProfile};
pub use lightcone::LightconeConfig;
pub use load::{Preset, load, load_with, resolve};
pub use schema::{
    Config, DiagnosticsConfig, HaloEffects, ImageConfig, LensConfig, LightConfig, LineOfSightConfig,
    SheetModel, json_schema,
};
