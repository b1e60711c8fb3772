//! The Navarro–Frenk–White lens (Navarro, Frenk & White 1996; deflection of Bartelmann 1996).

use super::nfw_radial;
use super::radial::{Radial, RadialLaw, by_scale};
use crate::error::Result;
use crate::numerics::real::Real;
use crate::profile::parameter::{Name, Parameter, PriorShape, Role, exactly, placed_ellipse};

/// NFW halo by its scale radius and the deflection there, as in lenstronomy (`Rs`, `alpha_Rs`).
///
/// α(θ) = k·m(u)·θ, u = (θ/r_s)², k = α_Rs/[r_s(1 − ln 2)], m = [½ln(u/4) + A(1−u)]/u.
/// Right to a few 1e-15 at every radius; at r = 0 the deflection vanishes and κ, which diverges
/// as −ln r, is that of 1e-15 r_s.
///
/// ```
/// use haloray::profile::mass::{MassProfile, Nfw};
/// let halo = Nfw::new(0.8, 0.01, [0.0, 0.0]).unwrap();
/// assert!((halo.deflection(0.8, 0.0)[0] - 0.01).abs() < 1e-16);
/// ```
pub type Nfw = Radial<NfwLaw>;

/// The radial law of the NFW lens, scale radius r_s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NfwLaw;

/// Scale radius of an NFW halo.
pub(super) const SCALE_RADIUS: Parameter = Parameter {
    name: "Rs",
    label: "R_{s}",
    usual_prior: PriorShape::Uniform([0.5, 20.0]),
    ..Parameter::RADIUS
};
/// Deflection of an NFW halo at its scale radius.
pub(super) const ALPHA_RS: Parameter = Parameter {
    name: "alpha_Rs",
    unit: "arcsec",
    label: "α_{Rs}",
    usual_prior: PriorShape::Uniform([0.0, 6.0]),
    role: Role::Strength,
    ..Parameter::NUMBER
};

impl RadialLaw for NfwLaw {
    const NAMES: &'static [Name] = &[
        Name { name: "NFW_ELLIPSE_POTENTIAL", held: &[] },
        Name { name: "NFW", held: &[("e1", 0.0), ("e2", 0.0)] },
    ];
    const PARAMETERS: &'static [Parameter] = &placed_ellipse![SCALE_RADIUS, ALPHA_RS];

    fn of_parameters(values: &[f64]) -> Result<Nfw> {
        let [r_s, alpha_rs, e1, e2, x, y] = exactly(values)?;
        Nfw::new(r_s, alpha_rs, [x, y])?.with_elliptical_potential([e1, e2])
    }

    #[inline(always)]
    fn radial<R: Real>(&self, u: R) -> [R; 3] {
        nfw_radial::nfw(u)
    }

    fn potential(&self, u: f64) -> f64 {
        nfw_radial::potential(u)
    }

    #[inline(always)]
    fn m<R: Real>(&self, u: R) -> R {
        nfw_radial::m(u)
    }

    #[inline(always)]
    fn respond<R: Real>(&self, u: R, k: f64, scale_arcsec: f64) -> ([R; 2], [R; 3]) {
        let [m, p1, _] = self.radial(u);
        let by_r_s = by_scale(p1, k, scale_arcsec) - m * k / R::splat(scale_arcsec);
        ([m, p1], [by_r_s, m * Nfw::strength(scale_arcsec, 1.0), R::splat(0.0)])
    }
}

/// m at the scale radius: 1 − ln 2.
pub(crate) const M_AT_R_S: f64 = 1.0 - std::f64::consts::LN_2;

impl Nfw {
    /// Halo of scale radius `r_s_arcsec` > 0 with the deflection `alpha_rs_arcsec` at that radius.
    ///
    /// # Errors
    /// When r_s is not positive or a number is not finite.
    pub fn new(r_s_arcsec: f64, alpha_rs_arcsec: f64, centre_arcsec: [f64; 2]) -> Result<Self> {
        SCALE_RADIUS.domain.check("r_s_arcsec", r_s_arcsec)?;
        ALPHA_RS.domain.check("alpha_rs_arcsec", alpha_rs_arcsec)?;
        let r_s_arcsec = resolved_scale_radius(r_s_arcsec);
        Self::round(NfwLaw, r_s_arcsec, Self::strength(r_s_arcsec, alpha_rs_arcsec), centre_arcsec)
    }

    /// k = α_Rs/[r_s(1 − ln 2)], the number in front of m(u).
    pub fn strength(r_s_arcsec: f64, alpha_rs_arcsec: f64) -> f64 {
        alpha_rs_arcsec / (r_s_arcsec * M_AT_R_S)
    }
}

/// The scale radius, at least 1e-30″: a halo's mass within any angle falls with it, and below that powers of u overflow.
pub(crate) fn resolved_scale_radius(r_s_arcsec: f64) -> f64 {
    r_s_arcsec.max(1e-30)
}
