//! The folder of an ensemble: `sightlines.h5`, `summary.json`, `config.toml` and figures.

use super::ensemble_figures::{distribution_figure, joint_figure, settling_figure};
use super::staged::{stage_figure, stage_json, stage_text};
use crate::ensemble::EnsembleStatistics;
use crate::error::Result;
use crate::io::{SightlineTable, StackRows, StackSpec, Staging};

/// Name of the table of an ensemble.
pub const SIGHTLINES_FILE: &str = "sightlines.h5";

/// Stages every file of an ensemble; nothing is seen under its final name until `staging` is committed.
///
/// # Errors
/// [`crate::Error::Write`] when the disk is full, and those of `rows`.
pub fn write_ensemble(
    table: &SightlineTable,
    stacks: &[StackSpec],
    rows: &dyn StackRows,
    staging: &Staging,
) -> Result<EnsembleStatistics> {
    staging.write(SIGHTLINES_FILE, |path| table.write(path, stacks, rows))?;
    let statistics = EnsembleStatistics::of(table);
    stage_json(staging, "summary.json", &statistics)?;
    stage_text(staging, "config.toml", &table.provenance.config_toml)?;
    stage_figure(staging, "figures/distributions", || Ok(Some(distribution_figure(table))))?;
    stage_figure(staging, "figures/joint", || Ok(Some(joint_figure(table))))?;
    stage_figure(staging, "figures/convergence", || settling_figure(table).map(Some))?;
    Ok(statistics)
}
