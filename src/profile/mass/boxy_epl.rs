//! The elliptical power law with boxy or disky contours (Van de Vyvere et al. 2022, A&A 659, A127).

use super::{Described, Epl, MassProfile, Response};
use crate::error::Result;
use crate::numerics::complex::Cx;
use crate::numerics::real::Real;
use crate::profile::parameter::{Name, Parameter, PriorShape, exactly};

/// [`Epl`] with a circular multipole of order four along its axes, as lenstronomy's `EPL_BOXYDISKY` (Xu et al. 2015, eq. B12):
///
/// ψ₄ = −(a/15)·r·cos 4(φ−φ_m), a = a4_a·θ_E/√q; disky for a4_a > 0, boxy below.
///
/// The multipole is isothermal and round whatever γ and q are. With n = z/r and W = n⁴e^{−4iφ_m} = C + iS,
///
/// α = −(a/30)·n·(5W̄ − 3W), κ = aC/(2r), γ = −κn².
///
/// Its direction φ_m is that of (e1, e2), and along x at e = 0: there the lens jumps with the direction from which e
/// comes, and its derivatives by e1 and e2 are those of the power law alone.
#[derive(Debug, Clone)]
pub struct BoxyEpl {
    epl: Epl,
    /// a, ∂a/∂θ_E and ∂a/∂a4_a.
    strength_arcsec: f64,
    by_einstein_radius: f64,
    by_a4_a: f64,
    /// ∂ln a/∂e_j and ∂φ_m/∂e_j.
    by_ellipticity: [[f64; 2]; 2],
    /// e^{−4iφ_m}.
    direction: [f64; 2],
}

/// Strength of the multipole.
const A4_A: Parameter = Parameter {
    name: "a4_a",
    label: "a_{4}/a",
    usual_prior: PriorShape::Uniform([-0.1, 0.1]),
    ..Parameter::NUMBER
};

impl BoxyEpl {
    /// The power law of [`Epl::new`] with a multipole of strength `a4_a`.
    ///
    /// # Errors
    /// When a parameter lies outside its domain.
    pub fn new(
        einstein_radius_arcsec: f64,
        slope: f64,
        ellipticity: [f64; 2],
        a4_a: f64,
        centre_arcsec: [f64; 2],
    ) -> Result<Self> {
        let epl = Epl::new(einstein_radius_arcsec, slope, ellipticity, centre_arcsec)?;
        A4_A.domain.check("a4_a", a4_a)?;
        let [e1, e2] = ellipticity;
        let e = e1.hypot(e2);
        // 1/√q, of derivative 1/(1−e²) of its logarithm.
        let stretch = ((1.0 + e) / (1.0 - e)).sqrt();
        let is_round = e < f64::MIN_POSITIVE;
        let along = if is_round { [1.0, 0.0] } else { [e1 / e, e2 / e] };
        let (by_e, turn) = if is_round { (0.0, 0.0) } else { (1.0 / (1.0 - e * e), 0.5 / e) };
        Ok(Self {
            epl,
            strength_arcsec: a4_a * einstein_radius_arcsec * stretch,
            by_einstein_radius: a4_a * stretch,
            by_a4_a: einstein_radius_arcsec * stretch,
            by_ellipticity: [[along[0] * by_e, -along[1] * turn], [along[1] * by_e, along[0] * turn]],
            direction: [along[0] * along[0] - along[1] * along[1], -2.0 * along[0] * along[1]],
        })
    }

    #[inline(always)]
    fn multipole<R: Real>(&self, x: R, y: R) -> Multipole<R> {
        let z = self.epl.offset(x, y);
        let radius = z.norm_sqr().sqrt();
        let n = z.scale(R::splat(1.0) / radius);
        let square = n * n;
        let w = Cx::splat(self.direction[0], self.direction[1]) * square * square;
        let kappa = w.re * (0.5 * self.strength_arcsec) / radius;
        Multipole { radius, n, square, w, kappa }
    }
}

/// Radius, n, n², W and κ of the multipole at one point.
struct Multipole<R> {
    radius: R,
    n: Cx<R>,
    square: Cx<R>,
    w: Cx<R>,
    kappa: R,
}

impl<R: Real> Multipole<R> {
    /// α/a.
    #[inline(always)]
    fn deflection(&self) -> Cx<R> {
        self.n * (self.w.conj() * (-5.0 / 30.0) + self.w * (3.0 / 30.0))
    }

    #[inline(always)]
    fn shear(&self) -> Cx<R> {
        -self.square.scale(self.kappa)
    }
}

impl MassProfile for BoxyEpl {
    fn potential(&self, x: f64, y: f64) -> f64 {
        let at = self.multipole(x, y);
        self.epl.potential(x, y) - self.strength_arcsec / 15.0 * at.radius * at.w.re
    }

    #[inline(always)]
    fn deflect<R: Real>(&self, x: R, y: R) -> Cx<R> {
        self.epl.deflect(x, y) + self.multipole(x, y).deflection() * self.strength_arcsec
    }

    #[inline(always)]
    fn respond<R: Real>(&self, x: R, y: R, by_parameter: &mut [Cx<R>]) -> Response<R> {
        let of_epl = self.epl.respond(x, y, &mut by_parameter[..Epl::PARAMETERS.len()]);
        let at = self.multipole(x, y);
        let alpha = at.deflection();
        let response = Response {
            deflection: of_epl.deflection + alpha * self.strength_arcsec,
            convergence: of_epl.convergence + at.kappa,
            shear: of_epl.shear + at.shear(),
        };
        if let [by_einstein_radius, _, by_e1, by_e2, by_a4_a, by_x, by_y] = by_parameter {
            // ∂α/∂φ_m = −(2i/15)·n·(5W̄ + 3W) for a = 1.
            let turned = at.n * (at.w.conj() * 5.0 + at.w * 3.0) * Cx::splat(0.0, -2.0 / 15.0);
            *by_einstein_radius += alpha * self.by_einstein_radius;
            for (by_e, [grown, angle]) in [by_e1, by_e2].into_iter().zip(self.by_ellipticity) {
                *by_e += (alpha * grown + turned * angle) * self.strength_arcsec;
            }
            *by_a4_a = alpha * self.by_a4_a;
            let [xx, xy, yy] = response.hessian();
            (*by_x, *by_y) = (-Cx::new(xx, xy), -Cx::new(xy, yy));
        }
        response
    }

    #[inline(always)]
    fn expand<R: Real>(&self, x: R, y: R) -> (Cx<R>, [R; 3]) {
        let (at, (alpha, [xx, xy, yy])) = (self.multipole(x, y), self.epl.expand(x, y));
        let shear = at.shear();
        let hessian = [xx + at.kappa + shear.re, xy + shear.im, yy + at.kappa - shear.re];
        (alpha + at.deflection() * self.strength_arcsec, hessian)
    }

    fn third_derivatives(&self, x: f64, y: f64) -> [f64; 4] {
        let (at, [xxx, xxy, xyy, yyy]) = (self.multipole(x, y), self.epl.third_derivatives(x, y));
        // F = ∂*κ = −(a/4r²)·n·(C + 4iS), G = ∂*γ = −Fn² + κn³/r; see `Epl::third_derivatives`.
        let slope = -0.25 * self.strength_arcsec / (at.radius * at.radius);
        let f = at.n * Cx::new(at.w.re, 4.0 * at.w.im) * slope;
        let g = at.square * (at.n * (at.kappa / at.radius) - f);
        [xxx + 3.0 * f.re + g.re, xxy + f.im + g.im, xyy + f.re - g.re, yyy + 3.0 * f.im - g.im]
    }
}

impl Described for BoxyEpl {
    const NAMES: &'static [Name] = &[Name { name: "EPL_BOXYDISKY", held: &[] }];
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::EINSTEIN_RADIUS,
        Parameter::SLOPE,
        Parameter::E1,
        Parameter::E2,
        A4_A,
        Parameter::CENTRE_X,
        Parameter::CENTRE_Y,
    ];

    fn of_parameters(values: &[f64]) -> Result<Self> {
        let [einstein_radius, slope, e1, e2, a4_a, x, y] = exactly(values)?;
        Self::new(einstein_radius, slope, [e1, e2], a4_a, [x, y])
    }

    fn centre_arcsec(&self) -> Option<[f64; 2]> {
        self.epl.centre_arcsec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_multipole_it_is_the_power_law() {
        let epl = Epl::new(1.2, 2.3, [0.1, -0.2], [0.0, 0.1]).unwrap();
        for lens in [[0.1, -0.2], [0.0, 0.0]].map(|e| BoxyEpl::new(1.2, 2.3, e, 0.0, [0.0, 0.1]).unwrap()) {
            let mut by_parameter = [Cx::new(0.0, 0.0); 7];
            lens.respond(0.7, 0.4, &mut by_parameter);
            assert!(by_parameter.iter().all(|d| d.re.is_finite() && d.im.is_finite()));
        }
        let lens = BoxyEpl::new(1.2, 2.3, [0.1, -0.2], 0.0, [0.0, 0.1]).unwrap();
        assert_eq!(lens.deflection(0.7, 0.4), epl.deflection(0.7, 0.4));
        assert_eq!(lens.third_derivatives(0.7, 0.4), epl.third_derivatives(0.7, 0.4));
    }
}
