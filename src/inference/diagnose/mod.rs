//! What draws and residuals say: convergence, statistics of each quantity, whether the model describes the image.

mod convergence;
mod doubts;
mod draw_statistics;
mod goodness;

pub use convergence::{Convergence, ESS_LIMIT, R_HAT_LIMIT, autocorrelation_time};
pub use doubts::doubts;
pub(crate) use draw_statistics::quantile_of_sorted;
pub use draw_statistics::{DrawStatistics, HPD_FRACTION};
pub use goodness::{Goodness, P_VALUE_LIMIT, negative_lights};
