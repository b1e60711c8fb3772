//! What merging kicks did to a bundle, measured at Chebyshev nodes and taken back as a polynomial.

use super::field::Field;

/// Nodes a side: cos(πk/4), the ends included.
pub(super) const SIDE: usize = 5;
/// Nodes of a tile.
pub(super) const NODES: usize = SIDE * SIDE;

/// A difference of β as products of Chebyshev polynomials T_a(x)T_b(y), a, b ≤ 4, on a tile.
#[derive(Clone)]
pub(super) struct Correction {
    inv_half: [f64; 2],
    /// Coefficients (x, y) at `[a·SIDE + b]`.
    coefficients: [[f64; 2]; NODES],
    /// What the last coefficients leave to expect of those that are missing, arcsec.
    pub error_arcsec: f64,
}

fn node(k: usize) -> f64 {
    [1.0, std::f64::consts::FRAC_1_SQRT_2, 0.0, -std::f64::consts::FRAC_1_SQRT_2, -1.0][k]
}

/// T_0 … T_4.
#[inline(always)]
fn chebyshev(x: f64) -> [f64; SIDE] {
    let square = x * x;
    [1.0, x, 2.0 * square - 1.0, x * (4.0 * square - 3.0), 8.0 * square * (square - 1.0) + 1.0]
}

impl Correction {
    /// The nodes as offsets from the centre of a tile.
    pub fn nodes(tile: &Field) -> [[f64; 2]; NODES] {
        std::array::from_fn(|k| [tile.half_arcsec[0] * node(k % SIDE), tile.half_arcsec[1] * node(k / SIDE)])
    }

    /// Interpolates differences at the nodes.
    ///
    /// Interpolation aliases what it cannot hold onto the coefficients it has and is off by at most twice the sum of
    /// those missing; they are taken to be no larger than the sum of the last kept, a or b = 4.
    pub fn through(tile: &Field, differences: &[[f64; 2]; NODES]) -> Self {
        let half = |k: usize| if k == 0 || k == SIDE - 1 { 0.5 } else { 1.0 };
        let weight = |a: usize, k: usize| 2.0 / (SIDE - 1) as f64 * half(a) * half(k) * chebyshev(node(k))[a];
        let mut coefficients = [[0.0; 2]; NODES];
        for (index, coefficient) in coefficients.iter_mut().enumerate() {
            let (a, b) = (index / SIDE, index % SIDE);
            for (k, difference) in differences.iter().enumerate() {
                let w = weight(a, k % SIDE) * weight(b, k / SIDE);
                *coefficient = [coefficient[0] + w * difference[0], coefficient[1] + w * difference[1]];
            }
        }
        let last = |i: &usize| (i / SIDE).max(i % SIDE) == SIDE - 1;
        let sum = |c: usize| (0..NODES).filter(last).map(|i| coefficients[i][c].abs()).sum::<f64>();
        let inv_half = tile.half_arcsec.map(|h| if h > 0.0 { 1.0 / h } else { 0.0 });
        Self { inv_half, coefficients, error_arcsec: 2.0 * sum(0).hypot(sum(1)) }
    }

    /// The difference at an offset from the centre.
    #[inline(always)]
    pub fn at(&self, offset: [f64; 2]) -> [f64; 2] {
        let (tx, ty) = (chebyshev(offset[0] * self.inv_half[0]), chebyshev(offset[1] * self.inv_half[1]));
        let mut sum = [0.0; 2];
        for a in 0..SIDE {
            for b in 0..SIDE {
                let product = tx[a] * ty[b];
                let [x, y] = self.coefficients[a * SIDE + b];
                sum = [sum[0] + x * product, sum[1] + y * product];
            }
        }
        sum
    }

    /// ∂/∂θ of the difference (xx, xy, yx, yy) and its second derivatives, as in a bundle of rays.
    pub fn derivatives(&self, offset: [f64; 2]) -> ([f64; 4], [f64; 6]) {
        let scaled = [offset[0] * self.inv_half[0], offset[1] * self.inv_half[1]];
        let first =
            |x: f64, s: f64| [0.0, s, 4.0 * x * s, (12.0 * x * x - 3.0) * s, (32.0 * x * x - 16.0) * x * s];
        let second =
            |x: f64, s: f64| [0.0, 0.0, 4.0 * s * s, 24.0 * x * s * s, (96.0 * x * x - 16.0) * s * s];
        let [t, d, dd] = [
            scaled.map(chebyshev),
            [0, 1].map(|c| first(scaled[c], self.inv_half[c])),
            [0, 1].map(|c| second(scaled[c], self.inv_half[c])),
        ];
        let (mut jacobian, mut seconds) = ([0.0; 4], [0.0; 6]);
        for a in 0..SIDE {
            for b in 0..SIDE {
                let by = [d[0][a] * t[1][b], t[0][a] * d[1][b]];
                let twice = [dd[0][a] * t[1][b], d[0][a] * d[1][b], t[0][a] * dd[1][b]];
                for c in 0..2 {
                    let coefficient = self.coefficients[a * SIDE + b][c];
                    for j in 0..2 {
                        jacobian[2 * c + j] += coefficient * by[j];
                    }
                    for j in 0..3 {
                        seconds[3 * c + j] += coefficient * twice[j];
                    }
                }
            }
        }
        (jacobian, seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quartic_comes_back_with_its_derivatives() {
        let tile = Field { centre_arcsec: [5.0, 6.0], half_arcsec: [0.5, 2.0] };
        let f = |[x, y]: [f64; 2]| [x * x * x * y - 0.3 * y.powi(4), 1.0 + x * y * y];
        let correction = Correction::through(&tile, &Correction::nodes(&tile).map(f));
        let (x, y) = (0.2, -1.1);
        let at = correction.at([x, y]);
        assert!((at[0] - f([x, y])[0]).abs() < 1e-13 && (at[1] - f([x, y])[1]).abs() < 1e-13);
        let (a, b) = correction.derivatives([x, y]);
        assert!(
            (a[0] - 3.0 * x * x * y).abs() < 1e-12 && (a[1] - (x * x * x - 1.2 * y.powi(3))).abs() < 1e-12
        );
        assert!((b[0] - 6.0 * x * y).abs() < 1e-11 && (b[1] - 3.0 * x * x).abs() < 1e-11);
        assert!((b[2] + 3.6 * y * y).abs() < 1e-11 && (b[5] - 2.0 * x).abs() < 1e-11);
    }
}
