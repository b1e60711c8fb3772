//! Statistics of the draws of one quantity: mean, median, spread, the highest-density interval with 68% of them.

use serde::{Deserialize, Serialize};

/// What is told of a posterior; units are those of the draws.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DrawStatistics {
    /// Mean.
    pub mean: f64,
    /// Median.
    pub median: f64,
    /// Standard deviation, divisor n − 1.
    pub standard_deviation: f64,
    /// Lower end of the highest-density interval with 68% of the draws.
    pub hpd68_low: f64,
    /// Upper end of that interval.
    pub hpd68_high: f64,
}

/// Fraction of the draws in the highest-density interval, that of one standard deviation in round figures.
pub const HPD_FRACTION: f64 = 0.68;

/// How far to either side widths of intervals are averaged to find the shortest, in fractions of the draws.
const START_WINDOW: f64 = 0.05;

impl DrawStatistics {
    /// Statistics of equal-weight draws in any order; `None` without two finite ones.
    ///
    /// ```
    /// use haloray::inference::DrawStatistics;
    /// let draws: Vec<f64> = (0..1000).map(|i| (i as f64 / 1000.0).powi(2)).collect(); // densest at zero
    /// let statistics = DrawStatistics::of(&draws).ok_or("no draws")?;
    /// assert!(statistics.hpd68_low == 0.0 && (statistics.hpd68_high - 0.68_f64.powi(2)).abs() < 2e-3);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn of(draws: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = draws.iter().copied().filter(|value| value.is_finite()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let count = sorted.len();
        if count < 2 {
            return None;
        }
        let mean = sorted.iter().sum::<f64>() / count as f64;
        let squares: f64 = sorted.iter().map(|value| (value - mean).powi(2)).sum();
        let (hpd68_low, hpd68_high) = highest_density_interval(&sorted, HPD_FRACTION);
        Some(Self {
            mean,
            median: quantile_of_sorted(&sorted, 0.5),
            standard_deviation: (squares / (count - 1) as f64).sqrt(),
            hpd68_low,
            hpd68_high,
        })
    }

    /// Whether the interval keeps clear of both ends of a prior: farther from them than `tolerance` times its
    /// width.
    ///
    /// The paper calls a parameter whose interval touches an end unbounded. An interval between draws
    /// never quite reaches an end, hence the tolerance.
    pub fn is_bounded(&self, prior_low: f64, prior_high: f64, tolerance: f64) -> bool {
        let margin = tolerance * (self.hpd68_high - self.hpd68_low);
        self.hpd68_low - prior_low > margin && prior_high - self.hpd68_high > margin
    }
}

/// The highest-density interval: between two draws with at least that fraction of them, where intervals are
/// shortest.
///
/// The very shortest is short by chance too: of 800 normal draws it holds 66.7% of the distribution, not 68%.
/// So the interval is taken about which the mean width is least, over starts within [`START_WINDOW`] of the
/// draws; that holds 67.6%, and its width is right to 0.5%. Beyond the first and the last start widths are
/// continued with odd symmetry, which keeps an interval that widens away from the edge of a prior at the edge.
fn highest_density_interval(sorted: &[f64], fraction: f64) -> (f64, f64) {
    let inside = ((fraction * sorted.len() as f64).ceil() as usize).clamp(1, sorted.len());
    let widths: Vec<f64> = sorted.windows(inside).map(|window| window[inside - 1] - window[0]).collect();
    let last = widths.len() - 1;
    let reach = ((START_WINDOW * sorted.len() as f64).round() as usize).min(last);
    let before = (1..=reach).rev().map(|k| 2.0 * widths[0] - widths[k]);
    let after = (1..=reach).map(|k| 2.0 * widths[last] - widths[last - k]);
    let mut sums = vec![0.0]; // of the widths before each start
    for width in before.chain(widths.iter().copied()).chain(after) {
        sums.push(sums[sums.len() - 1] + width);
    }
    let totals = sums.windows(2 * reach + 2).map(|sums| sums[2 * reach + 1] - sums[0]);
    let start = totals.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(start, _)| start);
    (sorted[start], sorted[start + inside - 1])
}

/// Quantile by linear interpolation between order statistics (type 7 of Hyndman & Fan 1996); NaN without
/// values.
pub(crate) fn quantile_of_sorted(sorted: &[f64], probability: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = probability.clamp(0.0, 1.0) * last as f64;
    let below = (place.floor() as usize).min(last);
    let above = (below + 1).min(last);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_follows_the_density() {
        // 70% of the draws within 0.001 of 5, the others far and wide.
        let draws: Vec<f64> =
            (0..1000).map(|i| if i < 700 { 5.0 + 1e-6 * f64::from(i) } else { f64::from(i) }).collect();
        let statistics = DrawStatistics::of(&draws).unwrap();
        assert!(statistics.hpd68_low == 5.0 && statistics.hpd68_high < 5.001);
        assert!(statistics.mean > 200.0 && (statistics.median - 5.0005).abs() < 1e-3);
    }

    #[test]
    fn an_interval_of_normal_draws_is_not_short_by_chance() {
        use rand::SeedableRng;
        use rand_distr::{Distribution, StandardNormal};
        use statrs::distribution::{ContinuousCDF, Normal};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let normal = Normal::standard();
        let repeats = 2000;
        let (mut inside, mut width) = (0.0, 0.0);
        for _ in 0..repeats {
            let draws: Vec<f64> = (0..800).map(|_| StandardNormal.sample(&mut rng)).collect();
            let statistics = DrawStatistics::of(&draws).unwrap();
            inside += normal.cdf(statistics.hpd68_high) - normal.cdf(statistics.hpd68_low);
            width += statistics.hpd68_high - statistics.hpd68_low;
        }
        let (inside, width) = (inside / f64::from(repeats), width / f64::from(repeats));
        // The very shortest interval: 0.667 and 1.953.
        assert!((inside - 0.68).abs() < 0.006, "{inside}");
        assert!((width / (2.0 * normal.inverse_cdf(0.84)) - 1.0).abs() < 0.008, "{width}");
    }

    #[test]
    fn an_interval_at_the_edge_of_the_prior_is_unbounded() {
        let draws: Vec<f64> = (0..1000).map(|i| (f64::from(i) / 1000.0).powi(2)).collect();
        let statistics = DrawStatistics::of(&draws).unwrap();
        assert!(!statistics.is_bounded(0.0, 1.0, 0.02));
        assert!(statistics.is_bounded(-1.0, 1.0, 0.02));
        assert!(!statistics.is_bounded(-1.0, 0.47, 0.02));
    }

    #[test]
    fn too_few_draws_have_no_statistics() {
        assert_eq!(DrawStatistics::of(&[1.0, f64::NAN]), None);
        assert_eq!(DrawStatistics::of(&[3.0, 3.0]).unwrap().hpd68_low, 3.0);
    }

    #[test]
    fn quantiles_interpolate() {
        assert_eq!(quantile_of_sorted(&[1.0, 2.0, 4.0], 0.75), 3.0);
        assert!(quantile_of_sorted(&[], 0.5).is_nan());
    }
}
