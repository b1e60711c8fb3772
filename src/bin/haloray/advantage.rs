//! `haloray study advantage`: the full against the minimal model on the paper's Table 1 image.

use std::path::PathBuf;
use std::time::Instant;

use haloray::Result;
use haloray::inference::model::ModelDescription;
use haloray::io::{Provenance, Staging};
use haloray::pipeline::{Advantage, advantage};
use haloray::plot::Figure;
use haloray::report::{
    FitSummary, RunRecord, corner_figure, exposure_figure, grouped, markdown_table, result_text,
    stage_figure, stage_page, stage_text, write_fit,
};

use crate::bars::Bars;
use crate::fit::{Outcome, table};
use crate::models::toml_of;
use crate::output::{begin, commit, print_files};
use crate::record::{option, record, value_name};
use crate::sampling::SamplerArg;

/// Fit the paper's Table 1 image with the full and with the minimal model of the line of sight (section 2.3).
///
/// Writes both fits and the paper's four corner panels: os and ds shears of the full model, which are degenerate; od
/// shear and ellipticity of both; γ_LOS and ellipticity of the minimal model. The full fit's γ_LOS is derived from its
/// od, os and ds shears.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  haloray study advantage -o advantage")]
pub struct AdvantageArgs {
    /// Seed of noise and sampling.
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
    /// How to sample.
    #[arg(long, value_enum, default_value_t = SamplerArg::Valley)]
    sampler: SamplerArg,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub fn run(args: &AdvantageArgs, bars: &Bars) -> Result<Outcome> {
    let staging = begin(&args.output, &["result.md", "image.svg", "image.png"], bars)?;
    let start = Instant::now();
    let study = advantage(args.seed, args.sampler.settings(), bars)?;
    let summaries = write(args, &study, &staging, start.elapsed().as_secs_f64())?;
    let files = commit(staging)?;
    if !bars.is_quiet() {
        for summary in &summaries {
            crate::terminal::print(&table(summary, &study.image.truths));
        }
    }
    print_files(&files, bars)?;
    let converged = summaries.iter().all(|summary| summary.converged);
    Ok(if converged { Outcome::Converged } else { Outcome::NotConverged })
}

fn write(
    args: &AdvantageArgs,
    study: &Advantage,
    staging: &Staging,
    seconds: f64,
) -> Result<Vec<FitSummary>> {
    let mut summaries = Vec::new();
    let options = [
        option("--seed", args.seed, 1),
        option("--sampler", value_name(args.sampler), value_name(SamplerArg::Valley)),
    ];
    let about = "The paper's Table 1 image fitted with the full and with the minimal model of the line of sight (section 2.3).";
    let none = Provenance::new(Some(args.seed), "");
    let whole = record("study advantage", &options.concat(), about, &none);
    for (name, fit) in [("simple-full", &study.full), ("simple-minimal", &study.minimal)] {
        let description = ModelDescription::built_in(name)?;
        let provenance = Provenance::new(Some(args.seed), toml_of(&description));
        let summary = FitSummary::of(fit, name, seconds);
        let record = RunRecord {
            command: format!("study advantage: {name}"),
            about: description.about.clone(),
            configuration: provenance.config_toml.clone(),
            ..whole.clone()
        };
        write_fit(
            fit,
            &summary,
            &[("truth", study.image.truths.clone())],
            staging,
            &format!("{name}/"),
            &provenance,
            &record,
        )?;
        summaries.push(summary);
    }
    let save = |name: &str, figure: Figure| stage_figure(staging, name, || Ok(Some(figure)));
    save("image", exposure_figure(&study.image.exposure, study.image.instrument.background_rms_e_s(), None))?;
    let (full, minimal) = (("full model", &study.full), ("minimal model", &study.minimal));
    let (od_and_shape, los) =
        (["gamma1_od", "gamma2_od", "lens.e1", "lens.e2"], ["gamma1_los", "gamma2_los"]);
    let panel = |fits: &[(&str, &haloray::inference::Fit)], names: &[&str]| {
        corner_figure(fits, names, &[("truth", study.image.truths.clone())])
    };
    save("full_os_ds", panel(&[full], &["gamma1_os", "gamma2_os", "gamma1_ds", "gamma2_ds"]))?;
    save("full_od_ellipticity", panel(&[full], &od_and_shape))?;
    save("minimal_od_ellipticity", panel(&[minimal], &od_and_shape))?;
    save("minimal_los_ellipticity", panel(&[minimal], &["gamma1_los", "gamma2_los", "lens.e1", "lens.e2"]))?;
    save("los_of_both", panel(&[full, minimal], &los))?;
    let figures =
        [("full_os_ds", "os and ds shears of the full model"), ("los_of_both", "γ_LOS of both models")];
    stage_text(staging, "result.md", &result_text(&comparison(&summaries, &study.image.truths), &figures))?;
    stage_page(staging, "", &whole)?;
    Ok(summaries)
}

/// The shears of both models beside the truth, and whether the fits have converged.
fn comparison(summaries: &[FitSummary], truths: &[(String, f64)]) -> String {
    let line = |name: &str, of: &dyn Fn(&FitSummary) -> String, truth: String| -> Vec<String> {
        [name.to_string()].into_iter().chain(summaries.iter().map(of)).chain([truth]).collect()
    };
    let shear = |name: &str| {
        let of = |summary: &FitSummary| {
            let found = summary.parameters.iter().find(|p| p.name == name);
            found.map_or(String::new(), |p| {
                let derived = if p.derived { " (derived)" } else { "" };
                format!("{:.4}, 68% in [{:.4}, {:.4}]{derived}", p.median, p.hpd68_low, p.hpd68_high)
            })
        };
        let truth = truths.iter().find(|(own, _)| own == name);
        line(name, &of, truth.map_or(String::new(), |(_, value)| format!("{value:.4}")))
    };
    // The full model has or derives every shear of the minimal one.
    let names = summaries.iter().take(1).flat_map(|full| &full.parameters).map(|p| p.name.as_str());
    let mut lines: Vec<Vec<String>> =
        names.filter(|name| name.starts_with("gamma") || name.starts_with("omega")).map(shear).collect();
    let state = |s: &FitSummary| {
        let converged = if s.converged { "yes" } else { "no" };
        format!("{converged}: worst R-hat {:.4}, worst ESS {:.0}", s.worst_r_hat, s.worst_ess)
    };
    lines.push(line("converged", &state, String::new()));
    lines.push(line("evaluations", &|s| grouped(s.evaluations as f64), String::new()));
    markdown_table(&["", "full model", "minimal model", "true"], &lines)
}
