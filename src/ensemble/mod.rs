//! Many sightlines of one configuration: planned, computed by number in any order, kept as they end, merged, summed up.

mod assembled;
mod columns;
mod expected;
mod merge;
mod plan;
mod run;
mod shard;
mod sightline;
mod slurm;
mod statistics;
mod store;

pub use assembled::{StoredStacks, assemble};
pub use columns::{EnsembleColumn, disc_radii, scalar_columns, stacks_of, tidal_columns};
pub use expected::{ExpectedShear, Smoothing, expected_shears};
pub use merge::{Merged, merge};
pub use plan::{Level, Plan};
pub use run::run;
pub use shard::Shard;
pub use sightline::{SightlineRow, sightline_row};
pub use slurm::SlurmJob;
pub use statistics::{ColumnStatistics, EnsembleStatistics, quantile};
pub use store::{Outcome, SightlineStore};
