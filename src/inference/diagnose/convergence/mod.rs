//! Whether chains have converged: rank-normalised split R-hat, bulk and tail effective sample size.
//!
//! Vehtari, Gelman, Simpson, Carpenter & Bürkner (2021, Bayesian Analysis 16, 667), equations 3–15. The numbers
//! agree with ArviZ 0.22 (`tests/reference/convergence.rs`).

mod autocorrelation_time;
mod effective_size;
mod judgement;
mod moments;
mod ranks;
mod split_r_hat;

pub use autocorrelation_time::autocorrelation_time;
pub use judgement::{Convergence, ESS_LIMIT, R_HAT_LIMIT};
