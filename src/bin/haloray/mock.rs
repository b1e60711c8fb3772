//! `haloray mock`: a catalogue of mock systems and their images.

use std::path::PathBuf;

use clap::ValueEnum;
use haloray::Result;
use haloray::imaging::{Instrument, PixelSampling, Psf};
use haloray::io::{CATALOGUE_GROUP, ImageFile, Provenance, Staging, catalogue_table, truth_table};
use haloray::mock::{MockImage, MockSystem, Protocol};
use haloray::monitor::Monitor;
use haloray::pipeline::RowStore;
use haloray::plot::figures::{GridData, MosaicImage, mosaic};
use haloray::report::{stage_figure, stage_page};
use rayon::prelude::*;

use crate::bars::Bars;
use crate::output::{begin, commit, print_files};
use crate::record::{flag, option, record, value_name};
use crate::sampling::SamplingArg;
use crate::saved::{SavedRows, StateFile};
use crate::settings::whole;

/// Draw realistic composite lenses and image them: the paper's catalogue of section 3 and appendix B.
///
/// Lenses are stars (Sérsic, elliptical potential, light that traces them) in an offset elliptical NFW halo, sheared by
/// the full line of sight, before an elliptical Sérsic source with one to three faint perturbers. Writes every drawn
/// parameter (catalogue.csv, catalogue.h5), truth.csv for `haloray study catalogue`, a FITS image each, and a mosaic.
/// System i of a seed is the same for any -n.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray mock -n 64 -o catalogue\n  haloray mock -n 10000 --no-images -o draws\n  \
                  haloray study catalogue catalogue -o results"
)]
pub struct Args {
    /// Number of systems.
    #[arg(long, short, allow_negative_numbers = true, value_name = "N", default_value_t = 64, value_parser = whole::<u32>(1..=1_000_000))]
    number: u32,
    /// Seed of systems and noise.
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
    /// Distributions: those of the authors' code, or of the text of appendix B.
    #[arg(long, value_enum, default_value_t = PresetArg::Paper)]
    preset: PresetArg,
    /// How pixels are integrated: at their centres, as in the paper and as the four models fit, or adaptively.
    #[arg(long, value_enum, default_value_t = SamplingArg::Point)]
    pixel_sampling: SamplingArg,
    /// Sources without perturbers, so that one Sérsic profile is all of them; lenses and sources stay as they are.
    #[arg(long)]
    no_perturbers: bool,
    /// Draw the systems only.
    #[arg(long)]
    no_images: bool,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

#[derive(Clone, Copy, ValueEnum)]
enum PresetArg {
    /// The authors' code.
    Paper,
    /// The text of appendix B.
    Text,
}

/// Images in the mosaic: more could not be told apart.
const MOST_IN_MOSAIC: usize = 144;

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let staging = begin(
        &args.output,
        &["catalogue.csv", "catalogue.h5", "truth.csv", "mosaic.svg", "mosaic.png"],
        bars,
    )?;
    let preset = match args.preset {
        PresetArg::Paper => Protocol::paper(),
        PresetArg::Text => Protocol::text(),
    };
    let protocol = if args.no_perturbers { preset.without_perturbers() } else { preset };
    let instrument = Instrument::default();
    let provenance = Provenance::new(Some(args.seed), toml_of(&protocol, args.pixel_sampling.into()));
    bars.begin("systems", None);
    let scale = instrument.pixel_scale_arcsec;
    let systems = MockSystem::draw_all(&protocol, args.seed, u64::from(args.number), scale)?;
    bars.end();
    let images = match args.no_images {
        true => None,
        false => Some(write_images(args, &systems, &instrument, &staging, &provenance, bars)?),
    };
    let of_images = images.as_ref().map(|(names, qualities)| (names.as_slice(), qualities.as_slice()));
    let table = catalogue_table(&systems, of_images)?;
    for name in ["catalogue.csv", "catalogue.h5"] {
        staging.write(name, |path| table.write(path, CATALOGUE_GROUP, &provenance))?;
    }
    if let Some((names, qualities)) = of_images {
        let truths = truth_table(&systems, names, qualities)?;
        staging.write("truth.csv", |path| truths.write(path, CATALOGUE_GROUP, &provenance))?;
    }
    let options = [
        option("-n", args.number, 64),
        option("--seed", args.seed, 1),
        option("--preset", value_name(args.preset), value_name(PresetArg::Paper)),
        option("--pixel-sampling", value_name(args.pixel_sampling), value_name(SamplingArg::Point)),
        flag("--no-perturbers", args.no_perturbers),
        flag("--no-images", args.no_images),
    ];
    let about = format!(
        "{} composite lenses drawn from the distributions of a catalogue, and their images behind a line of sight.",
        systems.len()
    );
    stage_page(&staging, "", &record("mock", &options.concat(), &about, &provenance))?;
    let files = commit(staging)?;
    StateFile::beside(&args.output, "study", String::new()).remove();
    if !bars.is_quiet() {
        let of_images = images.as_ref().map_or(0, |(names, _)| names.len());
        crate::terminal::print(&format!("{} systems drawn, {of_images} imaged\n", systems.len()));
    }
    print_files(&files, bars)
}

/// Stages the images and their mosaic; returns their names and qualities.
fn write_images(
    args: &Args,
    systems: &[MockSystem],
    instrument: &Instrument,
    staging: &Staging,
    provenance: &Provenance,
    bars: &Bars,
) -> Result<(Vec<String>, Vec<f64>)> {
    let command = format!("mock, seed {}\n{}", args.seed, provenance.config_toml);
    let saved = SavedRows::<MockImage>::beside(&args.output, command, bars)?;
    let rows: &dyn RowStore<MockImage> = &saved;
    let psf = Psf::gaussian(
        instrument.psf_fwhm_arcsec,
        instrument.psf_truncation_sigma,
        instrument.pixel_scale_arcsec,
    )?;
    let monitor: &dyn Monitor = bars;
    let task = monitor.task("images", Some(systems.len() as u64));
    let images: Vec<MockImage> = systems
        .par_iter()
        .map(|system| {
            task.check()?;
            let sampling = args.pixel_sampling.into();
            let expose = || MockImage::expose(system, instrument, &psf, sampling, args.seed);
            let image = rows.row(system.number, expose);
            task.advance(1);
            image
        })
        .collect::<Result<_>>()?;
    let digits = systems.len().to_string().len().max(2);
    let names: Vec<String> = (0..systems.len()).map(|i| format!("images/{i:0digits$}.fits")).collect();
    for ((system, image), name) in systems.iter().zip(&images).zip(&names) {
        task.check()?;
        let exposure = &image.exposure;
        let file = ImageFile::simulated(
            &exposure.noisy_e_s,
            &exposure.grid,
            instrument,
            &psf,
            args.pixel_sampling.into(),
            [system.z_lens, system.z_source],
        );
        staging.write(name, |path| file.write(path, provenance))?;
    }
    drop(task);
    let labels: Vec<String> = (0..systems.len()).map(|i| i.to_string()).collect();
    let tiles: Vec<MosaicImage> = images
        .iter()
        .zip(&labels)
        .take(MOST_IN_MOSAIC)
        .map(|(image, name)| {
            let (n, half) = (image.exposure.grid.pixels(), image.exposure.grid.half_width_arcsec());
            let values = &image.exposure.noisy_e_s;
            let grid = GridData::square(values, n, half);
            MosaicImage { image: grid, background_rms_e_per_s: instrument.background_rms_e_s(), name }
        })
        .collect();
    let columns = (tiles.len() as f64).sqrt().ceil() as usize;
    let figure = mosaic(&tiles, columns);
    stage_figure(staging, "mosaic", || Ok(Some(figure)))?;
    Ok((names, images.iter().map(|image| image.quality).collect()))
}

fn toml_of(protocol: &Protocol, sampling: PixelSampling) -> String {
    #[derive(serde::Serialize)]
    struct Resolved<'a> {
        pixel_sampling: PixelSampling,
        protocol: &'a Protocol,
    }
    let resolved = Resolved { pixel_sampling: sampling, protocol };
    toml::to_string_pretty(&resolved).unwrap_or_else(|error| format!("# {error}\n"))
}
