//! `haloray image`: one exposure of the lens through a line of sight.

use std::path::{Path, PathBuf};

use haloray::io::{Provenance, Staging, write_atomically};
use haloray::monitor::Monitor;
use haloray::numerics::random::Stage;
use haloray::pipeline::{self, LensAndSource, View, line_of_sight};
use haloray::report::{RunRecord, exposure_figure, image_file, stage_figure, stage_page};
use haloray::{Error, Result};

use crate::bars::Bars;
use crate::output::{Output, commit, print_files};
use crate::record::{configured, option};
use crate::settings::{Sight, imported_haloes, provenance, psf};
use crate::sheets::{kappa_of_sheets, tell_sheets};
use crate::summary::print_accuracy;

/// Image the lens and source of the configuration through its haloes.
///
/// FITS, float64, e⁻/s per pixel, with WCS and the keywords EXPTIME, BKGRMS, PSFFWHM, PSFTRUNC, ZLENS, ZSOURCE that
/// the fitter reads.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray image -o image\n  haloray image my.toml --haloes haloes.csv --noise-free -o image.fits"
)]
pub struct Args {
    #[command(flatten)]
    sight: Sight,
    /// With one FITS file as output: the image before noise.
    #[arg(long)]
    noise_free: bool,
    /// Folder for image.fits, image_noise_free.fits, the figure and its page, or one file ending in .fits.
    #[arg(long, short, value_name = "DIR|FILE.fits")]
    output: PathBuf,
}

/// What a folder gets.
const FILES: [&str; 5] = ["image.fits", "image_noise_free.fits", "image.svg", "image.png", "config.toml"];

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let config = args.sight.resolve()?;
    config.image_doubts().iter().for_each(crate::terminal::warn);
    let psf = psf(&config)?;
    let imported = imported_haloes(&config, args.sight.sightline(), bars)?;
    let provenance = provenance(&config, args.sight.sightline())?;
    let inputs =
        [config.haloes.catalogue.as_deref(), config.instrument.psf_file.as_deref(), args.sight.file()];
    let output = Output::begin(&args.output, &["fits", "fit"], &inputs, &FILES, bars)?;
    if args.noise_free && matches!(output, Output::Folder(_)) {
        let allowed = "left out with a folder as output, which holds both images";
        return Err(Error::argument("--noise-free", "given", allowed));
    }

    let haloes = pipeline::populate(&config, imported, args.sight.sightline(), bars)?;
    let sight = line_of_sight(&config, &haloes, &haloes.catalogue)?;
    let kappa_of_sheets = kappa_of_sheets(&config, &haloes)?;
    let shapes = LensAndSource::resolve(&config, args.sight.sightline());
    bars.begin("image", None);
    let view =
        View::through(&config, &sight, &shapes, &psf, (args.sight.sightline(), Stage::NoiseImage), bars)?;
    bars.end();

    let exposure = &view.exposure;
    let fits = |pixels: &[f64], path: &Path| {
        image_file(&config, &psf, &exposure.grid, pixels).write(path, &provenance)
    };
    let files = match output {
        Output::File(file) => {
            let pixels = if args.noise_free { &exposure.noise_free_e_s } else { &exposure.noisy_e_s };
            write_atomically(&file, |path| fits(pixels, path))?;
            vec![file]
        }
        Output::Folder(staging) => {
            staging.write("image.fits", |path| fits(&exposure.noisy_e_s, path))?;
            staging.write("image_noise_free.fits", |path| fits(&exposure.noise_free_e_s, path))?;
            let curves = view.curves.as_ref().map(|curves| curves.about(view.source_centre_arcsec));
            let figure = exposure_figure(exposure, config.instrument.background_rms_e_s(), curves.as_ref());
            stage_figure(&staging, "image", || Ok(Some(figure)))?;
            stage_page(&staging, "", &record(args, &staging, &provenance)?)?;
            commit(staging)?
        }
    };
    tell_sheets(&config, &kappa_of_sheets, bars);
    print_accuracy(&view.accuracy, bars);
    print_files(&files, bars)
}

fn record(args: &Args, staging: &Staging, provenance: &Provenance) -> Result<RunRecord> {
    let about = "One exposure of a lens and its source through the haloes of one line of sight.";
    configured(staging, "image", &option("--sightline", args.sight.sightline(), 0), about, provenance)
}
