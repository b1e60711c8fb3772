//! The smoothly truncated NFW lens ρ ∝ x⁻¹(1+x)⁻²·τ²/(τ²+x²) (Baltz, Marshall & Oguri 2009, eqs. A.6–A.10).

use std::f64::consts::PI;

use super::nfw::{ALPHA_RS, Nfw, SCALE_RADIUS, resolved_scale_radius};
use super::nfw_radial::{self, Basis};
use super::radial::{Radial, RadialLaw, by_scale};
use crate::error::Result;
use crate::numerics::elementary::{ln, ln_1p};
use crate::numerics::quadrature::integrate;
use crate::numerics::real::Each;
use crate::numerics::real::Real;
use crate::profile::parameter::{Name, Parameter, PriorShape, exactly, placed_ellipse};

/// Truncated NFW halo: the NFW halo of (r_s, α_Rs) cut off around r_t = τ r_s, as lenstronomy's `TNFW`.
///
/// `alpha_rs_arcsec` is the deflection at r_s of the halo *before* truncation, so that τ → ∞ is [`super::Nfw`].
/// Total mass is finite: α → k r_s² M∞/r, M∞ = τ²/(τ²+1)²·[(τ²−1)ln τ + πτ − (τ²+1)].
pub type TruncatedNfw = Radial<TruncatedNfwLaw>;

/// The radial law of the truncated NFW lens, scale radius r_s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruncatedNfwLaw {
    /// Truncation radius over scale radius.
    tau: f64,
}

/// Truncation radius of an NFW halo.
const TRUNCATION_RADIUS: Parameter = Parameter {
    name: "r_trunc",
    label: "R_{t}",
    usual_prior: PriorShape::Uniform([0.5, 100.0]),
    ..Parameter::RADIUS
};

impl RadialLaw for TruncatedNfwLaw {
    const NAMES: &'static [Name] = &[Name { name: "TNFW", held: &[("e1", 0.0), ("e2", 0.0)] }];
    const PARAMETERS: &'static [Parameter] = &placed_ellipse![SCALE_RADIUS, ALPHA_RS, TRUNCATION_RADIUS];

    fn of_parameters(values: &[f64]) -> Result<TruncatedNfw> {
        let [r_s, alpha_rs, r_trunc, e1, e2, x, y] = exactly(values)?;
        TruncatedNfw::new(r_s, alpha_rs, r_trunc, [x, y])?.with_elliptical_potential([e1, e2])
    }

    #[inline(always)]
    fn radial<R: Real>(&self, u: R) -> [R; 3] {
        truncated(u, &Whole(Truncation::at(self.tau)))
    }

    fn potential(&self, u: f64) -> f64 {
        potential(u, self.tau)
    }

    #[inline(always)]
    fn m<R: Real>(&self, u: R) -> R {
        let [l, a, nfw] = nfw_radial::l_a_m(u);
        let [m] = R::each([u, l, a, nfw], &MAlone(Truncation::at(self.tau)));
        m
    }

    #[inline(always)]
    fn respond<R: Real>(&self, u: R, k: f64, scale_arcsec: f64) -> ([R; 2], [R; 3]) {
        let [m, p1, by_tau] = truncated(u, &WithTau(Truncation::at(self.tau)));
        let (by_tau, scale) = (by_tau * k, R::splat(scale_arcsec));
        let by_r_s = by_scale(p1, k, scale_arcsec) - m * k / scale - by_tau * self.tau / scale;
        ([m, p1], [by_r_s, m * Nfw::strength(scale_arcsec, 1.0), by_tau / scale])
    }
}

/// What the radial functions of all radii at one τ share.
///
/// With s = √(τ²+u), v = u/(2τ(s+τ)), L_t = ln(√u/(s+τ)) = L − ln τ − ln(1+v), C = τ²/(τ²+1)²:
/// m = C{(τ²−1)[m_NFW + L_t/(τ(s+τ)) − ln(1+v)/u] + 2A − π/(s+τ)};
/// d(um)/du = κ/k = C{A + (τ²+1)E/2 + [−π + (τ²−1)L_t/τ]/(2s)}.
#[derive(Clone, Copy)]
pub struct Truncation {
    tau: f64,
    inv_tau: f64,
    ln_tau: f64,
    norm: f64,
}

impl Truncation {
    /// Of a halo with τ = r_t/r_s.
    #[inline(always)]
    pub fn at(tau: f64) -> Self {
        let t2 = tau * tau;
        Self { tau, inv_tau: 1.0 / tau, ln_tau: ln(tau), norm: t2 / ((t2 + 1.0) * (t2 + 1.0)) }
    }

    /// m of the truncated lens, L_t and 1/s from L, A and m of the NFW lens at the same u.
    #[inline(always)]
    fn m(&self, u: f64, [l, a, nfw]: [f64; 3]) -> [f64; 3] {
        let t2 = self.tau * self.tau;
        let s = (t2 + u).sqrt();
        let sum = s + self.tau;
        // Divisions limit the ray loop: 1/u, 1/s and 1/(s + τ) share one.
        let all = 1.0 / (u * sum * s);
        let (inv_u, inv_sum, inv_s) = (sum * s * all, u * s * all, u * sum * all);
        let by_tau = self.inv_tau * inv_sum;
        let swelling = ln_1p(0.5 * u * by_tau);
        let lt = l - self.ln_tau - swelling;
        let m = self.norm * ((t2 - 1.0) * (nfw + lt * by_tau - swelling * inv_u) + 2.0 * a - PI * inv_sum);
        [m, lt, inv_s]
    }

    /// (m, u·m′, u²·m″) of the truncated lens from the NFW functions of the same u; branch-free.
    #[inline(always)]
    pub fn radial(&self, u: f64, b: &Basis) -> [f64; 3] {
        let t2 = self.tau * self.tau;
        let [m, lt, inv_s] = self.m(u, [b.l, b.a, b.m]);
        let edge = -PI + (t2 - 1.0) * lt * self.inv_tau;
        let kappa = self.norm * (b.a + 0.5 * (t2 + 1.0) * b.e + 0.5 * edge * inv_s);
        let inv_s2 = inv_s * inv_s;
        let u_kappa_prime = self.norm
            * (0.5 * (b.e - b.a) - 0.5 * (t2 + 1.0) * (b.e + 0.5 * b.h) + 0.25 * (t2 - 1.0) * inv_s2
                - 0.25 * edge * u * inv_s2 * inv_s);
        let p1 = kappa - m;
        [m, p1, u_kappa_prime - 2.0 * p1]
    }

    /// ∂m/∂τ from m and the NFW functions of the same u: with ds/dτ = τ/s every factor has a simple logarithmic derivative.
    #[inline(always)]
    fn m_by_tau(&self, u: f64, b: &Basis, m: f64) -> f64 {
        let (tau, t2) = (self.tau, self.tau * self.tau);
        let s = (t2 + u).sqrt();
        let sum = s + tau;
        let v = 0.5 * u / (tau * sum);
        let swelling = ln_1p(v);
        let lt = b.l - self.ln_tau - swelling;
        let slope = self.inv_tau + 1.0 / s;
        let bracket = b.m + lt / (tau * sum) - swelling / u;
        let by_bracket = (-1.0 / s - lt * slope) / (tau * sum) + v * slope / (u * (1.0 + v));
        m * (2.0 / tau - 4.0 * tau / (t2 + 1.0))
            + self.norm * (2.0 * tau * bracket + (t2 - 1.0) * by_bracket + PI / (sum * s))
    }
}

/// m of the truncated lens from u and L, A and m of the NFW lens.
struct MAlone(Truncation);

impl Each<4, 1> for MAlone {
    #[inline(always)]
    fn of(&self, [u, nfw @ ..]: [f64; 4]) -> [f64; 1] {
        let [m, ..] = self.0.m(u, nfw);
        [m]
    }
}

/// (m, u·m′, u²·m″) from u and all functions of the NFW lens.
struct Whole(Truncation);

impl Each<7, 3> for Whole {
    #[inline(always)]
    fn of(&self, [u, basis @ ..]: [f64; 7]) -> [f64; 3] {
        self.0.radial(u, &basis.into())
    }
}

/// (m, u·m′, ∂m/∂τ).
struct WithTau(Truncation);

impl Each<7, 3> for WithTau {
    #[inline(always)]
    fn of(&self, [u, basis @ ..]: [f64; 7]) -> [f64; 3] {
        let basis = basis.into();
        let [m, p1, _] = self.0.radial(u, &basis);
        [m, p1, self.0.m_by_tau(u, &basis, m)]
    }
}

/// Functions of u that the truncation makes of the NFW functions.
#[inline(always)]
fn truncated<R: Real, const N: usize>(u: R, f: &impl Each<7, N>) -> [R; N] {
    let [l, a, m, e, h, inv_u] = nfw_radial::columns(u);
    R::each([u, l, a, m, e, h, inv_u], f)
}

impl TruncatedNfw {
    /// Halo of scale radius `r_s_arcsec`, untruncated deflection `alpha_rs_arcsec` there, truncated at `r_trunc_arcsec`.
    ///
    /// # Errors
    /// When a radius is not positive or a number is not finite.
    pub fn new(
        r_s_arcsec: f64,
        alpha_rs_arcsec: f64,
        r_trunc_arcsec: f64,
        centre_arcsec: [f64; 2],
    ) -> Result<Self> {
        SCALE_RADIUS.domain.check("r_s_arcsec", r_s_arcsec)?;
        ALPHA_RS.domain.check("alpha_rs_arcsec", alpha_rs_arcsec)?;
        TRUNCATION_RADIUS.domain.check("r_trunc_arcsec", r_trunc_arcsec)?;
        let r_s_arcsec = resolved_scale_radius(r_s_arcsec);
        let law = TruncatedNfwLaw { tau: r_trunc_arcsec / r_s_arcsec };
        Self::round(law, r_s_arcsec, Nfw::strength(r_s_arcsec, alpha_rs_arcsec), centre_arcsec)
    }
}

/// ∫₀ᵘ m du′ of the truncated lens by Gauss–Legendre in √u′ on logarithmic panels (the closed form needs dilogarithms).
///
/// Relative accuracy 1e-12 (`tests/properties/profiles.rs`).
pub fn potential(u: f64, tau: f64) -> f64 {
    /// Panels halve √u down to 2⁻²⁶ of it; what lies below is 1e-15 of the whole.
    const PANELS: i32 = 26;
    let (x, edge) = (u.sqrt(), Truncation::at(tau));
    let integrand = |x: f64| {
        let u = (x * x).max(nfw_radial::U_FLOOR);
        2.0 * x * edge.m(u, nfw_radial::l_a_m(u))[0]
    };
    (0..PANELS)
        .map(|i| {
            let low = if i + 1 == PANELS { 0.0 } else { x * 0.5f64.powi(i + 1) };
            integrate(low, x * 0.5f64.powi(i), 1, integrand)
        })
        .sum()
}
