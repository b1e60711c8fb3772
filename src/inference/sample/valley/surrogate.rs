//! What the floors found so far say of others: expansions to second order about the nearest.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::known_maximum::{KnownMaximum, weights};
use super::neighbours::nearest;

/// Interpolated expansions about the nearest floors (Franke & Little's weights, squared; Renka 1988, ACM Trans. Math.
/// Softw. 14, 139): of ln m to second order, the slope of ½ ln det that of a plane through all floors, and of t̂ to first order.
///
/// Near is what is near in the mean metric −d² ln p/ds² of the floors. Where the valley of s bends, posterior deviations
/// tell its length and not the width across it, in which an expansion fails.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Surrogate {
    known: Vec<KnownMaximum>,
    /// The highest ln m known.
    top: f64,
    /// d(½ ln det)/ds.
    determinant_slope: DVector<f64>,
    /// y of s, in which distances are measured, and y of each floor, a row a floor.
    ruler: DMatrix<f64>,
    anchors: DMatrix<f64>,
}

/// ln m of floors that are further apart than expansions err lie on different maxima of ln p over t.
pub(super) const APART: f64 = 15.0;

impl Surrogate {
    /// From what is known; `None` of nothing, and for metrics that are not positive definite.
    pub fn fit(known: Vec<KnownMaximum>) -> Option<Self> {
        let d = known.first()?.s.len();
        let top = known.iter().map(|k| k.log_marginal).fold(f64::NEG_INFINITY, f64::max);
        let weights = weights(&known);
        let mut metric = DMatrix::zeros(d, d);
        for (k, weight) in known.iter().zip(&weights) {
            metric += &k.metric * *weight;
        }
        let ruler = metric.cholesky()?.l().transpose();
        let y = DMatrix::from_columns(&known.iter().map(|k| &ruler * &k.s).collect::<Vec<_>>());
        let determinants = known.iter().map(|k| k.half_log_determinant);
        let by_y = plane(&weights, &y, &DVector::from_iterator(known.len(), determinants))?;
        Some(Self { known, top, determinant_slope: ruler.tr_mul(&by_y), ruler, anchors: y.transpose() })
    }

    /// ln m at s.
    pub fn log_marginal(&self, s: &DVector<f64>) -> f64 {
        self.neighbours(s).iter().map(|near| near.weight * near.value).sum()
    }

    /// Where t̂ may be at s: as the neighbours together have it, and as the nearest has it.
    pub fn stiff(&self, s: &DVector<f64>) -> [DVector<f64>; 2] {
        let near = self.neighbours(s);
        let of = |near: &Near| {
            let known = &self.known[near.floor];
            &known.stiff + &known.bend * (s - &known.s)
        };
        let together = near.iter().map(|near| of(near) * near.weight).sum();
        [together, of(&near[0])]
    }

    /// The floors nearest to y, the nearest first, with weights (1/r − 1/R)⁴ that add up to one; R, the reach, is the
    /// distance of the next. The weights are steep as expansions to second order err by the third power of r.
    ///
    /// Floors whose expansions are low are left out: they lie on lower maxima of ln p over t. So are those whose expansions are far
    /// above all that is known, as from a steep slope: beside them all others are low, and no chain is let to where they lead.
    fn neighbours(&self, s: &DVector<f64>) -> Vec<Near> {
        const MOST: usize = 16;
        const TINY: f64 = 1e-6;
        /// R of the farthest floor's distance, where no other floor is known.
        const BEYOND: f64 = 2.0;
        /// Most that is believed above the highest floor known.
        const HIGHER: f64 = 5.0;
        let y = &self.ruler * s;
        let mut nearest = nearest(self.anchors.as_slice(), y.as_slice(), MOST + 1);
        let beyond = if nearest.len() > MOST { 1.0 } else { BEYOND };
        let apart = |squared: f64| squared.sqrt().max(TINY);
        // A surrogate is made with a floor and forgets none.
        let reach = beyond * apart(nearest[nearest.len() - 1].1);
        nearest.truncate(MOST);
        let (mut from, mut pull) = (DVector::zeros(s.len()), DVector::zeros(s.len()));
        let of = |(floor, squared): (usize, f64)| {
            let known = &self.known[floor];
            s.sub_to(&known.s, &mut from);
            known.slope.sub_to(&self.determinant_slope, &mut pull);
            pull.gemv(-0.5, &known.metric, &from, 1.0);
            let weight = (1.0 / apart(squared) - 1.0 / reach).powi(4);
            Near { floor, weight, value: known.log_marginal + pull.dot(&from) }
        };
        let mut near: Vec<Near> = nearest.into_iter().map(of).collect();
        let is_believed = |near: &Near| near.value <= self.top + HIGHER;
        if near.iter().any(is_believed) {
            near.retain(is_believed);
        }
        let highest = near.iter().map(|near| near.value).fold(f64::NEG_INFINITY, f64::max);
        // One that is not a number stays, so that some floor does: a move there is refused.
        near.retain(|near| near.value >= highest - APART || near.value.is_nan());
        let sum: f64 = near.iter().map(|near| near.weight).sum();
        near.iter_mut().for_each(|near| near.weight /= sum);
        near
    }

    /// Whether all shapes are those of so many slow and stiff directions.
    pub fn fits(&self, slow: usize, stiff: usize) -> bool {
        let of_known = |known: &KnownMaximum| {
            (known.s.len(), known.slope.len(), known.stiff.len()) == (slow, slow, stiff)
                && (known.metric.shape(), known.bend.shape()) == ((slow, slow), (stiff, slow))
        };
        (self.determinant_slope.len(), self.ruler.shape(), !self.known.is_empty())
            == (slow, (slow, slow), true)
            && self.anchors.shape() == (self.known.len(), slow)
            && self.known.iter().all(of_known)
    }

    /// The maxima it was fitted to.
    pub fn known(&self) -> &[KnownMaximum] {
        &self.known
    }
}

/// A floor near to a point: its share of the weights, and its expansion of ln m to the point.
struct Near {
    floor: usize,
    weight: f64,
    value: f64,
}

/// The slope of the plane through values at the columns of `x`, by least squares of weights that add up to one; zero along
/// what `x` hardly determines.
fn plane(weights: &[f64], x: &DMatrix<f64>, values: &DVector<f64>) -> Option<DVector<f64>> {
    const RIDGE: f64 = 1e-3;
    let weights = DVector::from_column_slice(weights);
    let (mean_x, mean) = (x * &weights, values.dot(&weights));
    let mut matrix = DMatrix::identity(x.nrows(), x.nrows()) * RIDGE;
    let mut vector = DVector::zeros(x.nrows());
    for ((x, value), weight) in x.column_iter().zip(values).zip(&weights) {
        let offset = x - &mean_x;
        matrix.ger(*weight, &offset, &offset, 1.0);
        vector.axpy(weight * (value - mean), &offset, 1.0);
    }
    Some(matrix.cholesky()?.solve(&vector))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(s: Vec<f64>, log_marginal: f64, slope: Vec<f64>, metric: DMatrix<f64>) -> KnownMaximum {
        let d = s.len();
        KnownMaximum {
            stiff: DVector::from_element(1, s[0].sin()),
            bend: DMatrix::from_fn(1, d, |_, i| if i == 0 { s[0].cos() } else { 0.0 }),
            half_log_determinant: 0.0,
            s: DVector::from_vec(s),
            log_marginal,
            slope: DVector::from_vec(slope),
            metric,
        }
    }

    #[test]
    fn a_normal_distribution_is_found_again_anywhere() {
        // ln m = −x² − y²/2 − x/5 of s = (2x, y), the last term from ½ ln det = x/5.
        let metric = DMatrix::from_diagonal(&DVector::from_vec(vec![0.5, 1.0]));
        let floors = (0..9).map(|i| {
            let (x, y) = (f64::from(i % 3) - 1.0, f64::from(i / 3) - 1.0);
            KnownMaximum {
                half_log_determinant: 0.2 * x,
                ..known(vec![2.0 * x, y], -x * x - 0.5 * y * y - 0.2 * x, vec![-x, -y], metric.clone())
            }
        });
        let surrogate = Surrogate::fit(floors.collect()).unwrap();
        // x = 1.7.
        let value = surrogate.log_marginal(&DVector::from_vec(vec![3.4, -0.5]));
        assert!((value + 1.7 * 1.7 + 0.125 + 0.34).abs() < 1e-3, "{value}");
        let bytes = postcard::to_allocvec(&surrogate).unwrap();
        assert_eq!(postcard::from_bytes::<Surrogate>(&bytes).unwrap(), surrogate);
    }

    #[test]
    fn the_nearest_across_a_bent_valley_count() {
        // An arc of radius 1 about (0, 0), 0.03 wide: ln m = −½ ((r − 1)/0.03)² − ½ (angle/0.7)².
        let (width, long) = (0.03, 0.7);
        let value = |x: f64, y: f64| {
            let (r, angle) = (x.hypot(y), x.atan2(y));
            let (across, along) = ((r - 1.0) / width, angle / long);
            let (by_r, by_angle) =
                ([x / r / width, y / r / width], [y / (r * r) / long, -x / (r * r) / long]);
            let slope = (0..2).map(|i| -across * by_r[i] - along * by_angle[i]).collect::<Vec<_>>();
            let metric = DMatrix::from_fn(2, 2, |i, j| by_r[i] * by_r[j] + by_angle[i] * by_angle[j]);
            (-0.5 * (across * across + along * along), slope, metric)
        };
        let at = |i: i32, r: f64| [r * (0.25 * f64::from(i)).sin(), r * (0.25 * f64::from(i)).cos()];
        let floors = (-8..=8).flat_map(|i| [at(i, 0.97), at(i, 1.0), at(i, 1.03)]).map(|[x, y]| {
            let (log_marginal, slope, metric) = value(x, y);
            known(vec![x, y], log_marginal, slope, metric)
        });
        let surrogate = Surrogate::fit(floors.collect()).unwrap();
        for i in 0..8 {
            let angle = 0.25 * f64::from(i) - 0.9;
            let (x, y) = (1.01 * angle.sin(), 1.01 * angle.cos());
            let found = surrogate.log_marginal(&DVector::from_vec(vec![x, y]));
            assert!((found - value(x, y).0).abs() < 0.2, "{angle} {found} {}", value(x, y).0);
        }
    }

    #[test]
    fn floors_on_a_lower_maximum_do_not_count() {
        // ln m = −s²/2 with t̂ = sin s; every third floor was sought in vain and lies 80 lower, where t̂ = sin s + 5.
        let floors = (-10..=10).map(|i| {
            let (s, low) = (0.3 * f64::from(i), f64::from(u8::from(i % 3 == 0)));
            let metric = DMatrix::identity(1, 1);
            let floor = known(vec![s], -0.5 * s * s - 80.0 * low, vec![-s], metric);
            KnownMaximum { stiff: floor.stiff.add_scalar(5.0 * low), ..floor }
        });
        let surrogate = Surrogate::fit(floors.collect()).unwrap();
        for s in [-1.3_f64, 0.0, 0.02, 0.9, 2.0] {
            let x = DVector::from_element(1, s);
            let value = surrogate.log_marginal(&x);
            assert!((value + 0.5 * s * s).abs() < 1e-9, "{s}: {value}");
            let stiff = surrogate.stiff(&x);
            assert!(stiff.iter().all(|t| (t[0] - s.sin()).abs() < 0.05), "{s}: {stiff:?}");
        }
    }

    #[test]
    fn expansions_that_promise_the_impossible_do_not_count() {
        // ln m = −s²/2, and beside it a steep slope on another maximum, 10 lower, whose expansion rises by 450.
        let at = |s: f64, low: f64, slope| known(vec![s], low, vec![slope], DMatrix::identity(1, 1));
        let mut floors: Vec<_> =
            (-10..=10).map(|i| 0.3 * f64::from(i)).map(|s| at(s, -0.5 * s * s, -s)).collect();
        floors.push(at(0.5, -10.0, 30.0));
        let value = |floors, s| {
            let surrogate = Surrogate::fit(floors).unwrap();
            surrogate.log_marginal(&DVector::from_element(1, s))
        };
        assert!((value(floors.clone(), 1.3) + 0.845).abs() < 1e-3, "{}", value(floors, 1.3));
        // Where nothing else is known, the promise stands.
        assert!(value(vec![at(0.0, -10.0, 30.0)], 2.0) > 40.0);
    }

    #[test]
    fn a_far_expansion_does_not_wall_off_a_place() {
        // Twice as near to a peak 0.01 wide as to one of width 1.
        let floors = vec![
            known(vec![0.0], 0.0, vec![0.0], DMatrix::from_element(1, 1, 1e4)),
            known(vec![3.0], 0.0, vec![0.0], DMatrix::identity(1, 1)),
        ];
        let surrogate = Surrogate::fit(floors).unwrap();
        let value = surrogate.log_marginal(&DVector::from_vec(vec![1.0]));
        assert!(value > -2.0 - 3.0, "{value}");
    }

    #[test]
    fn the_floor_is_guessed_between_floors() {
        let floors =
            (-15..=15).map(|i| known(vec![0.4 * f64::from(i)], 0.0, vec![0.0], DMatrix::identity(1, 1)));
        let surrogate = Surrogate::fit(floors.collect()).unwrap();
        assert!(
            (-10..10)
                .map(|i| 0.4 * f64::from(i) + 0.2)
                .all(|x| { (surrogate.stiff(&DVector::from_vec(vec![x]))[0][0] - x.sin()).abs() < 0.05 })
        );
    }
}
