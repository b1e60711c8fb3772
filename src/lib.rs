//! haloray simulates what every dark-matter halo along a line of sight does to a strong-lensing image.

pub mod config;
pub mod constants;
pub mod cosmology;
pub mod diagnostics;
pub mod error;
pub mod halo;
pub mod imaging;
pub mod io;
pub mod mapping;
pub mod numerics;
pub mod pipeline;
pub mod plot;
pub mod profile;
pub mod report;

pub use error::{Error, Result};
