//! `haloray relations`: mass function and concentration as a table.

use std::path::PathBuf;

use haloray::Result;
use haloray::io::{Column, Table};
use haloray::pipeline::Relations;

use crate::bars::Bars;
use crate::output::check_file;
use crate::settings::{Settings, provenance, whole};

/// Tabulate the relations of a configuration: z, m200c_msun, sigma, peak_height, dn_dlnm_per_cmpc3, c200c.
///
/// Masses are equal steps of ln M over [haloes] mass_min_msun to mass_max_msun.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  haloray relations --preset consistent --z 0 --z 0.5 --z 1.5 -o relations.csv"
)]
pub struct Args {
    #[command(flatten)]
    settings: Settings,
    /// Redshift; give it several times for several.
    #[arg(long, value_name = "Z", default_values_t = [0.5])]
    z: Vec<f64>,
    /// Masses per redshift.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = whole::<u32>(2..=100_000))]
    masses: u32,
    /// Table to write: .csv, .h5 or .fits.
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
}

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let config = args.settings.resolve()?;
    Table::check_target(&args.output)?;
    check_file(&args.output, &[args.settings.file()], bars)?;
    let (low, high) = (config.haloes.mass_min_msun, config.haloes.mass_max_msun);
    let step = (high / low).ln() / f64::from(args.masses - 1);
    let masses: Vec<f64> = (0..args.masses).map(|i| low * (step * f64::from(i)).exp()).collect();
    let relations = Relations::of(&config, &args.z, &masses)?;
    let table = Table::new(vec![
        Column::f64("z", None, relations.z),
        Column::f64("m200c_msun", Some("solMass"), relations.m200c_msun),
        Column::f64("sigma", None, relations.sigma),
        Column::f64("peak_height", None, relations.peak_height),
        Column::f64("dn_dlnm_per_cmpc3", Some("Mpc^-3"), relations.dn_dlnm_per_cmpc3),
        Column::f64("c200c", None, relations.c200c),
    ])?;
    table.write(&args.output, "relations", &provenance(&config, 0)?)?;
    if !bars.is_quiet() {
        crate::terminal::print(&format!("{} rows written to {}\n", table.row_count(), args.output.display()));
    }
    Ok(())
}
