//! Quantiles of differences, printed and checked against a tolerance.

/// Median, 99th percentile and maximum of differences that the caller has scaled.
#[derive(Debug, Clone, Copy)]
pub struct Differences {
    pub q50: f64,
    pub q99: f64,
    pub max: f64,
}

impl Differences {
    /// Sorts the absolute values of `differences` and prints their quantiles under `label`.
    pub fn of(label: &str, differences: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = differences.into_iter().map(f64::abs).collect();
        assert!(!sorted.is_empty(), "{label}: nothing to compare");
        assert!(sorted.iter().all(|d| d.is_finite()), "{label}: not a number");
        sorted.sort_by(f64::total_cmp);
        let quantile = |q: f64| sorted[((sorted.len() - 1) as f64 * q).round() as usize];
        let all = Self { q50: quantile(0.5), q99: quantile(0.99), max: quantile(1.0) };
        println!(
            "{label}: {} values, q50 {:.1e}, q99 {:.1e}, max {:.1e}",
            sorted.len(),
            all.q50,
            all.q99,
            all.max
        );
        all
    }

    /// Fails unless the largest difference is at most `tolerance`.
    pub fn require_max(self, tolerance: f64) -> Self {
        assert!(self.max <= tolerance, "{self:?} exceeds {tolerance:e}");
        self
    }
}

/// Largest difference of two vectors over the largest component of the second.
pub fn scaled_difference(ours: &[f64], theirs: &[f64]) -> f64 {
    assert_eq!(ours.len(), theirs.len());
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |m, v| m.max(v.abs()));
    largest(&mut ours.iter().zip(theirs).map(|(a, b)| a - b)) / largest(&mut theirs.iter().copied())
}
