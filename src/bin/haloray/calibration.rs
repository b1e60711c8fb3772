//! `haloray study calibration`: are the posteriors right? Fits of systems drawn from their own prior.

use std::path::PathBuf;

use haloray::Result;
use haloray::inference::model::{CompiledModel, FreeParameter};
use haloray::io::{Column, Provenance, RAYS_GROUP, Table};
use haloray::pipeline::{Calibration, CalibrationFit, ParameterCalibration, calibration_of};
use haloray::plot::figures::{RankHistogram, calibration as rank_figure};
use haloray::report::{markdown_table, result_text, stage_figure, stage_json};
use serde::Serialize;

use crate::bars::Bars;
use crate::models::{description, toml_of};
use crate::output::{begin, finish_study};
use crate::record::{option, record, value_name};
use crate::sampling::SamplerArg;
use crate::saved::SavedRows;
use crate::settings::whole;

/// The model that is drawn from when no other is asked for.
const MODEL: &str = "calibration";

/// Whether posteriors are right: systems drawn from a prior and fitted under it (simulation-based calibration).
///
/// Draws systems from the priors of a model (informative ones around Table 1 unless another is given), makes small
/// HST-like images, and fits each under the same priors from a blind start. If all is right, the rank of the truth
/// among draws of the posterior is uniform and 68% intervals hold it in 68% of the fits. Writes ranks.csv,
/// summary.json, a figure and result.md.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray study calibration -n 200 -o calibration\n  haloray study calibration --model comprehensive -n 200 -o composite"
)]
pub struct CalibrationArgs {
    /// Number of systems.
    #[arg(long, short, allow_negative_numbers = true, value_name = "N", default_value_t = 200, value_parser = whole::<u32>(2..=1_000_000))]
    number: u32,
    /// Seed of systems, noise and sampling.
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
    /// `calibration`: an elliptical power law around Table 1; `comprehensive`: stars and dark halo as mock systems have
    /// them, with lens light (both in data/models); or a file of your own, as for `fit`, whose lights have amplitude =
    /// [mean, sd].
    #[arg(long, value_name = "NAME|FILE.toml", default_value = MODEL)]
    model: String,
    /// Pixels of 0.2 arcsec along each side of the images; 17, for `comprehensive` 31, when left out.
    #[arg(long, value_name = "N", value_parser = whole::<u16>(5..=1000))]
    pixels: Option<u16>,
    /// How to sample.
    #[arg(long, value_enum, default_value_t = SamplerArg::Valley)]
    sampler: SamplerArg,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

#[derive(Serialize)]
struct Summary<'a> {
    fits: usize,
    fits_converged: usize,
    fits_with_divergences: usize,
    fits_good: usize,
    fits_on_a_wrong_maximum: usize,
    seed: u64,
    model: &'a str,
    pixels: usize,
    parameters: &'a [ParameterCalibration],
}

pub fn run(args: &CalibrationArgs, bars: &Bars) -> Result<()> {
    let names = ["ranks.csv", "summary.json", "calibration.svg", "calibration.png", "result.md"];
    let calibration = args.calibration()?;
    let (staging, sampler) = (begin(&args.output, &names, bars)?, args.sampler.settings());
    let text = toml_of(calibration.description());
    let pixels = calibration.pixels();
    let command = format!("study calibration, seed {}, {sampler:?}, {pixels} pixels\n{text}", args.seed);
    let saved = SavedRows::beside(&args.output, command, bars)?;
    let fits = calibration.run(args.number as usize, args.seed, sampler, &saved, bars)?;
    let model = calibration.model();
    let names: Vec<String> = model.free.iter().map(|p| p.name.clone()).collect();
    let parameters = calibration_of(&names, &fits);
    let provenance = Provenance::new(Some(args.seed), &text);
    let table = rank_table(model, &fits)?;
    staging.write("ranks.csv", |path| table.write(path, RAYS_GROUP, &provenance))?;
    let summary = Summary {
        fits: fits.len(),
        fits_converged: fits.iter().filter(|fit| fit.is_converged).count(),
        fits_with_divergences: fits.iter().filter(|fit| fit.divergences > 0).count(),
        fits_good: fits.iter().filter(|fit| fit.is_good_fit).count(),
        fits_on_a_wrong_maximum: fits.iter().filter(|fit| fit.is_on_a_wrong_maximum()).count(),
        seed: args.seed,
        model: &calibration.description().name,
        pixels,
        parameters: &parameters,
    };
    stage_json(&staging, "summary.json", &summary)?;
    let figure = rank_figure(&parameters.iter().zip(&model.free).map(histogram).collect::<Vec<_>>());
    stage_figure(&staging, "calibration", || Ok(Some(figure)))?;
    let result = result_text(&summary.table(), &[("calibration", "rank histograms and coverage")]);
    let options = [
        option("-n", args.number, 200),
        option("--seed", args.seed, 1),
        option("--model", &args.model, MODEL),
        option("--pixels", args.pixels.map_or(String::new(), |pixels| pixels.to_string()), ""),
        option("--sampler", value_name(args.sampler), value_name(SamplerArg::Valley)),
    ];
    let about = "Are posteriors right? Systems drawn from a prior and fitted under it: the rank of the truth must be uniform.";
    let record = record("study calibration", &options.concat(), about, &provenance);
    finish_study(staging, &result, &record, bars)?;
    saved.remove();
    Ok(())
}

impl CalibrationArgs {
    fn calibration(&self) -> Result<Calibration> {
        let pixels = self.pixels.map(usize::from);
        let built_in = Calibration::built_in(&self.model, pixels);
        built_in.unwrap_or_else(|| Calibration::new(description(&self.model)?, pixels))
    }
}

fn histogram((parameter, free): (&ParameterCalibration, &FreeParameter)) -> RankHistogram {
    RankHistogram {
        label: free.label(),
        counts: parameter.rank_counts.iter().map(|n| *n as f64).collect(),
        p_value: parameter.p_value,
        coverage: parameter.coverage,
    }
}

/// Truth, mean, standard deviation and rank of every parameter, one row a fit.
fn rank_table(model: &CompiledModel, fits: &[CalibrationFit]) -> Result<Table> {
    let column = |name: String, value: &dyn Fn(&CalibrationFit) -> f64| {
        Column::f64(&name, None, fits.iter().map(value).collect())
    };
    let mut columns = vec![
        column("converged".into(), &|fit| f64::from(u8::from(fit.is_converged))),
        column("worst_r_hat".into(), &|fit| fit.worst_r_hat),
        column("worst_ess".into(), &|fit| fit.worst_ess),
        column("divergences".into(), &|fit| fit.divergences as f64),
        column("good_fit".into(), &|fit| f64::from(u8::from(fit.is_good_fit))),
        column("ln_p_above_truth".into(), &|fit| fit.ln_p_above_truth),
    ];
    for (i, parameter) in model.free.iter().enumerate() {
        let name = &parameter.name;
        columns.push(column(format!("{name}.truth"), &|fit| fit.truths[i]));
        columns.push(column(format!("{name}.mean"), &|fit| fit.means[i]));
        columns.push(column(format!("{name}.sd"), &|fit| fit.standard_deviations[i]));
        columns.push(column(format!("{name}.rank"), &|fit| fit.ranks[i] as f64));
    }
    Table::new(columns)
}

impl Summary<'_> {
    /// One line a parameter.
    fn table(&self) -> String {
        let line = |p: &ParameterCalibration| {
            vec![
                p.name.clone(),
                format!("{:.3}", p.chi2 / (p.rank_counts.len() - 1) as f64),
                format!("{:.4}", p.p_value),
                format!("{:.1}%", 100.0 * p.coverage),
                format!("{:.3}", p.mean_pull),
                format!("{:.5}", p.median_standard_deviation),
            ]
        };
        let head = ["parameter", "χ²/19", "p", "coverage of 68%", "mean pull", "median sd"];
        let table = markdown_table(&head, &self.parameters.iter().map(line).collect::<Vec<_>>());
        let Self { fits, fits_converged, fits_with_divergences, fits_good, fits_on_a_wrong_maximum, .. } =
            self;
        format!(
            "{fits} fits, {fits_converged} converged, {fits_with_divergences} with divergences; {fits_good} describe their image, \
             {fits_on_a_wrong_maximum} end on a maximum lower than the truth.\n\n{table}"
        )
    }
}
