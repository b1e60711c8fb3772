//! The deflection of an NFW halo as a Taylor polynomial about a ray, and the bound on what it leaves out.
//!
//! In complex notation (t the ray's offset from the centre, ϑ the small angle from the ray) K = f·k·m(u)·(t + ϑ) with
//! u = u₀XY, X = 1 + ϑ/t, Y = 1 + ϑ̄/t̄, so that K = f·k·t·Σ c_ab (ϑ/t)^a (ϑ̄/t̄)^b with real
//! c_ab = Σ_j m_j (b+1) j!/[(j−b)!(a+b−j)!(j+1−a)!], m_j = u₀^j m⁽ʲ⁾(u₀)/j!.

use super::polynomial::Polynomial;

/// Highest total degree in ϑ and ϑ̄.
pub(super) const DEGREE_MAX: usize = 10;
const COLUMNS: usize = DEGREE_MAX + 1;

const fn factorial(n: usize) -> f64 {
    let (mut product, mut i) = (1.0, 2);
    while i <= n {
        product *= i as f64;
        i += 1;
    }
    product
}

/// (b+1) j!/[(j−b)!(a+b−j)!(j+1−a)!] at `[a][b][j]`.
static WEIGHTS: [[[f64; COLUMNS]; COLUMNS]; COLUMNS] = {
    let mut w = [[[0.0; COLUMNS]; COLUMNS]; COLUMNS];
    let mut a = 0;
    while a < COLUMNS {
        let mut b = 0;
        while a + b < COLUMNS {
            let mut j = if b + 1 > a { b } else { a - 1 };
            while j <= a + b {
                w[a][b][j] = (b + 1) as f64 * factorial(j)
                    / (factorial(j - b) * factorial(a + b - j) * factorial(j + 1 - a));
                j += 1;
            }
            b += 1;
        }
        a += 1;
    }
    w
};

/// Taylor coefficients m_j = u₀^j m⁽ʲ⁾(u₀)/j! of the NFW law up to `degree`.
///
/// B = u·m = L + A obeys −2(1−u)B′ + B = 1 + ½ln(u/4) (from A's own equation 2zA′ + A = 1/(1−z)). Its recursion runs
/// upwards; near u = 1, where that divides by 1 − u, downwards.
fn radial_taylor(u0: f64, m0: f64, degree: usize) -> [f64; COLUMNS] {
    /// Steps above the degree from which the downward recursion has forgotten its start (each halves the error).
    const STEPS: usize = 55;
    let log_coefficient = |j: usize| if j % 2 == 1 { 0.5 / j as f64 } else { -0.5 / j as f64 };
    let mut b = [0.0; COLUMNS];
    b[0] = u0 * m0;
    let ratio = (1.0 - u0) / u0;
    if ratio.abs() < 0.5 {
        let mut above = 0.0;
        for j in (1..=degree + STEPS).rev() {
            let here = (2.0 * ratio * (j + 1) as f64 * above + log_coefficient(j)) / (2 * j + 1) as f64;
            if j <= degree {
                b[j] = here;
            }
            above = here;
        }
    } else {
        let scale = 0.5 / ratio;
        for j in 0..degree {
            let source = if j == 0 { 1.0 + 0.5 * (0.25 * u0).ln() } else { log_coefficient(j) };
            b[j + 1] = ((2 * j + 1) as f64 * b[j] - source) * scale / (j + 1) as f64;
        }
    }
    let inv_u0 = 1.0 / u0;
    let mut m = [0.0; COLUMNS];
    m[0] = m0;
    for j in 1..=degree {
        m[j] = b[j] * inv_u0 - m[j - 1];
    }
    m
}

/// One halo near a ray: offset of the ray from its centre, strength and m there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expansion {
    pub t_arcsec: [f64; 2],
    pub fk: f64,
    pub u: f64,
    pub m: f64,
    pub degree: usize,
}

impl Expansion {
    /// Adds the terms of degree 2 and more, `weight`ed, to `left` and, with the rest of the weight, to `right`.
    ///
    /// Only terms a = 0 and a > b: [`Polynomial::complete`] finds the others, since K is a gradient.
    pub fn add_to(&self, weight: f64, left: &mut Polynomial, right: &mut Polynomial) {
        let m = radial_taylor(self.u, self.m, self.degree);
        let [tx, ty] = self.t_arcsec;
        let inv_d = 1.0 / tx.hypot(ty);
        // Powers of t/|t|, and of its conjugate below the middle.
        let unit = [tx * inv_d, ty * inv_d];
        let mut phases = [[1.0, 0.0]; DEGREE_MAX + 2];
        for d in 1..=self.degree + 1 {
            let [x, y] = phases[d - 1];
            phases[d] = [x * unit[0] - y * unit[1], x * unit[1] + y * unit[0]];
        }
        left.degree = left.degree.max(self.degree);
        right.degree = right.degree.max(self.degree);
        let mut scale = self.fk * inv_d;
        for n in 2..=self.degree {
            for b in 0..=n {
                let a = n - b;
                if a != 0 && a <= b {
                    continue;
                }
                let row = &WEIGHTS[a][b];
                let first = b.max(a.saturating_sub(1));
                let c: f64 = scale * (first..=n).map(|j| row[j] * m[j]).sum::<f64>();
                let [x, y] = if b + 1 >= a {
                    phases[b + 1 - a]
                } else {
                    let [x, y] = phases[a - b - 1];
                    [x, -y]
                };
                let (l, r) = (weight * c, c - weight * c);
                let k = Polynomial::index(n, b);
                left.terms[k][0] += l * x;
                left.terms[k][1] += l * y;
                right.terms[k][0] += r * x;
                right.terms[k][1] += r * y;
            }
            scale *= inv_d;
        }
    }
}

/// The lowest degree p whose remainder α x^(p+1)[(2p+3) − (2p+1)x]/(1−x)² is at most `tolerance`, with the remainder;
/// x = ϱ/D is the radius of the bundle over the distance of the halo, α the deflection on the central ray.
///
/// m(u) = ∫dμ(τ)/(u+τ) with positive μ (Stieltjes), so a halo is a sum of softened point masses whose Taylor
/// coefficients along any line are Chebyshev polynomials of the second kind: |c_n| ≤ (2n+1)·α/Dⁿ.
pub(super) fn lowest_degree(alpha: f64, x: f64, tolerance: f64) -> Option<(usize, f64)> {
    /// Beyond this the series converges too slowly.
    const NEAREST: f64 = 0.6;
    if !(x < NEAREST) {
        return None;
    }
    let mut power = alpha * x / ((1.0 - x) * (1.0 - x));
    for p in 1..=DEGREE_MAX {
        power *= x;
        let remainder = power * ((2 * p + 3) as f64 - (2 * p + 1) as f64 * x);
        if remainder <= tolerance {
            return Some((p, remainder));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::mass::nfw_radial;

    #[test]
    fn the_radial_series_is_that_of_m() {
        for u0 in [1e-8, 1e-3, 0.3, 0.66, 0.7, 0.999, 1.0, 1.3, 1.99, 2.1, 7.0, 300.0, 1e7] {
            let series = radial_taylor(u0, nfw_radial::m(u0), DEGREE_MAX);
            for h in [-0.03, 0.02] {
                let sum = series.iter().rev().fold(0.0, |sum, c| sum * h + c);
                let exact = nfw_radial::m(u0 * (1.0 + h));
                assert!((sum / exact - 1.0).abs() < 1e-12, "{u0} {h} {sum} {exact}");
            }
        }
    }

    #[test]
    fn polynomials_follow_the_halo_within_the_stated_remainder() {
        let mut tightest = 0.0_f64;
        for (i, d) in [0.01, 0.3, 1.0, 1.1, 3.0, 40.0].into_iter().enumerate() {
            let t = [d * (1.0 + i as f64).cos(), d * (1.0 + i as f64).sin()];
            let (fk, x) = (0.7, 0.2);
            let kick = |v: [f64; 2]| {
                let p = [t[0] + v[0], t[1] + v[1]];
                let m = nfw_radial::m(p[0] * p[0] + p[1] * p[1]);
                p.map(|p| fk * m * p)
            };
            for tolerance in [1e-2, 1e-4, 1e-6] {
                let m = nfw_radial::m(d * d);
                let alpha = fk * m * d;
                let (degree, remainder) = lowest_degree(alpha, x, tolerance * alpha).unwrap();
                let (mut both, mut rest) = (Polynomial::default(), Polynomial::default());
                Expansion { t_arcsec: t, fk, u: d * d, m, degree }.add_to(1.0, &mut both, &mut rest);
                both.complete();
                let basis = nfw_radial::basis(d * d).nfw();
                let mut worst = 0.0_f64;
                for j in 0..24 {
                    let v = [x * d * (j as f64 * 0.2618).cos(), x * d * (j as f64 * 0.2618).sin()];
                    let radial = crate::profile::mass::RadialDerivatives {
                        k: fk,
                        m: basis[0],
                        p1: basis[1],
                        p2: basis[2],
                    };
                    let h = radial.hessian(t.map(|t| t / d));
                    let linear = [h[0] * v[0] + h[1] * v[1], h[1] * v[0] + h[2] * v[1]];
                    let (nonlinear, at, start) = (both.at(v), kick(v), kick([0.0; 2]));
                    let error = [0, 1].map(|c| at[c] - start[c] - linear[c] - nonlinear[c]);
                    worst = worst.max(error[0].hypot(error[1]));
                }
                assert!(worst <= remainder + 1e-14 * alpha, "{d} {degree} {worst:e} {remainder:e}");
                tightest = tightest.max(worst / remainder);
            }
        }
        assert!(tightest > 0.1, "the bound is far too weak: {tightest}");
    }
}
