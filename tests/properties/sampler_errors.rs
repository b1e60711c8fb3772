//! What samplers say of their own errors is true: over many seeds, means scatter as effective sizes promise.

use crate::samplers::{Found, all_samplers, moments, run};
use crate::targets::{Banana, Moments, Normal, by_quadrature};
use haloray::inference::LatentLikelihood;
use haloray::inference::sample::Problem;
use statrs::distribution::{ChiSquared, ContinuousCDF};

const SEEDS: u64 = 16;
/// Effective draws of every run.
const ESS: f64 = 2000.0;
/// Probability of the χ² of the means below which the promised errors count as too small; some seventy are tried.
const LEAST_P: f64 = 1e-5;
/// Student's t of 15 degrees of freedom is beyond it once in 40,000 times.
const MOST_T: f64 = 6.0;
/// Means and deviations of all runs together, over the right deviation; errors are 0.6% and, of the banana, 0.8%.
const TOLERANCE: f64 = 0.04;

/// Average of errors, and their average over its standard error as their scatter has it.
fn average_and_t(errors: &[f64]) -> (f64, f64) {
    let n = errors.len() as f64;
    let average = errors.iter().sum::<f64>() / n;
    let variance = errors.iter().map(|e| (e - average).powi(2)).sum::<f64>() / (n - 1.0);
    (average, average / (variance / n).sqrt())
}

/// Runs every sampler with many seeds. Their means and deviations are right by their own scatter, whatever the runs say of
/// their errors; and what they say is no less than the scatter.
fn check(name: &str, likelihood: &dyn LatentLikelihood, right: &Moments) {
    let starts = [right.means.clone()];
    let problem = Problem { likelihood, starts: &starts, metric: None };
    for settings in all_samplers() {
        let of_seed = |seed| {
            let (run, progress) = run(settings, &problem, seed, ESS, &right.means);
            moments(&run, &progress)
        };
        let runs: Vec<Vec<Found>> = (100..100 + SEEDS).map(of_seed).collect();
        for i in 0..right.means.len() {
            let (mean, deviation) = (right.means[i], right.deviations[i]);
            let of_means: Vec<f64> = runs.iter().map(|of| (of[i].mean - mean) / deviation).collect();
            let of_deviations: Vec<f64> = runs.iter().map(|of| of[i].deviation / deviation - 1.0).collect();
            let promised: f64 =
                of_means.iter().zip(&runs).map(|(error, of)| error * error * of[i].mean_ess).sum();
            let p = 1.0 - ChiSquared::new(SEEDS as f64).unwrap().cdf(promised);
            let sampler = settings.name();
            println!("{name}, {sampler}, z{i}: χ² of the means {promised:.1} of {SEEDS}, p {p:.2e}");
            assert!(p > LEAST_P, "{name}, {sampler}, z{i}: {promised}");
            for errors in [of_means, of_deviations] {
                let (average, t) = average_and_t(&errors);
                println!("{name}, {sampler}, z{i}: off by {average:.4} deviations, t {t:.2}");
                assert!(
                    t.abs() < MOST_T && average.abs() < TOLERANCE,
                    "{name}, {sampler}, z{i}: {average}, t {t}"
                );
            }
        }
    }
}

#[test]
#[ignore = "slow: just nightly"]
fn errors_are_as_promised_on_a_banana() {
    check("banana", &Banana, &by_quadrature(&Banana).0);
}

#[test]
#[ignore = "slow: just nightly"]
fn errors_are_as_promised_in_five_correlated_dimensions() {
    let target = Normal::correlated(5);
    check("normal", &target, &Moments::of_normal(&target));
}
