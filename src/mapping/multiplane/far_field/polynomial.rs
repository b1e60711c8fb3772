//! A kick that varies smoothly across a bundle: Σ C_ab ϑ^a ϑ̄^b in complex notation, a + b ≤ degree.

use super::taylor::DEGREE_MAX;

const TERMS: usize = (DEGREE_MAX + 1) * (DEGREE_MAX + 2) / 2;

/// Binomial coefficients.
const BINOMIAL: [[f64; DEGREE_MAX + 1]; DEGREE_MAX + 1] = {
    let mut c = [[0.0; DEGREE_MAX + 1]; DEGREE_MAX + 1];
    let mut n = 0;
    while n <= DEGREE_MAX {
        c[n][0] = 1.0;
        let mut k = 1;
        while k <= n {
            c[n][k] = c[n - 1][k - 1] + c[n - 1][k];
            k += 1;
        }
        n += 1;
    }
    c
};

/// (x+iy)^a (x−iy)^b = Σ_j i^j E_abj x^(a+b−j) y^j: Σ_k C(a,k) C(b,j−k) (−1)^(j−k) at `[a][b][j]`.
static EXPANSION: [[[f64; DEGREE_MAX + 1]; DEGREE_MAX + 1]; DEGREE_MAX + 1] = {
    let mut e = [[[0.0; DEGREE_MAX + 1]; DEGREE_MAX + 1]; DEGREE_MAX + 1];
    let mut a = 0;
    while a <= DEGREE_MAX {
        let mut b = 0;
        while a + b <= DEGREE_MAX {
            let mut k = 0;
            while k <= a {
                let mut l = 0;
                while l <= b {
                    let product = BINOMIAL[a][k] * BINOMIAL[b][l];
                    e[a][b][k + l] += if l % 2 == 0 { product } else { -product };
                    l += 1;
                }
                k += 1;
            }
            b += 1;
        }
        a += 1;
    }
    e
};

/// Complex coefficients C_ab, arcsec^(1−a−b), by total degree n = a + b and then by b.
#[derive(Debug, Clone)]
pub(super) struct Polynomial {
    pub degree: usize,
    pub terms: [[f64; 2]; TERMS],
}

impl Default for Polynomial {
    fn default() -> Self {
        Self { degree: 0, terms: [[0.0; 2]; TERMS] }
    }
}

fn times([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a * c - b * d, a * d + b * c]
}

impl Polynomial {
    /// Where C_ab with a + b = `n` is stored.
    #[inline(always)]
    pub const fn index(n: usize, b: usize) -> usize {
        n * (n + 1) / 2 + b
    }

    /// C_ab for 1 ≤ a ≤ b from the others: K = 2∂ψ/∂ϑ̄ with real ψ, so C_ab/(b+1) = conj(C_{b+1,a−1})/a.
    pub fn complete(&mut self) {
        for n in 2..=self.degree {
            for b in n.div_ceil(2)..n {
                let a = n - b;
                let [x, y] = self.terms[Self::index(n, a - 1)];
                let factor = (b + 1) as f64 / a as f64;
                self.terms[Self::index(n, b)] = [factor * x, -factor * y];
            }
        }
    }

    /// Adds another polynomial, `weight`ed.
    pub fn add(&mut self, other: &Self, weight: f64) {
        self.degree = self.degree.max(other.degree);
        let used = Self::index(other.degree + 1, 0);
        for (sum, term) in self.terms[..used].iter_mut().zip(&other.terms[..used]) {
            sum[0] += weight * term[0];
            sum[1] += weight * term[1];
        }
    }

    /// The same polynomial in ϑ′ = ϑ − δ: Σ_a ϑ^a row_a(ϑ̄), first each row shifted, then their sum, by Horner's rule.
    pub fn shifted(&self, delta: [f64; 2]) -> Self {
        const SIDE: usize = DEGREE_MAX + 1;
        let p = self.degree;
        let conjugate = [delta[0], -delta[1]];
        let mut grid = [[[0.0; 2]; SIDE]; SIDE];
        for n in 0..=p {
            for b in 0..=n {
                grid[n - b][b] = self.terms[Self::index(n, b)];
            }
        }
        for (a, row) in grid[..=p].iter_mut().enumerate() {
            let top = p - a;
            for low in 0..top {
                for b in (low..top).rev() {
                    let step = times(row[b + 1], conjugate);
                    row[b] = [row[b][0] + step[0], row[b][1] + step[1]];
                }
            }
        }
        for low in 0..p {
            for a in (low..p).rev() {
                let (before, after) = grid.split_at_mut(a + 1);
                // Row a + 1 reaches as far as degree p allows; the shift keeps the total degree.
                for (term, next) in before[a][..=p - a].iter_mut().zip(&after[0][..p - a]) {
                    let step = times(*next, delta);
                    *term = [term[0] + step[0], term[1] + step[1]];
                }
            }
        }
        let mut shifted = Self { degree: p, ..Self::default() };
        for n in 0..=p {
            for b in 0..=n {
                shifted.terms[Self::index(n, b)] = grid[n - b][b];
            }
        }
        shifted
    }

    /// Takes constant and linear part away and returns them: K(0) and its Hessian (xx, xy, yy).
    pub fn take_linear(&mut self) -> ([f64; 2], [f64; 3]) {
        let [constant, [kappa, _], [re, im]] = [self.terms[0], self.terms[1], self.terms[2]];
        self.terms[..3].fill([0.0; 2]);
        (constant, [kappa + re, im, kappa - re])
    }

    /// Σ|C_ab| ϱ^n of each degree n.
    pub fn sizes(&self, radius_arcsec: f64) -> [f64; DEGREE_MAX + 1] {
        let (mut sizes, mut power) = ([0.0; DEGREE_MAX + 1], 1.0);
        for n in 0..=self.degree {
            let terms = &self.terms[Self::index(n, 0)..Self::index(n + 1, 0)];
            sizes[n] = power * terms.iter().map(|c| (c[0] * c[0] + c[1] * c[1]).sqrt()).sum::<f64>();
            power *= radius_arcsec;
        }
        sizes
    }

    /// Lowers the degree while all that is left out stays below `tolerance` within the radius of `sizes`; returns it.
    pub fn truncate(&mut self, sizes: &[f64; DEGREE_MAX + 1], tolerance: f64) -> f64 {
        let mut left_out = 0.0;
        while self.degree > 1 && left_out + sizes[self.degree] <= tolerance {
            left_out += sizes[self.degree];
            self.degree -= 1;
        }
        self.terms[Self::index(self.degree + 1, 0)..].fill([0.0; 2]);
        left_out
    }

    /// Coefficients of x^i y^j in (K_x, K_y), row by row of j, each row with i = 0 … degree − j.
    pub fn real_rows(&self) -> Vec<[f64; 2]> {
        let p = self.degree;
        let mut rows = vec![[0.0; 2]; (p + 1) * (p + 2) / 2];
        let start = |j: usize| j * (p + 1) - j * j.saturating_sub(1) / 2;
        for n in 2..=p {
            for b in 0..=n {
                let a = n - b;
                let [re, im] = self.terms[Self::index(n, b)];
                for j in 0..=n {
                    let sum = EXPANSION[a][b][j];
                    let [x, y] = match j % 4 {
                        0 => [re, im],
                        1 => [-im, re],
                        2 => [-re, -im],
                        _ => [im, -re],
                    };
                    let row = &mut rows[start(j) + n - j];
                    row[0] += sum * x;
                    row[1] += sum * y;
                }
            }
        }
        rows
    }

    #[cfg(test)]
    pub fn at(&self, v: [f64; 2]) -> [f64; 2] {
        let mut sum = [0.0; 2];
        for n in 0..=self.degree {
            for b in 0..=n {
                let mut product = self.terms[Self::index(n, b)];
                for i in 0..n {
                    product = times(product, if i < b { [v[0], -v[1]] } else { v });
                }
                sum = [sum[0] + product[0], sum[1] + product[1]];
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> Polynomial {
        let mut p = Polynomial { degree: 6, ..Polynomial::default() };
        for (i, term) in p.terms[..Polynomial::index(7, 0)].iter_mut().enumerate() {
            *term = [(i as f64 * 1.7).sin(), (i as f64 * 2.3).cos()];
        }
        p
    }

    #[test]
    fn shifting_changes_coordinates_only() {
        let p = some();
        let shifted = p.shifted([0.3, -0.2]);
        let (a, b) = (p.at([0.5, 0.7]), shifted.at([0.2, 0.9]));
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 1e-13, "{a:?} {b:?}");
    }

    #[test]
    fn real_rows_are_the_terms_from_degree_two() {
        let mut p = some();
        p.terms[..3].fill([0.0; 2]);
        let (x, y) = (0.4_f64, -0.8_f64);
        let (mut sum, mut k) = ([0.0; 2], 0);
        let rows = p.real_rows();
        for j in 0..=6 {
            for i in 0..=6 - j {
                for c in 0..2 {
                    sum[c] += rows[k][c] * x.powi(i) * y.powi(j);
                }
                k += 1;
            }
        }
        let at = p.at([x, y]);
        assert!((at[0] - sum[0]).hypot(at[1] - sum[1]) < 1e-13);
    }
}
