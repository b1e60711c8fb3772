//! What the floors found so far say of others: expansions to second order about the nearest.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::known_maximum::KnownMaximum;
use super::neighbours::{Vicinity, nearest};

/// Interpolated expansions about the nearest floors (Franke & Little's weights, squared; Renka 1988, ACM Trans. Math.
/// Softw. 14, 139): of ln m to second order, the slope of ½ ln det that of a plane through all floors, and of t̂ to first order.
///
/// Near is what is near in the mean metric −d² ln p/ds² of the floors. Where the valley of s bends, posterior deviations
/// tell its length and not the width across it, in which an expansion fails.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Surrogate {
    centre: DVector<f64>,
    factor: DMatrix<f64>,
    known: Vec<KnownMaximum>,
    /// The highest ln m known.
    top: f64,
    /// d(½ ln det)/ds.
    determinant_slope: DVector<f64>,
    /// y of x, in which distances are measured, and y of each floor, a row a floor.
    ruler: DMatrix<f64>,
    anchors: DMatrix<f64>,
    /// Largest |x| of what counts as known.
    edge: f64,
}

/// ln m of floors that are further apart than expansions err lie on different maxima of ln p over t.
pub(super) const APART: f64 = 15.0;

impl Surrogate {
    /// From what is known, `centre` and `factor` (lower triangular) giving the scale x = F⁻¹(s − c); `None` for matrices
    /// that are not positive definite.
    pub fn fit(centre: DVector<f64>, factor: DMatrix<f64>, known: Vec<KnownMaximum>) -> Option<Self> {
        /// From the farthest floor, in posterior deviations.
        const EDGE: f64 = 14.0;
        let d = centre.len();
        let top = known.iter().map(|k| k.log_marginal).fold(f64::NEG_INFINITY, f64::max);
        // What lies far below the top hardly matters, and bends in its own way.
        let weight = |k: &KnownMaximum| 1.0 / (1.0 + ((top - k.log_marginal) / d as f64).powi(2));
        let sum: f64 = known.iter().map(weight).sum();
        let weights: Vec<f64> = known.iter().map(|k| weight(k) / sum).collect();
        let mut metric = DMatrix::zeros(d, d);
        for (k, weight) in known.iter().zip(&weights) {
            metric += &k.metric * *weight;
        }
        let ruler = metric.cholesky()?.l().tr_mul(&factor);
        let x: Option<Vec<_>> =
            known.iter().map(|k| factor.solve_lower_triangular(&(&k.s - &centre))).collect();
        let x = DMatrix::from_columns(&x?);
        let anchors = (&ruler * &x).transpose();
        let edge = EDGE + x.amax();
        let determinants = known.iter().map(|k| k.half_log_determinant);
        let mut determinant_slope = plane(&weights, &x, &DVector::from_iterator(known.len(), determinants))?;
        factor.tr_solve_lower_triangular_mut(&mut determinant_slope);
        Some(Self { centre, factor, known, top, determinant_slope, ruler, anchors, edge })
    }

    /// Centre and scale: x = F⁻¹(s − c).
    pub fn scale(&self) -> (&DVector<f64>, &DMatrix<f64>) {
        (&self.centre, &self.factor)
    }

    /// s of x.
    pub fn s(&self, x: &DVector<f64>) -> DVector<f64> {
        &self.centre + &self.factor * x
    }

    /// x of s.
    pub fn x(&self, s: &DVector<f64>) -> DVector<f64> {
        let mut x = s - &self.centre;
        // The factor of a positive-definite matrix has no zero on its diagonal.
        self.factor.solve_lower_triangular_mut(&mut x);
        x
    }

    /// Whether x lies so near to what is known that expansions may be trusted to lead back.
    pub fn reaches(&self, x: &DVector<f64>) -> bool {
        x.iter().all(|x| x.abs() <= self.edge)
    }

    /// ln m, and its slope by x, which lies in or near the vicinity if there is one.
    pub fn log_marginal(&self, x: &DVector<f64>, vicinity: Option<&mut Vicinity>) -> (f64, DVector<f64>) {
        let (s, y) = (self.s(x), &self.ruler * x);
        let Neighbours { near, slopes, farthest } = self.neighbours(&s, &y, vicinity);
        let value: f64 = near.iter().map(|near| near.weight * near.value).sum();
        let (mut by_s, mut by_y) = (DVector::zeros(x.len()), DVector::zeros(x.len()));
        let mut by_reach = 0.0;
        for near in &near {
            by_s.axpy(near.weight, &slopes.column(near.rank), 1.0);
            let by_weight = near.value - value;
            self.add_away(&mut by_y, by_weight * near.by_distance, &y, (near.floor, near.distance));
            by_reach += by_weight * near.by_reach;
        }
        self.add_away(&mut by_y, by_reach, &y, farthest);
        (value, self.factor.tr_mul(&by_s) + self.ruler.tr_mul(&by_y))
    }

    /// Where t̂ may be: as the neighbours together have it, and as the nearest has it.
    pub fn stiff(&self, x: &DVector<f64>) -> [DVector<f64>; 2] {
        let s = self.s(x);
        let near = self.neighbours(&s, &(&self.ruler * x), None).near;
        let of = |near: &Near| {
            let known = &self.known[near.floor];
            &known.stiff + &known.bend * (&s - &known.s)
        };
        let together = near.iter().map(|near| of(near) * near.weight).sum();
        [together, of(&near[0])]
    }

    /// Adds so many times the direction from a floor at a distance to y.
    fn add_away(
        &self,
        sum: &mut DVector<f64>,
        times: f64,
        y: &DVector<f64>,
        (floor, distance): (usize, f64),
    ) {
        let times = times / distance;
        for ((sum, y), anchor) in sum.iter_mut().zip(y).zip(&self.anchors.row(floor)) {
            *sum += times * (y - anchor);
        }
    }

    /// The floors nearest to y, the nearest first, with weights (1/r − 1/R)⁴ that add up to one; R, the reach, is the
    /// distance of the next. The weights are steep as expansions to second order err by the third power of r.
    ///
    /// Floors whose expansions are low are left out: they lie on lower maxima of ln p over t. So are those whose expansions are far
    /// above all that is known, as from a steep slope: beside them all others are low, and no chain is let to where they lead.
    fn neighbours(&self, s: &DVector<f64>, y: &DVector<f64>, vicinity: Option<&mut Vicinity>) -> Neighbours {
        const MOST: usize = 16;
        const TINY: f64 = 1e-6;
        /// R of the farthest floor's distance, where no other floor is known.
        const BEYOND: f64 = 2.0;
        /// Most that is believed above the highest floor known.
        const HIGHER: f64 = 5.0;
        let anchors = self.anchors.as_slice();
        let mut nearest = match vicinity {
            Some(vicinity) => vicinity.nearest(anchors, y, MOST + 1),
            None => nearest(anchors, y.as_slice(), MOST + 1, f64::INFINITY),
        };
        let beyond = if nearest.len() > MOST { 1.0 } else { BEYOND };
        let apart = |squared: f64| squared.sqrt().max(TINY);
        // A surrogate is made with a floor and forgets none.
        let (floor, squared) = nearest[nearest.len() - 1];
        let farthest = (floor, apart(squared));
        nearest.truncate(MOST);
        let reach = beyond * farthest.1;
        let mut from = DVector::zeros(s.len());
        let mut slopes = DMatrix::zeros(s.len(), nearest.len());
        let mut near: Vec<Near> = nearest
            .into_iter()
            .enumerate()
            .map(|(rank, (floor, squared))| {
                let distance = apart(squared);
                let root = 1.0 / distance - 1.0 / reach;
                let by_root = 4.0 * root.powi(3);
                let known = &self.known[floor];
                s.sub_to(&known.s, &mut from);
                let mut slope = slopes.column_mut(rank);
                known.slope.sub_to(&self.determinant_slope, &mut slope);
                let slope_there = slope.dot(&from);
                slope.gemv(-1.0, &known.metric, &from, 1.0);
                Near {
                    rank,
                    floor,
                    distance,
                    weight: root.powi(4),
                    by_distance: -by_root / (distance * distance),
                    by_reach: by_root * beyond / (reach * reach),
                    // A parabola rises as its mean slope says.
                    value: known.log_marginal + 0.5 * (slope_there + slope.dot(&from)),
                }
            })
            .collect();
        let is_believed = |near: &Near| near.value <= self.top + HIGHER;
        if near.iter().any(is_believed) {
            near.retain(is_believed);
        }
        let highest = near.iter().map(|near| near.value).fold(f64::NEG_INFINITY, f64::max);
        // One that is not a number stays, so that some floor does: a move there is refused.
        near.retain(|near| near.value >= highest - APART || near.value.is_nan());
        let sum: f64 = near.iter().map(|near| near.weight).sum();
        for near in &mut near {
            near.weight /= sum;
            near.by_distance /= sum;
            near.by_reach /= sum;
        }
        Neighbours { near, slopes, farthest }
    }

    /// Whether all shapes are those of so many slow and stiff directions.
    pub fn fits(&self, slow: usize, stiff: usize) -> bool {
        let of_known = |known: &KnownMaximum| {
            (known.s.len(), known.slope.len(), known.stiff.len()) == (slow, slow, stiff)
                && (known.metric.shape(), known.bend.shape()) == ((slow, slow), (stiff, slow))
        };
        (self.centre.len(), self.determinant_slope.len(), !self.known.is_empty()) == (slow, slow, true)
            && (self.factor.shape(), self.ruler.shape()) == ((slow, slow), (slow, slow))
            && self.anchors.shape() == (self.known.len(), slow)
            && self.known.iter().all(of_known)
    }

    /// The maxima it was fitted to.
    pub fn known(&self) -> &[KnownMaximum] {
        &self.known
    }
}

/// A floor near to a point: how many are nearer, its distance, its share of the weights, the slope of the weight by that
/// distance and by the distance of the farthest, both over the sum of weights, and its expansion of ln m to the point.
struct Near {
    rank: usize,
    floor: usize,
    distance: f64,
    weight: f64,
    by_distance: f64,
    by_reach: f64,
    value: f64,
}

/// The nearest floors, the slopes of their expansions at the point, a column a rank, and the floor beyond them with its distance.
struct Neighbours {
    near: Vec<Near>,
    slopes: DMatrix<f64>,
    farthest: (usize, f64),
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
        let factor = DMatrix::from_diagonal(&DVector::from_vec(vec![2.0, 1.0]));
        let surrogate = Surrogate::fit(DVector::zeros(2), factor, floors.collect()).unwrap();
        let x = DVector::from_vec(vec![1.7, -0.5]);
        let (value, slope) = surrogate.log_marginal(&x, None);
        assert!((value + 1.7 * 1.7 + 0.125 + 0.34).abs() < 1e-3, "{value}");
        assert!((slope - DVector::from_vec(vec![-3.4 - 0.2, 0.5])).amax() < 1e-3);
        assert!((surrogate.x(&surrogate.s(&x)) - &x).amax() < 1e-15);
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
        let surrogate = Surrogate::fit(DVector::zeros(2), DMatrix::identity(2, 2), floors.collect()).unwrap();
        for i in 0..8 {
            let angle = 0.25 * f64::from(i) - 0.9;
            let (x, y) = (1.01 * angle.sin(), 1.01 * angle.cos());
            let at = |x: f64, y: f64| surrogate.log_marginal(&DVector::from_vec(vec![x, y]), None);
            let (found, slope) = at(x, y);
            assert!((found - value(x, y).0).abs() < 0.2, "{angle} {found} {}", value(x, y).0);
            const STEP: f64 = 1e-5;
            let difference = (at(x + STEP, y).0 - at(x - STEP, y).0) / (2.0 * STEP);
            assert!((slope[0] - difference).abs() < 1e-5 * slope.norm(), "{} {difference}", slope[0]);
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
        let surrogate = Surrogate::fit(DVector::zeros(1), DMatrix::identity(1, 1), floors.collect()).unwrap();
        for s in [-1.3_f64, 0.0, 0.02, 0.9, 2.0] {
            let x = DVector::from_element(1, s);
            let (value, slope) = surrogate.log_marginal(&x, None);
            assert!((value + 0.5 * s * s).abs().max((slope[0] + s).abs()) < 1e-9, "{s}: {value} {slope}");
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
            let surrogate = Surrogate::fit(DVector::zeros(1), DMatrix::identity(1, 1), floors).unwrap();
            surrogate.log_marginal(&DVector::from_element(1, s), None).0
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
        let surrogate = Surrogate::fit(DVector::zeros(1), DMatrix::identity(1, 1), floors).unwrap();
        let (value, slope) = surrogate.log_marginal(&DVector::from_vec(vec![1.0]), None);
        assert!(value > -2.0 - 3.0 && slope[0] > 0.0, "{value} {slope}");
    }

    #[test]
    fn the_floor_is_guessed_between_floors() {
        let floors =
            (-15..=15).map(|i| known(vec![0.4 * f64::from(i)], 0.0, vec![0.0], DMatrix::identity(1, 1)));
        let surrogate = Surrogate::fit(DVector::zeros(1), DMatrix::identity(1, 1), floors.collect()).unwrap();
        assert!(
            (-10..10)
                .map(|i| 0.4 * f64::from(i) + 0.2)
                .all(|x| { (surrogate.stiff(&DVector::from_vec(vec![x]))[0][0] - x.sin()).abs() < 0.05 })
        );
    }
}
