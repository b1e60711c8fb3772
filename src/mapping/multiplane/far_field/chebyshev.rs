//! Polynomials in θ on a rectangle: products of Chebyshev polynomials up to a total degree.

/// A rectangle on the sky, sides along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// Centre in arcsec.
    pub centre_arcsec: [f64; 2],
    /// Half the sides in arcsec.
    pub half_arcsec: [f64; 2],
}

impl Field {
    /// The smallest rectangle around `theta_arcsec`, widened by a millionth so that rounding leaves none outside;
    /// none for no points or points that are not finite.
    pub fn around(theta_arcsec: &[[f64; 2]]) -> Option<Self> {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for theta in theta_arcsec {
            for c in 0..2 {
                low[c] = low[c].min(theta[c]);
                high[c] = high[c].max(theta[c]);
            }
        }
        let half_arcsec = [0, 1].map(|c| 0.5 * (high[c] - low[c]) * (1.0 + 1e-6));
        let centre_arcsec = [0, 1].map(|c| 0.5 * (high[c] + low[c]));
        let finite = theta_arcsec.iter().flatten().all(|v| v.is_finite());
        (finite && !theta_arcsec.is_empty()).then_some(Self { centre_arcsec, half_arcsec })
    }

    /// Half the diagonal, arcsec.
    pub fn radius_arcsec(&self) -> f64 {
        self.half_arcsec[0].hypot(self.half_arcsec[1])
    }

    /// θ in units of the half sides from the centre.
    pub(super) fn scaled(&self, theta: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|c| (theta[c] - self.centre_arcsec[c]) / self.half_arcsec[c])
    }

    /// True for θ inside.
    pub(super) fn contains(&self, theta: [f64; 2]) -> bool {
        (0..2).all(|c| (theta[c] - self.centre_arcsec[c]).abs() <= self.half_arcsec[c])
    }
}

/// Number of products T_a(x)T_b(y) with a + b ≤ degree.
pub(super) const fn terms(degree: usize) -> usize {
    (degree + 1) * (degree + 2) / 2
}

/// Fits values on the n×n Chebyshev nodes of a field; terms in order of total degree.
pub(super) struct Fit {
    n: usize,
    /// T_a(x_i)·(2 or 1)/n at `[a·n + i]`.
    transform: Vec<f64>,
    nodes: Vec<f64>,
}

impl Fit {
    /// Nodes x_i = cos(π(i+½)/n).
    pub fn new(n: usize) -> Self {
        let nodes: Vec<f64> =
            (0..n).map(|i| (std::f64::consts::PI * (i as f64 + 0.5) / n as f64).cos()).collect();
        let mut transform = Vec::with_capacity(n * n);
        for a in 0..n {
            for i in 0..n {
                let norm = if a == 0 { 1.0 } else { 2.0 } / n as f64;
                transform.push(norm * (std::f64::consts::PI * a as f64 * (i as f64 + 0.5) / n as f64).cos());
            }
        }
        Self { n, transform, nodes }
    }

    /// The nodes in arcsec, x fastest.
    pub fn nodes_arcsec(&self, field: &Field) -> Vec<[f64; 2]> {
        let at = |c: usize, i: usize| field.centre_arcsec[c] + field.half_arcsec[c] * self.nodes[i];
        (0..self.n * self.n).map(|k| [at(0, k % self.n), at(1, k / self.n)]).collect()
    }

    /// Coefficients of T_a(x)T_b(y) for a, b < n at `[a·n + b]`.
    fn coefficients(&self, values: impl Fn(usize) -> f64) -> Vec<f64> {
        let n = self.n;
        let mut rows = vec![0.0; n * n];
        for j in 0..n {
            let line: Vec<f64> = (0..n).map(|i| values(j * n + i)).collect();
            for a in 0..n {
                rows[a * n + j] = (0..n).map(|i| self.transform[a * n + i] * line[i]).sum();
            }
        }
        let coefficient =
            |k: usize| (0..n).map(|j| self.transform[(k % n) * n + j] * rows[(k / n) * n + j]).sum::<f64>();
        (0..n * n).map(coefficient).collect()
    }

    /// The coefficients by total degree up to `degree_max`, and for each degree d the sum of |those above d|.
    ///
    /// |T_a T_b| ≤ 1, so that sum bounds what leaving them out does anywhere in the field.
    pub fn by_degree(&self, values: impl Fn(usize) -> f64, degree_max: usize) -> (Vec<f64>, Vec<f64>) {
        let (n, all) = (self.n, self.coefficients(values));
        let (mut kept, mut sizes) = (Vec::with_capacity(terms(degree_max)), vec![0.0; 2 * n - 1]);
        for (total, size) in sizes.iter_mut().enumerate() {
            for b in total.saturating_sub(n - 1)..=total.min(n - 1) {
                let c = all[(total - b) * n + b];
                *size += c.abs();
                if total <= degree_max {
                    kept.push(c);
                }
            }
        }
        let mut left_out = vec![0.0; degree_max + 1];
        let mut sum: f64 = sizes[degree_max + 1..].iter().sum();
        for d in (0..=degree_max).rev() {
            left_out[d] = sum;
            sum += sizes[d];
        }
        (kept, left_out)
    }

    /// All n² coefficients, and the sum of |those with a or b in the last two places|.
    pub fn all(&self, values: impl Fn(usize) -> f64) -> (Vec<f64>, f64) {
        let (n, all) = (self.n, self.coefficients(values));
        let last = (0..n * n).filter(|k| (k / n).max(k % n) + 2 >= n).map(|k| all[k].abs()).sum();
        (all, last)
    }
}

/// T_0(x) … T_15(x).
#[inline(always)]
pub(super) fn chebyshev(x: f64) -> [f64; 16] {
    let mut t = [1.0; 16];
    t[1] = x;
    for a in 2..16 {
        t[a] = 2.0 * x * t[a - 1] - t[a - 2];
    }
    t
}

/// Values of the products at one scaled point, in the order of [`Fit::by_degree`].
pub(super) fn basis(degree: usize, point: [f64; 2], mut set: impl FnMut(usize, f64)) {
    let (tx, ty) = (chebyshev(point[0]), chebyshev(point[1]));
    let mut k = 0;
    for total in 0..=degree {
        for b in 0..=total {
            set(k, tx[total - b] * ty[b]);
            k += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polynomial_is_reproduced_and_what_is_left_out_bounds_the_error() {
        let field = Field { centre_arcsec: [0.3, -1.0], half_arcsec: [2.0, 0.7] };
        let fit = Fit::new(7);
        let nodes = fit.nodes_arcsec(&field);
        let f = |t: [f64; 2]| 0.3 + t[0] * t[1] * t[1] - 0.2 * t[0].powi(4) + 0.01 * (t[0] * t[1]).powi(3);
        for (degree, exact) in [(6, true), (4, false)] {
            let (c, left_out) = fit.by_degree(|i| f(nodes[i]), degree);
            let left_out = left_out[degree];
            assert_eq!(c.len(), terms(degree));
            let mut worst = 0.0_f64;
            for i in 0..100 {
                let p = [(i as f64 * 0.7).sin(), (i as f64 * 1.3).cos()];
                let theta = [0, 1].map(|k| field.centre_arcsec[k] + field.half_arcsec[k] * p[k]);
                let mut sum = 0.0;
                basis(degree, p, |k, b| sum += c[k] * b);
                worst = worst.max((sum - f(theta)).abs());
            }
            assert!(worst <= left_out + 1e-13, "{degree} {worst:e} {left_out:e}");
            assert!(exact == (left_out < 1e-12), "{degree} {left_out:e}");
        }
    }
}
