//! Flat ΛCDM: distances, linear growth, the Eisenstein–Hu power spectrum and σ(M).

pub(crate) mod background;
pub mod eisenstein98;
pub(crate) mod growth;
pub(crate) mod linear;
pub(crate) mod variance;

pub use background::{Background, BackgroundParameters};
pub use linear::{LinearTheory, MASS_MAX_MSUN, MASS_MIN_MSUN, StructureParameters};
