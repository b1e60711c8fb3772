//! One sightline of an ensemble, as `haloray simulate` computes it.

use serde::{Deserialize, Serialize};

use super::columns::{disc_shears, numbers_of, scalar_columns, tidal_columns};
use super::plan::{Level, Plan};
use crate::error::Result;
use crate::imaging::{Exposure, Psf};
use crate::monitor::Monitor;
use crate::numerics::random::Stage;
use crate::pipeline::{
    FittedShear, HaloCounts, LensAndSource, Quantities, Selection, SightScalars, Sightlines, View, maps,
};

/// What is known of a sightline, in the order of the columns and stacks of its plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SightlineRow {
    /// Seen through all haloes.
    pub all_haloes: Vec<f64>,
    /// Seen through the haloes in the tidal regime.
    pub tidal_haloes: Vec<f64>,
    /// Maps and images, row-major.
    pub stacks: Vec<Vec<f32>>,
}

/// Computes sightline `number` of a plan; `sightlines` are those of the configuration of its lens.
///
/// # Errors
/// Whatever a simulation may fail by; when cancelled.
pub fn sightline_row(
    plan: &Plan,
    sightlines: &Sightlines,
    psf: &Psf,
    number: u64,
    monitor: &dyn Monitor,
) -> Result<SightlineRow> {
    let config = sightlines.config();
    let haloes = sightlines.draw(number, monitor)?;
    let sight = sightlines.line_of_sight(&haloes.catalogue, Selection::All)?;
    let judged = haloes.judged(config, &sight)?;
    let counts = HaloCounts::of(config, &haloes, &judged, &sight);
    let mut row = SightlineRow { all_haloes: Vec::new(), tidal_haloes: Vec::new(), stacks: Vec::new() };
    let mut numbers = if plan.level.has_images() {
        let shapes = LensAndSource::resolve(config, number);
        let view = |sight, stage| View::through(config, sight, &shapes, psf, (number, stage), monitor);
        let all = view(&sight, Stage::NoiseAllHaloes)?;
        let in_tidal_regime = haloes.catalogue.select(&judged.is_tidal);
        let tidal_sight = sightlines.line_of_sight(&in_tidal_regime, Selection::TidalRegime)?;
        let tidal = view(&tidal_sight, Stage::NoiseTidalHaloes)?;
        let columns = tidal_columns(plan);
        row.tidal_haloes = in_order(&tidal.quantities(), columns.iter().map(|column| column.name.as_str()));
        let pixels = |e: &Exposure| [&e.noisy_e_s, &e.noise_free_e_s].map(|pixels| single(pixels));
        row.stacks = [pixels(&all.exposure), pixels(&tidal.exposure)].concat();
        let fit = match plan.level {
            Level::Fits => Some(FittedShear::of(config, &shapes, &all, psf, &plan.model, monitor)?),
            _ => None,
        };
        numbers_of(&counts, &all.scalars(), Some(&all.los_shears), fit.as_ref())
    } else {
        let scalars = SightScalars::of(config, &sight)?;
        if plan.level == Level::Maps {
            let (maps, _) = maps(config, &sight, monitor)?;
            row.stacks = maps.columns().iter().map(|(_, _, values)| single(values)).collect();
        }
        numbers_of(&counts, &scalars, None, None)
    };
    let shears = haloes.los_shears_in_discs(config, &sight, &plan.smoothing_arcsec)?;
    numbers.0.extend(disc_shears(&plan.smoothing_arcsec, &shears).0);
    let columns = scalar_columns(plan);
    row.all_haloes = in_order(&numbers, columns.iter().map(|column| column.name.as_str()));
    let lens = plan.lens_of(number) as f64;
    let los = &config.line_of_sight;
    for (name, value) in [
        ("failed", 0.0),
        ("lens", lens),
        ("z_lens", los.z_lens),
        ("z_source", los.z_source),
        ("einstein_radius_arcsec", config.lens.einstein_radius_arcsec),
    ] {
        if let Some(place) = columns.iter().position(|column| column.name == name) {
            row.all_haloes[place] = value;
        }
    }
    Ok(row)
}

/// The values of those names; not a number where there is none.
fn in_order<'a>(numbers: &Quantities, names: impl Iterator<Item = &'a str>) -> Vec<f64> {
    names.map(|name| numbers.get(name)).collect()
}

fn single(values: &[f64]) -> Vec<f32> {
    values.iter().map(|value| *value as f32).collect()
}
