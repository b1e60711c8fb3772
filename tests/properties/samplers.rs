//! Samplers on posteriors with known answers: moments, evidence, agreement, threads, interruption.

use std::sync::atomic::{AtomicI64, Ordering};

use crate::targets::{Banana, Gorge, Moments, Normal, Nowhere, PEAK, Truncated, TwoPeaks, by_quadrature};
use haloray::Error;
use haloray::inference::sample::{
    EnsembleSliceSettings, NestedSettings, NutsSettings, Problem, SamplerSettings, StretchSettings,
    ValleySettings,
};
use haloray::inference::{LatentLikelihood, RunStatus, SamplerRun};
use haloray::monitor::{Monitor, Silent};

/// A run to its end, with more effective draws than convergence needs, of every z and of its square about `centre`.
pub fn run(
    settings: SamplerSettings,
    problem: &Problem,
    seed: u64,
    min_ess: f64,
    centre: &[f64],
) -> (SamplerRun, RunStatus) {
    let squares = |z: &[f64]| z.iter().zip(centre).map(|(z, c)| (z - c).powi(2)).collect();
    let mut run = SamplerRun::start(&settings, seed, problem, &Silent).unwrap().until(min_ess).unwrap();
    let progress = run.finish(problem.likelihood, &|z| [z.to_vec(), squares(z)].concat(), &Silent).unwrap();
    (run, progress)
}

fn nuts() -> SamplerSettings {
    SamplerSettings::Nuts(NutsSettings::default())
}

fn valley() -> SamplerSettings {
    SamplerSettings::Valley(ValleySettings::default())
}

pub fn all_samplers() -> [SamplerSettings; 5] {
    [
        nuts(),
        valley(),
        SamplerSettings::EnsembleSlice(EnsembleSliceSettings::default()),
        SamplerSettings::Stretch(StretchSettings::default()),
        SamplerSettings::Nested(NestedSettings::default()),
    ]
}

/// Effective draws asked for: standard errors of 3.2% of a deviation and, of a normal's deviation, of 2.2%.
const QUICK_ESS: f64 = 1000.0;

/// Mean and standard deviation of a coordinate, each with the effective number of draws that it comes from.
pub struct Found {
    pub mean: f64,
    pub mean_ess: f64,
    pub deviation: f64,
    pub deviation_ess: f64,
}

/// Moments of every coordinate of a [`run`].
pub fn moments(run: &SamplerRun, progress: &RunStatus) -> Vec<Found> {
    let dimension = run.chains().dimension;
    let of_coordinate = |i: usize| {
        let draws = run.chains().coordinate(i).concat();
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        let square = draws.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / draws.len() as f64;
        let [mean_ess, deviation_ess] = [i, dimension + i].map(|k| progress.quantities[k].ess_bulk);
        Found { mean, mean_ess, deviation: square.sqrt(), deviation_ess }
    };
    (0..dimension).map(of_coordinate).collect()
}

/// Means and standard deviations within 4 standard errors: σ/√n and σ√((κ − 1)/4n), κ the kurtosis.
fn assert_moments(run: &SamplerRun, progress: &RunStatus, right: &Moments) {
    for (i, found) in moments(run, progress).into_iter().enumerate() {
        let (mean, deviation) = (right.means[i], right.deviations[i]);
        assert!(found.mean_ess.min(found.deviation_ess) > 0.9 * QUICK_ESS, "z{i}: few effective draws");
        let error = (found.mean - mean) / deviation * found.mean_ess.sqrt();
        assert!(error.abs() < 4.0, "mean of z{i}: {} is {error} standard errors from {mean}", found.mean);
        let scale = ((right.kurtoses[i] - 1.0) / (4.0 * found.deviation_ess)).sqrt();
        let error = (found.deviation / deviation - 1.0) / scale;
        assert!(error.abs() < 4.0, "deviation of z{i}: {error} standard errors from {deviation}");
    }
}

#[test]
fn nuts_finds_a_correlated_normal_in_twenty_dimensions() {
    let target = Normal::correlated(20);
    let (mean, covariance, right) = (target.mean(), target.covariance(), Moments::of_normal(&target));
    let starts = [mean.as_slice().to_vec()];
    let metric = target.metric();
    let problem = Problem { likelihood: &target, starts: &starts, metric: Some(&metric) };
    let (run, progress) = run(nuts(), &problem, 1, QUICK_ESS, &right.means);
    assert!(progress.is_converged && progress.divergences == 0);
    assert_moments(&run, &progress, &right);
    // Correlations of neighbours too.
    let draws = run.chains().chains.iter().flat_map(|chain| chain.z.chunks_exact(20));
    let (mut found, mut count) = ([0.0; 19], 0.0);
    for z in draws {
        (0..19).for_each(|i| found[i] += (z[i] - mean[i]) * (z[i + 1] - mean[i + 1]));
        count += 1.0;
    }
    for i in 0..19 {
        let correlation = |c: f64| c / (right.deviations[i] * right.deviations[i + 1]);
        let difference = correlation(found[i] / count) - correlation(covariance[(i, i + 1)]);
        assert!(
            difference.abs() < 4.0 / QUICK_ESS.sqrt(),
            "correlation of z{i} with the next: off by {difference}"
        );
    }
}

#[test]
fn nuts_needs_no_metric() {
    let target = Normal::correlated(8);
    let starts = [vec![0.0; 8], vec![0.5; 8]];
    let problem = Problem { likelihood: &target, starts: &starts, metric: None };
    let right = Moments::of_normal(&target);
    let (run, progress) = run(nuts(), &problem, 2, QUICK_ESS, &right.means);
    assert!(progress.is_converged);
    assert_moments(&run, &progress, &right);
}

#[test]
fn nuts_stops_unconverged_when_its_gradients_are_used_up() {
    let target = Normal::correlated(8);
    let starts = [vec![0.0; 8]];
    let problem = Problem { likelihood: &target, starts: &starts, metric: None };
    let limited = NutsSettings { max_gradients: 1, block_draws: 20, ..NutsSettings::default() };
    let (run, progress) = run(SamplerSettings::Nuts(limited), &problem, 2, QUICK_ESS, &[0.0; 8]);
    assert!(progress.is_finished && !progress.is_converged);
    assert_eq!(run.chains().draws(), 20);
}

#[test]
fn all_samplers_agree_on_a_banana_and_at_an_edge() {
    for (likelihood, start) in [(&Banana as &dyn LatentLikelihood, [0.3, 0.1]), (&Truncated, [0.3, 0.1])] {
        let starts = [start.to_vec()];
        let problem = Problem { likelihood, starts: &starts, metric: None };
        let (right, log_evidence) = by_quadrature(likelihood);
        for settings in all_samplers() {
            let (run, progress) = run(settings, &problem, 3, QUICK_ESS, &right.means);
            assert!(progress.is_converged, "{settings:?}");
            assert_moments(&run, &progress, &right);
            if let Some(evidence) = run.evidence() {
                let error = (evidence.log_evidence - log_evidence) / evidence.log_evidence_error;
                assert!(error.abs() < 4.0 && evidence.log_evidence_error < 0.2, "{evidence:?}");
            }
        }
    }
}

#[test]
fn all_samplers_agree_in_ten_correlated_dimensions() {
    let target = Normal::correlated(10);
    let (right, metric) = (Moments::of_normal(&target), target.metric());
    let starts = [right.means.clone()];
    let problem = Problem { likelihood: &target, starts: &starts, metric: Some(&metric) };
    for settings in all_samplers() {
        let (run, progress) = run(settings, &problem, 4, QUICK_ESS, &right.means);
        assert!(progress.is_converged, "{settings:?}");
        assert_moments(&run, &progress, &right);
        if let Some(evidence) = run.evidence() {
            let error = (evidence.log_evidence - target.log_evidence()) / evidence.log_evidence_error;
            assert!(error.abs() < 4.0 && evidence.log_evidence_error < 0.5, "{evidence:?}");
        }
    }
}

#[test]
fn the_valley_sampler_follows_a_narrow_valley_that_bends() {
    let starts = [vec![0.0; 3]];
    let problem = Problem { likelihood: &Gorge, starts: &starts, metric: None };
    // Across the valley only its floor counts: means over z₀ by quadrature.
    let floor = (-6000..6000).map(|i| (f64::from(i) + 0.5) * 1e-3).map(|a| {
        let [b, c] = Gorge::floor(a);
        ([a, b, c], (-0.5 * (a * a + b * b + c * c)).exp())
    });
    let right = Moments::of(floor);
    let (run, progress) = run(valley(), &problem, 8, QUICK_ESS, &right.means);
    assert!(progress.is_converged, "{progress:?}");
    assert_moments(&run, &progress, &right);
    // And the draws scatter about it by its width.
    let draws = run.chains().coordinate(0).concat().into_iter().zip(run.chains().coordinate(1).concat());
    let across: Vec<f64> = draws.map(|(a, b)| (b - Gorge::floor(a)[0]) / 1e-3).collect();
    let square = across.iter().map(|o| o * o).sum::<f64>() / across.len() as f64;
    assert!((square - 1.0).abs() < 0.15, "{square}");
}

#[test]
fn nested_sampling_weighs_two_peaks() {
    let problem = Problem { likelihood: &TwoPeaks, starts: &[], metric: None };
    let (run, progress) =
        run(SamplerSettings::Nested(NestedSettings::default()), &problem, 5, QUICK_ESS, &[0.0; 2]);
    let evidence = run.evidence().unwrap();
    let off = (evidence.log_evidence - TwoPeaks::log_evidence()) / evidence.log_evidence_error;
    assert!(progress.is_converged && off.abs() < 4.0 && evidence.log_evidence_error < 0.15);
    // Both peaks hold half: the scatter is that of 600 live points, not of the draws.
    let draws = run.chains().coordinate(0).concat();
    let right = draws.iter().filter(|x| **x > 0.0).count() as f64 / draws.len() as f64;
    assert!((right - 0.5).abs() < 4.0 * 0.5 / 600.0_f64.sqrt(), "{right}");
}

#[test]
fn chains_in_separate_peaks_are_not_converged() {
    // A peak a chain cannot leave, and chains that start in both.
    let starts = [PEAK.to_vec(), PEAK.map(|x| -x).to_vec()];
    let problem = Problem { likelihood: &TwoPeaks, starts: &starts, metric: None };
    let settings = EnsembleSliceSettings {
        start_spread: 0.01,
        max_steps: 600,
        warmup_steps: 100,
        ensembles: 2,
        ..EnsembleSliceSettings::default()
    };
    let (_, progress) = run(SamplerSettings::EnsembleSlice(settings), &problem, 6, QUICK_ESS, &[0.0; 2]);
    assert!(progress.is_finished && !progress.is_converged && progress.worst.r_hat > 1.5, "{progress:?}");
}

#[test]
fn a_run_that_was_saved_and_continued_has_the_same_bytes() {
    let starts = [vec![0.3, 0.1]];
    let problem = Problem { likelihood: &Banana, starts: &starts, metric: None };
    for settings in all_samplers() {
        let mut whole = SamplerRun::start(&settings, 5, &problem, &Silent).unwrap();
        let mut broken = whole.clone();
        for _ in 0..5 {
            whole.advance(&Banana, &Silent).unwrap();
            let saved = postcard::to_allocvec(&broken).unwrap();
            broken = postcard::from_bytes(&saved).unwrap();
            broken.advance(&Banana, &Silent).unwrap();
        }
        assert_eq!(whole, broken);
        for run in [&mut whole, &mut broken] {
            run.finish(&Banana, &|z| z.to_vec(), &Silent).unwrap();
        }
        assert!(whole.chains().draws() > 100 && whole == broken);
    }
}

/// Stops work once it has been asked so many times whether to.
struct StopsAfter(AtomicI64);

impl Monitor for StopsAfter {
    fn begin(&self, _: &str, _: Option<u64>) {}
    fn advance(&self, _: u64) {}
    fn tell(&self, _: &str) {}
    fn end(&self) {}
    fn is_cancelled(&self) -> bool {
        self.0.fetch_sub(1, Ordering::Relaxed) <= 0
    }
}

#[test]
fn a_run_stopped_within_a_block_is_as_it_was_before() {
    let starts = [vec![0.3, 0.1]];
    let problem = Problem { likelihood: &Banana, starts: &starts, metric: None };
    for settings in all_samplers() {
        let mut run = SamplerRun::start(&settings, 5, &problem, &Silent).unwrap();
        for _ in 0..5 {
            run.advance(&Banana, &Silent).unwrap();
            let before = run.clone();
            let stopped = run.advance(&Banana, &StopsAfter(AtomicI64::new(20)));
            assert!(matches!(stopped, Err(Error::Cancelled)) && run == before);
        }
    }
}

#[test]
fn threads_change_no_byte() {
    let starts = [vec![0.3, 0.1]];
    let problem = Problem { likelihood: &Banana, starts: &starts, metric: None };
    for settings in all_samplers() {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut run = SamplerRun::start(&settings, 6, &problem, &Silent).unwrap();
                (0..5).for_each(|_| run.advance(&Banana, &Silent).unwrap());
                run
            })
        };
        assert_eq!(with(1), with(3));
    }
}

#[test]
fn hopeless_problems_are_refused() {
    let starts = [vec![0.0, 0.0]];
    let refused = |settings: SamplerSettings, problem: Problem| {
        SamplerRun::start(&settings, 7, &problem, &Silent).unwrap_err().to_string()
    };
    for settings in all_samplers() {
        let message = refused(settings, Problem { likelihood: &Nowhere, starts: &starts, metric: None });
        assert!(message.contains("the log-likelihood at") && message.contains("finite"), "{message}");
    }
    let none = refused(nuts(), Problem { likelihood: &Banana, starts: &[], metric: None });
    assert!(none.contains("the number of start points is 0, but must be at least 1"), "{none}");
    let short = refused(nuts(), Problem { likelihood: &Banana, starts: &[vec![1.0]], metric: None });
    assert!(short.contains("of a start point is 1, but must be 2"), "{short}");
    let few = SamplerSettings::Nested(NestedSettings { live_points: 3, ..NestedSettings::default() });
    let few = refused(few, Problem { likelihood: &Banana, starts: &starts, metric: None });
    assert!(few.contains("live_points of nested is 3, but must be at least 10"), "{few}");
}
