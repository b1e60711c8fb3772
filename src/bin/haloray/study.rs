//! `haloray study`: experiments over many sightlines.

use std::path::{Path, PathBuf};

use clap::Subcommand;
use haloray::Result;
use haloray::config::Config;
use haloray::io::{AttributeValue, Column, Provenance, RAYS_GROUP, RunFile, Table};
use haloray::pipeline::{ImageResidual, TidalResidual, rms, tidal_residual, tidal_study};
use haloray::report::{markdown_table, number_text, result_text, stage_figure, tidal_residual_figure};

use crate::advantage::{self, AdvantageArgs};
use crate::bars::Bars;
use crate::fit::Outcome;
use crate::output::{begin, finish_study};
use crate::record::{configured, option};
use crate::saved::SavedRows;
use crate::settings::{Settings, provenance, whole};

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
    Haloes(crate::halo_choices::HaloChoicesArgs),
    WhichShear(crate::which_shear::WhichShearArgs),
    Validity(Box<crate::validity::ValidityArgs>),
    Expected(Box<crate::expected::ExpectedArgs>),
    Advantage(AdvantageArgs),
    Calibration(crate::calibration::CalibrationArgs),
    Catalogue(crate::catalogue::CatalogueArgs),
}

/// What the tidal and flexion models of the line of sight leave of the traced rays.
///
/// For each sightline the rays of the [maps] grid are traced through haloes and main lens and compared with the full
/// tidal model and the flexion model whose tensors are those of the axis ray; nothing is fitted. Rays within 0.4
/// Einstein radii of the lens centre are left out. Writes residuals.csv, the maps of the first
/// sightline (residual_maps.h5), a figure and result.md.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  haloray study tidal -n 100 -o tidal_study")]
struct TidalArgs {
    #[command(flatten)]
    settings: Settings,
    /// Number of sightlines.
    #[arg(long, short, allow_negative_numbers = true, value_name = "N", default_value_t = 100, value_parser = whole::<u64>(1..=u64::MAX))]
    number: u64,
    /// Sightline K alone, as it stands in the study of more than K of them.
    #[arg(long, value_name = "K", conflicts_with = "number")]
    sightline: Option<u64>,
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
        Study::Haloes(args) => crate::halo_choices::run(args, bars).map(|()| Outcome::Converged),
        Study::WhichShear(args) => crate::which_shear::run(args, bars).map(|()| Outcome::Converged),
        Study::Validity(args) => crate::validity::run(args, bars).map(|()| Outcome::Converged),
        Study::Expected(args) => crate::expected::run(args, bars).map(|()| Outcome::Converged),
        Study::Advantage(args) => advantage::run(args, bars),
        Study::Catalogue(args) => crate::catalogue::run(args, bars).map(|()| Outcome::Converged),
        Study::Calibration(args) => crate::calibration::run(args, bars).map(|()| Outcome::Converged),
    }
}

fn run_tidal(args: &TidalArgs, bars: &Bars) -> Result<()> {
    let config = args.settings.resolve()?;
    let provenance = provenance(&config, 0)?;
    let staging = begin(
        &args.output,
        &["residuals.csv", RESIDUAL_MAPS, "tidal_residuals.svg", "tidal_residuals.png", "result.md"],
        bars,
    )?;
    let command = format!("study tidal, all haloes: {}\n{}", args.all_haloes, provenance.config_toml);
    let saved = SavedRows::beside(&args.output, command, bars)?;
    let rows = match args.sightline {
        Some(sightline) => vec![tidal_residual(&config, sightline, !args.all_haloes, bars)?],
        None => tidal_study(&config, args.number, !args.all_haloes, &saved, bars)?,
    };
    let table = residual_table(&rows)?;
    staging.write("residuals.csv", |path| table.write(path, RAYS_GROUP, &provenance))?;
    staging.write(RESIDUAL_MAPS, |path| write_residual_maps(path, &config, &rows[0], &provenance))?;
    stage_figure(&staging, "tidal_residuals", || tidal_residual_figure(&config, &rows).map(Some))?;
    let shows = "residuals in β and in the image of the first sightline, and the rms and χ² of all";
    let all_haloes = if args.all_haloes { "--all-haloes" } else { "" };
    let number = match args.sightline {
        Some(sightline) => option("--sightline", sightline, ""),
        None => option("-n", args.number, 100),
    };
    let arguments: Vec<String> = number.into_iter().chain([all_haloes.into()]).collect();
    let about = "What the tidal and flexion models of the line of sight leave of traced rays and of the image; nothing is fitted.";
    let record = configured(&staging, "study tidal", &arguments, about, &provenance)?;
    finish_study(staging, &result_text(&summary(&rows), &[("tidal_residuals", shows)]), &record, bars)?;
    saved.remove();
    Ok(())
}

/// What `tidal_residuals.svg` shows of the first sightline.
const RESIDUAL_MAPS: &str = "residual_maps.h5";

fn write_residual_maps(
    path: &Path,
    config: &Config,
    first: &TidalResidual,
    provenance: &Provenance,
) -> Result<()> {
    let file = RunFile::create(path, provenance)?;
    let (rays, image) = (&first.grid, &first.image);
    for (model, of_rays, of_image) in [
        ("tidal", &first.tidal_arcsec, &image.tidal_over_noise),
        ("flexion", &first.flexion_arcsec, &image.flexion_over_noise),
    ] {
        let about = format!("|β_traced − β_{model}|; no number near the lens centre");
        file.write_with_gaps(
            "rays",
            &format!("{model}_arcsec"),
            of_rays,
            &[rays.points; 2],
            "arcsec",
            &about,
        )?;
        let pixels = (image.grid.pixels(), image.grid.pixels());
        let about = format!("(noise-free image through haloes − image of the {model} model)/σ");
        file.write_2d("image", &format!("{model}_over_noise"), of_image, pixels, "", &about)?;
    }
    file.attribute("/", "sightline", AttributeValue::U64(first.sightline))?;
    file.attribute("rays", "half_width_arcsec", rays.half_width_arcsec)?;
    file.attribute("rays", "einstein_radius_arcsec", config.lens.einstein_radius_arcsec)?;
    file.attribute("image", "pixel_scale_arcsec", image.grid.pixel_scale_arcsec())?;
    file.close()
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

/// Quantiles over the sightlines of what is left of β and of the image.
fn summary(rows: &[TidalResidual]) -> String {
    let line = |name: &str, value: &dyn Fn(&TidalResidual) -> f64| -> Vec<String> {
        let mut sorted: Vec<f64> = rows.iter().map(value).collect();
        sorted.sort_by(f64::total_cmp);
        let at = |fraction: f64| sorted[((sorted.len() - 1) as f64 * fraction).round() as usize];
        let quantiles = [0.16, 0.5, 0.84, 1.0].map(|fraction| number_text(at(fraction), 3));
        [name.to_string()].into_iter().chain(quantiles).collect()
    };
    let rays = [
        line("tidal model, rms over the field", &|r| rms(&r.tidal_arcsec)),
        line("tidal model, largest in the field", &|r| largest(&r.tidal_arcsec)),
        line("flexion model, rms over the field", &|r| rms(&r.flexion_arcsec)),
        line("flexion model, largest in the field", &|r| largest(&r.flexion_arcsec)),
    ];
    let image = [
        line("tidal model, largest pixel over noise", &|r| largest_size(&r.image.tidal_over_noise)),
        line("tidal model, χ²", &|r| ImageResidual::chi_squared(&r.image.tidal_over_noise)),
        line("flexion model, largest pixel over noise", &|r| largest_size(&r.image.flexion_over_noise)),
        line("flexion model, χ²", &|r| ImageResidual::chi_squared(&r.image.flexion_over_noise)),
    ];
    let table =
        |what: &str, lines: &[Vec<String>]| markdown_table(&[what, "16%", "median", "84%", "largest"], lines);
    let (rays, image) = (table("residual in β, arcsec", &rays), table("difference of the images", &image));
    format!("{} sightlines.\n\n{rays}\n{image}", rows.len())
}
