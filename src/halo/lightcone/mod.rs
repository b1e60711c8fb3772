//! Sightlines through a light cone of the sky: directions, footprint, and which haloes lie in which cylinder.

mod cone_sightline;
mod cylinders;
mod direction;
mod footprint;

pub use cone_sightline::{ConeHaloes, ConeSightline, LensHalo};
pub use cylinders::{Cylinders, LARGEST_SEPARATION_DEG, Member};
pub use direction::{Direction, TangentFrame};
pub use footprint::{Footprint, FootprintOfHaloes};
