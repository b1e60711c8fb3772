//! When is the tidal approximation good enough to measure γ_LOS, and which γ_LOS? Sightlines imaged through their haloes, each
//! beside a strictly tidal twin of the same tensors and noise, and fitted with tidal and flexion models.

mod delays;
mod estimate;
mod fit_groups;
mod plan;
mod rows;
mod sightline;
mod statistics;
mod summary;

pub use fit_groups::{FitGroup, FitPair};
pub use plan::{Estimate, FitStart, SeenHaloes, ValidityCase, ValidityPlan};
pub use rows::{Mock, ValidityFit, ValidityImage, ValiditySightline, ValidityView, VaryingHalo};
pub use sightline::validity;
pub use statistics::{Biases, Deviation, Share, WITHIN_68, rank_correlation};
pub use summary::{
    DefinitionSummary, GroupSummary, MIDDLE, NOTICED_EXCESS, PREFERRED_LOG_ODDS, SingleHaloSummary,
    ValiditySummary,
};
