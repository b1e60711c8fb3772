//! `haloray study haloes`: what truncation and scatter of haloes change.

use std::path::PathBuf;

use haloray::Result;
use haloray::io::{Column, RAYS_GROUP, Table};
use haloray::pipeline::{HaloChoice, halo_choices};
use haloray::report::{markdown_table, result_text};

use crate::bars::Bars;
use crate::output::{begin, finish_study};
use crate::record::{configured, option};
use crate::settings::{Settings, provenance, whole};

/// What truncation and concentration scatter of the haloes change in shear, flexion and Δ.
///
/// The same sightlines with plain and truncated haloes, without and with scatter. Writes haloes.csv and result.md.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  haloray study haloes --preset consistent -n 60 -o halo_choices")]
pub struct HaloChoicesArgs {
    #[command(flatten)]
    settings: Settings,
    /// Number of sightlines.
    #[arg(long, short, allow_negative_numbers = true, value_name = "N", default_value_t = 60, value_parser = whole::<u64>(1..=u64::MAX))]
    number: u64,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub fn run(args: &HaloChoicesArgs, bars: &Bars) -> Result<()> {
    let config = args.settings.resolve()?;
    let provenance = provenance(&config, 0)?;
    let staging = begin(&args.output, &["haloes.csv", "result.md"], bars)?;
    let rows = halo_choices(&config, args.number, bars)?;
    let column = |name: &str, unit: Option<&str>, value: &dyn Fn(&HaloChoice) -> f64| {
        Column::f64(name, unit, rows.iter().map(value).collect())
    };
    let table = Table::new(vec![
        Column::text("choice", rows.iter().map(|row| row.name.clone()).collect()),
        column("rms_gamma_os", None, &|row| row.rms_gamma),
        column("rms_f_os_of_disc_per_arcsec", Some("arcsec^-1"), &|row| row.rms_f_per_arcsec),
        column("share_beyond_tidal", None, &|row| row.share_beyond_tidal),
        column("share_beyond_tidal_of_disc", None, &|row| row.share_beyond_tidal_of_disc),
        column("matter_over_mean_density", None, &|row| row.matter_over_mean_density),
    ])?;
    staging.write("haloes.csv", |path| table.write(path, RAYS_GROUP, &provenance))?;
    let line = |row: &HaloChoice| {
        vec![
            row.name.clone(),
            format!("{:.4}", row.rms_gamma),
            format!("{:.5}", row.rms_f_per_arcsec),
            format!("{:.1}%", 100.0 * row.share_beyond_tidal),
            format!("{:.1}%", 100.0 * row.share_beyond_tidal_of_disc),
            format!("{:.2}", row.matter_over_mean_density),
        ]
    };
    let limit = config.diagnostics.delta_threshold;
    let head = [
        "haloes",
        "rms γ_os",
        "rms F_os over the disc, 1/arcsec",
        &format!("Δ_h ≥ {limit}"),
        &format!("Δ_h ≥ {limit} over the disc"),
        "mass over all matter",
    ];
    let lines: Vec<_> = rows.iter().map(line).collect();
    let text = format!("{} sightlines.\n\n{}", args.number, markdown_table(&head, &lines));
    let about = "The same sightlines with plain and truncated haloes, without and with scatter of their concentrations.";
    let record = configured(&staging, "study haloes", &option("-n", args.number, 60), about, &provenance)?;
    finish_study(staging, &result_text(&text, &[]), &record, bars)
}
