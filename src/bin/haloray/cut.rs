//! `haloray study cut`: what the shear cut does to a line of sight.

use std::path::PathBuf;

use haloray::Result;
use haloray::error::require;
use haloray::io::{Column, RAYS_GROUP, Staging, Table};
use haloray::pipeline::{CutRow, cut_study};
use haloray::report::cut_figure;

use crate::bars::Bars;
use crate::output::print_files;
use crate::settings::{Settings, Tracing, provenance, psf};
use crate::summary::grouped;

/// What the shear cut does to κ, γ, F, Δ and the image of one line of sight.
///
/// The haloes are drawn once, at the loosest cut, and those of smaller point-lens shear on the axis left out step by
/// step. Writes cut.csv and a figure.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray study cut -o cut\n  haloray study cut --cuts 1e-6,1e-7,0 -o uncut    # all ten million, minutes"
)]
pub struct CutArgs {
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    tracing: Tracing,
    /// Smallest point-lens shears to keep; 0 keeps all haloes.
    #[arg(long, value_name = "SHEARS", value_delimiter = ',', allow_negative_numbers = true)]
    #[arg(default_value = "1e-4,3e-5,1e-5,3e-6,1e-6,3e-7,1e-7")]
    cuts: Vec<f64>,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub fn run(args: &CutArgs, bars: &Bars) -> Result<()> {
    let mut config = args.settings.resolve()?;
    args.tracing.apply(&mut config);
    for &cut in &args.cuts {
        require((0.0..1.0).contains(&cut), "--cuts", cut, "at least 0 and below 1")?;
    }
    let (psf, provenance) = (psf(&config)?, provenance(&config)?);
    let staging = Staging::begin(&args.output)?;
    let rows = cut_study(&config, &psf, &args.cuts, bars)?;
    let table = table(&rows)?;
    staging.write("cut.csv", |path| table.write(path, RAYS_GROUP, &provenance))?;
    let figure = cut_figure(&rows);
    staging.write("cut.svg", |path| figure.save(&path.with_extension("")).map(drop))?;
    let files = staging.commit()?;
    if !bars.is_quiet() {
        crate::print(&text(&rows));
    }
    print_files(&files, bars);
    Ok(())
}

fn largest(row: &CutRow) -> f64 {
    row.image_over_noise.iter().map(|v| v.abs()).fold(0.0, f64::max)
}

fn table(rows: &[CutRow]) -> Result<Table> {
    let column = |name: &str, unit: Option<&str>, value: &dyn Fn(&CutRow) -> f64| {
        Column::f64(name, unit, rows.iter().map(value).collect())
    };
    let named = |name: &'static str, unit: Option<&'static str>| {
        column(name, unit, &|row| row.view.quantities().get(name))
    };
    Table::new(vec![
        column("min_point_shear", None, &|r| r.min_point_shear),
        column("number_of_haloes", None, &|r| r.view.number_of_haloes as f64),
        named("kappa_os", None),
        named("gamma1_os", None),
        named("gamma2_os", None),
        named("F1_os_per_arcsec", Some("arcsec^-1")),
        named("F2_os_per_arcsec", Some("arcsec^-1")),
        named("kappa_los", None),
        named("gamma1_los", None),
        named("gamma2_los", None),
        named("delta_tot", None),
        named("source_centre_x_arcsec", Some("arcsec")),
        named("source_centre_y_arcsec", Some("arcsec")),
        column("image_max_over_noise", None, &largest),
        column("image_chi2", None, &CutRow::image_chi_squared),
    ])
}

fn text(rows: &[CutRow]) -> String {
    let mut text = String::from(
        "cut          haloes   κ_os      γ1_os     γ2_os     Δ_tot     image − that of the last line: largest/σ, χ²\n",
    );
    for row in rows {
        let q = row.view.quantities();
        text += &format!(
            "{:<8.0e} {:>10}   {:+.5}  {:+.5}  {:+.5}  {:.5}   {:.2e}  {:.2e}\n",
            row.min_point_shear,
            grouped(row.view.number_of_haloes as f64),
            q.get("kappa_os"),
            q.get("gamma1_os"),
            q.get("gamma2_os"),
            q.get("delta_tot"),
            largest(row),
            row.image_chi_squared()
        );
    }
    text
}
