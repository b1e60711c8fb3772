//! `haloray study catalogue`: every image of a catalogue with every model; precision, accuracy, outliers.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Mutex;

use haloray::imaging::PixelSampling;
use haloray::inference::model::ModelDescription;
use haloray::io::{
    CATALOGUE_GROUP, Provenance, Saved, Staging, TrueShear, read_observation, read_recovery,
    read_truth_table, write_recovery,
};
use haloray::mock::ShearRecovery;
use haloray::pipeline::{CatalogueImage, CatalogueSettings, compiled_with_shear, fit_catalogue};
use haloray::report::{
    CatalogueReport, RunRecord, result_text, stage_figure, stage_json, stage_page, stage_text,
};
use haloray::{Error, Result};

use crate::bars::Bars;
use crate::fit::fingerprint;
use crate::models::{description, toml_of};
use crate::output::{begin, commit, one_of_a_name, print_files};
use crate::record::{file_name, flag, option, record, value_name};
use crate::sampling::{SamplerArg, SamplingArg, limited};
use crate::settings::whole;
use crate::terminal::{print, warn};

/// How well γ_LOS is measured: every image of a catalogue fitted with every model (section 3, Table 2).
///
/// DIR holds truth.csv (image, gamma1_los, gamma2_los, optionally quality) and the FITS images it names: the folder of
/// `haloray mock`, or one made elsewhere. One fit runs on each core from a blind start; a line tells of each that ends.
/// A fit that has ended is never repeated: the same command goes on where it was stopped and ends with the same table.
/// An image that a model cannot be fitted to is named and left out; what can be fitted is.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  haloray study catalogue catalogue\n  \
                  haloray study catalogue catalogue --models comprehensive,power-law -o results")]
pub struct CatalogueArgs {
    /// Folder with truth.csv and the images.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Models, built in or files ending in .toml.
    #[arg(
        long,
        value_name = "NAME|MODEL.toml,…",
        value_delimiter = ',',
        default_value = "comprehensive,no-foreground-shear,aligned,power-law"
    )]
    models: Vec<String>,
    /// Fit only the first N images of the table.
    #[arg(long, value_name = "N", value_parser = whole::<usize>(1..=u64::MAX))]
    first: Option<usize>,
    /// How pixels are integrated, instead of the models' (`point`): as the images were made.
    #[arg(long, value_enum)]
    pixel_sampling: Option<SamplingArg>,
    /// The profile likelihood of γ_LOS beside its posterior, with its coverage; some seconds more a fit.
    #[arg(long)]
    profile: bool,
    /// How to sample.
    #[arg(long, value_enum, default_value_t = SamplerArg::Valley)]
    sampler: SamplerArg,
    /// Draws of a chain or walker after which a fit stops, converged or not.
    #[arg(long, value_name = "N", value_parser = whole::<usize>(4..=u64::MAX))]
    max_draws: Option<usize>,
    /// Seed of starts and sampling.
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
    /// Folder for the results; DIR/study when left out.
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub fn run(args: &CatalogueArgs, bars: &Bars) -> Result<()> {
    let output = args.output.clone().unwrap_or_else(|| args.folder.join("study"));
    let models: Vec<ModelDescription> = args.models.iter().map(|m| description(m)).collect::<Result<_>>()?;
    compiled_with_shear(&models)?;
    let settings = CatalogueSettings {
        sampler: limited(args.sampler.settings(), args.max_draws)?,
        pixel_sampling: args.pixel_sampling.map(PixelSampling::from),
        profile: args.profile,
        seed: args.seed,
    };
    let mut truths = read_truth_table(&args.folder.join("truth.csv"))?;
    truths.truncate(args.first.unwrap_or(usize::MAX));
    one_of_a_name("model", models.iter().map(|model| model.name.as_str()))?;
    one_of_a_name("image", truths.iter().map(|truth| truth.image.as_str()))?;
    let images = truths
        .iter()
        .map(|truth| {
            let (observation, keywords) = read_observation(&args.folder.join(&truth.image))?;
            let pixel_sampling = keywords.pixel_sampling;
            Ok(CatalogueImage { name: truth.image.clone(), observation, pixel_sampling })
        })
        .collect::<Result<Vec<_>>>()?;
    let staging = begin(&output, &["fits.csv", "table.md", "result.md", "scores.json"], bars)?;
    bars.keeps("the fits that have ended", &output.join("fits"));

    let keys = keys(args, &images, &models, &settings)?;
    let all: Vec<(usize, usize)> =
        (0..images.len()).flat_map(|i| (0..models.len()).map(move |m| (i, m))).collect();
    let key = |(i, m): (usize, usize)| keys[i * models.len() + m].as_str();
    let saved =
        |task: (usize, usize)| read_recovery(&output, key(task), &images[task.0].name, &models[task.1].name);
    let mut fits = BTreeMap::new();
    for task in &all {
        match saved(*task)? {
            Saved::State(fit) => drop(fits.insert(*task, fit)),
            Saved::Nothing => {}
            Saved::Unusable(why) => {
                let (image, model) = (&images[task.0].name, &models[task.1].name);
                warn(format_args!("the saved fit of {image} with {model} is {why}; it begins anew"));
            }
        }
    }
    let missing: Vec<_> = all.iter().copied().filter(|task| !fits.contains_key(task)).collect();
    let fits = Mutex::new(fits);
    fit_catalogue(&images, &models, &missing, &settings, bars, |task, fit, seconds| {
        match fit {
            Ok(fit) => {
                match write_recovery(&output, key(task), &fit, seconds) {
                    Err(error @ Error::Write { .. }) => {
                        warn(format_args!("{error}; the study goes on, but would repeat this fit"));
                    }
                    written => written?,
                }
                let mut fits = fits.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
                if !bars.is_quiet() {
                    print(&line(fits.len() + 1, all.len(), &fit, &truths[task.0], seconds));
                }
                fits.insert(task, (fit, seconds));
            }
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            Err(error) => {
                let (image, model) = (&images[task.0].name, &models[task.1].name);
                warn(format_args!("no fit of {image} with {model}: {error}"));
            }
        }
        Ok(())
    })?;

    let fits = fits.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    let seconds: f64 = fits.values().map(|(_, seconds)| seconds).sum();
    let report = CatalogueReport {
        models: models.iter().map(|m| m.name.clone()).collect(),
        fits: fits.into_iter().map(|(task, (fit, _))| (fit, truths[task.0].clone())).collect(),
    };
    if report.fits.is_empty() {
        return Err(Error::out_of_range(
            "number of fits",
            0,
            "at least one; the warnings say why there is none",
        ));
    }
    let provenance = Provenance::new(Some(args.seed), resolved(&models, &settings));
    write(&report, &staging, &provenance)?;
    stage_page(&staging, "", &catalogue_record(args, &provenance))?;
    let files = commit(staging)?;
    if !bars.is_quiet() {
        let (table, fits) = (report.markdown(), report.fits.len());
        print(&format!("\n{table}\n{fits} of {} fits, {seconds:.0} s of fitting\n\n", all.len()));
    }
    print_files(&files, bars)
}

/// What each fit depends on: image, model and settings.
fn keys(
    args: &CatalogueArgs,
    images: &[CatalogueImage],
    models: &[ModelDescription],
    settings: &CatalogueSettings,
) -> Result<Vec<String>> {
    let mut keys = Vec::new();
    for image in images {
        let bytes = fingerprint(&args.folder.join(&image.name))?;
        for model in models {
            let model = toml_of(&settings.resolved(model, image));
            let profile = if settings.profile { ", profiles" } else { "" };
            keys.push(format!("{bytes}\n{:?}, seed {}{profile}\n{model}", settings.sampler, settings.seed));
        }
    }
    Ok(keys)
}

fn catalogue_record(args: &CatalogueArgs, provenance: &Provenance) -> RunRecord {
    let models: Vec<String> = args.models.iter().map(|model| file_name(model.as_ref())).collect();
    let text = |value: Option<usize>| value.map(|n| n.to_string()).unwrap_or_default();
    let options = [
        option("--models", models.join(","), "comprehensive,no-foreground-shear,aligned,power-law"),
        option("--first", text(args.first), ""),
        option("--pixel-sampling", args.pixel_sampling.map(value_name).unwrap_or_default(), ""),
        flag("--profile", args.profile),
        option("--sampler", value_name(args.sampler), value_name(SamplerArg::Valley)),
        option("--max-draws", text(args.max_draws), ""),
        option("--seed", args.seed, 1),
    ];
    let about = "Every image of a catalogue fitted with every model: how precisely and truly γ_LOS is found.";
    let words: Vec<String> = ["catalogue".to_owned()].into_iter().chain(options.concat()).collect();
    record("study catalogue", &words, about, provenance)
}

fn resolved(models: &[ModelDescription], settings: &CatalogueSettings) -> String {
    let models = models.iter().map(|m| format!("# ---- {}\n{}", m.name, toml_of(m)));
    format!("# {:?}\n{}", settings.sampler, models.collect::<String>())
}

fn line(number: usize, all: usize, fit: &ShearRecovery, truth: &TrueShear, seconds: f64) -> String {
    let shear = |a: usize| {
        let s = &fit.shear[a];
        let [minus, plus] = s.sigmas();
        format!("{:+.4} +{plus:.4} −{minus:.4} (true {:+.4})", s.median, truth.gamma_los[a])
    };
    let state = match (fit.converged, fit.is_productive()) {
        (false, _) => format!("NOT CONVERGED (R-hat {:.3}, ESS {:.0})", fit.worst_r_hat, fit.worst_ess),
        (true, false) => "unbounded".into(),
        (true, true) => "converged".into(),
    };
    let (image, model) = (&fit.image, &fit.model);
    format!(
        "{number}/{all}  {image}  {model:<20}  γ1 {}  γ2 {}  {state}, {seconds:.0} s\n",
        shear(0),
        shear(1)
    )
}

/// Tables, scores and figures.
fn write(report: &CatalogueReport, staging: &Staging, provenance: &Provenance) -> Result<()> {
    let table = report.fit_table()?;
    staging.write("fits.csv", |path| table.write(path, CATALOGUE_GROUP, provenance))?;
    stage_text(staging, "table.md", &report.markdown())?;
    let figures = report.figures();
    let shown: Vec<(&str, &str)> = figures.iter().map(|figure| (figure.name, figure.shows)).collect();
    stage_text(staging, "result.md", &result_text(&report.markdown(), &shown))?;
    stage_json(staging, "scores.json", &report.scores())?;
    figures.into_iter().try_for_each(|named| stage_figure(staging, named.name, || Ok(Some(named.figure))))
}

/// The default of `--models` are the models of the paper's table.
#[cfg(test)]
mod tests {
    use haloray::mock::PAPER_TABLE_2;

    use super::*;

    #[test]
    fn the_models_of_the_paper_are_built_in() {
        for paper in PAPER_TABLE_2 {
            assert_eq!(description(paper.model).unwrap().name, paper.model);
        }
    }
}
