//! Functions on a square as sums of Chebyshev polynomials, with derivatives, many rays in SIMD lanes.

use std::sync::LazyLock;

use super::field::Field;

/// Rays that travel together.
pub(super) const LANES: usize = 32;
/// One number a ray.
pub(super) type Lanes = [f64; LANES];
/// Lanes that stay in registers while a series is summed.
const CHUNK: usize = 8;

/// Nodes a side of the finer grid: paths of rays are of degree 7 in each coordinate.
pub(super) const SIDE: usize = 8;
/// Nodes a side of the coarser grid: rows are of degree 3.
pub(super) const ROW_SIDE: usize = 4;

/// cos(πj/(side − 1)) for the nodes and for the values of T_a at node k, j = a·k.
fn cosine(side: usize, j: usize) -> f64 {
    (std::f64::consts::PI * j as f64 / (side - 1) as f64).cos()
}

/// Coefficient a of an interpolant from the value at node k: (2/n)·γ_a γ_k T_a(x_k), γ = ½ at the ends, n = side − 1.
fn weights<const N: usize>() -> [[f64; N]; N] {
    let half = |k: usize| if k == 0 || k == N - 1 { 0.5 } else { 1.0 };
    std::array::from_fn(|a| {
        std::array::from_fn(|k| 2.0 / (N - 1) as f64 * half(a) * half(k) * cosine(N, a * k))
    })
}

static FINE: LazyLock<[[f64; SIDE]; SIDE]> = LazyLock::new(weights);
static COARSE: LazyLock<[[f64; ROW_SIDE]; ROW_SIDE]> = LazyLock::new(weights);

/// The nodes cos(πk/(side − 1)) of a square, x fastest.
pub(super) fn nodes(square: &Field, side: usize) -> Vec<[f64; 2]> {
    let at = |k: usize| {
        let node = [cosine(side, k % side), cosine(side, k / side)];
        [0, 1].map(|c| square.centre_arcsec[c] + square.half_arcsec[c] * node[c])
    };
    (0..side * side).map(at).collect()
}

/// T_a and its derivatives with respect to θ at the rays of a block: `[coordinate][derivative][a]`.
pub(super) struct Basis([[[Lanes; SIDE]; 3]; 2]);

impl Basis {
    /// At most [`LANES`] rays of a square; lanes beyond repeat the last.
    #[inline(always)]
    pub fn at<const ORDER: usize>(square: &Field, theta_arcsec: &[[f64; 2]]) -> Self {
        let mut basis = [[[[0.0; LANES]; SIDE]; 3]; 2];
        let last = theta_arcsec.len() - 1;
        for c in 0..2 {
            let scale = 1.0 / square.half_arcsec[c];
            let [values, first, second] = &mut basis[c];
            for i in 0..LANES {
                let x = scale * (theta_arcsec[i.min(last)][c] - square.centre_arcsec[c]);
                values[0][i] = 1.0;
                values[1][i] = x;
                first[1][i] = scale;
                for a in 2..SIDE {
                    values[a][i] = 2.0 * x * values[a - 1][i] - values[a - 2][i];
                }
                if ORDER >= 1 {
                    for a in 2..SIDE {
                        first[a][i] =
                            2.0 * (scale * values[a - 1][i] + x * first[a - 1][i]) - first[a - 2][i];
                        second[a][i] =
                            2.0 * (2.0 * scale * first[a - 1][i] + x * second[a - 1][i]) - second[a - 2][i];
                    }
                }
            }
        }
        Self(basis)
    }
}

/// Value, first derivatives (x, y) and second derivatives (xx, xy, yy) of `C` functions.
pub(super) struct Jet<const C: usize> {
    pub value: [Lanes; C],
    pub first: [[Lanes; C]; 2],
    pub second: [[Lanes; C]; 3],
}

impl<const C: usize> Jet<C> {
    pub fn zero() -> Self {
        Self { value: [[0.0; LANES]; C], first: [[[0.0; LANES]; C]; 2], second: [[[0.0; LANES]; C]; 3] }
    }
}

/// `C` functions Σ c_ab T_a(x)T_b(y), a + b ≤ degree; b runs fastest.
pub(super) struct Series<const C: usize> {
    side: usize,
    degree: usize,
    terms: Vec<[f64; C]>,
}

impl<const C: usize> Series<C> {
    /// Interpolates values at the nodes of the finer grid; see [`Self::coarse`].
    pub fn fine(values: &[[f64; C]], scale: [f64; C], tolerance: f64) -> Self {
        Self::through(&*FINE, values, scale, tolerance)
    }

    /// Interpolates values at the nodes of the coarser grid.
    ///
    /// The highest total degrees are left out as long as their terms, each times its `scale`, add up to at most
    /// `tolerance`.
    pub fn coarse(values: &[[f64; C]], scale: [f64; C], tolerance: f64) -> Self {
        Self::through(&*COARSE, values, scale, tolerance)
    }

    fn through<const N: usize>(
        weights: &[[f64; N]; N],
        values: &[[f64; C]],
        scale: [f64; C],
        tolerance: f64,
    ) -> Self {
        let mut rows = [[[0.0; C]; N]; N];
        for (a, row) in rows.iter_mut().enumerate() {
            for (l, sum) in row.iter_mut().enumerate() {
                for k in 0..N {
                    for c in 0..C {
                        sum[c] += weights[a][k] * values[k + N * l][c];
                    }
                }
            }
        }
        let mut grid = [[[0.0; C]; N]; N];
        let mut sizes = [0.0; 2 * SIDE];
        for a in 0..N {
            for b in 0..N {
                let sum = &mut grid[a][b];
                for l in 0..N {
                    for c in 0..C {
                        sum[c] += weights[b][l] * rows[a][l][c];
                    }
                }
                sizes[a + b] += (0..C).map(|c| scale[c] * sum[c].abs()).fold(0.0, f64::max);
            }
        }
        let (mut degree, mut left_out) = (2 * (N - 1), 0.0);
        while degree > 0 && left_out + sizes[degree] <= tolerance {
            left_out += sizes[degree];
            degree -= 1;
        }
        let mut series = Self { side: N, degree, terms: Vec::new() };
        for (a, row) in grid.iter().enumerate().take(degree + 1) {
            series.terms.extend_from_slice(&row[..series.row(a)]);
        }
        series
    }

    /// Number of terms with T_a(x).
    #[inline(always)]
    fn row(&self, a: usize) -> usize {
        self.side.min(self.degree + 1 - a)
    }

    /// Sums the series for a block of rays.
    #[inline(always)]
    pub fn at<const ORDER: usize>(&self, basis: &Basis, jet: &mut Jet<C>) {
        let [x, y] = &basis.0;
        for start in (0..LANES).step_by(CHUNK) {
            let of = |lanes: &Lanes| -> [f64; CHUNK] { std::array::from_fn(|i| lanes[start + i]) };
            let mut value = [[0.0; CHUNK]; C];
            let mut first = [[[0.0; CHUNK]; C]; 2];
            let mut second = [[[0.0; CHUNK]; C]; 3];
            let mut terms = self.terms.as_slice();
            for a in 0..self.side.min(self.degree + 1) {
                let (row, rest) = terms.split_at(self.row(a));
                terms = rest;
                let mut inner = [[[0.0; CHUNK]; C]; 3];
                for (b, term) in row.iter().enumerate() {
                    for (d, inner) in inner.iter_mut().enumerate().take(ORDER + 1) {
                        let t = of(&y[d][b]);
                        for c in 0..C {
                            for i in 0..CHUNK {
                                inner[c][i] += term[c] * t[i];
                            }
                        }
                    }
                }
                let t: [[f64; CHUNK]; 3] = std::array::from_fn(|d| of(&x[d][a]));
                for c in 0..C {
                    for i in 0..CHUNK {
                        value[c][i] += t[0][i] * inner[0][c][i];
                        if ORDER >= 1 {
                            first[0][c][i] += t[1][i] * inner[0][c][i];
                            first[1][c][i] += t[0][i] * inner[1][c][i];
                        }
                        if ORDER >= 2 {
                            second[0][c][i] += t[2][i] * inner[0][c][i];
                            second[1][c][i] += t[1][i] * inner[1][c][i];
                            second[2][c][i] += t[0][i] * inner[2][c][i];
                        }
                    }
                }
            }
            for c in 0..C {
                jet.value[c][start..start + CHUNK].copy_from_slice(&value[c]);
                if ORDER >= 1 {
                    for j in 0..2 {
                        jet.first[j][c][start..start + CHUNK].copy_from_slice(&first[j][c]);
                    }
                }
                if ORDER >= 2 {
                    for j in 0..3 {
                        jet.second[j][c][start..start + CHUNK].copy_from_slice(&second[j][c]);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_comes_back_with_its_derivatives() {
        let square = Field { centre_arcsec: [5.0, 6.0], half_arcsec: [2.0, 2.0] };
        let f = |[x, y]: [f64; 2]| [(x - 5.0).powi(3) * y - 0.3 * (y - 6.0).powi(4), 1.0 + x * y * y];
        let values: Vec<[f64; 2]> = nodes(&square, SIDE).into_iter().map(f).collect();
        let series = Series::fine(&values, [1.0; 2], 1e-12);
        assert_eq!(series.degree, 4);
        let (x, y) = (5.2, 4.9);
        let mut jet = Jet::zero();
        series.at::<2>(&Basis::at::<2>(&square, &[[x, y]]), &mut jet);
        let close = |a: &[f64; LANES], b: f64| assert!((a[3] - b).abs() < 1e-10, "{} {b}", a[3]);
        let (u, v) = (x - 5.0, y - 6.0);
        close(&jet.value[0], f([x, y])[0]);
        close(&jet.value[1], f([x, y])[1]);
        close(&jet.first[0][0], 3.0 * u * u * y);
        close(&jet.first[1][0], u.powi(3) - 1.2 * v.powi(3));
        close(&jet.second[0][0], 6.0 * u * y);
        close(&jet.second[1][0], 3.0 * u * u);
        close(&jet.second[2][0], -3.6 * v * v);
        close(&jet.second[2][1], 2.0 * x);
    }

    #[test]
    fn the_coarse_grid_holds_cubics() {
        let square = Field { centre_arcsec: [0.0; 2], half_arcsec: [1.5; 2] };
        let values: Vec<[f64; 1]> =
            nodes(&square, ROW_SIDE).into_iter().map(|[x, y]| [1.0 + x * x * y - y]).collect();
        let mut jet = Jet::zero();
        let series = Series::coarse(&values, [1.0], 1e-13);
        series.at::<0>(&Basis::at::<0>(&square, &[[0.7, -1.1]]), &mut jet);
        assert!((jet.value[0][0] - (1.0 - 0.49 * 1.1 + 1.1)).abs() < 1e-13 && series.degree == 3);
    }
}
