//! Searches for the highest posterior density: a climb, a maximum over some directions with others held, a blind start.

mod climb;
mod conditional_maximum;
mod expansion;
mod guess;
mod start;

pub use climb::Maximum;
pub(crate) use climb::to_the_top;
pub(crate) use conditional_maximum::{Axes, MOST_CURVATURES};
pub(crate) use expansion::ConditionalMaximum;
pub(super) use start::no_model;
pub use start::{StartSearch, climb_from, find_start};
