//! Convergence, shear and flexion from outside: a cubic potential about an origin.

use super::{Described, MassProfile, Response};
use crate::error::{Domain, Result};
use crate::numerics::complex::Cx;
use crate::numerics::real::Real;
use crate::profile::parameter::{Name, Parameter, exactly};

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
        Domain::FINITE.check("kappa", kappa)?;
        for value in shear.into_iter().chain(third_per_arcsec).chain(origin_arcsec) {
            Domain::FINITE.check("a number of the external field", value)?;
        }
        let hessian = [kappa + shear[0], shear[1], kappa - shear[0]];
        Ok(Self { origin_arcsec, hessian, third_per_arcsec })
    }

    #[inline(always)]
    fn offset<R: Real>(&self, x: R, y: R) -> [R; 2] {
        [x + -self.origin_arcsec[0], y + -self.origin_arcsec[1]]
    }

    #[inline(always)]
    fn hessian_at<R: Real>(&self, [x, y]: [R; 2]) -> [R; 3] {
        let ([xx, xy, yy], [xxx, xxy, xyy, yyy]) = (self.hessian, self.third_per_arcsec);
        [x * xxx + xx + y * xxy, x * xxy + xy + y * xyy, x * xyy + yy + y * yyy]
    }
}

impl MassProfile for External {
    fn potential(&self, x: f64, y: f64) -> f64 {
        let [x, y] = self.offset(x, y);
        let ([xx, xy, yy], [xxx, xxy, xyy, yyy]) = (self.hessian, self.third_per_arcsec);
        0.5 * (xx * x * x + 2.0 * xy * x * y + yy * y * y)
            + (xxx * x * x * x + 3.0 * xxy * x * x * y + 3.0 * xyy * x * y * y + yyy * y * y * y) / 6.0
    }

    #[inline(always)]
    fn deflect<R: Real>(&self, x: R, y: R) -> Cx<R> {
        let [x, y] = self.offset(x, y);
        let ([xx, xy, yy], [xxx, xxy, xyy, yyy]) = (self.hessian, self.third_per_arcsec);
        Cx::new(
            x * xx + y * xy + (x * xxx * x + x * (2.0 * xxy) * y + y * xyy * y) * 0.5,
            x * xy + y * yy + (x * xxy * x + x * (2.0 * xyy) * y + y * yyy * y) * 0.5,
        )
    }

    #[inline(always)]
    fn respond<R: Real>(&self, x: R, y: R, by_parameter: &mut [Cx<R>]) -> Response<R> {
        let [dx, dy] = self.offset(x, y);
        let hessian = self.hessian_at([dx, dy]);
        let ([xx, xy, yy], zero) = (hessian, R::splat(0.0));
        let derivatives = [
            [dx, dy],
            [dx, -dy],
            [dy, dx],
            [dx * 0.5 * dx, zero],
            [dx * dy, dx * 0.5 * dx],
            [dy * 0.5 * dy, dx * dy],
            [zero, dy * 0.5 * dy],
            [-xx, -xy],
            [-xy, -yy],
        ];
        for (out, [re, im]) in by_parameter.iter_mut().zip(derivatives) {
            *out = Cx::new(re, im);
        }
        Response::new(self.deflect(x, y), hessian)
    }

    #[inline(always)]
    fn expand<R: Real>(&self, x: R, y: R) -> (Cx<R>, [R; 3]) {
        (self.deflect(x, y), self.hessian_at(self.offset(x, y)))
    }

    fn third_derivatives(&self, _: f64, _: f64) -> [f64; 4] {
        self.third_per_arcsec
    }
}

/// First coordinate of the origin of an external field.
pub(super) const ORIGIN_X: Parameter = Parameter { name: "ra_0", label: "x_{0}", ..Parameter::CENTRE_X };
/// Second coordinate of the origin of an external field.
pub(super) const ORIGIN_Y: Parameter = Parameter { name: "dec_0", label: "y_{0}", ..Parameter::CENTRE_Y };

impl Described for External {
    const NAMES: &'static [Name] = &[
        Name { name: "SHEAR", held: &[("kappa", 0.0), ("g1", 0.0), ("g2", 0.0), ("g3", 0.0), ("g4", 0.0)] },
        Name {
            name: "CONVERGENCE",
            held: &[("gamma1", 0.0), ("gamma2", 0.0), ("g1", 0.0), ("g2", 0.0), ("g3", 0.0), ("g4", 0.0)],
        },
        Name { name: "FLEXION", held: &[("kappa", 0.0), ("gamma1", 0.0), ("gamma2", 0.0)] },
    ];
    const PARAMETERS: &'static [Parameter] = &[
        Parameter { name: "kappa", label: "κ_{ext}", ..Parameter::FIELD },
        Parameter { name: "gamma1", label: "γ_{1}^{ext}", ..Parameter::FIELD },
        Parameter { name: "gamma2", label: "γ_{2}^{ext}", ..Parameter::FIELD },
        Parameter { name: "g1", label: "g_{1}", ..Parameter::FLEXION },
        Parameter { name: "g2", label: "g_{2}", ..Parameter::FLEXION },
        Parameter { name: "g3", label: "g_{3}", ..Parameter::FLEXION },
        Parameter { name: "g4", label: "g_{4}", ..Parameter::FLEXION },
        ORIGIN_X,
        ORIGIN_Y,
    ];

    fn of_parameters(values: &[f64]) -> Result<Self> {
        let [kappa, gamma1, gamma2, g1, g2, g3, g4, x, y] = exactly(values)?;
        Self::new(kappa, [gamma1, gamma2], [g1, g2, g3, g4], [x, y])
    }
}
