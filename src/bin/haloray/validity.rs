//! `haloray study validity`: when is the tidal approximation good enough to measure γ_LOS, and which γ_LOS?

use std::path::PathBuf;

use clap::ValueEnum;
use haloray::io::RAYS_GROUP;
use haloray::pipeline::{
    Estimate, FitStart, SeenHaloes, ValidityCase, ValidityPlan, ValiditySummary, validity,
};
use haloray::report::{result_text, stage_json, validity_figures, validity_result, validity_table};
use haloray::{Error, Result};

use crate::bars::Bars;
use crate::output::{begin, finish_study};
use crate::record::{configured, option, value_name};
use crate::saved::SavedRows;
use crate::settings::{Settings, provenance, psf, whole, with_named_files};

/// When the tidal approximation is good enough to measure γ_LOS, and which γ_LOS it then measures.
///
/// Images N sightlines through all their haloes and through those with Δ_h below each limit, each image beside that of a strictly
/// tidal twin: the same lens, source and noise behind nothing but the tensors of the axis ray. Every image is fitted with every
/// model from every start. Writes validity.csv and validity.h5 (one row a fit), summary.json (biases, scatter and coverage by
/// definition of γ_LOS, shares of misfits, evidences, H0 of delays), figures and result.md. What has ended is kept: the same
/// command, with more or fewer sightlines too, goes on where it was stopped.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
                  haloray study validity --preset consistent -n 1000 --estimate laplace -o validity\n  \
                  haloray study validity --preset consistent -n 200 --estimate laplace --views all \\\n    \
                  --starts truth --vary source.radius_arcsec=0.1,0.6 \\\n    \
                  --vary lens.einstein_radius_arcsec=0.8,2 -o varied")]
pub struct ValidityArgs {
    #[command(flatten)]
    settings: Settings,
    /// Number of sightlines.
    #[arg(long, short, allow_negative_numbers = true, value_name = "N", default_value_t = 100, value_parser = whole::<u64>(1..=(1 << 40) - 1))]
    number: u64,
    /// Haloes that are seen: all, or those with Δ_h below a limit.
    #[arg(long, value_name = "all|LIMIT", value_delimiter = ',', default_value = "all,0.3,0.1,0.03")]
    views: Vec<SeenHaloes>,
    /// Built-in models with free gamma1_los and gamma2_los; evidences are compared with the first one's.
    #[arg(long, value_name = "NAME", value_delimiter = ',', default_value = "tidal-minimal,tidal-flexion")]
    models: Vec<String>,
    /// Where fits begin: from priors and image alone, from the truth.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "blind,truth")]
    starts: Vec<StartArg>,
    /// How γ_LOS and its errors are taken from a posterior.
    #[arg(long, value_enum, default_value_t = EstimateArg::Sample)]
    estimate: EstimateArg,
    /// No delays and no H0: of truncated haloes they take longer than a fit from the truth.
    #[arg(long)]
    no_delays: bool,
    /// The same sightlines with another value of a key, one key at a time; may be given again for other keys.
    #[arg(long, value_name = "KEY=VALUE,…")]
    vary: Vec<String>,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum StartArg {
    /// From priors and image alone.
    Blind,
    /// From the true lens and source behind the nearest tidal model.
    Truth,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum EstimateArg {
    /// The normal posterior about the highest maximum: seconds a fit.
    Laplace,
    /// Mean and covariance of converged draws: a minute a fit.
    Sample,
}

/// What a folder gets.
const FILES: [&str; 4] = ["validity.csv", "validity.h5", "summary.json", "result.md"];

pub fn run(args: &ValidityArgs, bars: &Bars) -> Result<()> {
    let plan = args.plan()?;
    plan.validate()?;
    let identified = |case: &ValidityCase| {
        Ok(with_named_files(&case.config, &case.psf, &provenance(&case.config, 0)?.config_toml))
    };
    let configurations: Vec<String> = plan.cases.iter().map(identified).collect::<Result<_>>()?;
    let provenance = provenance(&plan.cases[0].config, 0)?;
    let staging = begin(&args.output, &FILES, bars)?;
    let saved = SavedRows::beside(&args.output, plan.identity(&configurations), bars)?;
    let rows = validity(&plan, args.number, &saved, bars)?;
    let summary = ValiditySummary::of(&plan, &rows);
    let table = validity_table(&plan, &rows)?;
    for name in ["validity.csv", "validity.h5"] {
        staging.write(name, |path| table.write(path, RAYS_GROUP, &provenance))?;
    }
    stage_json(&staging, "summary.json", &summary)?;
    let figures = validity_figures(&plan, &rows, &staging)?;
    let about = "When the tidal approximation is good enough to measure γ_LOS, and which γ_LOS: images of sightlines and of their \
                 tidal twins, fitted.";
    let record = configured(&staging, "study validity", &args.words(), about, &provenance)?;
    finish_study(staging, &result_text(&validity_result(&plan, &summary), &figures), &record, bars)?;
    saved.remove();
    Ok(())
}

impl ValidityArgs {
    /// Base configuration and its variations, with everything else.
    fn plan(&self) -> Result<ValidityPlan> {
        let base = self.settings.resolve()?;
        let mut cases = vec![ValidityCase { name: "base".into(), psf: psf(&base)?, config: base.clone() }];
        for vary in &self.vary {
            let allowed = "KEY=VALUE,… with the section in the key, as source.radius_arcsec=0.1,0.6";
            let refuse = || Error::argument("--vary", vary, allowed);
            let (key, values) = vary.split_once('=').ok_or_else(refuse)?;
            for value in values.split(',').map(str::trim) {
                if value.is_empty() {
                    return Err(refuse());
                }
                let name = format!("{}={value}", key.trim());
                let mut config = self.settings.resolve_with(std::slice::from_ref(&name))?;
                // Δ is measured at the scale of the lens where it was before.
                if base.diagnostics.theta_e_arcsec == base.lens.einstein_radius_arcsec
                    && config.diagnostics.theta_e_arcsec == base.diagnostics.theta_e_arcsec
                {
                    config.diagnostics.theta_e_arcsec = config.lens.einstein_radius_arcsec;
                }
                config.validate()?;
                cases.push(ValidityCase { name, psf: psf(&config)?, config });
            }
        }
        let start = |start: &StartArg| match start {
            StartArg::Blind => FitStart::Blind,
            StartArg::Truth => FitStart::Truth,
        };
        Ok(ValidityPlan {
            cases,
            views: self.views.clone(),
            models: self.models.clone(),
            starts: self.starts.iter().map(start).collect(),
            estimate: match self.estimate {
                EstimateArg::Laplace => Estimate::Laplace,
                EstimateArg::Sample => Estimate::Sample,
            },
            has_delays: !self.no_delays,
        })
    }

    /// The words that repeat it.
    fn words(&self) -> Vec<String> {
        let views: Vec<String> = self.views.iter().map(ToString::to_string).collect();
        let starts: Vec<String> = self.starts.iter().map(|start| value_name(*start)).collect();
        let vary = self.vary.iter().flat_map(|vary| ["--vary".into(), vary.clone()]);
        [
            option("-n", self.number, 100),
            option("--views", views.join(","), "all,0.3,0.1,0.03"),
            option("--models", self.models.join(","), "tidal-minimal,tidal-flexion"),
            option("--starts", starts.join(","), "blind,truth"),
            option("--estimate", value_name(self.estimate), value_name(EstimateArg::Sample)),
        ]
        .into_iter()
        .flatten()
        .chain([if self.no_delays { "--no-delays".into() } else { String::new() }])
        .chain(vary)
        .collect()
    }
}
