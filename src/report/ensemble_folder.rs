//! The folder of an ensemble: `sightlines.h5`, `summary.json`, `config.toml`, figures and, of a whole one, its page.

use super::ensemble_figures::{distribution_figure, joint_figure, settling_figure};
use super::page::{RunRecord, stage_page};
use super::staged::{stage_figure, stage_json, stage_text};
use crate::ensemble::{EnsembleStatistics, disc_radii};
use crate::error::Result;
use crate::io::{SightlineTable, StackRows, StackSpec, Staging};

/// Name of the table of an ensemble.
pub const SIGHTLINES_FILE: &str = "sightlines.h5";

/// Sightlines from which contours of their quantities, and how averages settle, are drawn.
const FEWEST_IN_CONTOURS: usize = 20;

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
    // Contours and a trend of fewer would show what is not there.
    if table.numbers.len() >= FEWEST_IN_CONTOURS {
        stage_figure(staging, "figures/joint", || Ok(Some(joint_figure(table))))?;
        stage_figure(staging, "figures/convergence", || settling_figure(table).map(Some))?;
    }
    if table.numbers.iter().copied().eq(table.whole.clone()) {
        stage_page(staging, "", &record(table))?;
    }
    Ok(statistics)
}

/// What repeats the ensemble, whether one process computed it or shards were merged.
fn record(table: &SightlineTable) -> RunRecord {
    let number = table.whole.end - table.whole.start;
    let each = number / table.lenses.len().max(1) as u64;
    let mut words =
        vec!["config.toml".into(), "-n".into(), each.to_string(), "--level".into(), table.level.clone()];
    let mut option = |is_needed: bool, name: &str, value: &str| {
        if is_needed {
            words.extend([name, value].map(String::from));
        }
    };
    option(table.whole.start > 0, "--first", &table.whole.start.to_string());
    option(!table.model.is_empty(), "--model", &table.model);
    option(!table.lenses.is_empty(), "--lenses", "lenses.csv");
    let radii: Vec<String> = disc_radii(table).iter().map(f64::to_string).collect();
    option(!radii.is_empty(), "--smoothing", &radii.join(","));
    option(true, "-o", "ensemble_again");
    let about = format!("{number} sightlines of one configuration: {}.", table.level);
    let makes_images = !["scalars", "maps"].contains(&table.level.as_str());
    RunRecord { makes_images, ..RunRecord::new("ensemble", &words, &about, &table.provenance) }
}
