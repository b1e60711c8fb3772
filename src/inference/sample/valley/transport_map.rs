//! Coordinates in which a bent valley is straight.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::known_maximum::KnownMaximum;

/// s = c + V u with u_j = f_j(x_1 … x_(j−1)) + w_j x_j: V are principal axes of s, the widest first, f_j a polynomial that says where
/// the valley runs in direction j given the wider ones, and w_j its width there. A triangular transport map (Parno & Marzouk 2018,
/// SIAM/ASA J. Uncertainty Quantification 6, 645): under it the posterior is nearly N(0, 1), and volumes change by one factor everywhere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct TransportMap {
    centre: DVector<f64>,
    axes: DMatrix<f64>,
    monomials: Monomials,
    /// Of f_j in row j, a column for each monomial.
    coefficients: DMatrix<f64>,
    widths: DVector<f64>,
}

impl TransportMap {
    /// By the shape of the valley at floors, each with its weight; of many every so many, at most 250. `None` where there is none with
    /// a curvature that is positive definite.
    ///
    /// ln p about a floor is normal: with L Lᵀ the covariance of u there and g the slope, the mean of u_j given u_1 … u_(j−1) is
    /// u_j + L_jj (Lᵀ g)_j, and its slopes are known as well. f_j is fitted to both by least squares.
    pub fn fit(floors: &[(&KnownMaximum, f64)]) -> Option<Self> {
        const MOST: usize = 250;
        let kept = floors.iter().step_by(floors.len().div_ceil(MOST).max(1));
        let local: Vec<_> = kept
            .filter_map(|(k, weight)| Some((*k, k.metric.clone().cholesky()?.inverse(), *weight)))
            .collect();
        let d = local.first()?.0.s.len();
        let sum: f64 = local.iter().map(|(.., weight)| weight).sum();
        let centre = local.iter().map(|(k, _, weight)| &k.s * (weight / sum)).sum::<DVector<f64>>();
        let mut covariance = DMatrix::zeros(d, d);
        for (k, own, weight) in &local {
            let offset = &k.s - &centre;
            covariance.ger(weight / sum, &offset, &offset, 1.0);
            covariance += own * (weight / sum);
        }
        let eigen = covariance.symmetric_eigen();
        let mut widest_first: Vec<usize> = (0..d).collect();
        widest_first.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let axes = eigen.eigenvectors.select_columns(&widest_first);
        let places = local.iter().map(|(k, own, weight)| Place::of(k, own, weight / sum, (&centre, &axes)));
        let mut places: Vec<Place> = places.collect::<Option<_>>()?;
        let monomials = Monomials::of(d);
        let mut map = Self {
            coefficients: DMatrix::zeros(d, monomials.factors.len()),
            widths: DVector::zeros(d),
            centre,
            axes,
            monomials,
        };
        (0..d).try_for_each(|j| map.fit_direction(j, &mut places))?;
        Some(map)
    }

    /// f_j and w_j, and x_j at all places.
    fn fit_direction(&mut self, j: usize, places: &mut [Place]) -> Option<()> {
        /// Of what one floor a deviation from the rest says.
        const RIDGE: f64 = 1e-3;
        let monomials = self.monomials.of_first(j);
        let variance: f64 = places.iter().map(|place| place.weight * place.width(j).powi(2)).sum();
        let mut matrix = DMatrix::identity(monomials.len(), monomials.len()) * (RIDGE / variance);
        let mut vector = DVector::zeros(monomials.len());
        for place in &*places {
            let weight = place.weight / (place.width(j).powi(2) + variance);
            let mut add = |row: &DVector<f64>, value: f64| {
                matrix.ger(weight, row, row, 1.0);
                vector.axpy(weight * value, row, 1.0);
            };
            add(&values(monomials, &place.x), place.mean(j));
            for (i, slope) in place.slopes(j).into_iter().enumerate() {
                add(&derivatives(monomials, &place.x, i), slope);
            }
        }
        let row = matrix.cholesky()?.solve(&vector);
        let left: Vec<f64> =
            places.iter().map(|place| place.u[j] - values(monomials, &place.x).dot(&row)).collect();
        // Chains that stand still are nowhere else.
        let spread: f64 = places.iter().zip(&left).map(|(place, left)| place.weight * left * left).sum();
        let width = spread.max(variance).sqrt();
        for (place, left) in places.iter_mut().zip(left) {
            let by_x = (0..j).map(|i| derivatives(monomials, &place.x, i).dot(&row));
            place.jacobian.push(by_x.chain([width]).collect());
            place.x.push(left / width);
        }
        self.coefficients.view_mut((j, 0), (1, row.len())).tr_copy_from(&row);
        self.widths[j] = width;
        (width > 0.0 && width.is_finite() && row.iter().all(|c| c.is_finite())).then_some(())
    }

    /// s of x.
    pub fn s(&self, x: &DVector<f64>) -> DVector<f64> {
        let middle = &self.coefficients * values(&self.monomials.factors, x.as_slice());
        &self.centre + &self.axes * (middle + self.widths.component_mul(x))
    }

    /// x of s.
    pub fn x(&self, s: &DVector<f64>) -> DVector<f64> {
        let u = self.axes.tr_mul(&(s - &self.centre));
        let mut x = vec![];
        for j in 0..s.len() {
            let values = values(self.monomials.of_first(j), &x);
            let middle = self.coefficients.view((j, 0), (1, values.len())).tr_dot(&values);
            x.push((u[j] - middle) / self.widths[j]);
        }
        DVector::from_vec(x)
    }

    /// Whether all shapes are those of so many slow directions.
    pub fn fits(&self, slow: usize) -> bool {
        self.monomials == Monomials::of(slow)
            && (self.centre.len(), self.widths.len(), self.axes.shape()) == (slow, slow, (slow, slow))
            && self.coefficients.shape() == (slow, self.monomials.factors.len())
    }
}

/// One, all coordinates but the last, their products of two, and of three of the first three. Those of the first j coordinates come
/// before those in which a later one is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Monomials {
    /// The coordinates of each, the last first, and [`ONE`].
    factors: Vec<[usize; 3]>,
}

/// A factor of one.
const ONE: usize = usize::MAX;

impl Monomials {
    fn of(dimension: usize) -> Self {
        const CUBIC: usize = 3;
        let mut factors = vec![[ONE; 3]];
        for i in 0..dimension.saturating_sub(1) {
            factors.push([i, ONE, ONE]);
            for k in 0..=i {
                factors.push([i, k, ONE]);
                factors.extend((0..=k).filter(|_| i < CUBIC).map(|l| [i, k, l]));
            }
        }
        Self { factors }
    }

    fn of_first(&self, j: usize) -> &[[usize; 3]] {
        &self.factors[..self.factors.partition_point(|factors| factors[0] == ONE || factors[0] < j)]
    }
}

fn factor(x: &[f64], i: usize) -> f64 {
    if i == ONE { 1.0 } else { x[i] }
}

fn values(monomials: &[[usize; 3]], x: &[f64]) -> DVector<f64> {
    let of = |factors: &[usize; 3]| factors.iter().map(|i| factor(x, *i)).product();
    DVector::from_iterator(monomials.len(), monomials.iter().map(of))
}

/// By x_i.
fn derivatives(monomials: &[[usize; 3]], x: &[f64], i: usize) -> DVector<f64> {
    let of = |[a, b, c]: &[usize; 3]| {
        let without =
            |own: usize, [p, q]: [usize; 2]| if own == i { factor(x, p) * factor(x, q) } else { 0.0 };
        without(*a, [*b, *c]) + without(*b, [*a, *c]) + without(*c, [*a, *b])
    };
    DVector::from_iterator(monomials.len(), monomials.iter().map(of))
}

/// The valley at one floor, where u is normal.
struct Place {
    /// Of all weights, which add up to one.
    weight: f64,
    u: DVector<f64>,
    /// L, L⁻¹ and Lᵀ g.
    factor: DMatrix<f64>,
    inverse: DMatrix<f64>,
    pull: DVector<f64>,
    /// x and the rows of du/dx of the directions that are fitted.
    x: Vec<f64>,
    jacobian: Vec<Vec<f64>>,
}

impl Place {
    fn of(
        known: &KnownMaximum,
        covariance: &DMatrix<f64>,
        weight: f64,
        (centre, axes): (&DVector<f64>, &DMatrix<f64>),
    ) -> Option<Self> {
        let factor = axes.tr_mul(&(covariance * axes)).cholesky()?.l();
        let inverse = factor.clone().try_inverse()?;
        let pull = factor.tr_mul(&axes.tr_mul(&known.slope));
        let u = axes.tr_mul(&(&known.s - centre));
        Some(Self { weight, u, factor, inverse, pull, x: vec![], jacobian: vec![] })
    }

    /// Deviation of u_j given those before.
    fn width(&self, j: usize) -> f64 {
        self.factor[(j, j)]
    }

    /// Mean of u_j given those before.
    fn mean(&self, j: usize) -> f64 {
        self.u[j] + self.factor[(j, j)] * self.pull[j]
    }

    /// Slopes of that mean by x_1 … x_(j−1).
    fn slopes(&self, j: usize) -> Vec<f64> {
        let by_u = |i: usize| -self.factor[(j, j)] * self.inverse[(j, i)];
        (0..j).map(|x| (x..j).map(|i| by_u(i) * self.jacobian[i][x]).sum()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A valley along s_1 ~ N(0, ½): s_2 is s_1² + N(0, 0.01) and s_3 is s_1³ + s_1 s_2 + N(0, 0.003).
    fn floor(s: [f64; 3]) -> KnownMaximum {
        let [x, y, z] = s;
        let (b, c) = ((y - x * x) / 0.01, (z - x.powi(3) - x * y) / 0.003);
        let residuals = DVector::from_vec(vec![x / 0.5, b, c]);
        let jacobian = DMatrix::from_row_slice(
            3,
            3,
            &[2.0, 0.0, 0.0, -200.0 * x, 100.0, 0.0, -(y + 3.0 * x * x) / 0.003, -x / 0.003, 1.0 / 0.003],
        );
        KnownMaximum {
            s: DVector::from_column_slice(&s),
            log_marginal: -0.5 * residuals.norm_squared(),
            half_log_determinant: 0.0,
            slope: -jacobian.tr_mul(&residuals),
            metric: jacobian.tr_mul(&jacobian),
            stiff: DVector::zeros(0),
            bend: DMatrix::zeros(0, 3),
        }
    }

    /// Points with residuals of a deviation and less.
    fn on_the_valley(i: u32) -> [f64; 3] {
        let [a, b, c] = [0.7, 1.9, 3.1].map(|frequency| (frequency * f64::from(i)).sin());
        let x = 0.7 * a;
        let y = x * x + 0.01 * b;
        [x, y, x.powi(3) + x * y + 0.003 * c]
    }

    fn map(count: u32) -> TransportMap {
        let floors: Vec<_> = (0..count).map(|i| floor(on_the_valley(i))).collect();
        TransportMap::fit(&floors.iter().map(|floor| (floor, 1.0)).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn a_bent_valley_is_straight_and_as_wide_as_one() {
        // Ten floors tell: each knows slopes too. Others lie where these say.
        let map = map(10);
        for i in 100..200 {
            let x = map.x(&DVector::from_column_slice(&on_the_valley(i)));
            assert!(x.amax() < 2.0, "{i} {x}");
        }
        // In straight coordinates, whatever they are, the third would be a hundred deviations off.
        let spread = (100..200).map(|i| on_the_valley(i)[2].powi(2)).sum::<f64>() / 100.0;
        assert!(spread.sqrt() > 30.0 * 0.003);
    }

    #[test]
    fn there_and_back_is_the_same_and_volumes_keep_their_ratio() {
        let map = map(20);
        let at = |x: [f64; 3]| map.s(&DVector::from_column_slice(&x));
        const STEP: f64 = 1e-6;
        let volume = |x: [f64; 3]| {
            let column = |i: usize| {
                let mut there = x;
                there[i] += STEP;
                (at(there) - at(x)) / STEP
            };
            DMatrix::from_columns(&[column(0), column(1), column(2)]).determinant().abs()
        };
        for x in [[0.0, 0.0, 0.0], [1.5, -0.7, 0.3], [-2.0, 1.0, 2.0]] {
            assert!((map.x(&at(x)) - DVector::from_column_slice(&x)).amax() < 1e-9);
            assert!((volume(x) / volume([0.0; 3]) - 1.0).abs() < 1e-4, "{}", volume(x));
        }
        assert!(map.fits(3) && !map.fits(2));
    }

    #[test]
    fn chains_that_stand_still_make_no_map_without_width() {
        let still = floor(on_the_valley(3));
        let map = TransportMap::fit(&[(&still, 1.0); 30]).unwrap();
        let moved = map.s(&(map.x(&still.s) + DVector::from_element(3, 1.0))) - &still.s;
        assert!(moved.amax() > 0.1, "{moved}");
        let flat = KnownMaximum { metric: DMatrix::zeros(3, 3), ..still };
        assert_eq!(TransportMap::fit(&[(&flat, 1.0)]), None);
    }
}
