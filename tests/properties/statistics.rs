//! Two-sample Kolmogorov–Smirnov and Poisson dispersion tests.

use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Probability of a larger distance between the distributions of two samples of one population.
///
/// Asymptotic distribution of Kolmogorov with the small-sample factor of Stephens (1970, J. R. Stat. Soc. B 32, 115).
pub fn kolmogorov_smirnov_p(a: &[f64], b: &[f64]) -> f64 {
    let sorted = |sample: &[f64]| {
        let mut sample = sample.to_vec();
        sample.sort_by(f64::total_cmp);
        sample
    };
    let (a, b) = (sorted(a), sorted(b));
    let (mut i, mut j, mut distance) = (0, 0, 0.0_f64);
    while i < a.len() && j < b.len() {
        let at = a[i].min(b[j]);
        while i < a.len() && a[i] <= at {
            i += 1;
        }
        while j < b.len() && b[j] <= at {
            j += 1;
        }
        distance = distance.max((i as f64 / a.len() as f64 - j as f64 / b.len() as f64).abs());
    }
    let n = (a.len() as f64 * b.len() as f64 / (a.len() + b.len()) as f64).sqrt();
    let lambda = (n + 0.12 + 0.11 / n) * distance;
    let terms = (1..100).map(|k| {
        let k = f64::from(k);
        (if k % 2.0 == 1.0 { 2.0 } else { -2.0 }) * (-2.0 * k * k * lambda * lambda).exp()
    });
    if lambda < 0.2 { 1.0 } else { terms.sum::<f64>().clamp(0.0, 1.0) }
}

/// Two-sided probability of the scatter of `counts` about the known mean of a Poisson process.
pub fn poisson_dispersion_p(counts: &[f64], mean: f64) -> f64 {
    let chi_squared: f64 = counts.iter().map(|n| (n - mean).powi(2) / mean).sum();
    let below = ChiSquared::new(counts.len() as f64).unwrap().cdf(chi_squared);
    2.0 * below.min(1.0 - below)
}
