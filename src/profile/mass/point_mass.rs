//! The point mass.

use super::radial::{Radial, RadialLaw, by_scale};
use crate::error::{Domain, Result};
use crate::numerics::real::Real;
use crate::profile::parameter::{Name, Parameter, RADIAN_ARCSEC, exactly, placed_ellipse};

/// Point mass of Einstein radius θ_E: α = θ_E²/r²·θ, ψ = θ_E² ln r (r in arcsec), as lenstronomy's `POINT_MASS`.
///
/// ```
/// use haloray::profile::mass::{MassProfile, PointMass};
/// let lens = PointMass::new(1.5, [0.0, 0.0]).unwrap();
/// assert_eq!(lens.deflection(3.0, 0.0), [0.75, 0.0]);
/// ```
pub type PointMass = Radial<PointMassLaw>;

/// The radial law of the point mass in units of its Einstein radius.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMassLaw {
    ln_einstein_radius_squared: f64,
}

/// Einstein radius of a point mass, which is one only if it has a mass.
const EINSTEIN_RADIUS: Parameter =
    Parameter { domain: Domain::above_to(0.0, RADIAN_ARCSEC), ..Parameter::EINSTEIN_RADIUS };

impl RadialLaw for PointMassLaw {
    const NAMES: &'static [Name] = &[Name { name: "POINT_MASS", held: &[("e1", 0.0), ("e2", 0.0)] }];
    const PARAMETERS: &'static [Parameter] = &placed_ellipse![EINSTEIN_RADIUS];

    fn of_parameters(values: &[f64]) -> Result<PointMass> {
        let [einstein_radius, e1, e2, x, y] = exactly(values)?;
        PointMass::new(einstein_radius, [x, y])?.with_elliptical_potential([e1, e2])
    }

    #[inline(always)]
    fn radial<R: Real>(&self, u: R) -> [R; 3] {
        [1.0, -1.0, 2.0].map(|p| R::splat(p) / u)
    }

    fn potential(&self, u: f64) -> f64 {
        u.ln() + self.ln_einstein_radius_squared
    }

    #[inline(always)]
    fn m<R: Real>(&self, u: R) -> R {
        R::splat(1.0) / u
    }

    #[inline(always)]
    fn respond<R: Real>(&self, u: R, k: f64, scale_arcsec: f64) -> ([R; 2], [R; 3]) {
        let m = self.m(u);
        ([m, -m], [by_scale(-m, k, scale_arcsec), R::splat(0.0), R::splat(0.0)])
    }
}

impl PointMass {
    /// Point mass of an Einstein radius above 0, a radian at most.
    ///
    /// # Errors
    /// When the Einstein radius is another.
    pub fn new(einstein_radius_arcsec: f64, centre_arcsec: [f64; 2]) -> Result<Self> {
        EINSTEIN_RADIUS.domain.check("einstein_radius_arcsec", einstein_radius_arcsec)?;
        let law = PointMassLaw { ln_einstein_radius_squared: 2.0 * einstein_radius_arcsec.ln() };
        Self::round(law, einstein_radius_arcsec, 1.0, centre_arcsec)
    }
}
