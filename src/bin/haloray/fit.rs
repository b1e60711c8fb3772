//! `haloray fit`: an image and a model to a posterior.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use haloray::error::{Domain, FileFault};
use haloray::imaging::PixelSampling;
use haloray::inference::diagnose::ESS_LIMIT;
use haloray::inference::model::{BUILT_IN, FreeParameter, LikelihoodKind};
use haloray::inference::{Fit, FitSettings, FitState, FitStore};
use haloray::io::{NumbersByName, Provenance, hash, read_observation, read_text};
use haloray::monitor::Monitor;
use haloray::report::{FitSummary, RunRecord, decimals_text, grouped, probability_text, write_fit};
use haloray::{Error, Result};

use crate::bars::Bars;
use crate::models::{description, list, toml_of};
use crate::output::{begin, commit, print_files};
use crate::record::{file_name, option, record, value_name};
use crate::sampling::{LikelihoodArg, SamplerArg, SamplingArg, limited};
use crate::saved::StateFile;
use crate::settings::whole;
use crate::terminal::{print, print_result, warn};
use crate::through_haloes::{choose_table, compile};

/// Fit a lensed image: the posterior of a lens, its line of sight and its source.
///
/// IMAGE.fits needs a WCS or pixel scale and the keywords EXPTIME (s), BKGRMS (e⁻/s), PSFFWHM (arcsec; PSFTRUNC in
/// standard deviations) or an extension PSF, on the image's pixels or, if it says so (PIXSCALE, WCS), on whole parts of
/// them; an extension MASK says which pixels to use (1 = use). Pixels are in e⁻/s. Of several extensions SCI is taken.
/// The start is found from image and priors alone. The folder then holds summary.json, posterior.nc (ArviZ reads it),
/// the model and figures. A fit that was interrupted continues with the same command and ends with the same posterior.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray fit --list\n  haloray fit image.fits --model simple-minimal -o fit\n  \
                  haloray fit image.fits --model my.toml --sampler nested -o evidence\n  \
                  haloray fit run/image_all_haloes.fits --model haloes --haloes run/run.h5 -o closure\n\n\
                  Exit code 1 if the posterior has not converged (R-hat < 1.01 and ESS > 400 for every quantity).\n\
                  Whether the model describes the image is another question: good_fit in summary.json, and a warning before the table."
)]
pub struct Args {
    /// The image.
    #[arg(value_name = "IMAGE.fits", required_unless_present = "list")]
    image: Option<PathBuf>,
    /// A built-in model (see --list), or a file ending in .toml.
    #[arg(long, value_name = "NAME|MODEL.toml", required_unless_present = "list")]
    model: Option<String>,
    /// Halo table of a model whose line of sight is made of haloes (.csv, .h5, .fits, or the run.h5 of a simulation).
    #[arg(long, value_name = "FILE")]
    haloes: Option<PathBuf>,
    /// Explain the built-in models and stop; with --model, print that model as TOML.
    #[arg(long)]
    list: bool,
    /// How to sample.
    #[arg(long, value_enum, default_value_t = SamplerArg::Valley)]
    sampler: SamplerArg,
    /// Likelihood, instead of the model's.
    #[arg(long, value_enum)]
    likelihood: Option<LikelihoodArg>,
    /// How pixels are integrated, instead of what the image's PIXSAMP, or else the model, says; adaptive if none does.
    #[arg(long, value_enum)]
    pixel_sampling: Option<SamplingArg>,
    /// Draws of a chain or walker after which sampling stops, converged or not; nested sampling stops by itself.
    #[arg(long, value_name = "N", value_parser = whole::<usize>(4..=u64::MAX))]
    max_draws: Option<usize>,
    /// Sample until every quantity has this many effective draws, for smoother contours; nested sampling stops by itself.
    #[arg(long, value_name = "N", default_value_t = ESS_LIMIT)]
    min_ess: f64,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
    /// Free parameters (gamma1_los,lens.theta_E) whose profile likelihood is wanted beside the posterior: how high ln L gets
    /// where each is held, and the intervals of −2Δln L < 1 and 4, in which priors have no part but for their edges.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    profile: Vec<String>,
    /// JSON object of true values by parameter name, drawn as lines in the corner plot.
    #[arg(long, value_name = "FILE.json")]
    truth: Option<PathBuf>,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR", required_unless_present = "list")]
    output: Option<PathBuf>,
}

/// What the folder of a fit holds.
const FIT_FILES: [&str; 15] = [
    "summary.json",
    "timings.json",
    "model.toml",
    "posterior.nc",
    "reconstruction.h5",
    "corner.svg",
    "corner.png",
    "reconstruction.svg",
    "reconstruction.png",
    "source.svg",
    "source.png",
    "profiles.svg",
    "profiles.png",
    "trace.svg",
    "trace.png",
];

/// What [`run`] says when it ended well or not.
pub enum Outcome {
    Converged,
    NotConverged,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> Self {
        match outcome {
            Outcome::Converged => Self::SUCCESS,
            Outcome::NotConverged => Self::from(1),
        }
    }
}

pub fn run(args: &Args, bars: &Bars) -> Result<Outcome> {
    let description = args.model.as_deref().map(description).transpose()?;
    let (Some(image), Some(output), Some(mut description), false) =
        (&args.image, &args.output, description.clone(), args.list)
    else {
        // A built-in model is shown as it was written, one line a prior, ready to be extended.
        let built_in = BUILT_IN.iter().find(|(name, _)| Some(*name) == args.model.as_deref());
        let text = built_in.map(|(_, toml)| toml.to_string()).or(description.map(|d| toml_of(&d)));
        print_result(&text.unwrap_or_else(list))?;
        return Ok(Outcome::Converged);
    };
    if let Some(kind) = args.likelihood {
        description.likelihood = match kind {
            LikelihoodArg::Gaussian => LikelihoodKind::Gaussian,
            LikelihoodArg::Lenstronomy => LikelihoodKind::Lenstronomy,
        };
    }
    let sampling = args.pixel_sampling.map(PixelSampling::from);
    choose_table(&mut description, args.haloes.as_deref(), args.model.as_deref())?;
    Domain::at_least(ESS_LIMIT)
        .check("min_ess", args.min_ess)
        .map_err(|e| e.named("min_ess", "--min-ess"))?;
    let (observation, keywords) = read_observation(image)?;
    let pixel_sampling = description.sampling(sampling.or(keywords.pixel_sampling));
    description.pixel_sampling = Some(pixel_sampling);
    let settings = FitSettings {
        likelihood: description.likelihood,
        pixel_sampling,
        sampler: limited(args.sampler.settings(), args.max_draws)?,
        min_ess: args.min_ess,
        seed: args.seed,
    };
    let model = compile(&description, &keywords)?;
    model.free.iter().filter_map(FreeParameter::cut_prior).for_each(warn);
    let known: Vec<String> = model.quantities().into_iter().map(|quantity| quantity.name).collect();
    let truths = args.truth.as_deref().map_or(Ok(Vec::new()), |path| read_truths(path, &known))?;
    for name in &args.profile {
        model.place_of_free(name).map_err(|error| error.named("name of a free parameter", "--profile"))?;
    }
    let provenance = Provenance::new(Some(args.seed), toml_of(&description));
    let staging = begin(output, &FIT_FILES, bars)?;

    let mut inputs = fingerprint(image)?;
    if let Some(table) = &description.line_of_sight.file {
        inputs += &fingerprint(table)?;
    }
    let command = format!("{settings:?}\n{}\n{inputs}", provenance.config_toml);
    let mut saved = SavedFit::beside(output, command, bars);
    let monitor: &dyn Monitor = bars;
    let task = monitor.task(&description.name, None);
    let fit = Fit::run(observation, model, settings, &mut saved, monitor).map_err(|error| {
        // What cannot be fitted has no state worth keeping.
        if error.is_bad_input() {
            saved.file.remove();
        }
        error.in_model(&description.name)
    })?;
    drop(task);
    let profiles = fit.profiles(&args.profile, monitor)?;
    let summary = FitSummary { profiles, ..FitSummary::of(&fit, &description.name, saved.seconds()) };
    let about = match description.about.as_str() {
        "" => format!("An image fitted with the model {}.", description.name),
        about => about.to_owned(),
    };
    let record = fit_record(args, image, &about, &provenance);
    write_fit(&fit, &summary, &[("truth", truths.clone())], &staging, "", &provenance, &record)?;
    let files = commit(staging)?;
    saved.file.remove();
    if !bars.is_quiet() {
        print(&table(&summary, &truths));
    }
    print_files(&files, bars)?;
    Ok(if summary.converged { Outcome::Converged } else { Outcome::NotConverged })
}

/// What the page says of the command; likelihood and pixels are in the model that is kept.
fn fit_record(args: &Args, image: &Path, about: &str, provenance: &Provenance) -> RunRecord {
    let text = |value: Option<String>| value.unwrap_or_default();
    let options = [
        option("--haloes", text(args.haloes.as_deref().map(file_name)), ""),
        option("--sampler", value_name(args.sampler), value_name(SamplerArg::Valley)),
        option("--max-draws", text(args.max_draws.map(|n| n.to_string())), ""),
        option("--min-ess", args.min_ess, ESS_LIMIT),
        option("--seed", args.seed, 1),
        option("--profile", args.profile.join(","), ""),
        option("--truth", text(args.truth.as_deref().map(file_name)), ""),
    ];
    let inputs = [file_name(image), "--model".into(), "model.toml".into()];
    let words: Vec<String> = inputs.into_iter().chain(options.into_iter().flatten()).collect();
    record("fit", &words, about, provenance)
}

/// The state of an unfinished fit.
struct SavedFit<'a> {
    bars: &'a Bars,
    file: StateFile,
    /// Seconds of earlier attempts.
    before: f64,
    start: Instant,
}

impl<'a> SavedFit<'a> {
    fn beside(output: &Path, command: String, bars: &'a Bars) -> Self {
        let file = StateFile::beside(output, "fit", command);
        bars.keeps("the state of the fit", &file.path);
        Self { bars, file, before: 0.0, start: Instant::now() }
    }

    /// Seconds of all attempts.
    fn seconds(&self) -> f64 {
        self.before + self.start.elapsed().as_secs_f64()
    }
}

impl FitStore for SavedFit<'_> {
    fn load(&mut self) -> Result<Option<FitState>> {
        let (state, seconds) = self.file.load()?.unzip();
        self.before = seconds.unwrap_or(0.0);
        Ok(state)
    }

    fn refuse(&mut self) {
        self.before = 0.0;
        self.file.begin_anew("of another fit");
    }

    fn doubt(&mut self, doubt: &str) {
        warn(doubt);
    }

    fn save(&mut self, state: &FitState) -> Result<()> {
        let seconds = self.seconds();
        self.file.save(&(state, seconds), self.bars.is_cancelled())
    }
}

/// The image's bytes in short, to notice another image under the same name.
pub fn fingerprint(path: &Path) -> Result<String> {
    let bytes = std::fs::read(path).map_err(Error::read(path))?;
    Ok(format!("{} bytes, {:016x}", bytes.len(), hash(&bytes)))
}

fn read_truths(path: &Path, known: &[String]) -> Result<Vec<(String, f64)>> {
    let refuse = |problem| Err(Error::file(FileFault::Content, path, problem));
    let text = read_text(path)?;
    let NumbersByName(values) = match serde_json::from_str(&text) {
        Ok(values) => values,
        Err(e) => return refuse(format!("not a JSON object of numbers by parameter name: {e}")),
    };
    let unknown: Vec<&str> =
        values.keys().map(String::as_str).filter(|n| !known.iter().any(|k| k == n)).collect();
    if !unknown.is_empty() {
        let (unknown, known) = (unknown.join(", "), known.join(", "));
        return refuse(format!("the fit has no {unknown}; its parameters are {known}"));
    }
    Ok(values.into_iter().collect())
}

/// The posterior as a person reads it.
pub fn table(summary: &FitSummary, truths: &[(String, f64)]) -> String {
    let mut text = String::from("\n");
    if !summary.good_fit {
        text += "NOT A GOOD FIT\n";
    }
    summary.warnings.iter().for_each(|warning| text += &format!("warning: {warning}\n"));
    let _ = writeln!(
        text,
        "\n{:<24} {:>11} {:>11} {:>24} {:>8} {:>8}",
        "parameter", "median", "best fit", "68% interval", "R-hat", "ESS"
    );
    for p in &summary.parameters {
        let note = match (p.bounded, truths.iter().find(|(name, _)| *name == p.name)) {
            (false, _) => "  reaches its prior's edge".into(),
            (_, Some((_, truth))) => format!("  true {}", decimals_text(*truth, 5)),
            _ => String::new(),
        };
        let _ = writeln!(
            text,
            "{:<24} {:>11} {:>11} {:>24} {:>8.4} {:>8.0}{note}",
            p.name,
            decimals_text(p.median, 5),
            decimals_text(p.best_fit, 5),
            format!("[{}, {}]", decimals_text(p.hpd68_low, 5), decimals_text(p.hpd68_high, 5)),
            p.r_hat,
            p.ess_bulk.min(p.ess_tail)
        );
    }
    if !summary.profiles.is_empty() {
        let _ = writeln!(
            text,
            "\n{:<24} {:>11} {:>24} {:>24}",
            "profile likelihood", "highest at", "−2Δln L < 1", "−2Δln L < 4"
        );
    }
    for profile in &summary.profiles {
        let ends = |interval: [Option<f64>; 2]| {
            let [low, high] = interval.map(|end| end.map_or("edge".into(), |end| decimals_text(end, 5)));
            format!("[{low}, {high}]")
        };
        let (name, best) = (&profile.name, decimals_text(profile.best_fit, 5));
        let (inner, outer) = (ends(profile.interval68), ends(profile.interval95));
        let _ = writeln!(text, "{name:<24} {best:>11} {inner:>24} {outer:>24}");
    }
    if let (Some(z), Some(error)) = (summary.log_evidence, summary.log_evidence_error) {
        let _ = writeln!(text, "\nln Z = {} ± {error:.2}", decimals_text(z, 2));
    }
    let _ = writeln!(
        text,
        "\n{}{}: χ²/dof {:.3} (p {}), {} evaluations, {:.1} s{}\n",
        if summary.converged { "converged" } else { "NOT CONVERGED" },
        if summary.good_fit { ", good fit" } else { ", NOT A GOOD FIT" },
        summary.chi2_reduced,
        probability_text(summary.p_value, 2),
        grouped(summary.evaluations as f64),
        summary.seconds,
        if summary.divergences > 0 {
            format!(", {} divergences", summary.divergences)
        } else {
            String::new()
        },
    );
    text
}
