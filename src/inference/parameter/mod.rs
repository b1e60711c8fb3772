//! What is known of a parameter before the data are seen.

mod prior;

pub use prior::{Prior, PriorShape};
