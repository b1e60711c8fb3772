//! Radial functions shared by the NFW and truncated NFW lenses: no cancellation at u → 0, no seam at u = 1.
//!
//! With u = (r/r_s)² and z = 1 − u, everything is built from the entire-looking function
//! A(z) = artanh(√z)/√z (z > 0), arctan(√−z)/√−z (z < 0), A(0) = 1, its divided differences
//! E = (A − 1)/z and H = (A − 3E)/z, and L = ½ ln(u/4). The NFW lens is α ∝ m(u)·θ with
//!
//! u·m = L + A,   u·m′ = E/2 − m,   u²·m″ = −E/2 − H/4 − 2u·m′   (Bartelmann 1996; E/2 is its κ).
//!
//! Four regimes, blended by nothing: `inner` (u < 0.8), `seam`, `outer` (u ≥ 1.25), `far` (u ≥ 7). Each is
//! branch-free, so a loop over rays inside one regime becomes SIMD code with the same bits.

use crate::numerics::elementary::{arctan, arctan_over_argument, artanh_over_argument, ln};
use crate::numerics::real::{Each, Real};

/// Below this u the form without cancellation at u → 0 is used.
pub const INNER_END: f64 = 0.8;
/// From this u on the arctan form is used.
pub const OUTER_START: f64 = 1.25;
/// From this u on, √(u−1) > 1 + √2 and the form with few divisions is used.
pub const FAR_START: f64 = 7.0;
/// u is never taken smaller: at the very centre κ diverges as −ln r and is evaluated at r = 1e-15 r_s.
pub const U_FLOOR: f64 = 1e-30;

/// The functions L, A, m, E, H of one radius.
#[derive(Debug, Clone, Copy)]
pub struct Basis {
    /// L = ½ ln(u/4).
    pub l: f64,
    /// A(1 − u).
    pub a: f64,
    /// m = (L + A)/u.
    pub m: f64,
    /// E = (A − 1)/(1 − u), twice the NFW convergence in units of k.
    pub e: f64,
    /// H = (A − 3E)/(1 − u).
    pub h: f64,
}

impl Basis {
    /// (m, u·m′, u²·m″) of the NFW lens.
    #[inline(always)]
    pub fn nfw(&self) -> [f64; 3] {
        let p1 = 0.5 * self.e - self.m;
        [self.m, p1, -0.5 * self.e - 0.25 * self.h - 2.0 * p1]
    }
}

/// L = ½ ln(u/4) at any u ≥ [`U_FLOOR`], which every form below starts from.
#[inline(always)]
pub fn l<R: Real>(u: R) -> R {
    ln(u * 0.25) * 0.5
}

/// All functions for u < [`INNER_END`]: m = [−L − ½S(q)]/[w(1+w)], w = √(1−u), q = u/(2(1+w)), S = −ln(1−q)/q.
#[inline(always)]
pub fn inner(u: f64, l: f64) -> Basis {
    let w = (1.0 - u).sqrt();
    let q = 0.5 * u / (1.0 + w);
    let inv = 1.0 / (2.0 - q);
    let s = q * inv;
    let m = (-l - inv * artanh_over_argument(s * s)) / (w * (1.0 + w));
    let inv_z = 1.0 / (1.0 - u);
    let a = u * m - l;
    let e = (a - 1.0) * inv_z;
    Basis { l, a, m, e, h: (a - 3.0 * e) * inv_z }
}

/// All functions for [`OUTER_START`] ≤ u < [`FAR_START`].
#[inline(always)]
pub fn outer(u: f64, l: f64) -> Basis {
    let (w, inv_z) = ((u - 1.0).sqrt(), 1.0 / (1.0 - u));
    let a = arctan(w) / w;
    let e = (a - 1.0) * inv_z;
    Basis { l, a, m: (l + a) / u, e, h: (a - 3.0 * e) * inv_z }
}

/// All functions for u ≥ [`FAR_START`]: with v = 1/(u−1), A = (π/2)√v − v·arctan(√v)/√v.
///
/// Divisions limit the ray loop, so 1/u and v share one.
#[inline(always)]
pub fn far(u: f64, l: f64) -> Basis {
    let both = 1.0 / (u * (u - 1.0));
    let (inv_u, v) = ((u - 1.0) * both, u * both);
    let a = std::f64::consts::FRAC_PI_2 * v.sqrt() - v * arctan_over_argument(v);
    let e = (1.0 - a) * v;
    Basis { l, a, m: (l + a) * inv_u, e, h: (3.0 * e - a) * v }
}

/// All functions for [`INNER_END`] ≤ u < [`OUTER_START`]: H by its Taylor series
/// −Σ 4(n+1)zⁿ/((2n+3)(2n+5)), then E = (1 − zH)/(3 − z) and A = 1 + zE, which lose nothing.
#[inline(always)]
pub fn seam(u: f64, l: f64) -> Basis {
    /// |z| ≤ 0.25: the first term left out is below 0.25²⁴ ≈ 4e-15·(1/24) of H.
    const TERMS: usize = 25;
    let z = 1.0 - u;
    let mut h = 0.0;
    for n in (0..TERMS).rev() {
        let n = n as f64;
        h = h * z - 4.0 * (n + 1.0) / ((2.0 * n + 3.0) * (2.0 * n + 5.0));
    }
    let e = (1.0 - z * h) / (3.0 - z);
    let a = 1.0 + z * e;
    Basis { l, a, m: (l + a) / u, e, h }
}

/// m(u) at any u ≥ [`U_FLOOR`].
#[inline(always)]
pub fn m<R: Real>(u: R) -> R {
    let [m] = by_regime(u, l(u), MAlone);
    m
}

/// (m, u·m′, u²·m″) of the NFW lens at any u ≥ [`U_FLOOR`].
#[inline(always)]
pub fn nfw<R: Real>(u: R) -> [R; 3] {
    by_regime(u, l(u), NfwLens)
}

/// (L, A, m) at any u ≥ [`U_FLOOR`].
#[inline(always)]
pub fn l_a_m<R: Real>(u: R) -> [R; 3] {
    by_regime(u, l(u), Lam)
}

/// All functions at any u ≥ [`U_FLOOR`], as (L, A, m, E, H).
#[inline(always)]
pub fn columns<R: Real>(u: R) -> [R; 5] {
    by_regime(u, l(u), Columns)
}

/// All functions at any u ≥ [`U_FLOOR`].
#[inline(always)]
pub fn basis(u: f64) -> Basis {
    with_l(u, l(u))
}

/// All functions at any u ≥ [`U_FLOOR`], of which L is known.
#[inline(always)]
pub fn with_l(u: f64, l: f64) -> Basis {
    if u < INNER_END {
        inner(u, l)
    } else if u >= FAR_START {
        far(u, l)
    } else if u >= OUTER_START {
        outer(u, l)
    } else {
        seam(u, l)
    }
}

impl From<[f64; 5]> for Basis {
    #[inline(always)]
    fn from([l, a, m, e, h]: [f64; 5]) -> Self {
        Self { l, a, m, e, h }
    }
}

/// What is made of the functions of one radius.
trait OfBasis<const N: usize>: Copy {
    fn of(self, basis: Basis) -> [f64; N];
}

#[derive(Clone, Copy)]
struct MAlone;

impl OfBasis<1> for MAlone {
    #[inline(always)]
    fn of(self, basis: Basis) -> [f64; 1] {
        [basis.m]
    }
}

#[derive(Clone, Copy)]
struct NfwLens;

impl OfBasis<3> for NfwLens {
    #[inline(always)]
    fn of(self, basis: Basis) -> [f64; 3] {
        basis.nfw()
    }
}

#[derive(Clone, Copy)]
struct Lam;

impl OfBasis<3> for Lam {
    #[inline(always)]
    fn of(self, basis: Basis) -> [f64; 3] {
        [basis.l, basis.a, basis.m]
    }
}

#[derive(Clone, Copy)]
struct Columns;

impl OfBasis<5> for Columns {
    #[inline(always)]
    fn of(self, Basis { l, a, m, e, h }: Basis) -> [f64; 5] {
        [l, a, m, e, h]
    }
}

/// A form is evaluated, in all lanes, where its regime has any of them.
#[inline(always)]
fn by_regime<R: Real, const N: usize>(u: R, l: R, f: impl OfBasis<N>) -> [R; N] {
    macro_rules! form {
        ($basis:path) => {{
            struct Form<F>(F);
            impl<const N: usize, F: OfBasis<N>> Each<2, N> for Form<F> {
                #[inline(always)]
                fn of(&self, [u, l]: [f64; 2]) -> [f64; N] {
                    self.0.of($basis(u, l))
                }
            }
            R::each([u, l], &Form(f))
        }};
    }
    let [least, largest] = u.extent();
    if largest < INNER_END {
        return form!(inner);
    }
    let mut all = [R::splat(0.0); N];
    if largest >= FAR_START {
        all = form!(far);
    }
    if least < FAR_START && largest >= OUTER_START {
        put_below(&mut all, u, FAR_START, form!(outer));
    }
    if least < OUTER_START {
        put_below(&mut all, u, OUTER_START, form!(seam));
    }
    if least < INNER_END {
        put_below(&mut all, u, INNER_END, form!(inner));
    }
    all
}

/// `form` where u is below `limit`.
#[inline(always)]
fn put_below<R: Real, const N: usize>(all: &mut [R; N], u: R, limit: f64, form: [R; N]) {
    for i in 0..N {
        all[i] = all[i].or_below(u, limit, form[i]);
    }
}

/// ½∫₀ᵘ m du′·2 = L² − zA², the potential in units of k r_s²/2, without cancellation at u → 0.
pub fn potential(u: f64) -> f64 {
    let b = basis(u);
    if u < INNER_END {
        let um = u * b.m;
        u * b.l * b.l + (1.0 - u) * um * (2.0 * b.l - um)
    } else {
        b.l * b.l - (1.0 - u) * b.a * b.a
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::real::{LANES, Lanes};

    /// A few rounding errors of the regime with the larger cancellation.
    const SEAM: f64 = 3e-14;

    #[test]
    fn regimes_agree_where_they_meet() {
        for (u, s, other) in [
            (INNER_END, seam as fn(f64, f64) -> Basis, inner as fn(f64, f64) -> Basis),
            (OUTER_START, seam, outer),
            (FAR_START, outer, far),
        ] {
            let [s, other] = [s(u, l(u)), other(u, l(u))];
            for (a, b) in [(s.m, other.m), (s.a, other.a), (s.e, other.e), (s.h, other.h)] {
                assert!((a / b - 1.0).abs() < SEAM, "u = {u}: {a} {b}");
            }
        }
    }

    #[test]
    fn values_at_the_scale_radius() {
        let b = seam(1.0, l(1.0));
        assert!((b.m - (1.0 - std::f64::consts::LN_2)).abs() < 1e-15);
        assert!((b.e - 1.0 / 3.0).abs() < 1e-15 && (b.h + 4.0 / 15.0).abs() < 1e-15);
    }

    #[test]
    fn limits_at_the_centre_are_logarithmic() {
        // m → −L/2 − 1/4, u m′ → −1/4, u² m″ → 1/4.
        for u in [1e-30, 1e-20, 1e-12] {
            let b = inner(u, l(u));
            let [m, p1, p2] = b.nfw();
            assert!((m - (-0.5 * b.l - 0.25)).abs() < 1e-10);
            assert!((p1 + 0.25).abs() < 1e-10 && (p2 - 0.25).abs() < 1e-10, "{u:e} {p1} {p2}");
        }
    }

    #[test]
    fn fast_and_full_m_have_the_same_bits_in_lanes_and_alone() {
        let u: Vec<f64> = (-400..400).map(|i| (f64::from(i) * 0.05).exp()).collect();
        // Lanes over few regimes and over all.
        for step in [1, 23] {
            for start in 0..u.len() - LANES * step {
                let lanes = Lanes(std::array::from_fn(|i| u[start + step * i]));
                let (fast, full, columns) = (m(lanes), nfw(lanes), columns(lanes));
                for (i, u) in lanes.0.into_iter().enumerate() {
                    let alone = basis(u);
                    assert_eq!([m(u), fast.0[i]], [alone.m; 2], "{u}");
                    assert_eq!(full.map(|own| own.0[i]), alone.nfw(), "{u}");
                    let Basis { l, a, m, e, h } = alone;
                    assert_eq!(columns.map(|own| own.0[i]), [l, a, m, e, h], "{u}");
                }
            }
        }
    }
}
