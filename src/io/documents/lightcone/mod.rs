//! Light cones of N-body simulations: which columns are what, reading them in parts, and the sightlines taken from them.

mod aim;
mod candidates;
mod columns;
mod extraction;
mod folder;
mod gather;
mod reading;

pub use extraction::{ConeExtraction, extract_cone, read_cone};
pub use folder::{CONE_INDEX_FILE, write_cone};
