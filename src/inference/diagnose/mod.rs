//! What the draws say: whether chains have converged, and statistics of each quantity.

mod convergence;
mod draw_statistics;

pub use convergence::{Convergence, ESS_LIMIT, R_HAT_LIMIT, autocorrelation_time};
pub(crate) use draw_statistics::quantile_of_sorted;
pub use draw_statistics::{DrawStatistics, HPD_FRACTION};
