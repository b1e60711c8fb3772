//! Is the paper's σ̄ of γ_LOS that of its posteriors? For the images of a catalogue, the posterior beside what an ensemble
//! of stretch moves says that starts at the true parameters and stops when the authors' chains did.
//!
//! haloray mock -n 64 --seed 1 -o catalogue
//! cargo run --release --example chains_from_the_truth -- catalogue 0 3 4 18
//!
//! The numbers are rows of catalogue/truth.csv, counted from 0; all rows when left out.

use std::path::Path;

use haloray::imaging::PixelSampling;
use haloray::inference::model::{CompiledModel, ModelDescription};
use haloray::inference::sample::{Problem, SamplerSettings, StretchSettings};
use haloray::inference::{DrawStatistics, Fit, FitSettings, NoStore, SamplerRun};
use haloray::io::{CATALOGUE_GROUP, Table, Values, read_observation};
use haloray::monitor::Silent;
use haloray::{Error, Result};

/// Evaluations of the authors' chains for one image.
const EVALUATIONS: usize = 665_000;
/// Their walkers for each parameter.
const WALKERS: usize = 10;
/// Scatter about the truth at the start in standard deviations of the latent prior, about 1e-4 of a uniform prior's width:
/// the authors' code has 0.001 × 0.1 for shears of ±0.5.
const SPREAD: f64 = 2.5e-4;
const SHEARS: [&str; 2] = ["gamma1_los", "gamma2_los"];

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().unwrap_or_else(|| "catalogue".into());
    let rows: Vec<usize> = arguments.filter_map(|n| n.parse().ok()).collect();
    let path = Path::new(&folder).join("truth.csv");
    let truth = Table::read(&path, CATALOGUE_GROUP)?;
    let Some(Values::Text(names)) = truth.column("image").map(|c| &c.values) else {
        return Err(Error::table(&path, "column image", "missing"));
    };
    let settings = FitSettings { pixel_sampling: PixelSampling::Point, seed: 1, ..FitSettings::default() };
    println!(
        "| image | σ, posterior | σ, chains from the truth | ratio | R-hat, posterior | R-hat of γ_LOS, chains |"
    );
    println!("|---|---|---|---|---|---|");
    let (mut sums, mut count) = ([0.0; 2], 0.0);
    for (row, name) in names.iter().enumerate().filter(|(i, _)| rows.is_empty() || rows.contains(i)) {
        let (observation, _) = read_observation(&Path::new(&folder).join(name))?;
        let model = CompiledModel::new(&ModelDescription::built_in("comprehensive")?)?;
        let fit = Fit::run(observation, model, settings, &mut NoStore, &Silent)?;
        let posterior = SHEARS.map(|name| fit.draws_of(name).unwrap_or_default().to_vec());

        let free = fit.likelihood.model().free.iter();
        let true_value = |name: &str| -> Result<f64> { Ok(truth.required_f64(name)?[row]) };
        let start =
            free.map(|p| Ok(p.prior.to_latent(true_value(&p.name)?))).collect::<Result<Vec<f64>>>()?;
        let (chains, r_hat) = chains_from(&fit, start)?;

        let sigmas = [uncertainty(&posterior), uncertainty(&chains)];
        let [ours, theirs] = sigmas;
        let worst = fit.status.worst.r_hat;
        println!("| {name} | {ours:.4} | {theirs:.4} | {:.2} | {worst:.3} | {r_hat:.2} |", theirs / ours);
        sums = [sums[0] + ours, sums[1] + theirs];
        count += 1.0;
    }
    println!("\nmean σ: {:.4} posterior, {:.4} chains from the truth", sums[0] / count, sums[1] / count);
    Ok(())
}

/// Two ensembles of the authors' length from one start; draws of γ_LOS of their second halves, and the worst R-hat of it.
fn chains_from(fit: &Fit, start: Vec<f64>) -> Result<([Vec<Vec<f64>>; 2], f64)> {
    let model = fit.likelihood.model();
    let half = EVALUATIONS / (WALKERS * model.free.len()) / 2;
    let settings = SamplerSettings::Stretch(StretchSettings {
        ensembles: 2,
        walkers_per_coordinate: WALKERS,
        warmup_steps: half,
        block_steps: half,
        max_steps: half,
        thin: 1,
        start_spread: SPREAD,
        ..StretchSettings::default()
    });
    let problem = Problem { likelihood: &fit.likelihood, starts: &[start], metric: None };
    let mut run = SamplerRun::start(&settings, 1, &problem, &Silent)?;
    let status = run.finish(&fit.likelihood, &|z| model.at_latent(z).0, &Silent)?;
    let place = |name: &str| model.free.iter().position(|p| p.name == name).unwrap_or(0);
    let draws = SHEARS.map(|name| run.chains().map(|z| model.at_latent(z).0[place(name)]));
    let r_hat = SHEARS.map(|name| status.quantities[place(name)].r_hat);
    Ok((draws, r_hat[0].max(r_hat[1])))
}

/// The paper's σ of an image: the geometric mean of both components' half 68% intervals.
fn uncertainty(draws: &[Vec<Vec<f64>>; 2]) -> f64 {
    let half = |draws: &Vec<Vec<f64>>| {
        DrawStatistics::of(&draws.concat()).map_or(f64::NAN, |s| 0.5 * (s.hpd68_high - s.hpd68_low))
    };
    (half(&draws[0]) * half(&draws[1])).sqrt()
}
