//! `haloray map`: maps of the distortions of a line of sight.

use std::path::PathBuf;

use haloray::Result;
use haloray::io::{Provenance, RunFile, Staging, write_curves, write_hdf5_atomically, write_maps};
use haloray::pipeline::{
    self, LensAndSource, critical_curves, lens_centre, line_of_sight, main_lens, source_centre,
};
use haloray::report::{RunRecord, map_figures, stage_figures, stage_page};

use crate::bars::Bars;
use crate::output::{Output, commit, print_files};
use crate::record::{configured, option};
use crate::settings::{Sight, imported_haloes, provenance, whole};
use crate::sheets::{kappa_of_sheets, tell_sheets};
use crate::summary::print_accuracy;

/// Map κ, γ1, γ2, ω, |F|, |G| and Δ of the haloes on a grid (main lens excluded).
///
/// Haloes are drawn as configured or read from --haloes; the grid is [maps] of the configuration.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray map -o maps\n  haloray map --haloes haloes.csv --grid-points 201 -o maps.h5"
)]
pub struct Args {
    #[command(flatten)]
    sight: Sight,
    /// Nodes a side, instead of the configuration's.
    #[arg(long, allow_negative_numbers = true, value_name = "N")]
    #[arg(value_parser = whole::<usize>(2..=2048))]
    grid_points: Option<usize>,
    /// Largest |θ_x| and |θ_y| of the grid, instead of the configuration's.
    #[arg(long, allow_negative_numbers = true, value_name = "ARCSEC")]
    half_width_arcsec: Option<f64>,
    /// Folder for maps.h5, the figures and their page, or one file ending in .h5 for the maps alone.
    #[arg(long, short, value_name = "DIR|FILE.h5")]
    output: PathBuf,
}

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let mut config = args.sight.resolve()?;
    args.sight.check_seed_matters(&config)?;
    config.maps.points = args.grid_points.unwrap_or(config.maps.points);
    config.maps.half_width_arcsec = args.half_width_arcsec.unwrap_or(config.maps.half_width_arcsec);
    config.validate().map_err(|error| error.named("maps.half_width_arcsec", "--half-width-arcsec"))?;
    let imported = imported_haloes(&config, args.sight.sightline(), bars)?;
    let provenance = provenance(&config, args.sight.sightline())?;
    let output = Output::begin(
        &args.output,
        &["h5", "hdf5"],
        &[config.haloes.catalogue.as_deref(), args.sight.file()],
        &["maps.h5", "config.toml"],
        bars,
    )?;

    let haloes = pipeline::populate(&config, imported, args.sight.sightline(), bars)?;
    let sight = line_of_sight(&config, &haloes, &haloes.catalogue)?;
    let kappa_of_sheets = kappa_of_sheets(&config, &haloes)?;
    let (maps, accuracy) = pipeline::maps(&config, &sight, bars)?;
    let curves = config.diagnostics.critical_curves.then(|| {
        bars.stage("critical curves", || {
            let shapes = LensAndSource::resolve(&config, args.sight.sightline());
            let lens = main_lens(&config, &shapes, lens_centre(&config, &sight)?)?;
            critical_curves(&sight.through_lens(&lens)?, config.maps.half_width_arcsec, bars)
        })
    });
    let curves = curves.transpose()?;

    let write = |path: &std::path::Path| -> Result<()> {
        let file = RunFile::create(path, &provenance)?;
        write_maps(&file, "maps", &maps)?;
        if let Some(curves) = &curves {
            write_curves(&file, "curves", curves, source_centre(&sight))?;
        }
        file.close()
    };
    let files = match output {
        Output::File(file) => {
            write_hdf5_atomically(&file, write)?;
            vec![file]
        }
        Output::Folder(staging) => {
            staging.write("maps.h5", write)?;
            let figures = map_figures(&staging.path("maps.h5"))?;
            stage_figures(&staging, figures.map(|(name, draw)| (name.into(), draw)).into())?;
            stage_page(&staging, "", &record(args, &staging, &provenance)?)?;
            commit(staging)?
        }
    };
    tell_sheets(&config, &kappa_of_sheets, bars);
    print_accuracy(&accuracy, bars);
    print_files(&files, bars)
}

fn record(args: &Args, staging: &Staging, provenance: &Provenance) -> Result<RunRecord> {
    let about =
        "What the haloes on one line of sight do over a field: convergence, shear, flexion and their change.";
    let sightline = option("--sightline", args.sight.sightline(), 0);
    let record = configured(staging, "map", &sightline, about, provenance)?;
    Ok(RunRecord { makes_images: false, ..record })
}
