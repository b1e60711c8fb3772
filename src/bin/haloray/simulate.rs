//! `haloray simulate`: the whole chain into one folder.

use std::path::PathBuf;

use haloray::Result;
use haloray::inference::model::ModelDescription;
use haloray::io::{Provenance, Staging};
use haloray::pipeline::{DEFINITIONS, Inputs, ViewFit, fit_views, simulate};
use haloray::report::{FitSummary, RunRecord, stage_page, stage_text, write_fit, write_run};

use crate::bars::Bars;
use crate::fit::{Outcome, table};
use crate::models::toml_of;
use crate::output::{begin, commit, one_of_a_name};
use crate::record::{configured, option};
use crate::settings::{Settings, Sightline, Tracing, imported_haloes, provenance, psf};
use crate::summary;

/// Run the whole chain: haloes, tracing, diagnostics, maps, the two images, files and figures.
///
/// Without a configuration the embedded preset `paper` runs: section 4 of Hogg, Fleury, Larena & Martinelli 2023 at
/// its real size. The folder then holds run.h5 (everything, see docs/FILES.md), report.html (all of it as a
/// page), summary.json, config.toml, four FITS images and the figures as SVG and PNG.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray simulate -o run\n  haloray simulate --preset consistent --seed 7 -o run7\n  \
                  haloray simulate my.toml -o run    # my.toml holds only the keys you change\n  \
                  haloray simulate -o run --fit      # and fit both images"
)]
pub struct Args {
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    sightline: Sightline,
    #[command(flatten)]
    tracing: Tracing,
    /// Fit both images too, with `tidal-minimal` or the models given (comma-separated names of `haloray fit --list`).
    #[arg(long, value_name = "MODELS", num_args = 0..=1, value_delimiter = ',', default_missing_value = "tidal-minimal")]
    fit: Vec<String>,
    /// Draw critical curves and caustics over images and maps, and keep them in run.h5.
    #[arg(long)]
    curves: bool,
    /// Folder for the results; made if missing, files of an earlier run are replaced.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub fn run(args: &mut Args, bars: &Bars) -> Result<Outcome> {
    // `--fit my.toml` means the flag and the configuration.
    if let [file] = args.fit.as_slice()
        && file.to_ascii_lowercase().ends_with(".toml")
        && args.settings.or_file(file)
    {
        args.fit = vec!["tidal-minimal".into()];
    }
    let args = &*args;
    one_of_a_name("model", args.fit.iter().map(String::as_str))?;
    for model in &args.fit {
        ModelDescription::built_in(model)?;
    }
    let mut config = args.settings.resolve()?;
    args.tracing.apply(&mut config);
    config.diagnostics.critical_curves |= args.curves;
    config.image_doubts().iter().for_each(crate::terminal::warn);
    let psf = psf(&config)?;
    let provenance = provenance(&config, args.sightline.number)?;
    let staging =
        begin(&args.output, &["run.h5", "summary.json", "config.toml", "recovered_shears.csv"], bars)?;
    let inputs =
        Inputs { catalogue: imported_haloes(&config, args.sightline.number, bars)?, psf: psf.clone() };
    let run = simulate(&config, inputs, args.sightline.number, bars)?;
    bars.stage("files and figures", || write_run(&run, &psf, &staging, &provenance))?;
    let fits = fit_views(&run, &psf, &args.fit, bars)?;
    let record = record(args, &staging, &provenance)?;
    let summaries = write_fits(&fits, &staging, &record, config.seed)?;
    bars.stage("page", || stage_page(&staging, "", &record))?;
    let files = commit(staging)?;
    if !bars.is_quiet() {
        summary::print(&run, &args.settings.name(), &bars.seconds());
        for (fit, summary) in fits.iter().zip(&summaries) {
            crate::terminal::print(&format!("{} fitted with {}; true: on the axis\n", fit.image, fit.model));
            crate::terminal::print(&table(summary, fit.on_axis()));
        }
    }
    crate::output::print_files(&files, bars)?;
    for fit in &fits {
        if let Some(gain) = fit.missed_by {
            crate::terminal::warn(format_args!(
                "{} fitted with {}: a climb from the truth ends {gain:.1} higher in ln p; the fit missed that maximum",
                fit.image, fit.model
            ));
        }
    }
    let converged = summaries.iter().all(|summary| summary.converged);
    Ok(if converged { Outcome::Converged } else { Outcome::NotConverged })
}

fn record(args: &Args, staging: &Staging, provenance: &Provenance) -> Result<RunRecord> {
    let about = "What every halo on one line of sight does to the image of a lens: haloes, tensors, maps and images through them.";
    let sightline = option("--sightline", args.sightline.number, 0);
    let arguments: Vec<String> =
        [sightline, option("--fit", args.fit.join(","), "")].into_iter().flatten().collect();
    configured(staging, "simulate", &arguments, about, provenance)
}

/// Every fit in a folder of its own, and a table of expected and recovered shears.
fn write_fits(fits: &[ViewFit], staging: &Staging, whole: &RunRecord, seed: u64) -> Result<Vec<FitSummary>> {
    let mut summaries = Vec::new();
    let mut rows =
        String::from("image,model,parameter,expected_on_axis,median,hpd68_low,hpd68_high,converged");
    rows += &DEFINITIONS[1..].iter().map(|name| format!(",expected_{name}")).collect::<String>();
    rows += ",truth_climbs_higher_by\n";
    for fit in fits {
        let provenance = Provenance::new(Some(seed), toml_of(&fit.description));
        let summary = FitSummary::of(&fit.fit, &fit.model, fit.seconds);
        let prefix = format!("fit_{}_{}/", fit.image, fit.model);
        let record = RunRecord {
            command: format!("simulate: {} fitted with {}", fit.image.replace('_', " "), fit.model),
            about: fit.description.about.clone(),
            configuration: provenance.config_toml.clone(),
            ..whole.clone()
        };
        write_fit(&fit.fit, &summary, &fit.expected, staging, &prefix, &provenance, &record)?;
        let missed_by = fit.missed_by.unwrap_or(0.0);
        for (name, expected) in fit.on_axis() {
            if let Some(p) = summary.parameters.iter().find(|p| p.name == *name) {
                rows += &format!(
                    "{},{},{name},{expected},{},{},{},{}",
                    fit.image, fit.model, p.median, p.hpd68_low, p.hpd68_high, summary.converged
                );
                // Empty where a definition has nothing to say.
                for definition in &DEFINITIONS[1..] {
                    let set = fit.expected.iter().find(|(own, _)| own == definition);
                    let value = set.and_then(|(_, set)| set.iter().find(|(own, _)| own == name));
                    rows += &value.map_or(",".into(), |(_, value)| format!(",{value}"));
                }
                rows += &format!(",{missed_by}\n");
            }
        }
        summaries.push(summary);
    }
    if !fits.is_empty() {
        stage_text(staging, "recovered_shears.csv", &rows)?;
    }
    Ok(summaries)
}
