//! The Navarro–Frenk–White lens (Navarro, Frenk & White 1996; deflection of Bartelmann 1996).

use super::nfw_radial;
use super::radial::{Radial, RadialLaw, by_scale};
use crate::error::Result;
use crate::numerics::real::Real;
use crate::profile::parameter::{Name, Parameter, PriorShape, Role, exactly};

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
    const PARAMETERS: &'static [Parameter] =
        &[SCALE_RADIUS, ALPHA_RS, Parameter::E1, Parameter::E2, Parameter::CENTRE_X, Parameter::CENTRE_Y];

    fn of_parameters(values: &[f64]) -> Result<Nfw> {
        let [r_s, alpha_rs, e1, e2, x, y] = exactly(values)?;
        Nfw::new(r_s, alpha_rs, [x, y])?.with_elliptical_potential([e1, e2])
    }

    fn radial(&self, u: f64) -> [f64; 3] {
        nfw_radial::basis(u).nfw()
    }

    fn potential(&self, u: f64) -> f64 {
        nfw_radial::potential(u)
    }

    #[inline(always)]
    fn m<R: Real>(&self, u: R) -> R {
        let [m] = if u.is_below(nfw_radial::INNER_END) {
            u.each(|u| [nfw_radial::m_inner(u)])
        } else {
            u.each(|u| [nfw_radial::m(u)])
        };
        m
    }

    #[inline(always)]
    fn respond<R: Real>(&self, u: R, k: f64, scale_arcsec: f64) -> ([R; 2], [R; 3]) {
        let [m, p1, _] = if u.is_below(nfw_radial::INNER_END) {
            u.each(|u| nfw_radial::inner(u).nfw())
        } else {
            u.each(|u| nfw_radial::basis(u).nfw())
        };
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
        Self::round(NfwLaw, r_s_arcsec, Self::strength(r_s_arcsec, alpha_rs_arcsec), centre_arcsec)
    }

    /// k = α_Rs/[r_s(1 − ln 2)], the number in front of m(u).
    pub fn strength(r_s_arcsec: f64, alpha_rs_arcsec: f64) -> f64 {
        alpha_rs_arcsec / (r_s_arcsec * M_AT_R_S)
    }
}

#[cfg(test)]
mod tests {
    use super::super::MassProfile;
    use super::super::derivative_checks::assert_consistent;
    use super::*;
    use proptest::prelude::*;

    /// Richardson differences with a step of 2% of the radius lose six digits at most.
    const DIFFERENCES: f64 = 2e-9;

    proptest! {
        #[test]
        fn derivatives_are_consistent(lg in -4.0..3.0_f64, phi in 0.0..std::f64::consts::TAU, r_s in 0.05..30.0_f64) {
            let r = r_s * 10f64.powf(lg);
            let halo = Nfw::new(r_s, 0.3, [0.0, 0.0]).unwrap();
            assert_consistent(&halo, r * phi.cos(), r * phi.sin(), 0.02 * r, DIFFERENCES);
        }
    }

    #[test]
    fn derivatives_are_consistent_across_the_seam() {
        let halo = Nfw::new(1.0, 0.3, [0.1, -0.2]).unwrap();
        for i in 0..60 {
            let r = 0.85 + 0.005 * f64::from(i);
            assert_consistent(&halo, 0.1 + r * 0.6, -0.2 + r * 0.8, 0.02, DIFFERENCES);
        }
    }

    #[test]
    fn the_centre_gives_finite_numbers() {
        let halo = Nfw::new(0.5, 0.01, [0.0, 0.0]).unwrap();
        assert_eq!(halo.deflection(0.0, 0.0), [0.0, 0.0]);
        assert!(halo.hessian(0.0, 0.0).iter().all(|v| v.is_finite()));
        assert!(halo.third_derivatives(0.0, 0.0).iter().all(|v| v.is_finite()));
        assert!(halo.potential(0.0, 0.0).abs() < 1e-20);
    }

    #[test]
    fn far_away_it_is_isolated_mass_growing_as_the_logarithm() {
        // r·α/(k r_s²) = ln(r/2r_s) + O(r_s/r): at r = 1e6 r_s to 2e-6 of one.
        let halo = Nfw::new(1.0, M_AT_R_S, [0.0, 0.0]).unwrap();
        let r = 1e6;
        let want = (r / 2.0_f64).ln();
        assert!((r * halo.deflection(r, 0.0)[0] - want).abs() < 2e-6);
    }

    #[test]
    fn bad_parameters_are_refused() {
        for r_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Nfw::new(r_s, 0.1, [0.0, 0.0]).is_err(), "{r_s}");
        }
        assert!(Nfw::new(1.0, f64::NAN, [0.0, 0.0]).is_err());
    }
}
