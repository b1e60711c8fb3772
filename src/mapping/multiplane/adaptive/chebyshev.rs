//! Functions on a square as sums of Chebyshev polynomials, with derivatives, many rays in SIMD lanes.

use std::sync::LazyLock;

use super::field::Field;

/// Rays that travel together.
pub(super) const LANES: usize = 32;
/// One number a ray.
pub(super) type Lanes = [f64; LANES];

/// Nodes a side of the finer grid: paths of rays are of degree 8 in each coordinate.
pub(super) const SIDE: usize = 9;
/// Nodes a side of the coarser grid, every other one of the finer: rows are of degree 4.
pub(super) const ROW_SIDE: usize = 5;

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

/// The nodes cos(πk/8) of the finer grid on a square, x fastest.
pub(super) fn nodes(square: &Field) -> Vec<[f64; 2]> {
    let at = |k: usize| {
        let node = [cosine(SIDE, k % SIDE), cosine(SIDE, k / SIDE)];
        [0, 1].map(|c| square.centre_arcsec[c] + square.half_arcsec[c] * node[c])
    };
    (0..SIDE * SIDE).map(at).collect()
}

/// Number in the finer grid of node `k` of the coarser.
pub(super) fn fine_number(k: usize) -> usize {
    2 * (k % ROW_SIDE) + 2 * SIDE * (k / ROW_SIDE)
}

/// The value at node 0 of the coarser grid, a corner, from the others: that for which no T_4(x)T_4(y) is needed.
///
/// What is missed is 64 times that coefficient, of total degree 8 in a function resolved to degree 4.
pub(super) fn corner(value: impl Fn(usize) -> f64) -> f64 {
    let half = |k: usize| if k == 0 || k == ROW_SIDE - 1 { 0.5 } else { 1.0 };
    let term = |k: usize| {
        let (x, y) = (k % ROW_SIDE, k / ROW_SIDE);
        let sign = if (x + y) % 2 == 0 { 1.0 } else { -1.0 };
        sign * half(x) * half(y) * value(k)
    };
    -4.0 * (1..ROW_SIDE * ROW_SIDE).map(term).sum::<f64>()
}

/// T_a and its derivatives with respect to θ at the rays of a block: `[coordinate][derivative][a]`.
pub(super) struct Basis([[[Lanes; SIDE]; 3]; 2]);

impl Basis {
    pub fn zero() -> Self {
        Self([[[[0.0; LANES]; SIDE]; 3]; 2])
    }

    /// At most [`LANES`] rays of a square; lanes beyond repeat the last.
    pub fn at<const ORDER: usize>(square: &Field, theta_arcsec: &[[f64; 2]]) -> Self {
        let mut basis = Self::zero();
        let last = theta_arcsec.len() - 1;
        basis.set::<ORDER>(square, |c, i| theta_arcsec[i.min(last)][c]);
        basis
    }

    /// Sets what that order needs; coordinate `c` of ray `i` is `theta(c, i)`.
    #[inline(always)]
    pub fn set<const ORDER: usize>(&mut self, square: &Field, theta: impl Fn(usize, usize) -> f64) {
        for (c, [values, first, second]) in self.0.iter_mut().enumerate() {
            let scale = 1.0 / square.half_arcsec[c];
            for i in 0..LANES {
                let x = scale * (theta(c, i) - square.centre_arcsec[c]);
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

/// `C` functions Σ c_ab T_a(x)T_b(y), a + b ≤ degree; b fastest.
pub(super) struct Series<const C: usize> {
    side: usize,
    degree: usize,
    terms: Vec<[f64; C]>,
}

impl<const C: usize> Series<C> {
    /// Interpolates values at the nodes of the finer grid; see [`Self::coarse`].
    pub fn fine(values: &[[f64; C]], scale: [f64; C], tolerance: f64) -> Self {
        Self::within(&grid(&FINE, values), scale, tolerance)
    }

    /// Interpolates values at the nodes of the coarser grid.
    ///
    /// The highest total degrees are left out as long as their terms, each times its `scale`, add up to at most
    /// `tolerance`.
    pub fn coarse(values: &[[f64; C]], scale: [f64; C], tolerance: f64) -> Self {
        Self::within(&grid(&COARSE, values), scale, tolerance)
    }

    fn within<const N: usize>(grid: &[[[f64; C]; N]; N], scale: [f64; C], tolerance: f64) -> Self {
        let mut sizes = [0.0; 2 * SIDE];
        for (a, row) in grid.iter().enumerate() {
            for (b, term) in row.iter().enumerate() {
                sizes[a + b] += (0..C).map(|c| scale[c] * term[c].abs()).fold(0.0, f64::max);
            }
        }
        let (mut degree, mut left_out) = (N, 0.0);
        while degree > 0 && left_out + sizes[degree] <= tolerance {
            left_out += sizes[degree];
            degree -= 1;
        }
        Self::of_degree(grid, degree)
    }

    fn of_degree<const N: usize>(grid: &[[[f64; C]; N]; N], degree: usize) -> Self {
        let mut terms = Vec::with_capacity(N * N);
        for (a, row) in grid.iter().enumerate().take(degree + 1) {
            terms.extend(row.iter().take(degree + 1 - a));
        }
        Self { side: N, degree, terms }
    }

    /// Sums the series for a block of rays.
    #[inline(always)]
    pub fn at<const ORDER: usize>(&self, basis: &Basis, jet: &mut Jet<C>) {
        let ([x, dx, ddx], [y, dy, ddy]) = (&basis.0[0], &basis.0[1]);
        self.sum(x, y, &mut jet.value);
        if ORDER >= 1 {
            self.sum(dx, y, &mut jet.first[0]);
            self.sum(x, dy, &mut jet.first[1]);
        }
        if ORDER >= 2 {
            self.sum(ddx, y, &mut jet.second[0]);
            self.sum(dx, dy, &mut jet.second[1]);
            self.sum(x, ddy, &mut jet.second[2]);
        }
    }

    #[inline(always)]
    fn sum(&self, x: &[Lanes; SIDE], y: &[Lanes; SIDE], out: &mut [Lanes; C]) {
        // 64 sums stay in registers.
        match C {
            8 => self.sum_by::<8>(x, y, out),
            _ => self.sum_by::<32>(x, y, out),
        }
    }

    /// Σ_a x_a Σ_b c_ab y_b, `WIDTH` rays at a time.
    #[inline(always)]
    fn sum_by<const WIDTH: usize>(&self, x: &[Lanes; SIDE], y: &[Lanes; SIDE], out: &mut [Lanes; C]) {
        for block in 0..LANES / WIDTH {
            let block_of = |lanes: &Lanes| lanes.as_chunks::<WIDTH>().0[block];
            let mut total = [[0.0; WIDTH]; C];
            let mut terms = self.terms.as_slice();
            for (a, x) in x.iter().enumerate().take(self.side.min(self.degree + 1)) {
                let (row, rest) = terms.split_at(self.side.min(self.degree + 1 - a));
                terms = rest;
                let mut inner = [[0.0; WIDTH]; C];
                for (term, y) in row.iter().zip(y) {
                    let y = block_of(y);
                    for c in 0..C {
                        for i in 0..WIDTH {
                            inner[c][i] += term[c] * y[i];
                        }
                    }
                }
                let x = block_of(x);
                for c in 0..C {
                    for i in 0..WIDTH {
                        total[c][i] += x[i] * inner[c][i];
                    }
                }
            }
            for c in 0..C {
                out[c][block * WIDTH..(block + 1) * WIDTH].copy_from_slice(&total[c]);
            }
        }
    }
}

/// Coefficients of T_a(x)T_b(y) at `[a][b]` of the interpolant of values at nodes.
fn grid<const C: usize, const N: usize>(weights: &[[f64; N]; N], values: &[[f64; C]]) -> [[[f64; C]; N]; N] {
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
    for (row, sums) in rows.iter().zip(&mut grid) {
        for (b, sum) in sums.iter_mut().enumerate() {
            for l in 0..N {
                for c in 0..C {
                    sum[c] += weights[b][l] * row[l][c];
                }
            }
        }
    }
    grid
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_comes_back_with_its_derivatives() {
        let square = Field { centre_arcsec: [5.0, 6.0], half_arcsec: [2.0, 2.0] };
        let f = |[x, y]: [f64; 2]| [(x - 5.0).powi(3) * y - 0.3 * (y - 6.0).powi(4), 1.0 + x * y * y];
        let values: Vec<[f64; 2]> = nodes(&square).into_iter().map(f).collect();
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
    fn the_coarse_grid_holds_cubics_and_knows_its_corner() {
        let square = Field { centre_arcsec: [0.0; 2], half_arcsec: [1.5; 2] };
        let fine = nodes(&square);
        let f = |k: usize| {
            let [x, y] = fine[fine_number(k)];
            [1.0 + x * x * y - y]
        };
        let values: Vec<[f64; 1]> = (0..ROW_SIDE * ROW_SIDE).map(f).collect();
        assert!((corner(|k| values[k][0]) - values[0][0]).abs() < 1e-13);
        let mut jet = Jet::zero();
        let series = Series::coarse(&values, [1.0], 1e-13);
        series.at::<0>(&Basis::at::<0>(&square, &[[0.7, -1.1]]), &mut jet);
        assert!((jet.value[0][0] - (1.0 - 0.49 * 1.1 + 1.1)).abs() < 1e-13 && series.degree == 3);
    }
}
