//! Radial functions shared by the NFW and truncated NFW lenses: no cancellation at u → 0, no seam at u = 1.
//!
//! With u = (r/r_s)² and z = 1 − u, everything is built from the entire-looking function
//! A(z) = artanh(√z)/√z (z > 0), arctan(√−z)/√−z (z < 0), A(0) = 1, its divided differences
//! E = (A − 1)/z and H = (A − 3E)/z, and L = ½ ln(u/4). The NFW lens is α ∝ m(u)·θ with
//!
//! u·m = L + A,   u·m′ = E/2 − m,   u²·m″ = −E/2 − H/4 − 2u·m′   (Bartelmann 1996; E/2 is its κ).
//!
//! Four regimes, blended by nothing: inner (u < 0.8), seam, outer (u ≥ 1.25), far (u ≥ 6.8). [`functions`] has them side by
//! side without a branch: told of one regime it is that one's code alone, told of each ray's own it is that of all. Either
//! way a loop over rays becomes SIMD code with the same bits, of one square root and one division a ray.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, SQRT_2};

use crate::numerics::dispatch::kernel;
use crate::numerics::elementary::{
    arctan_series, artanh_series, half_ln_of_reduced, polynomial, reduced_for_ln,
};
use crate::numerics::real::{Each, LANES, Lanes, Real};

/// Below this u the form without cancellation at u → 0 is used.
pub const INNER_END: f64 = 0.8;
/// From this u on the arctan form is used.
pub const OUTER_START: f64 = 1.25;
/// From this u on, √(u−1) ≥ 1 + √2 and the arctan is that of the reciprocal.
pub const FAR_START: f64 = 4.0 + 2.0 * SQRT_2;
/// u is never taken smaller: at the very centre κ diverges as −ln r and is evaluated at r = 1e-15 r_s.
pub const U_FLOOR: f64 = 1e-30;

/// The functions L, A, m, E, H of one radius, and 1/u.
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
    /// 1/u.
    pub inv_u: f64,
}

impl Basis {
    /// (m, u·m′, u²·m″) of the NFW lens.
    #[inline(always)]
    pub fn nfw(&self) -> [f64; 3] {
        let p1 = 0.5 * self.e - self.m;
        [self.m, p1, -0.5 * self.e - 0.25 * self.h - 2.0 * p1]
    }
}

/// Where u lies; outside the other three if none is true.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Regime {
    inner: bool,
    seam: bool,
    far: bool,
}

impl Regime {
    /// [`OUTER_START`] ≤ u < [`FAR_START`].
    pub const OUTER: Self = Self { inner: false, seam: false, far: false };
    /// u < [`INNER_END`].
    pub const INNER: Self = Self { inner: true, ..Self::OUTER };
    /// u ≥ [`FAR_START`].
    pub const FAR: Self = Self { far: true, ..Self::OUTER };

    /// The regime of one u.
    #[inline(always)]
    pub fn of(u: f64) -> Self {
        Self { inner: u < INNER_END, seam: (INNER_END..OUTER_START).contains(&u), far: u >= FAR_START }
    }

    #[inline(always)]
    fn pick(self, inner: f64, seam: f64, outer: f64, far: f64) -> f64 {
        let outside = if self.far { far } else { outer };
        let else_seam = if self.seam { seam } else { outside };
        if self.inner { inner } else { else_seam }
    }
}

/// The regime in which several u lie together, if there is one for which code of its own pays.
pub enum Together {
    /// All below [`INNER_END`].
    Inner,
    /// All from [`OUTER_START`] to [`FAR_START`].
    Outer,
    /// All from [`FAR_START`] on.
    Far,
    /// None of these.
    Mixed,
}

impl Together {
    /// Of several u; that all are far, the usual case, is asked for first.
    #[inline(always)]
    pub fn of<const N: usize>(u: &[f64; N]) -> Self {
        if all_from(u, FAR_START) {
            Self::Far
        } else if all_below(u, INNER_END) {
            Self::Inner
        } else if all_from(u, OUTER_START) && all_below(u, FAR_START) {
            Self::Outer
        } else {
            Self::Mixed
        }
    }
}

// Loops without a way out, since such are vectorised.

#[inline(always)]
fn all_from<const N: usize>(u: &[f64; N], least: f64) -> bool {
    let mut all = true;
    for u in u {
        all &= *u >= least;
    }
    all
}

#[inline(always)]
fn all_below<const N: usize>(u: &[f64; N], limit: f64) -> bool {
    let mut all = true;
    for u in u {
        all &= *u < limit;
    }
    all
}

/// Coefficients of H(z) = −Σ 4(n+1)zⁿ/((2n+3)(2n+5)); at |z| ≤ 0.25 the first left out is 0.25²⁵ ≈ 1e-15·(1/25) of H.
const SEAM_H: [f64; 25] = {
    let mut coefficients = [0.0; 25];
    let mut n = 0;
    while n < 25 {
        let real = n as f64;
        coefficients[n] = -4.0 * (real + 1.0) / ((2.0 * real + 3.0) * (2.0 * real + 5.0));
        n += 1;
    }
    coefficients
};

/// All functions at a u ≥ [`U_FLOOR`] of this regime.
///
/// - inner: m = [−L − ½S(q)]/[w(1+w)] with w = √(1−u), q = u/(2(1+w)), ½S(q) = −ln(1−q)/(2q) = artanh(s)/q, s = q/(2−q);
/// - seam: H by its Taylor series, then E = (1 − zH)/(3 − z) and A = 1 + zE, which lose nothing;
/// - outer: A = arctan(w)/w, w = √(u−1), arctan w = π/4 + arctan((w−1)/(w+1));
/// - far: the same with arctan w = π/2 − arctan(1/w).
#[inline(always)]
pub fn functions(u: f64, at: Regime) -> Basis {
    let (z, above) = (1.0 - u, u - 1.0);
    let w = at.pick(z, 1.0, above, above).sqrt();
    // Divisions limit the ray loop: all reciprocals are made of one.
    let ([numerator, denominator], exponent) = reduced_for_ln(u);
    let first = at.pick(2.0 * (1.0 + w) - 0.5 * u, 3.0 - z, w + 1.0, 1.0);
    let second = at.pick(w * (1.0 + w), 1.0, w, above);
    let of_form = first * second;
    let of_form_and_u = of_form * u;
    let one_over_all = 1.0 / (of_form_and_u * denominator);
    let one_over_form_and_u = one_over_all * denominator;
    let (inv_u, one_over_form) = (one_over_form_and_u * of_form, one_over_form_and_u * u);
    let (inv_first, inv_second) = (one_over_form * second, one_over_form * first);

    // Terms that are known early are added first: a ray waits for each operation that follows the division.
    let l = half_ln_of_reduced(numerator * of_form_and_u * one_over_all, exponent - 2.0);
    let (s, inv_2_minus_q) = (0.5 * u * inv_first, (1.0 + w) * inv_first);
    let m_inner = (-l - inv_2_minus_q * (1.0 + s * s * artanh_series(s * s))) * inv_second;
    let inv_w = at.pick((1.0 + w) * inv_second, 0.0, inv_second, w * inv_second);
    let t = (w - 1.0) * inv_first;
    // t² and t/w; in the far regime they do not wait for w.
    let (z_arctan, t_over_w) = if at.far { (inv_second, -inv_second) } else { (t * t, t * inv_w) };
    let angle = if at.far { FRAC_PI_2 } else { FRAC_PI_4 };
    let a_outside = (angle * inv_w + t_over_w) + t_over_w * z_arctan * arctan_series(z_arctan);
    let h_seam = polynomial(&SEAM_H, z);
    let e_seam = (1.0 - z * h_seam) * inv_first;

    let a_not_inner = if at.seam { 1.0 + z * e_seam } else { a_outside };
    let m = if at.inner { m_inner } else { (l + a_not_inner) * inv_u };
    let a = if at.inner { u * m - l } else { a_not_inner };
    let inv_z = at.pick(inv_w * inv_w, 0.0, -inv_w * inv_w, -inv_second);
    let e = if at.seam { e_seam } else { (a - 1.0) * inv_z };
    let h = if at.seam { h_seam } else { (a - 3.0 * e) * inv_z };
    Basis { l, a, m, e, h, inv_u }
}

/// m(u) at any u ≥ [`U_FLOOR`].
#[inline(always)]
pub fn m<R: Real>(u: R) -> R {
    let [m] = by_regime(u, MAlone);
    m
}

/// (m, u·m′, u²·m″) of the NFW lens at any u ≥ [`U_FLOOR`].
#[inline(always)]
pub fn nfw<R: Real>(u: R) -> [R; 3] {
    by_regime(u, NfwLens)
}

kernel! {
    /// m + u·m′ at each u, the convergence of an NFW lens in units of k, with the bits of [`nfw`].
    pub fn convergences(u: &mut [f64]) {
        for start in (0..u.len()).step_by(LANES) {
            let [m, p1, _] = nfw(Lanes::load(u, start));
            (m + p1).store(u, start);
        }
    }
}

/// (L, A, m) at any u ≥ [`U_FLOOR`].
#[inline(always)]
pub fn l_a_m<R: Real>(u: R) -> [R; 3] {
    by_regime(u, Lam)
}

/// All functions at any u ≥ [`U_FLOOR`], as (L, A, m, E, H, 1/u).
#[inline(always)]
pub fn columns<R: Real>(u: R) -> [R; 6] {
    by_regime(u, Columns)
}

/// All functions at any u ≥ [`U_FLOOR`].
#[inline(always)]
pub fn basis(u: f64) -> Basis {
    columns(u).into()
}

impl From<[f64; 6]> for Basis {
    #[inline(always)]
    fn from([l, a, m, e, h, inv_u]: [f64; 6]) -> Self {
        Self { l, a, m, e, h, inv_u }
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

impl OfBasis<6> for Columns {
    #[inline(always)]
    fn of(self, Basis { l, a, m, e, h, inv_u }: Basis) -> [f64; 6] {
        [l, a, m, e, h, inv_u]
    }
}

/// By the code of one regime where all lanes lie in it.
#[inline(always)]
fn by_regime<R: Real, const N: usize>(u: R, f: impl OfBasis<N>) -> [R; N] {
    macro_rules! at {
        (|$u:ident| $regime:expr) => {{
            struct At<F>(F);
            impl<const N: usize, F: OfBasis<N>> Each<1, N> for At<F> {
                #[inline(always)]
                fn of(&self, [$u]: [f64; 1]) -> [f64; N] {
                    self.0.of(functions($u, $regime))
                }
            }
            R::each([u], &At(f))
        }};
    }
    match Together::of(&u.extent()) {
        Together::Inner => at!(|u| Regime::INNER),
        Together::Outer => at!(|u| Regime::OUTER),
        Together::Far => at!(|u| Regime::FAR),
        Together::Mixed => at!(|u| Regime::of(u)),
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
        let seam = Regime::of(1.0);
        for (u, one, other) in [
            (INNER_END, seam, Regime::INNER),
            (OUTER_START, seam, Regime::OUTER),
            (FAR_START, Regime::OUTER, Regime::FAR),
        ] {
            let [s, other] = [one, other].map(|regime| functions(u, regime));
            for (a, b) in [(s.m, other.m), (s.a, other.a), (s.e, other.e), (s.h, other.h)] {
                assert!((a / b - 1.0).abs() < SEAM, "u = {u}: {a} {b}");
            }
        }
    }

    #[test]
    fn values_at_the_scale_radius() {
        let b = basis(1.0);
        assert!((b.m - (1.0 - std::f64::consts::LN_2)).abs() < 1e-15);
        assert!((b.e - 1.0 / 3.0).abs() < 1e-15 && (b.h + 4.0 / 15.0).abs() < 1e-15);
    }

    #[test]
    fn limits_at_the_centre_are_logarithmic() {
        // m → −L/2 − 1/4, u m′ → −1/4, u² m″ → 1/4.
        for u in [1e-30, 1e-20, 1e-12] {
            let b = basis(u);
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
                    let Basis { l, a, m, e, h, inv_u } = alone;
                    assert_eq!(columns.map(|own| own.0[i]), [l, a, m, e, h, inv_u], "{u}");
                }
            }
        }
    }
}
