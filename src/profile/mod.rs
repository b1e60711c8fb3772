//! Mass and light profiles: angles in, angles out; no cosmology.

pub mod light;
pub mod mass;
mod parameter;
pub mod registry;
