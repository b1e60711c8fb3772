//! Searches for the highest posterior density: a climb, a maximum over some directions with others held, a blind start.

mod climb;
mod conditional_maximum;
mod easier;
mod expansion;
mod guess;
mod start;

pub(super) use climb::no_model;
pub(crate) use climb::to_the_top;
pub use climb::{Maximum, climb_from};
pub(crate) use conditional_maximum::{Axes, MOST_CURVATURES};
pub(crate) use expansion::ConditionalMaximum;
pub use start::{StartSearch, find_start};
