//! Convergence, shear and flexion from outside: a cubic potential about an origin.

use super::MassProfile;
use crate::error::{Result, require};
use crate::numerics::complex::Cx;

/// ψ = ½(κ+γ1)x² + γ2 xy + ½(κ−γ1)y² + (g1 x³ + 3g2 x²y + 3g3 xy² + g4 y³)/6 about `origin`.
///
/// lenstronomy's `SHEAR`, `CONVERGENCE` and `FLEXION` are its parts; g1…g4 are the third derivatives of ψ.
///
/// ```
/// use haloray::profile::mass::{External, MassProfile};
/// let sheet = External::new(0.1, [0.03, 0.0], [0.0; 4], [0.0, 0.0]).unwrap();
/// let [x, y] = sheet.deflection(1.0, 1.0);
/// assert!((x - 0.13).abs() < 1e-15 && (y - 0.07).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct External {
    origin_arcsec: [f64; 2],
    hessian: [f64; 3],
    third_per_arcsec: [f64; 4],
}

impl External {
    /// Convergence `kappa`, shear (γ1, γ2) and third derivatives (ψ_xxx, ψ_xxy, ψ_xyy, ψ_yyy) per arcsec.
    ///
    /// # Errors
    /// When a number is not finite.
    pub fn new(
        kappa: f64,
        shear: [f64; 2],
        third_per_arcsec: [f64; 4],
        origin_arcsec: [f64; 2],
    ) -> Result<Self> {
        require(true, "kappa", kappa, "finite")?;
        for value in shear.into_iter().chain(third_per_arcsec).chain(origin_arcsec) {
            require(true, "a number of the external field", value, "finite")?;
        }
        let hessian = [kappa + shear[0], shear[1], kappa - shear[0]];
        Ok(Self { origin_arcsec, hessian, third_per_arcsec })
    }

    fn offset(&self, x: f64, y: f64) -> [f64; 2] {
        [x - self.origin_arcsec[0], y - self.origin_arcsec[1]]
    }
}

impl MassProfile for External {
    fn potential(&self, x: f64, y: f64) -> f64 {
        let [x, y] = self.offset(x, y);
        let ([xx, xy, yy], [xxx, xxy, xyy, yyy]) = (self.hessian, self.third_per_arcsec);
        0.5 * (xx * x * x + 2.0 * xy * x * y + yy * y * y)
            + (xxx * x * x * x + 3.0 * xxy * x * x * y + 3.0 * xyy * x * y * y + yyy * y * y * y) / 6.0
    }

    fn deflection(&self, x: f64, y: f64) -> [f64; 2] {
        let [x, y] = self.offset(x, y);
        let ([xx, xy, yy], [xxx, xxy, xyy, yyy]) = (self.hessian, self.third_per_arcsec);
        [
            xx * x + xy * y + 0.5 * (xxx * x * x + 2.0 * xxy * x * y + xyy * y * y),
            xy * x + yy * y + 0.5 * (xxy * x * x + 2.0 * xyy * x * y + yyy * y * y),
        ]
    }

    fn hessian(&self, x: f64, y: f64) -> [f64; 3] {
        let [x, y] = self.offset(x, y);
        let ([xx, xy, yy], [xxx, xxy, xyy, yyy]) = (self.hessian, self.third_per_arcsec);
        [xx + xxx * x + xxy * y, xy + xxy * x + xyy * y, yy + xyy * x + yyy * y]
    }

    fn third_derivatives(&self, _: f64, _: f64) -> [f64; 4] {
        self.third_per_arcsec
    }

    fn parameters(&self) -> &'static [&'static str] {
        &["kappa", "gamma1", "gamma2", "g1", "g2", "g3", "g4", "ra_0", "dec_0"]
    }

    fn parameter_derivatives(&self, x: f64, y: f64, by_parameter: &mut [Cx<f64>]) {
        let [xx, xy, yy] = self.hessian(x, y);
        let [x, y] = self.offset(x, y);
        let derivatives = [
            [x, y],
            [x, -y],
            [y, x],
            [0.5 * x * x, 0.0],
            [x * y, 0.5 * x * x],
            [0.5 * y * y, x * y],
            [0.0, 0.5 * y * y],
            [-xx, -xy],
            [-xy, -yy],
        ];
        for (out, [re, im]) in by_parameter.iter_mut().zip(derivatives) {
            *out = Cx::new(re, im);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::derivative_checks::{assert_consistent, assert_parameter_derivatives};
    use super::*;

    #[test]
    fn derivatives_are_consistent() {
        let field = External::new(0.05, [0.02, -0.04], [0.01, -0.02, 0.03, 0.005], [0.2, -0.1]).unwrap();
        assert_consistent(&field, 1.3, -0.7, 0.1, 1e-11);
    }

    #[test]
    fn parameter_derivatives_are_those_of_the_deflection() {
        let build =
            |p: &[f64]| External::new(p[0], [p[1], p[2]], [p[3], p[4], p[5], p[6]], [p[7], p[8]]).unwrap();
        let parameters = [0.05, 0.02, -0.04, 0.01, -0.02, 0.03, 0.005, 0.2, -0.1];
        assert_parameter_derivatives(build, &parameters, [1.3, -0.7], 1e-9);
    }
}
