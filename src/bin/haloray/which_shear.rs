//! `haloray study which-shear`: the γ_LOS of fits against every definition of it.

use std::path::PathBuf;

use haloray::Result;
use haloray::inference::model::ModelDescription;
use haloray::io::{Column, RAYS_GROUP, Table};
use haloray::pipeline::{DEFINITIONS, WhichShear, median_deviations, which_shear};
use haloray::report::{markdown_table, result_text, stage_figure, which_shear_figure};

use crate::bars::Bars;
use crate::output::{begin, finish_study};
use crate::record::{configured, option};
use crate::saved::SavedRows;
use crate::settings::{Settings, provenance, psf, whole, with_named_files};

/// Which shear of the line of sight an image measures.
///
/// Images N sightlines through all their haloes, fits each, and compares the fitted γ_LOS with that of the axis ray, of the
/// ring, of the image's light, and of the nearest tidal and flexion models. Writes which_shear.csv, a figure and result.md.
/// The same command, with more or fewer sightlines too, goes on where it was stopped.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  printf '[source]\\nsersic_index = 1.0\\n' > n1.toml\n  haloray study which-shear n1.toml --preset consistent -n 35 -o which_shear\n\nA sightline takes a minute or two."
)]
pub struct WhichShearArgs {
    #[command(flatten)]
    settings: Settings,
    /// Number of sightlines.
    #[arg(long, short, allow_negative_numbers = true, value_name = "N", default_value_t = 35, value_parser = whole::<u64>(1..=u64::MAX))]
    number: u64,
    /// A built-in model with gamma1_los and gamma2_los (`haloray fit --list`).
    #[arg(long, value_name = "NAME", default_value = "tidal-minimal")]
    model: String,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub fn run(args: &WhichShearArgs, bars: &Bars) -> Result<()> {
    let config = args.settings.resolve()?;
    ModelDescription::built_in(&args.model)?;
    let (psf, provenance) = (psf(&config)?, provenance(&config, 0)?);
    let staging =
        begin(&args.output, &["which_shear.csv", "which_shear.svg", "which_shear.png", "result.md"], bars)?;
    let configuration = with_named_files(&config, &psf, &provenance.config_toml);
    let command = format!("study which-shear, {}\n{configuration}", args.model);
    let saved = SavedRows::beside(&args.output, command, bars)?;
    let rows = which_shear(&config, &psf, &args.model, args.number, &saved, bars)?;
    let table = table(&rows)?;
    staging.write("which_shear.csv", |path| table.write(path, RAYS_GROUP, &provenance))?;
    stage_figure(&staging, "which_shear", || Ok(Some(which_shear_figure(&rows))))?;
    let shows = "how many fits lie within how many σ of each definition";
    let about =
        "γ_LOS as fits of images through all haloes find it, against five definitions of what it should be.";
    let options = [option("-n", args.number, 35), option("--model", &args.model, "tidal-minimal")];
    let record = configured(&staging, "study which-shear", &options.concat(), about, &provenance)?;
    finish_study(staging, &result_text(&summary(&rows), &[("which_shear", shows)]), &record, bars)?;
    saved.remove();
    Ok(())
}

fn table(rows: &[WhichShear]) -> Result<Table> {
    let column = |name: &str, unit: Option<&str>, value: &dyn Fn(&WhichShear) -> f64| {
        Column::f64(name, unit, rows.iter().map(value).collect())
    };
    let mut columns = vec![column("sightline", None, &|row| row.sightline as f64)];
    for (i, name) in DEFINITIONS.iter().enumerate() {
        columns.push(column(&format!("gamma1_los_{name}"), None, &|row| row.by_definition[i][0]));
        columns.push(column(&format!("gamma2_los_{name}"), None, &|row| row.by_definition[i][1]));
        columns.push(column(&format!("deviation_{name}_sigma"), None, &|row| row.deviation(i)));
    }
    columns.extend([
        column("gamma1_los_fit", None, &|row| row.fitted[0]),
        column("gamma2_los_fit", None, &|row| row.fitted[1]),
        column("covariance_11", None, &|row| row.covariance[0]),
        column("covariance_12", None, &|row| row.covariance[1]),
        column("covariance_22", None, &|row| row.covariance[2]),
        column("residual_best_tidal_arcsec", Some("arcsec"), &|row| row.residual_arcsec[0]),
        column("residual_best_flexion_arcsec", Some("arcsec"), &|row| row.residual_arcsec[1]),
        column("chi2_reduced", None, &|row| row.chi2_reduced),
        column("converged", None, &|row| f64::from(u8::from(row.converged))),
        column("missed_by", None, &|row| row.missed_by.unwrap_or(0.0)),
    ]);
    Table::new(columns)
}

/// One line a definition.
fn summary(rows: &[WhichShear]) -> String {
    let medians = median_deviations(rows);
    let line = |i: usize| {
        let within = |sigma: f64| rows.iter().filter(|row| row.deviation(i) <= sigma).count();
        let square =
            |row: &WhichShear| (0..2).map(|c| (row.fitted[c] - row.by_definition[i][c]).powi(2)).sum::<f64>();
        let known: Vec<f64> = rows.iter().map(square).filter(|v| v.is_finite()).collect();
        let rms = (known.iter().sum::<f64>() / known.len().max(1) as f64).sqrt();
        vec![
            DEFINITIONS[i].to_string(),
            format!("{:.2}", medians[i]),
            within(1.0).to_string(),
            within(2.0).to_string(),
            format!("{rms:.4}"),
        ]
    };
    let head = ["γ_LOS of", "median deviation, σ", "within 1 σ", "within 2 σ", "rms of the difference"];
    let count = |of: &dyn Fn(&WhichShear) -> bool| rows.iter().filter(|row| of(row)).count();
    format!(
        "{} sightlines, {} fits converged, {} ended below a climb from the truth.\n\n{}",
        rows.len(),
        count(&|row| row.converged),
        count(&|row| row.missed_by.is_some()),
        markdown_table(&head, &(0..DEFINITIONS.len()).map(line).collect::<Vec<_>>())
    )
}
