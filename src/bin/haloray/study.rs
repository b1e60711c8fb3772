//! `haloray study`: experiments over many sightlines.

use std::path::PathBuf;

use clap::Subcommand;
use haloray::Result;
use haloray::io::{Column, RAYS_GROUP, Staging, Table};
use haloray::pipeline::{ImageResidual, TidalResidual, rms, tidal_study};
use haloray::report::tidal_residual_figure;

use crate::advantage::{self, AdvantageArgs};
use crate::bars::Bars;
use crate::fit::Outcome;
use crate::output::print_files;
use crate::settings::{Settings, provenance};

/// Experiments over many sightlines.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    study: Study,
}

#[derive(Subcommand)]
enum Study {
    Tidal(TidalArgs),
    Cut(crate::cut::CutArgs),
    Advantage(AdvantageArgs),
    Calibration(crate::calibration::CalibrationArgs),
    Catalogue(crate::catalogue::CatalogueArgs),
}

/// What the tidal and flexion models of the line of sight leave of the traced rays.
///
/// For each sightline the rays of the [maps] grid are traced through haloes and main lens and compared with the full
/// tidal model and the flexion model whose tensors are those of the axis ray; nothing is fitted. Rays within 0.4
/// Einstein radii of the lens centre are left out. Writes residuals.csv and a figure.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  haloray study tidal -n 100 -o tidal_study")]
struct TidalArgs {
    #[command(flatten)]
    settings: Settings,
    /// Number of sightlines.
    #[arg(long, short, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..))]
    number: u64,
    /// Keep the haloes beyond the tidal regime (Δ_h at or above the threshold), which are left out otherwise.
    #[arg(long)]
    all_haloes: bool,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub fn run(args: &Args, bars: &Bars) -> Result<Outcome> {
    match &args.study {
        Study::Tidal(args) => run_tidal(args, bars).map(|()| Outcome::Converged),
        Study::Cut(args) => crate::cut::run(args, bars).map(|()| Outcome::Converged),
        Study::Advantage(args) => advantage::run(args, bars),
        Study::Catalogue(args) => crate::catalogue::run(args, bars).map(|()| Outcome::Converged),
        Study::Calibration(args) => crate::calibration::run(args, bars).map(|()| Outcome::Converged),
    }
}

fn run_tidal(args: &TidalArgs, bars: &Bars) -> Result<()> {
    let config = args.settings.resolve()?;
    let provenance = provenance(&config)?;
    let staging = Staging::begin(&args.output)?;
    let rows = tidal_study(&config, args.number, !args.all_haloes, bars)?;
    let table = residual_table(&rows)?;
    staging.write("residuals.csv", |path| table.write(path, RAYS_GROUP, &provenance))?;
    let figure = tidal_residual_figure(&config, &rows)?;
    staging.write("tidal_residuals.svg", |path| figure.save(&path.with_extension("")).map(drop))?;
    let files = staging.commit()?;
    if !bars.is_quiet() {
        crate::print(&summary(&rows));
    }
    print_files(&files, bars);
    Ok(())
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max)
}

fn largest_size(values: &[f64]) -> f64 {
    values.iter().map(|v| v.abs()).fold(0.0, f64::max)
}

fn residual_table(rows: &[TidalResidual]) -> Result<Table> {
    let column = |name: &str, unit: Option<&str>, value: &dyn Fn(&TidalResidual) -> f64| {
        Column::f64(name, unit, rows.iter().map(value).collect())
    };
    let arcsec = Some("arcsec");
    Table::new(vec![
        column("sightline", None, &|r| r.sightline as f64),
        column("number_of_haloes", None, &|r| r.number_of_haloes as f64),
        column("gamma1_los", None, &|r| r.gamma_los.re),
        column("gamma2_los", None, &|r| r.gamma_los.im),
        column("tidal_rms_arcsec", arcsec, &|r| rms(&r.tidal_arcsec)),
        column("tidal_max_arcsec", arcsec, &|r| largest(&r.tidal_arcsec)),
        column("flexion_rms_arcsec", arcsec, &|r| rms(&r.flexion_arcsec)),
        column("flexion_max_arcsec", arcsec, &|r| largest(&r.flexion_arcsec)),
        column("tidal_image_max_over_noise", None, &|r| largest_size(&r.image.tidal_over_noise)),
        column("tidal_image_chi2", None, &|r| ImageResidual::chi_squared(&r.image.tidal_over_noise)),
        column("flexion_image_max_over_noise", None, &|r| largest_size(&r.image.flexion_over_noise)),
        column("flexion_image_chi2", None, &|r| ImageResidual::chi_squared(&r.image.flexion_over_noise)),
    ])
}

/// Quartiles over the sightlines, as lines of text.
fn summary(rows: &[TidalResidual]) -> String {
    let line = |name: &str, values: Vec<f64>| {
        let mut sorted = values;
        sorted.sort_by(f64::total_cmp);
        let at = |fraction: f64| sorted[((sorted.len() - 1) as f64 * fraction).round() as usize];
        format!("{name:<28} {:.2e}  {:.2e}  {:.2e}  {:.2e}\n", at(0.16), at(0.5), at(0.84), at(1.0))
    };
    let image = |value: &dyn Fn(&TidalResidual) -> f64| rows.iter().map(value).collect::<Vec<f64>>();
    format!(
        "residual in β, arcsec        16%       median    84%       largest   ({} sightlines)\n",
        rows.len()
    ) + &line("tidal model, rms", rows.iter().map(|r| rms(&r.tidal_arcsec)).collect())
        + &line("tidal model, largest", rows.iter().map(|r| largest(&r.tidal_arcsec)).collect())
        + &line("flexion model, rms", rows.iter().map(|r| rms(&r.flexion_arcsec)).collect())
        + &line("flexion model, largest", rows.iter().map(|r| largest(&r.flexion_arcsec)).collect())
        + "residual in the image\n"
        + &line("tidal model, largest/noise", image(&|r| largest_size(&r.image.tidal_over_noise)))
        + &line("tidal model, chi2", image(&|r| ImageResidual::chi_squared(&r.image.tidal_over_noise)))
        + &line("flexion model, largest/noise", image(&|r| largest_size(&r.image.flexion_over_noise)))
        + &line("flexion model, chi2", image(&|r| ImageResidual::chi_squared(&r.image.flexion_over_noise)))
}
