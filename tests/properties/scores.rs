//! The scores of models over a catalogue, worked by hand.

use haloray::mock::{ModelScore, ProfiledShear, RecoveredShear, ShearRecovery};

fn fit(median: [f64; 2], minus: f64, plus: f64, bounded: bool) -> ShearRecovery {
    let shear = median.map(|median| RecoveredShear {
        median,
        mean: median,
        standard_deviation: plus,
        best_fit: median,
        low: median - minus,
        high: median + plus,
        bounded,
        fisher: plus,
        profile: None,
    });
    ShearRecovery {
        image: "a.fits".into(),
        model: "m".into(),
        shear,
        draws: vec![],
        converged: true,
        worst_r_hat: 1.0,
        worst_ess: 500.0,
        divergences: 0,
        chi2_reduced: 1.0,
        evaluations: 1,
        unbounded: vec![],
    }
}

#[test]
fn the_metrics_are_those_of_the_paper() {
    // Worked by hand: σ⁻ = 0.01, σ⁺ = 0.03; truth (0, 0).
    let below = fit([-0.03, -0.06], 0.01, 0.03, true);
    let above = fit([0.02, 0.01], 0.01, 0.03, true);
    let lost = fit([9.0, 9.0], 0.01, 0.03, false);
    let truth = [0.0, 0.0];
    let score = ModelScore::of(
        "m",
        &[(&below, truth, Some(1e3)), (&above, truth, Some(1e2)), (&lost, truth, Some(1e2))],
    );
    assert_eq!((score.images, score.productive, score.converged), (3, 2, 3));
    assert!((score.mean_uncertainty - 0.02).abs() < 1e-15);
    // Below the truth σ⁺ counts: (1 + 4)/2; above it σ⁻: (4 + 1)/2.
    assert!((score.chi2 - 2.5).abs() < 1e-12, "{}", score.chi2);
    // √(0.03² + 0.06²)/(0.03√2) = 1.58; √(0.02² + 0.01²)/(0.01√2) = 1.58.
    assert_eq!(score.outliers, 0);
    assert!((score.largest_residual - 2.5f64.sqrt()).abs() < 1e-12);
    // The interval of `below` ends at 0 in γ1 and short of it in γ2; that of `above` holds γ2 alone.
    assert!((score.coverage - 0.5).abs() < 1e-12);
    assert!(score.quality_fit.is_some_and(|line| line.slope.abs() < 1e-12));
}

#[test]
fn profiles_are_scored_beside_posteriors() {
    let profiled = |best_fit: f64, interval68: [Option<f64>; 2]| {
        let mut fit = fit([0.0; 2], 0.01, 0.01, true);
        fit.shear.iter_mut().for_each(|s| s.profile = Some(ProfiledShear { best_fit, interval68 }));
        fit
    };
    // Two of its own σ above the truth; the truth inside, at an open end.
    let (off, open) = (profiled(0.04, [Some(0.02), Some(0.05)]), profiled(0.01, [None, Some(0.02)]));
    let score = ModelScore::of("m", &[(&off, [0.0; 2], None), (&open, [0.0; 2], None)]);
    assert_eq!(score.profile_coverage, Some(0.5));
    assert!(score.profile_chi2.is_some_and(|chi2| (chi2 - 2.0).abs() < 1e-12), "{score:?}");
    assert_eq!(
        ModelScore::of("m", &[(&fit([0.0; 2], 0.1, 0.1, true), [0.0; 2], None)]).profile_coverage,
        None
    );
}

#[test]
fn a_straight_line_is_found() {
    let fits =
        [1.0, 0.25, -0.5].map(|log_sigma| f64::powf(10.0, log_sigma)).map(|s| fit([0.0; 2], s, s, true));
    let rows = [0, 1, 2].map(|i| (&fits[i], [0.0; 2], Some(f64::powi(10.0, i as i32))));
    let line = ModelScore::of("m", &rows).quality_fit.unwrap();
    assert!((line.slope + 0.75).abs() < 1e-14 && (line.intercept - 1.0).abs() < 1e-14);
    assert!(ModelScore::of("m", &rows[..1]).quality_fit.is_none());
}
