//! Flat ΛCDM: distances, linear growth, the Eisenstein–Hu power spectrum and σ(M).

pub mod background;
pub mod eisenstein98;
pub mod growth;
pub mod linear;
pub mod variance;

pub use background::{Background, BackgroundParameters};
pub use linear::{LinearTheory, MASS_MAX_MSUN, MASS_MIN_MSUN, StructureParameters};
