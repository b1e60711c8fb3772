//! `haloray study cut`: what the shear cut does to a line of sight.

use std::path::PathBuf;

use haloray::Result;
use haloray::error::Domain;
use haloray::io::{Column, RAYS_GROUP, Table};
use haloray::pipeline::{CutRow, cut_study};
use haloray::report::{
    cut_figure, decimals_text, grouped, markdown_table, number_text, result_text, stage_figure,
};

use crate::bars::Bars;
use crate::output::{begin, finish_study};
use crate::record::configured;
use crate::settings::{Settings, Tracing, of_option, provenance, psf};

/// What the shear cut does to κ, γ, F, Δ and the image of one line of sight.
///
/// The haloes are drawn once, at the loosest cut, and those of smaller point-lens shear on the axis left out step by
/// step. Writes cut.csv, a figure and result.md.
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
        of_option(Domain::from_below(0.0, 1.0), "--cuts", cut, "at least 0 and below 1")?;
    }
    let (psf, provenance) = (psf(&config)?, provenance(&config, 0)?);
    let staging = begin(&args.output, &["cut.csv", "cut.svg", "cut.png", "result.md"], bars)?;
    let rows = cut_study(&config, &psf, &args.cuts, bars)?;
    let table = table(&rows)?;
    staging.write("cut.csv", |path| table.write(path, RAYS_GROUP, &provenance))?;
    let figure = cut_figure(&rows);
    stage_figure(&staging, "cut", || Ok(Some(figure)))?;
    let shows = "changes of κ, γ, F, Δ and of the image against the cut";
    let cuts: Vec<String> = args.cuts.iter().map(|cut| format!("{cut:e}")).collect();
    let about = "One line of sight with fewer and fewer of its haloes left out: what the shear cut changes.";
    let arguments = ["--cuts".to_owned(), cuts.join(",")];
    let record = configured(&staging, "study cut", &arguments, about, &provenance)?;
    finish_study(staging, &result_text(&summary(&rows), &[("cut", shows)]), &record, bars)
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

/// One line a cut; the image is compared with that of the last.
fn summary(rows: &[CutRow]) -> String {
    let line = |row: &CutRow| {
        let q = row.view.quantities();
        let signed = ["kappa_os", "gamma1_os", "gamma2_os"].map(|name| decimals_text(q.get(name), 4));
        let cut = [number_text(row.min_point_shear, 1), grouped(row.view.number_of_haloes as f64)];
        let delta = format!("{:.3}", q.get("delta_tot"));
        let image = [number_text(largest(row), 3), number_text(row.image_chi_squared(), 3)];
        cut.into_iter().chain(signed).chain([delta]).chain(image).collect()
    };
    let head =
        ["cut", "haloes", "κ_os", "γ1_os", "γ2_os", "Δ_tot", "largest pixel over noise", "χ² of the image"];
    markdown_table(&head, &rows.iter().map(line).collect::<Vec<_>>())
}
