//! Curved valleys of a posterior: the *conditional maximum*, where the well-measured directions have their highest density
//! while the others are held. All of them together are the floor of the valley.
//!
//! With z = o + S s + T t, S the directions the data hardly measure and T those they measure well (orthonormal, from the
//! Fisher matrix at o), the maximum t̂(s) = argmax_t ln p(s, t) bends by many widths of t where s moves by one of its own.
//! It is found by Gauss–Newton, whose last step also gives the normal distribution of t about it.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::expansion::{ConditionalMaximum, Expansion};
use crate::inference::likelihood::{Curvature, LatentLikelihood};

/// Distance in standard deviations from which one more step of the expansion is exact enough: the error of ln p is of third
/// order in it.
const NEAR: f64 = 0.5;

/// Curvatures after which a search for a conditional maximum is given up.
pub(crate) const MOST_CURVATURES: u64 = 30;

/// Slow and stiff directions about an origin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Axes {
    origin: DVector<f64>,
    slow: DMatrix<f64>,
    stiff: DMatrix<f64>,
}

/// Principal axes as columns, and these in the order of their widths, the widest first.
fn principal_axes(metric: &DMatrix<f64>) -> (DMatrix<f64>, Vec<usize>) {
    let eigen = metric.clone().symmetric_eigen();
    let mut order: Vec<usize> = (0..metric.nrows()).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    (eigen.eigenvectors, order)
}

impl Axes {
    /// The `slow` widest principal axes of the metric, and the rest, the narrowest first.
    pub fn split(origin: &[f64], metric: &DMatrix<f64>, slow: usize) -> Self {
        let (vectors, mut order) = principal_axes(metric);
        order[slow..].reverse();
        let (slow, stiff) = order.split_at(slow);
        Self::of_columns(origin, &vectors, slow, stiff)
    }

    /// The principal axis of the metric that is most along `heading`, s growing that way, and the rest.
    pub fn along(origin: &[f64], metric: &DMatrix<f64>, heading: &DVector<f64>) -> Self {
        let (vectors, mut order) = principal_axes(metric);
        let cosines = vectors.tr_mul(heading);
        let followed = cosines.iamax();
        order.retain(|axis| *axis != followed);
        let mut axes = Self::of_columns(origin, &vectors, &[followed], &order);
        axes.slow *= cosines[followed].signum();
        axes
    }

    fn of_columns(origin: &[f64], vectors: &DMatrix<f64>, slow: &[usize], stiff: &[usize]) -> Self {
        let [slow, stiff] = [slow, stiff].map(|columns| vectors.select_columns(columns));
        Self { origin: DVector::from_column_slice(origin), slow, stiff }
    }

    /// The same with one stiff direction taken as slow.
    pub fn with_slow(mut self, direction: usize) -> Self {
        let followed = self.stiff.column(direction).into_owned();
        let slow = self.slow.ncols();
        self.slow = self.slow.insert_column(slow, 0.0);
        self.slow.set_column(slow, &followed);
        self.stiff = self.stiff.remove_column(direction);
        self
    }

    /// Number of principal axes wider than `width`.
    pub fn wider_than(width: f64, metric: &DMatrix<f64>) -> usize {
        metric.symmetric_eigenvalues().iter().filter(|value| value.sqrt() * width < 1.0).count()
    }

    /// S, a column a direction.
    pub fn slow(&self) -> &DMatrix<f64> {
        &self.slow
    }

    /// Number of coordinates s.
    pub fn slow_dimension(&self) -> usize {
        self.slow.ncols()
    }

    /// Number of coordinates t.
    pub fn stiff_dimension(&self) -> usize {
        self.stiff.ncols()
    }

    /// Whether all directions are of that dimension, and make up a basis of it.
    pub fn fits(&self, dimension: usize) -> bool {
        let rows = [self.origin.len(), self.slow.nrows(), self.stiff.nrows()];
        rows == [dimension; 3] && self.slow.ncols() + self.stiff.ncols() == dimension
    }

    /// z.
    pub fn at(&self, s: &DVector<f64>, t: &DVector<f64>) -> DVector<f64> {
        &self.origin + &self.slow * s + &self.stiff * t
    }

    /// s and t of z.
    pub fn coordinates(&self, z: &[f64]) -> [DVector<f64>; 2] {
        let from_origin = DVector::from_column_slice(z) - &self.origin;
        [self.slow.tr_mul(&from_origin), self.stiff.tr_mul(&from_origin)]
    }

    /// The maximum over t at s, sought from `guess`; `None` where it is not reached with `most` curvatures.
    pub fn maximum(
        &self,
        likelihood: &dyn LatentLikelihood,
        s: &DVector<f64>,
        guess: DVector<f64>,
        most: u64,
    ) -> Option<ConditionalMaximum> {
        self.search(likelihood, s, guess, most)?.ok()
    }

    /// The same; where it is not reached, what Laplace's method says about the highest point met, as the error.
    pub fn search(
        &self,
        likelihood: &dyn LatentLikelihood,
        s: &DVector<f64>,
        guess: DVector<f64>,
        most: u64,
    ) -> Option<Result<ConditionalMaximum, ConditionalMaximum>> {
        /// After a step that gains less of what the expansion promises, the next is damped as much.
        const GOOD: f64 = 0.5;
        const LEAST_DAMPING: f64 = 1e-2;
        /// Steps so damped that lead down have met a kink.
        const KINK_DAMPING: f64 = 10.0;
        const MOST_DAMPING: f64 = 1e4;
        let mut here = self.expand(likelihood, s, guess)?;
        // The nearest point met on the other side of a kink.
        let mut across: Option<Expansion> = None;
        let (mut damping, mut left) = (0.0, most);
        loop {
            let ridge = across.as_ref().and_then(|across| here.ridge(across));
            across = across.filter(|_| ridge.is_some());
            let model = ridge.as_ref().unwrap_or(&here);
            let newton = model.step(0.0)?;
            if model.distance(&newton) < NEAR {
                return model.maximum(&newton).map(Ok);
            }
            if left == 0 || damping > MOST_DAMPING {
                return here.maximum(&DVector::zeros(newton.len())).map(Err);
            }
            left -= 1;
            let step = if damping == 0.0 { newton } else { model.step(damping)? };
            let (t, promised) = (&here.t + &step, model.gain(&step));
            let harder = f64::max(10.0 * damping, LEAST_DAMPING);
            // The value alone refuses most steps that are still too long, at a fifth of the cost.
            let is_trial = across.is_none() && damping > 0.0 && damping < KINK_DAMPING;
            if is_trial && self.log_density(likelihood, s, &t) <= here.log_density {
                damping = harder;
                continue;
            }
            let there = self.expand(likelihood, s, t);
            let is_across = match (&there, &across) {
                (Some(there), Some(across)) => here.is_crossed(there, across)?,
                _ => false,
            };
            match there {
                Some(there) if there.log_density > here.log_density => {
                    let gain = there.log_density - here.log_density;
                    let before = std::mem::replace(&mut here, there);
                    across = if is_across { Some(before) } else { across };
                    damping = match gain {
                        gain if gain < GOOD * promised => damping,
                        _ if damping > LEAST_DAMPING => 0.1 * damping,
                        _ => 0.0,
                    };
                }
                Some(there) if is_across => {
                    let is_nearer = across.is_none_or(|across| there.log_density > across.log_density);
                    damping = if is_nearer { damping } else { harder };
                    across = Some(there);
                }
                Some(there) if across.is_none() && damping >= KINK_DAMPING => {
                    across = Some(there);
                    damping = 0.0;
                }
                _ => damping = harder,
            }
        }
    }

    /// The maximum over the first `count` coordinates t alone, the others held, and C of their precision C Cᵀ there. Where it is not
    /// reached, a normal distribution about the best point met that is as wide as the step which is left; `None` where there is none.
    pub fn nested_maximum(
        &self,
        likelihood: &dyn LatentLikelihood,
        s: &DVector<f64>,
        t: &DVector<f64>,
        count: usize,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        const MOST: usize = 8;
        /// What is left of a step that has led down, and how much longer the next is after one that has led up.
        const SHORTER: f64 = 0.3;
        const LONGER: f64 = 3.0;
        let held = t.len() - count;
        let origin = &self.origin + &self.slow * s + self.stiff.columns(count, held) * t.rows(count, held);
        let stiff = self.stiff.columns(0, count).into_owned();
        let (axes, no_s) = (Self { slow: DMatrix::zeros(origin.len(), 0), origin, stiff }, DVector::zeros(0));
        let mut here = axes.expand(likelihood, &no_s, t.rows(0, count).into_owned())?;
        let (mut newton, mut share) = (here.step(0.0)?, 1.0);
        for _ in 0..MOST {
            if here.distance(&newton) < NEAR {
                break;
            }
            match axes.expand(likelihood, &no_s, &here.t + &newton * share) {
                Some(there) if there.log_density > here.log_density => {
                    (newton, here) = (there.step(0.0)?, there);
                    share = f64::min(1.0, LONGER * share);
                }
                _ => share *= SHORTER,
            }
        }
        let factor = here.stiff.clone().cholesky()?.l() / here.distance(&newton).max(1.0);
        Some((here.t + newton * share, factor))
    }

    fn log_density(&self, likelihood: &dyn LatentLikelihood, s: &DVector<f64>, t: &DVector<f64>) -> f64 {
        let z = self.at(s, t);
        likelihood.log_likelihood(z.as_slice()) - 0.5 * z.norm_squared()
    }

    fn expand(
        &self,
        likelihood: &dyn LatentLikelihood,
        s: &DVector<f64>,
        t: DVector<f64>,
    ) -> Option<Expansion> {
        let Curvature { log_posterior, gradient, metric } =
            likelihood.curvature(self.at(s, &t).as_slice()).ok()?;
        let (by_slow, by_stiff) = (&metric * &self.slow, &metric * &self.stiff);
        Some(Expansion {
            log_density: log_posterior,
            by_s: self.slow.tr_mul(&gradient),
            by_t: self.stiff.tr_mul(&gradient),
            slow: self.slow.tr_mul(&by_slow),
            mixed: self.stiff.tr_mul(&by_slow),
            stiff: self.stiff.tr_mul(&by_stiff),
            t,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inference::likelihood::{Counter, known::Known};
    use crate::monitor::Silent;

    /// b = a² ± 0.001 with N(0, 1) priors of a and b.
    const PARABOLA: Known = Known {
        dimension: 2,
        log_likelihood: |z| -0.5 * ((z[1] - z[0] * z[0]) / 1e-3).powi(2),
        slope_and_metric: |z| {
            let (offset, row) = ((z[1] - z[0] * z[0]) / 1e-6, DVector::from_vec(vec![-2.0 * z[0], 1.0]));
            let metric = &row * row.transpose() * 1e6 + DMatrix::identity(2, 2);
            (row * -offset - DVector::from_column_slice(z), metric)
        },
    };

    #[test]
    fn the_floor_of_a_parabola_is_the_parabola() {
        let metric = PARABOLA.curvature(&[0.0, 0.0]).unwrap().metric;
        assert_eq!(Axes::wider_than(0.03, &metric), 1);
        let axes = Axes::split(&[0.0, 0.0], &metric, 1);
        for a in [-2.0, -0.5, 0.0, 1.0, 3.0] {
            let s = DVector::from_vec(vec![a]);
            let floor = axes.maximum(&PARABOLA, &s, DVector::zeros(1), 30).unwrap();
            let [x, y] = [0, 1].map(|i| axes.at(&s, &floor.stiff)[i]);
            assert!((y - x * x).abs() < 1e-4 && (x.abs() - a.abs()).abs() < 1e-12, "{x} {y}");
            // Along b = a²: ln p = −a²/2 − a⁴/2.
            assert!((floor.log_density + 0.5 * (a * a + a.powi(4))).abs() < 1e-4);
            assert!((floor.slope[0] + a + 2.0 * a.powi(3)).abs() < 1e-3 * (1.0 + a.abs().powi(3)));
            assert!((floor.bend[(0, 0)].abs() - 2.0 * a.abs()).abs() < 1e-4 * (1.0 + a.abs()));
            assert!((floor.factor[(0, 0)] - 1e3).abs() < 1.0);
        }
    }

    #[test]
    fn a_nested_maximum_is_met_along_a_bend_and_wide_where_it_is_not_reached() {
        // The parabola's b given a is known to 0.001; its a, which b = a² leaves two of, from its mirror image.
        let axes = Axes::split(&[0.0, 0.0], &PARABOLA.curvature(&[0.0, 0.0]).unwrap().metric, 0);
        let nothing = DVector::zeros(0);
        let of = |b: f64, a: f64, count| {
            let [_, t] = axes.coordinates(&[a, b]);
            axes.nested_maximum(&PARABOLA, &nothing, &t, count).unwrap()
        };
        let (own, factor) = of(0.3, 0.9, 1);
        assert!((own[0].abs() - 0.81).abs() < 1e-5 && (factor[(0, 0)] - 1e3).abs() < 1.0, "{own} {factor}");
        // Both together: eight steps do not lead round the bend from there to the top. Priors alone make C one.
        let (own, factor) = of(9.0, 3.0, 2);
        let top = axes.at(&nothing, &own);
        assert!(top.norm() > 1.0 && factor[(1, 1)] < 0.9, "{top} {factor}");
    }

    #[test]
    fn a_search_cut_short_says_where_it_is() {
        let metric = PARABOLA.curvature(&[0.0, 0.0]).unwrap().metric;
        let axes = Axes::split(&[0.0, 0.0], &metric, 1);
        let (s, guess) = (DVector::from_element(1, 0.3), DVector::from_element(1, 0.05));
        let z = axes.at(&s, &guess);
        let reached = axes.search(&PARABOLA, &s, guess.clone(), 0).unwrap().unwrap_err();
        let log_density = PARABOLA.curvature(z.as_slice()).unwrap().log_posterior;
        assert_eq!((reached.stiff, reached.log_density), (guess.clone(), log_density));
        assert!(axes.maximum(&PARABOLA, &s, guess.clone(), 0).is_none());
        assert!(axes.maximum(&PARABOLA, &s, guess, 1).is_some());
    }

    #[test]
    fn the_floor_on_a_kink_follows_it() {
        /// ln p = −150 (b − a²) above the parabola, 50 (b − a²) below, with N(0, 1) priors of a and b.
        const KINK: Known = Known {
            dimension: 2,
            log_likelihood: |z| f64::min(-150.0 * (z[1] - z[0] * z[0]), 50.0 * (z[1] - z[0] * z[0])),
            slope_and_metric: |z| {
                let slope = if z[1] > z[0] * z[0] { -150.0 } else { 50.0 };
                let along = DVector::from_vec(vec![-2.0 * z[0], 1.0]) * slope;
                (along - DVector::from_column_slice(z), DMatrix::identity(2, 2))
            },
        };
        let axes = Axes::split(&[0.0, 0.0], &DMatrix::from_diagonal(&DVector::from_vec(vec![0.5, 1.0])), 1);
        for a in [-1.5, -0.5, 0.0, 1.0] {
            let s = DVector::from_vec(vec![a]);
            let counter = Counter::new(&Silent);
            let floor = axes.maximum(&counter.watch(&KINK), &s, DVector::from_vec(vec![0.3]), 30).unwrap();
            let [x, y] = [0, 1].map(|i| axes.at(&s, &floor.stiff)[i]);
            let evaluations = counter.evaluations().unwrap();
            assert!(evaluations < 24, "{a}: {evaluations} evaluations");
            assert!((y - x * x).abs() < 1e-3, "{x} {y}");
            assert!((floor.log_density + 0.5 * (x * x + y * y)).abs() < 0.05, "{x} {}", floor.log_density);
            // Along b = a²: ln p = −a²/2 − a⁴/2.
            assert!(
                (floor.slope[0] + a + 2.0 * a.powi(3)).abs() < 0.05 * (1.0 + a.abs()),
                "{a} {}",
                floor.slope[0]
            );
            assert!((floor.bend[(0, 0)].abs() - 2.0 * a.abs()).abs() < 1e-2, "{a} {}", floor.bend[(0, 0)]);
            assert!((floor.factor[(0, 0)].powi(2) / (1.0 + 200.0 * 200.0 / 8.0) - 1.0).abs() < 0.01);
        }
    }

    #[test]
    fn a_search_held_up_at_a_wall_is_soon_given_up() {
        /// ln p = 100 b, which ends at b = 0.
        const WALL: Known = Known {
            dimension: 2,
            log_likelihood: |z| if z[1] > 0.0 { f64::NEG_INFINITY } else { 100.0 * z[1] },
            slope_and_metric: |_| {
                let metric = DMatrix::from_diagonal(&DVector::from_vec(vec![0.1, 1.0]));
                (DVector::from_vec(vec![0.0, 100.0]), metric)
            },
        };
        let axes = Axes::split(&[0.0, 0.0], &DMatrix::from_diagonal(&DVector::from_vec(vec![0.1, 1.0])), 1);
        let counter = Counter::new(&Silent);
        let wall = counter.watch(&WALL);
        assert!(axes.maximum(&wall, &DVector::zeros(1), DVector::zeros(1), 1000).is_none());
        let evaluations = counter.evaluations().unwrap();
        assert!((3..20).contains(&evaluations), "{evaluations} evaluations");
    }

    #[test]
    fn there_is_no_floor_where_there_is_no_likelihood() {
        let axes = Axes::split(&[0.0, 0.0], &DMatrix::identity(2, 2), 1);
        const NOTHING: Known = Known {
            dimension: 2,
            log_likelihood: |_| f64::NEG_INFINITY,
            slope_and_metric: |_| unreachable!("there is no likelihood"),
        };
        assert!(axes.maximum(&NOTHING, &DVector::zeros(1), DVector::zeros(1), 30).is_none());
    }
}
