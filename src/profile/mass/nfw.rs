//! The Navarro–Frenk–White lens (Navarro, Frenk & White 1996; deflection of Bartelmann 1996).

use super::{MassProfile, RadialDerivatives, nfw_radial};
use crate::error::{Result, require};

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
#[derive(Debug, Clone, Copy)]
pub struct Nfw {
    centre_arcsec: [f64; 2],
    r_s_arcsec: f64,
    k: f64,
}

/// m at the scale radius: 1 − ln 2.
pub(crate) const M_AT_R_S: f64 = 1.0 - std::f64::consts::LN_2;

impl Nfw {
    /// Halo of scale radius `r_s_arcsec` > 0 with the deflection `alpha_rs_arcsec` at that radius.
    ///
    /// # Errors
    /// When r_s is not positive or a number is not finite.
    pub fn new(r_s_arcsec: f64, alpha_rs_arcsec: f64, centre_arcsec: [f64; 2]) -> Result<Self> {
        require(r_s_arcsec > 0.0, "r_s_arcsec", r_s_arcsec, "a positive number")?;
        require(true, "alpha_rs_arcsec", alpha_rs_arcsec, "a finite number")?;
        Ok(Self { centre_arcsec, r_s_arcsec, k: Self::strength(r_s_arcsec, alpha_rs_arcsec) })
    }

    /// k = α_Rs/[r_s(1 − ln 2)], the number in front of m(u).
    pub fn strength(r_s_arcsec: f64, alpha_rs_arcsec: f64) -> f64 {
        alpha_rs_arcsec / (r_s_arcsec * M_AT_R_S)
    }

    fn offset(&self, x: f64, y: f64) -> Offset {
        Offset::new(x - self.centre_arcsec[0], y - self.centre_arcsec[1], self.r_s_arcsec)
    }

    fn radial(&self, u: f64) -> RadialDerivatives {
        let [m, p1, p2] = nfw_radial::basis(u).nfw();
        RadialDerivatives { k: self.k, m, p1, p2 }
    }
}

/// Position relative to a halo: offset, unit vector, 1/r and u, floored at the centre.
pub(super) struct Offset {
    pub t: [f64; 2],
    pub n: [f64; 2],
    pub inv_r: f64,
    pub u: f64,
}

impl Offset {
    pub fn new(tx: f64, ty: f64, r_s: f64) -> Self {
        let u = ((tx * tx + ty * ty) / (r_s * r_s)).max(nfw_radial::U_FLOOR);
        let inv_r = 1.0 / (u.sqrt() * r_s);
        Self { t: [tx, ty], n: [tx * inv_r, ty * inv_r], inv_r, u }
    }
}

impl MassProfile for Nfw {
    fn potential(&self, x: f64, y: f64) -> f64 {
        0.5 * self.k * self.r_s_arcsec.powi(2) * nfw_radial::potential(self.offset(x, y).u)
    }

    fn deflection(&self, x: f64, y: f64) -> [f64; 2] {
        let o = self.offset(x, y);
        let km = self.k * nfw_radial::m(o.u);
        [km * o.t[0], km * o.t[1]]
    }

    fn hessian(&self, x: f64, y: f64) -> [f64; 3] {
        let o = self.offset(x, y);
        self.radial(o.u).hessian(o.n)
    }

    fn third_derivatives(&self, x: f64, y: f64) -> [f64; 4] {
        let o = self.offset(x, y);
        self.radial(o.u).third_derivatives(o.n, o.inv_r)
    }
}

#[cfg(test)]
mod tests {
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
