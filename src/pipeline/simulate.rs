//! The one function that runs the chain.

use super::haloes::{Haloes, SingleHaloes, line_of_sight_of, sheets_of};
use super::matter::{MatterBudget, Selection};
use super::shapes::LensAndSource;
use super::sightlines::populate;
use super::view::{View, maps};
use crate::config::Config;
use crate::diagnostics::TidalMaps;
use crate::error::Result;
use crate::halo::HaloCatalogue;
use crate::imaging::Psf;
use crate::mapping::multiplane::{AccuracyReport, LineOfSight, Sheets};
use crate::monitor::Monitor;
use crate::numerics::random::Stage;

/// What a run needs besides its configuration: files already read.
#[derive(Debug, Clone)]
pub struct Inputs {
    /// The user's own haloes instead of a draw.
    pub catalogue: Option<HaloCatalogue>,
    /// The point-spread function.
    pub psf: Psf,
}

/// Everything one run finds out.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// The resolved configuration.
    pub config: Config,
    /// The haloes and their population.
    pub haloes: Haloes,
    /// Distortions each halo causes alone.
    pub single_haloes: SingleHaloes,
    /// The sheets beside all haloes.
    pub sheets: Sheets,
    /// Mass in haloes and sheets.
    pub matter: MatterBudget,
    /// Shapes of lens and source.
    pub shapes: LensAndSource,
    /// Seen through all haloes.
    pub all: View,
    /// Seen through the haloes in the tidal regime only (Δ_h below the threshold).
    pub tidal: View,
    /// Maps of all haloes, main lens excluded.
    pub maps: TidalMaps,
    /// How accurately rays of images and maps were traced.
    pub accuracy: AccuracyReport,
}

/// Runs the whole chain for realisation `realisation` of the configured seed.
///
/// # Errors
/// For input that the configuration could not check by itself (an imported catalogue, say); when cancelled.
pub fn simulate(
    config: &Config,
    inputs: Inputs,
    realisation: u64,
    monitor: &dyn Monitor,
) -> Result<Simulation> {
    let haloes = populate(config, inputs.catalogue, realisation, monitor)?;

    let task = monitor.task("tidal variation of each halo", None);
    let single_haloes = haloes.effects(config)?;
    let within = single_haloes.decisive(config).within(config.diagnostics.delta_threshold);
    let in_tidal_regime = haloes.catalogue.select(&within);
    drop(task);

    let shapes = LensAndSource::resolve(config, realisation);
    let view = |name: &str, sight, stage| {
        let _task = monitor.task(name, None);
        View::through(config, sight, &shapes, &inputs.psf, (realisation, stage), monitor)
    };
    let sheets = sheets_of(config, &haloes, &haloes.catalogue, Selection::All)?;
    let sight = LineOfSight::along(config.line_of_sight.reference, &haloes.catalogue, &sheets)?;
    let matter = MatterBudget::of(config, &haloes.linear, &haloes.population, sight.sheet_convergence())?;
    let all = view("image through all haloes", &sight, Stage::NoiseAllHaloes)?;
    let tidal_sight = line_of_sight_of(config, &haloes, &in_tidal_regime, Selection::TidalRegime)?;
    let tidal = view("image through tidal haloes", &tidal_sight, Stage::NoiseTidalHaloes)?;

    let (maps, of_maps) = maps(config, &sight, monitor)?;
    let accuracy = all.accuracy.and(&tidal.accuracy).and(&of_maps);
    Ok(Simulation {
        config: config.clone(),
        haloes,
        single_haloes,
        sheets,
        matter,
        shapes,
        all,
        tidal,
        maps,
        accuracy,
    })
}
