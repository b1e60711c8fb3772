//! Smoothed densities of draws for display: curves of one quantity, contours of two.
//!
//! Gaussian kernels with the widths of Scott (1992, Multivariate Density Estimation), in two dimensions with
//! the shape of the draws' covariance, so that a narrow ridge stays narrow. Beyond an end where draws are few the
//! density runs out; draws near one where they are many are mirrored at it, so that a density that is cut off keeps
//! its height there.

use super::contour::Field;
use super::mark::Point;

/// Nodes of a curve.
const CURVE_NODES: usize = 256;
/// Nodes of an axis of a field, and of the grid on which the draws are smoothed.
const FIELD_NODES: usize = 128;
/// Ridges narrower than this share of their length need more nodes, in proportion, up to so many times as many: with
/// few across it, the contour of a ridge falls into beads.
const NARROW: f64 = 0.15;
const MOST_TIMES_AS_MANY: f64 = 6.0;
/// A kernel is cut here, in its widths.
const KERNEL_REACH: f64 = 4.0;
/// Kernels in units of Scott's width: draws of a chain tell less than independent ones, and ragged contours
/// nothing.
const WIDENING: f64 = 1.2;

/// The density of one quantity, its peak 1; `None` for fewer than two different values.
pub fn curve(draws: &[f64]) -> Option<Vec<Point>> {
    let finite: Vec<f64> = draws.iter().copied().filter(|value| value.is_finite()).collect();
    let width = WIDENING * (finite.len() as f64).powf(-0.2);
    let spread = Spread::of(&finite, width)?;
    let step = (spread.high - spread.low) / CURVE_NODES as f64;
    let mut density = vec![0.0; CURVE_NODES];
    for value in &finite {
        density[(((value - spread.low) / step) as usize).min(CURVE_NODES - 1)] += 1.0;
    }
    let density = smoothed(&density, width * spread.deviation / step);
    let peak = density.iter().copied().fold(0.0, f64::max);
    let node = |(i, value): (usize, f64)| [spread.low + (i as f64 + 0.5) * step, value / peak];
    Some(density.into_iter().enumerate().map(node).collect())
}

/// The density of two quantities and the levels that enclose the given fractions of it.
pub fn field(x: &[f64], y: &[f64], fractions: &[f64]) -> Option<(Field, Vec<f64>)> {
    let pairs = x.iter().zip(y).map(|(x, y)| (*x, *y)).filter(|(x, y)| x.is_finite() && y.is_finite());
    let (x, y): (Vec<f64>, Vec<f64>) = pairs.unzip();
    let width = WIDENING * (x.len() as f64).powf(-1.0 / 6.0);
    let (along_x, along_y) = (Spread::of(&x, width)?, Spread::of(&y, width)?);
    let product: f64 = x.iter().zip(&y).map(|(x, y)| along_x.unit(*x) * along_y.unit(*y)).sum();
    let correlation = (product / x.len() as f64).clamp(-0.9999, 0.9999);
    let rest = (1.0 - correlation * correlation).sqrt();
    let white = |x: f64, y: f64| {
        let u = along_x.unit(x);
        (u, (along_y.unit(y) - correlation * u) / rest)
    };
    // Round coordinates u, v: a grid wide enough for all draws and their mirror images.
    let reach = KERNEL_REACH * width;
    let furthest = x
        .iter()
        .zip(&y)
        .map(|(x, y)| white(*x, *y))
        .fold(0.0_f64, |far, (u, v)| far.max(u.abs()).max(v.abs()));
    let half = furthest + reach;
    let step = 2.0 * half / FIELD_NODES as f64;
    let mut counts = vec![0.0; FIELD_NODES * FIELD_NODES];
    let mut count = |x: f64, y: f64| {
        let (u, v) = white(x, y);
        let (i, j) = (((u + half) / step).floor(), ((v + half) / step).floor());
        let is_inside = |k: f64| k >= 0.0 && k < FIELD_NODES as f64;
        if is_inside(i) && is_inside(j) {
            counts[j as usize * FIELD_NODES + i as usize] += 1.0;
        }
    };
    // Mirrored along the ridge, so that a ridge runs straight on behind the end.
    let slope = correlation * along_y.deviation / along_x.deviation;
    let inverse_slope = correlation * along_x.deviation / along_y.deviation;
    for (&x, &y) in x.iter().zip(&y) {
        for image_x in along_x.with_mirror_images(x, reach) {
            let y = y + slope * (image_x - x);
            for image_y in along_y.with_mirror_images(y, reach) {
                count(image_x + inverse_slope * (image_y - y), image_y);
            }
        }
    }
    let density = smoothed_in_two_dimensions(&counts, width / step);
    let nodes = (FIELD_NODES as f64 * (NARROW / rest).clamp(1.0, MOST_TIMES_AS_MANY)) as usize;
    let axis = |spread: &Spread| -> Vec<f64> {
        let node = |i: usize| spread.low + (spread.high - spread.low) * i as f64 / (nodes - 1) as f64;
        (0..nodes).map(node).collect()
    };
    let (x, y) = (axis(&along_x), axis(&along_y));
    let at = |(x, y): (f64, f64)| {
        let (u, v) = white(x, y);
        interpolated(&density, (u + half) / step - 0.5, (v + half) / step - 0.5)
    };
    let places = y.iter().flat_map(|&y| x.iter().map(move |&x| (x, y)));
    let values: Vec<f64> = places.map(at).collect();
    let levels = fractions.iter().map(|fraction| enclosing_level(&values, *fraction)).collect();
    Some((Field { x, y, values }, levels))
}

/// The level above which that fraction of the sum lies.
fn enclosing_level(values: &[f64], fraction: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(|a, b| b.total_cmp(a));
    let wanted = fraction * sorted.iter().sum::<f64>();
    let mut sum = 0.0;
    let reached = sorted.iter().find(|value| {
        sum += **value;
        sum >= wanted
    });
    reached.copied().unwrap_or(0.0)
}

/// Mean and deviation of values that differ, and the ends of their density.
struct Spread {
    low: f64,
    high: f64,
    mean: f64,
    deviation: f64,
}

impl Spread {
    /// Smoothed with a kernel of that width in deviations.
    fn of(values: &[f64], width: f64) -> Option<Self> {
        /// Of the peak of a normal density: where the values' own is lower at an end, it fades out.
        const FADES_BELOW: f64 = 0.25;
        /// How near the end that is looked at, in widths of the kernel, and values there that say nothing.
        const CLOSE: f64 = 0.25;
        const FEW: f64 = 4.0;
        /// Values closer than this, in units of themselves, are one.
        const ROUNDING: f64 = 1e-13;
        let count = values.len() as f64;
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // Equal values may deviate from their mean by rounding; a kernel of that width covers cells without number.
        let varies = high - low > ROUNDING * low.abs().max(high.abs());
        let mean = values.iter().sum::<f64>() / count;
        let deviation = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt();
        // Close to the end, as a narrow one of several modes would fill a whole kernel there.
        let close = CLOSE * width * deviation;
        let of_peak = FADES_BELOW * CLOSE * count * width / std::f64::consts::TAU.sqrt();
        let beyond = |end: f64| {
            let near = values.iter().filter(|value| (*value - end).abs() < close).count();
            if (near as f64) < of_peak.max(FEW) { KERNEL_REACH * width * deviation } else { 0.0 }
        };
        let (low, high) = (low - beyond(low), high + beyond(high));
        (varies && deviation > 0.0 && (deviation + high - low).is_finite()).then_some(Self {
            low,
            high,
            mean,
            deviation,
        })
    }

    fn unit(&self, value: f64) -> f64 {
        (value - self.mean) / self.deviation
    }

    /// The value, and its images behind ends that a kernel of that reach (in deviations) crosses.
    fn with_mirror_images(&self, value: f64, reach: f64) -> impl Iterator<Item = f64> {
        let reach = reach * self.deviation;
        let below = (0.0..reach).contains(&(value - self.low)).then_some(2.0 * self.low - value);
        let above = (0.0..reach).contains(&(self.high - value)).then_some(2.0 * self.high - value);
        [Some(value), below, above].into_iter().flatten()
    }
}

/// A Gaussian kernel of that width in cells, cut at its reach and normalised.
fn kernel(width: f64) -> Vec<f64> {
    let reach = (KERNEL_REACH * width).ceil() as usize;
    let weight = |k: usize| (-0.5 * ((k as f64 - reach as f64) / width.max(1e-3)).powi(2)).exp();
    let weights: Vec<f64> = (0..=2 * reach).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    weights.into_iter().map(|weight| weight / sum).collect()
}

/// Convolved with a Gaussian; the cells beyond an end are the mirror image of those before it.
fn smoothed(cells: &[f64], width: f64) -> Vec<f64> {
    let kernel = kernel(width);
    let (reach, period) = (kernel.len() / 2, 2 * cells.len());
    let mirrored = |k: usize| {
        let k = k % period;
        cells[if k < cells.len() { k } else { period - 1 - k }]
    };
    // Any shift by whole periods keeps the index from being negative.
    let shift = period * (reach / period + 1) - reach;
    (0..cells.len())
        .map(|i| kernel.iter().enumerate().map(|(k, weight)| weight * mirrored(i + k + shift)).sum())
        .collect()
}

fn smoothed_in_two_dimensions(cells: &[f64], width: f64) -> Vec<f64> {
    let rows = |cells: &[f64]| -> Vec<f64> {
        cells.chunks_exact(FIELD_NODES).flat_map(|row| smoothed(row, width)).collect()
    };
    transposed(&rows(&transposed(&rows(cells))))
}

fn transposed(cells: &[f64]) -> Vec<f64> {
    let at = |k: usize| cells[(k % FIELD_NODES) * FIELD_NODES + k / FIELD_NODES];
    (0..FIELD_NODES * FIELD_NODES).map(at).collect()
}

/// Bilinear between cells; zero outside.
fn interpolated(cells: &[f64], i: f64, j: f64) -> f64 {
    let (left, below) = (i.floor(), j.floor());
    let last = (FIELD_NODES - 2) as f64;
    if !(0.0..=last).contains(&left) || !(0.0..=last).contains(&below) {
        return 0.0;
    }
    let (s, t) = (i - left, j - below);
    let at = |di: usize, dj: usize| cells[(below as usize + dj) * FIELD_NODES + left as usize + di];
    (1.0 - t) * ((1.0 - s) * at(0, 0) + s * at(1, 0)) + t * ((1.0 - s) * at(0, 1) + s * at(1, 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::random::{Stage, stream};
    use rand::RngExt;
    use rand_distr::{Distribution, StandardNormal};

    fn normal(count: usize) -> (Vec<f64>, Vec<f64>) {
        let mut rng = stream(1, 0, Stage::Sampling, 0);
        (0..count)
            .map(|_| {
                let (a, b): (f64, f64) = (StandardNormal.sample(&mut rng), StandardNormal.sample(&mut rng));
                (a, 0.95 * a + 0.1 * b)
            })
            .unzip()
    }

    #[test]
    fn contours_enclose_their_fraction_of_the_draws() {
        let (x, y) = normal(20_000);
        let (field, levels) = field(&x, &y, &[0.68, 0.95]).unwrap();
        for (level, fraction) in levels.iter().zip([0.68, 0.95]) {
            let step = |axis: &[f64]| (axis[1] - axis[0], axis[0]);
            let ((dx, x0), (dy, y0)) = (step(&field.x), step(&field.y));
            let inside = x.iter().zip(&y).filter(|(x, y)| {
                let (i, j) = (((*x - x0) / dx).round() as usize, ((*y - y0) / dy).round() as usize);
                field.values[j * field.x.len() + i] > *level
            });
            let share = inside.count() as f64 / x.len() as f64;
            assert!((share - fraction).abs() < 0.025, "{share} in the contour of {fraction}");
        }
        assert!(levels[0] > levels[1]);
    }

    #[test]
    fn the_contour_of_a_narrow_ridge_is_one_ring() {
        let (x, y) = normal(4000);
        let y: Vec<f64> = x.iter().zip(&y).map(|(x, y)| x + 0.4 * (y - 0.95 * x)).collect();
        let (field, levels) = field(&x, &y, &[0.68]).unwrap();
        assert_eq!(field.rings_above(levels[0]).len(), 1);
    }

    #[test]
    fn a_density_keeps_its_height_at_a_cut() {
        let mut rng = stream(2, 0, Stage::Sampling, 0);
        let uniform: Vec<f64> = (0..50_000).map(|_| rng.random::<f64>()).collect();
        let density = curve(&uniform).unwrap();
        assert!(density[0][1] > 0.9 && density[CURVE_NODES - 1][1] > 0.9, "{density:?}");
        let other: Vec<f64> = (0..50_000).map(|_| rng.random::<f64>()).collect();
        let (field, _) = field(&uniform, &other, &[0.68]).unwrap();
        let centre = field.values[FIELD_NODES * FIELD_NODES / 2 + FIELD_NODES / 2];
        assert!(field.values[0] / centre > 0.7, "{}", field.values[0] / centre);
    }

    #[test]
    fn a_density_of_few_draws_fades_out() {
        let (x, y) = normal(800);
        let density = curve(&x).unwrap();
        assert!(density[0][1] < 1e-3 && density[CURVE_NODES - 1][1] < 1e-3);
        let (field, levels) = field(&x, &y, &[0.95]).unwrap();
        let n = field.x.len();
        let border = (0..n).flat_map(|k| [(k, 0), (k, n - 1), (0, k), (n - 1, k)]);
        assert!(border.map(|(i, j)| field.values[j * n + i]).all(|value| value < levels[0]));
    }

    #[test]
    fn the_outer_one_of_two_narrow_modes_is_not_cut_off() {
        let (x, y) = normal(2000);
        let modes = |values: &[f64]| -> Vec<f64> {
            values.iter().enumerate().map(|(i, v)| 0.2 * v + if i % 3 == 0 { -2.0 } else { 0.0 }).collect()
        };
        let (field, levels) = field(&modes(&x), &modes(&y), &[0.95]).unwrap();
        let n = field.x.len();
        assert!((0..n).all(|k| field.values[k * n + n - 1].max(field.values[(n - 1) * n + k]) < levels[0]));
    }

    #[test]
    fn what_does_not_vary_has_no_density() {
        assert!(curve(&[1.0; 10]).is_none() && curve(&[]).is_none() && curve(&[f64::NAN, 1.0]).is_none());
        assert!(field(&[1.0, 2.0], &[3.0, 3.0], &[0.68]).is_none());
        // The mean of these is not exactly any of them.
        for stuck in [[0.1; 7], [1e300; 7], [0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3 + 1e-16]] {
            assert!(curve(&stuck).is_none() && field(&stuck, &stuck, &[0.68]).is_none());
        }
    }
}
