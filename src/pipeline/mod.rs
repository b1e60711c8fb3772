//! The whole chain as values: config → haloes → line of sight → diagnostics, maps, images.

mod haloes;
mod progress;
mod simulate;
mod view;

pub use haloes::{Haloes, MassFunctionCurve, populate};
pub use progress::{Progress, Silent, Tracked};
pub use simulate::{Inputs, Simulation, simulate};
pub use view::{LensAndSource, View};
