//! `haloray populate`: draw the haloes of a line of sight into a table.

use std::path::PathBuf;

use haloray::Result;
use haloray::io::{Table, write_haloes};
use haloray::pipeline;

use crate::bars::Bars;
use crate::output::check_file;
use crate::settings::{Settings, Sightline, imported_haloes, provenance};
use crate::summary::counted;
use haloray::report::grouped;

/// Draw the haloes of a line of sight and write them as a table.
///
/// Columns: z, theta_x_arcsec, theta_y_arcsec, r_s_arcsec, alpha_rs_arcsec (reduced to the source), m200c_msun, c200c.
/// The table can be given to `trace`, `map` and `image`.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray populate -o haloes.h5\n  haloray populate --draw brute-force --seed 3 -o haloes.csv"
)]
pub struct Args {
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    sightline: Sightline,
    /// Halo table to write: .csv, .h5 or .fits.
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
}

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let config = args.settings.resolve()?;
    Table::check_target(&args.output)?;
    check_file(&args.output, &[config.haloes.catalogue.as_deref(), args.settings.file()], bars)?;
    let imported = imported_haloes(&config, args.sightline.number, bars)?;
    let haloes = pipeline::populate(&config, imported, args.sightline.number, bars)?;
    bars.stage("write table", || {
        write_haloes(&haloes.catalogue, &args.output, &provenance(&config, args.sightline.number)?)
    })?;
    if !bars.is_quiet() {
        let drawn = haloes.number_drawn.map_or(String::new(), |n| format!(" of {} drawn", grouped(n as f64)));
        let kept = counted(haloes.catalogue.len(), "halo", "haloes");
        crate::terminal::print(&format!("{kept}{drawn} written to {}\n", args.output.display()));
    }
    Ok(())
}
