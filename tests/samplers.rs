//! Samplers on posteriors with known answers: moments, evidence, agreement, threads, interruption.

#[path = "support/targets.rs"]
mod targets;

use haloray::inference::LatentLikelihood;
use haloray::inference::sampler::{NutsSettings, Problem, Progress, SamplerRun, SamplerSettings};
use targets::{Banana, Normal, Truncated, by_quadrature};

fn run(settings: SamplerSettings, problem: &Problem, seed: u64) -> (SamplerRun, Progress) {
    let mut run = SamplerRun::start(&settings, seed, problem).unwrap();
    let progress = run.finish(problem.likelihood, &|z| z.to_vec(), |_, _| Ok(())).unwrap();
    (run, progress)
}

fn nuts() -> SamplerSettings {
    SamplerSettings::Nuts(NutsSettings::default())
}

/// Mean and standard deviation of every coordinate, with the effective number of draws.
fn moments(run: &SamplerRun, progress: &Progress) -> Vec<(f64, f64, f64)> {
    (0..run.chains().dimension)
        .map(|i| {
            let draws = run.chains().coordinate(i).concat();
            let mean = draws.iter().sum::<f64>() / draws.len() as f64;
            let square = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / draws.len() as f64;
            (mean, square.sqrt(), progress.quantities[i].ess_bulk)
        })
        .collect()
}

/// Means within 4 standard errors, standard deviations within 12% (4 errors of 400 normal draws are 14%).
fn assert_moments(found: &[(f64, f64, f64)], means: &[f64], deviations: &[f64]) {
    for (i, (mean, deviation, ess)) in found.iter().enumerate() {
        let error = (mean - means[i]) / deviations[i] * ess.sqrt();
        assert!(error.abs() < 4.0, "mean of z{i}: {mean} is {error} standard errors from {}", means[i]);
        let ratio = deviation / deviations[i];
        assert!((ratio - 1.0).abs() < 0.12, "deviation of z{i}: {ratio} times the right one");
    }
}

#[test]
fn nuts_finds_a_correlated_normal_in_twenty_dimensions() {
    let target = Normal::correlated(20);
    let (mean, covariance) = (target.mean(), target.covariance());
    let deviations: Vec<f64> = (0..20).map(|i| covariance[(i, i)].sqrt()).collect();
    let starts = [mean.as_slice().to_vec()];
    let metric = target.metric();
    let problem = Problem { likelihood: &target, starts: &starts, metric: Some(&metric) };
    let (run, progress) = run(nuts(), &problem, 1);
    eprintln!("{:?} {} draws {} evaluations", progress.worst, progress.draws, progress.evaluations);
    assert!(progress.is_converged && progress.divergences == 0);
    assert_moments(&moments(&run, &progress), mean.as_slice(), &deviations);
    // Correlations of neighbours too.
    let draws = run.chains().chains.iter().flat_map(|chain| chain.z.chunks_exact(20));
    let (mut found, mut count) = ([0.0; 19], 0.0);
    for z in draws {
        (0..19).for_each(|i| found[i] += (z[i] - mean[i]) * (z[i + 1] - mean[i + 1]));
        count += 1.0;
    }
    for i in 0..19 {
        let correlation = |c: f64| c / (deviations[i] * deviations[i + 1]);
        let difference = correlation(found[i] / count) - correlation(covariance[(i, i + 1)]);
        assert!(difference.abs() < 0.12, "correlation of z{i} with the next: off by {difference}");
    }
}

#[test]
fn nuts_needs_no_metric() {
    let target = Normal::correlated(8);
    let starts = [vec![0.0; 8], vec![0.5; 8]];
    let problem = Problem { likelihood: &target, starts: &starts, metric: None };
    let (run, progress) = run(nuts(), &problem, 2);
    eprintln!("{:?} {} draws {} evaluations", progress.worst, progress.draws, progress.evaluations);
    assert!(progress.is_converged);
    let covariance = target.covariance();
    let deviations: Vec<f64> = (0..8).map(|i| covariance[(i, i)].sqrt()).collect();
    assert_moments(&moments(&run, &progress), target.mean().as_slice(), &deviations);
}

#[test]
fn nuts_follows_a_banana_and_an_edge() {
    for (likelihood, seed) in [(&Banana as &dyn LatentLikelihood, 3), (&Truncated, 4)] {
        let starts = [vec![0.3, 0.1]];
        let problem = Problem { likelihood, starts: &starts, metric: None };
        let (run, progress) = run(nuts(), &problem, seed);
        eprintln!(
            "{:?} {} draws {} evaluations {} div",
            progress.worst, progress.draws, progress.evaluations, progress.divergences
        );
        let (mean, deviation, _) = by_quadrature(likelihood);
        assert!(progress.is_converged);
        assert_moments(&moments(&run, &progress), &mean, &deviation);
    }
}

#[test]
fn a_run_that_was_saved_and_continued_has_the_same_bytes() {
    let starts = [vec![0.3, 0.1]];
    let problem = Problem { likelihood: &Banana, starts: &starts, metric: None };
    let mut whole = SamplerRun::start(&nuts(), 5, &problem).unwrap();
    let mut broken = whole.clone();
    for _ in 0..6 {
        whole.advance(&Banana);
        let saved = serde_json::to_string(&broken).unwrap();
        broken = serde_json::from_str(&saved).unwrap();
        broken.advance(&Banana);
    }
    assert!(whole.chains().draws() > 0);
    assert_eq!(whole, broken);
}

#[test]
fn threads_change_no_byte() {
    let starts = [vec![0.3, 0.1]];
    let problem = Problem { likelihood: &Banana, starts: &starts, metric: None };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(nuts(), &problem, 6).0)
    };
    assert_eq!(with(1), with(3));
}
