//! `haloray simulate`: the whole chain into one folder.

use std::path::PathBuf;

use haloray::Result;
use haloray::io::Staging;
use haloray::pipeline::{Inputs, simulate};
use haloray::report::write_run;

use crate::bars::Bars;
use crate::settings::{Settings, imported_haloes, provenance, psf};
use crate::summary;

/// Run the whole chain: haloes, tracing, diagnostics, maps, the two images, files and figures.
///
/// Without a configuration the embedded preset `paper` runs: section 4 of Hogg, Fleury, Larena & Martinelli 2023 at
/// its real size. The folder then holds run.h5 (everything, see docs/FILES.md), summary.json, config.toml, four FITS
/// images and the figures as SVG and PNG.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray simulate -o run\n  haloray simulate --preset consistent --seed 7 -o run7\n  \
                  haloray simulate my.toml -o run    # my.toml holds only the keys you change"
)]
pub struct Args {
    #[command(flatten)]
    settings: Settings,
    /// Folder for the results; made if missing, files of an earlier run are replaced.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let config = args.settings.resolve()?;
    let psf = psf(&config)?;
    let inputs = Inputs { catalogue: imported_haloes(&config)?, psf: psf.clone() };
    let provenance = provenance(&config)?;
    let staging = Staging::begin(&args.output)?;
    let run = simulate(&config, inputs, 0, bars)?;
    bars.stage("files and figures", || write_run(&run, &psf, &staging, &provenance))?;
    let files = staging.commit()?;
    if !bars.is_quiet() {
        summary::print(&run, &args.settings.name(), &bars.seconds(), &files);
    }
    Ok(())
}
