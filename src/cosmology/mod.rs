//! Flat ΛCDM: distances, linear growth, the Eisenstein–Hu power spectrum and σ(M).

pub(crate) mod background;
pub mod eisenstein98;
pub(crate) mod growth;
pub(crate) mod linear;
mod structure_parameters;
pub(crate) mod variance;

pub use background::{Background, BackgroundParameters};
pub use linear::{LinearTheory, MASS_MAX_MSUN, MASS_MIN_MSUN};
pub use structure_parameters::StructureParameters;
