//! `haloray images`: all images of a point source behind a lens model, critical curves and caustics.

use std::path::PathBuf;

use haloray::diagnostics::{CriticalCurves, PointImages, SkyWindow};
use haloray::io::{Provenance, RAYS_GROUP, curve_table, image_table, kind_name, read_lens_model};
use haloray::report::{RunRecord, curve_figure, decimals_text, stage_figure, stage_page};
use haloray::{Error, Result};

use crate::bars::Bars;
use crate::output::{Output, commit, print_files};
use crate::record::{file_name, option, record as record_of};
use crate::settings::Cosmology;

/// Find all images of a point source behind a lens model in lenstronomy's own form.
///
/// Prints position, kind, magnification and delay of every image, faint central ones included, and says whether the
/// parities add up to the winding of β − β_s along the edge of the window, as they must when none is missing. The window
/// is widened where rays at its edge are deflected so far that images may lie outside. A folder
/// as output holds images.csv, curves.csv (critical curves and caustics, vertex by vertex) and their figure.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  haloray images model.json --source 0.1,0.05\n  \
                  haloray images model.json --source 0.1,0.05 -o images.csv\n  \
                  haloray images model.json --source 0.1,0.05 -o lens      # with curves and figure")]
pub struct Args {
    /// Lens model, as for `haloray lens`.
    #[arg(value_name = "MODEL.json")]
    model: PathBuf,
    /// Position of the source, arcsec.
    #[arg(long, value_name = "X,Y", allow_hyphen_values = true)]
    source: String,
    /// Half the side of the window about the axis in which images are looked for; widened where they may lie outside.
    #[arg(long, allow_negative_numbers = true, value_name = "ARCSEC", default_value_t = HALF_WIDTH_ARCSEC)]
    half_width_arcsec: f64,
    /// One file for the images (.csv, .h5 or .fits), or a folder for images, curves, figure and page.
    #[arg(long, short, value_name = "DIR|FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    cosmology: Cosmology,
}

const HALF_WIDTH_ARCSEC: f64 = 5.0;
/// What a folder gets.
const FILES: [&str; 4] = ["images.csv", "curves.csv", "curves.svg", "curves.png"];

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let source = source(&args.source)?;
    let model = read_lens_model(&args.model, &args.cosmology.background()?)?;
    let window = SkyWindow::about_axis(args.half_width_arcsec, model.lens.lens_centres_arcsec())
        .map_err(|error| error.named("half_width_arcsec", "--half-width-arcsec"))?;
    let extensions = ["csv", "h5", "hdf5", "fits", "fit"];
    let output = args.output.as_deref();
    let output = output
        .map(|path| Output::begin(path, &extensions, &[Some(&args.model)], &FILES, bars))
        .transpose()?;
    for warning in &model.warnings {
        crate::terminal::warn(warning);
    }
    let mapping = model.lens.mapping();
    let found = PointImages::of(mapping, &window, source, bars)?;
    if let Some(doubt) = found.doubt() {
        crate::terminal::warn(doubt);
    }
    let table = image_table(&found)?;
    let provenance = Provenance::new(None, "");
    let files = match output {
        None => Vec::new(),
        Some(Output::File(file)) => {
            table.write(&file, RAYS_GROUP, &provenance)?;
            vec![file]
        }
        Some(Output::Folder(staging)) => {
            staging.write("images.csv", |path| table.write(path, RAYS_GROUP, &provenance))?;
            let curves = CriticalCurves::of(mapping, &found.window, bars)?;
            let vertices = curve_table(&curves)?;
            staging.write("curves.csv", |path| vertices.write(path, RAYS_GROUP, &provenance))?;
            let figure = curve_figure(&curves, &found, source, found.window.half_width_arcsec);
            stage_figure(&staging, "curves", || Ok(Some(figure)))?;
            let doubts = model.warnings.iter().map(ToString::to_string).chain(found.doubt());
            stage_page(&staging, "", &record(args, doubts.collect(), &found, &provenance))?;
            commit(staging)?
        }
    };
    crate::terminal::print_result(&text(&found))?;
    print_files(&files, bars)
}

fn record(args: &Args, warnings: Vec<String>, found: &PointImages, provenance: &Provenance) -> RunRecord {
    let verdict = if found.is_complete() { "complete" } else { "not proven complete" };
    let about = format!(
        "All images of a point source behind a lens model: {}, {verdict} by the parity count.",
        found.images.len()
    );
    let half_width = option("--half-width-arcsec", args.half_width_arcsec, HALF_WIDTH_ARCSEC);
    let arguments = [file_name(&args.model), "--source".into(), args.source.clone()];
    let arguments: Vec<String> =
        arguments.into_iter().chain(half_width).chain(args.cosmology.words()).collect();
    RunRecord { warnings, makes_images: false, ..record_of("images", &arguments, &about, provenance) }
}

fn source(text: &str) -> Result<[f64; 2]> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some(&[x, y]) if x.is_finite() && y.is_finite() => Ok([x, y]),
        _ => Err(Error::argument("--source", text, "two numbers with a comma between them, in arcsec")),
    }
}

fn text(found: &PointImages) -> String {
    let mut text = "    θ_x [arcsec]    θ_y [arcsec]  kind     magnification  delay [days]\n".to_owned();
    for image in &found.images {
        let [x, y] = image.theta_arcsec;
        let (kind, magnification) = (kind_name(image.kind()), image.magnification());
        let [x, y, magnification, delay] = [(x, 9), (y, 9), (magnification, 6), (image.delay_days, 6)]
            .map(|(value, n)| decimals_text(value, n));
        text += &format!("{x:>16}{y:>16}  {kind:<7}{magnification:>15}{delay:>14}\n");
    }
    for point in &found.singular {
        let [x, y] = point.theta_arcsec;
        let [x, y] = [x, y].map(|value| decimals_text(value, 9));
        text += &format!("{x:>16}{y:>16}  singular lens centre, counts {}\n", point.winding);
    }
    let verdict = if found.is_complete() { "complete by the parity count" } else { "NOT proven complete" };
    let half = found.window.half_width_arcsec;
    text + &format!("{} images within {half:.4}″ of the axis, {verdict}\n", found.images.len())
}
