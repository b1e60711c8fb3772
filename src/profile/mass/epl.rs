//! The elliptical power law (Tessore & Metcalf 2015, A&A 580, A79).

use super::{Described, MassProfile, Response};
use crate::error::{Domain, Result};
use crate::numerics::complex::Cx;
use crate::numerics::elementary::Elementary;
use crate::numerics::real::Real;
use crate::profile::parameter::{Name, Parameter, checked_centre, exactly, placed_ellipse};

/// Elliptical power-law lens, κ = (3−γ)/2·(θ_E/√(qx²+y²/q))^(γ−1) in its own axes.
///
/// With z = x + iy from the centre, ε = e1 + i·e2, ζ = z − εz̄, b = θ_E√(1−|ε|²), t = γ−1 and c = 2−t, Tessore & Metcalf's
/// series (their eq. 13) needs no rotation to the axes and is smooth at ε = 0:
///
/// α = (b/|ζ|)^t·ζ·P(s), P(s) = Σ aₙsⁿ, s = −ε̄ζ/ζ̄, aₙ = Π_{k≤n}(2k−c)/(2k+c); κ = (c/2)(b/|ζ|)^t.
///
/// α is homogeneous of degree 1−t, which gives the potential, ψ = Re(z̄α)/c, and the shear, z̄γ = (1−t)α − zκ.
/// Within 1e-9″ of the centre every number is that at 1e-9″ to its right, so that all stay finite.
/// Parameters as lenstronomy's `EPL`: θ_E, γ, (e1, e2) = (1−q)/(1+q)·(cos 2φ, sin 2φ), centre.
#[derive(Debug, Clone)]
pub struct Epl {
    einstein_radius_arcsec: f64,
    ellipticity: [f64; 2],
    centre_arcsec: [f64; 2],
    b_arcsec: f64,
    t: f64,
    /// (aₙ, ∂aₙ/∂t), as many as change the sum.
    series: Vec<[f64; 2]>,
}

/// Largest |e|, an axis ratio of 1:200.
const MOST_ELLIPTICITY: f64 = 0.99;

impl Epl {
    /// Lens of Einstein radius `einstein_radius_arcsec` ≥ 0, slope 1 < `slope` < 3, |e| ≤ 0.99.
    ///
    /// The series has ln(1e-17)/ln |e| terms, 3,900 for an axis ratio of 1:200, and without end as |e| → 1.
    ///
    /// # Errors
    /// When a parameter lies outside its domain.
    pub fn new(
        einstein_radius_arcsec: f64,
        slope: f64,
        ellipticity: [f64; 2],
        centre_arcsec: [f64; 2],
    ) -> Result<Self> {
        Parameter::EINSTEIN_RADIUS.domain.check("einstein_radius_arcsec", einstein_radius_arcsec)?;
        Parameter::SLOPE.domain.check("the slope gamma", slope)?;
        let e = Domain::from_to(0.0, MOST_ELLIPTICITY)
            .check("|e| of the lens", ellipticity[0].hypot(ellipticity[1]))?;
        checked_centre(centre_arcsec)?;
        let t = slope - 1.0;
        Ok(Self {
            einstein_radius_arcsec,
            ellipticity,
            centre_arcsec,
            b_arcsec: einstein_radius_arcsec * (1.0 - e * e).sqrt(),
            t,
            series: series(e, t),
        })
    }

    /// x + iy from the centre, no nearer to it than the floor.
    #[inline(always)]
    pub(super) fn offset<R: Real>(&self, x: R, y: R) -> Cx<R> {
        const RADIUS_FLOOR_ARCSEC: f64 = 1e-9;
        const LIMIT: f64 = RADIUS_FLOOR_ARCSEC * RADIUS_FLOOR_ARCSEC;
        let z = Cx::new(x + -self.centre_arcsec[0], y + -self.centre_arcsec[1]);
        let r2 = z.norm_sqr();
        Cx::new(z.re.unless_below(r2, LIMIT, RADIUS_FLOOR_ARCSEC), z.im.unless_below(r2, LIMIT, 0.0))
    }

    #[inline(always)]
    fn frame<R: Real>(&self, x: R, y: R) -> Frame<R> {
        let z = self.offset(x, y);
        let epsilon = Cx::splat(self.ellipticity[0], self.ellipticity[1]);
        let zeta = z - epsilon * z.conj();
        let norm_sqr = zeta.norm_sqr();
        let inverse = R::splat(1.0) / norm_sqr;
        // (b/|ζ|)^t = (|ζ|²/b²)^{−t/2}; b = 0 is a lens without mass.
        let b2 = (self.b_arcsec * self.b_arcsec).max(f64::MIN_POSITIVE);
        let ln_radius = (norm_sqr * (1.0 / b2)).ln() * -0.5;
        let power = if self.b_arcsec > 0.0 { (ln_radius * self.t).exp() } else { R::splat(0.0) };
        let s = -(epsilon.conj() * zeta * zeta).scale(inverse);
        Frame { z, epsilon, zeta, inverse, ln_radius, power, s }
    }

    /// P(s).
    #[inline(always)]
    fn sum<R: Real>(&self, s: Cx<R>) -> Cx<R> {
        let mut p = Cx::zero();
        for [a, _] in self.series.iter().rev() {
            p = p * s;
            p.re = p.re + *a;
        }
        p
    }

    /// ∂α/∂θ_E = t·α/θ_E.
    #[inline(always)]
    fn by_einstein_radius<R: Real>(&self, f: &Frame<R>, p: Cx<R>) -> Cx<R> {
        let inverse =
            if self.einstein_radius_arcsec > 0.0 { self.t / self.einstein_radius_arcsec } else { 0.0 };
        (f.zeta * p).scale(f.power * inverse)
    }

    /// (κ, γ) from the deflection.
    #[inline(always)]
    fn distortion<R: Real>(&self, f: &Frame<R>, deflection: Cx<R>) -> (R, Cx<R>) {
        let kappa = f.power * (0.5 * (2.0 - self.t));
        let inverse = R::splat(1.0) / f.z.norm_sqr();
        (kappa, (deflection * (1.0 - self.t) - f.z.scale(kappa)) * f.z.scale(inverse))
    }
}

/// What all derivatives share at one point.
struct Frame<R> {
    z: Cx<R>,
    epsilon: Cx<R>,
    zeta: Cx<R>,
    /// 1/|ζ|².
    inverse: R,
    /// ln(b/|ζ|).
    ln_radius: R,
    /// (b/|ζ|)^t.
    power: R,
    s: Cx<R>,
}

/// (aₙ, ∂aₙ/∂t) until neither changes P or its derivative at |s| = `e` any more.
fn series(e: f64, t: f64) -> Vec<[f64; 2]> {
    const RELATIVE: f64 = 1e-17;
    let c = 2.0 - t;
    let (mut terms, mut power, mut n) = (vec![[1.0, 0.0]], 1.0, 1.0);
    while power > RELATIVE {
        let [a, da] = terms[terms.len() - 1];
        let (ratio, d_ratio) = ((2.0 * n - c) / (2.0 * n + c), 4.0 * n / (2.0 * n + c).powi(2));
        terms.push([a * ratio, da * ratio + a * d_ratio]);
        (power, n) = (power * e, n + 1.0);
    }
    terms
}

impl MassProfile for Epl {
    fn potential(&self, x: f64, y: f64) -> f64 {
        let f = self.frame(x, y);
        f.z.dot((f.zeta * self.sum(f.s)).scale(f.power)) / (2.0 - self.t)
    }

    #[inline(always)]
    fn deflect<R: Real>(&self, x: R, y: R) -> Cx<R> {
        let f = self.frame(x, y);
        (f.zeta * self.sum(f.s)).scale(f.power)
    }

    #[inline(always)]
    fn respond<R: Real>(&self, x: R, y: R, by_parameter: &mut [Cx<R>]) -> Response<R> {
        let f = self.frame(x, y);
        let (mut p, mut dp_ds, mut dp_dt) = (Cx::zero(), Cx::zero(), Cx::zero());
        for [a, da] in self.series.iter().rev() {
            dp_ds = dp_ds * f.s + p;
            p = p * f.s;
            p.re = p.re + *a;
            dp_dt = dp_dt * f.s;
            dp_dt.re = dp_dt.re + *da;
        }
        let deflection = (f.zeta * p).scale(f.power);
        let (convergence, shear) = self.distortion(&f, deflection);
        let response = Response { deflection, convergence, shear };
        by_parameter[0] = self.by_einstein_radius(&f, p);
        by_parameter[1] = deflection.scale(f.ln_radius) + (f.zeta * dp_dt).scale(f.power);
        let e2 = self.ellipticity[0].powi(2) + self.ellipticity[1].powi(2);
        for (j, unit) in [Cx::splat(1.0, 0.0), Cx::splat(0.0, 1.0)].into_iter().enumerate() {
            // δζ = −δε z̄, δs = −δε̄ ζ/ζ̄ + s·(δζ/ζ − conj(δζ/ζ)), δln(b/|ζ|) = −e_j/(1−e²) − Re(δζ/ζ).
            let d_zeta = -(unit * f.z.conj());
            let relative = (d_zeta * f.zeta.conj()).scale(f.inverse);
            let d_s = -(unit.conj() * f.zeta * f.zeta).scale(f.inverse)
                + f.s * Cx::new(R::splat(0.0), relative.im * 2.0);
            let d_ln = -relative.re + -self.ellipticity[j] / (1.0 - e2);
            by_parameter[2 + j] =
                deflection.scale(d_ln * self.t) + (d_zeta * p + f.zeta * dp_ds * d_s).scale(f.power);
        }
        let [xx, xy, yy] = response.hessian();
        by_parameter[4] = -Cx::new(xx, xy);
        by_parameter[5] = -Cx::new(xy, yy);
        response
    }

    #[inline(always)]
    fn expand<R: Real>(&self, x: R, y: R) -> (Cx<R>, [R; 3]) {
        let f = self.frame(x, y);
        let deflection = (f.zeta * self.sum(f.s)).scale(f.power);
        let (convergence, shear) = self.distortion(&f, deflection);
        (deflection, Response { deflection, convergence, shear }.hessian())
    }

    fn third_derivatives(&self, x: f64, y: f64) -> [f64; 4] {
        let at = self.frame(x, y);
        let (kappa, gamma) = self.distortion(&at, (at.zeta * self.sum(at.s)).scale(at.power));
        // F = ∂*κ with κ ∝ |ζ|^{−t}, ∂*|ζ|² = ζ − εζ̄; G = ∂*γ from ∂* of z̄γ = (1−t)α − zκ.
        let f = (at.zeta - at.epsilon * at.zeta.conj()) * (-0.5 * self.t * kappa * at.inverse);
        let inverse = 1.0 / at.z.norm_sqr();
        let g = (gamma * (-self.t) - at.z * f) * at.z.scale(inverse);
        // ∂xκ = 2Re F, ∂yκ = 2Im F; ∂xγ = F + G, ∂yγ = i(F − G).
        [3.0 * f.re + g.re, f.im + g.im, f.re - g.re, 3.0 * f.im - g.im]
    }
}

impl Described for Epl {
    const NAMES: &'static [Name] = &[
        Name { name: "EPL", held: &[] },
        Name { name: "SIE", held: &[("gamma", 2.0)] },
        Name { name: "SIS", held: &[("gamma", 2.0), ("e1", 0.0), ("e2", 0.0)] },
    ];
    const PARAMETERS: &'static [Parameter] = &placed_ellipse![Parameter::EINSTEIN_RADIUS, Parameter::SLOPE];

    fn of_parameters(values: &[f64]) -> Result<Self> {
        let [einstein_radius, slope, e1, e2, x, y] = exactly(values)?;
        Self::new(einstein_radius, slope, [e1, e2], [x, y])
    }

    fn centre_arcsec(&self) -> Option<[f64; 2]> {
        Some(self.centre_arcsec)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn build(p: &[f64]) -> Epl {
        Epl::new(p[0], p[1], [p[2], p[3]], [p[4], p[5]]).unwrap()
    }

    #[test]
    fn extremes_stay_finite_and_continuous() {
        for slope in [1.0 + 1e-9, 2.0, 3.0 - 1e-9] {
            for e in [0.0, 1e-300, 1e-12, 0.3, 0.85] {
                let lens = build(&[1.2, slope, e, -0.5 * e, 0.0, 0.0]);
                for x in [0.0, 1e-300, 1e-12, 1e-9, 1e-3, 1.0, 1e6] {
                    let mut by_parameter = [Cx::new(0.0, 0.0); 6];
                    lens.respond(x, -0.3 * x, &mut by_parameter);
                    let mut numbers = vec![lens.potential(x, -0.3 * x)];
                    numbers.extend(lens.deflection(x, -0.3 * x));
                    numbers.extend(lens.hessian(x, -0.3 * x));
                    numbers.extend(lens.third_derivatives(x, -0.3 * x));
                    numbers.extend(by_parameter.iter().flat_map(|d| [d.re, d.im]));
                    assert!(numbers.iter().all(|v| v.is_finite()), "γ {slope}, e {e}, x {x}: {numbers:?}");
                }
            }
        }
        // q → 1: the deflection of the round lens, to the size of e.
        let (round, nearly) =
            (build(&[1.2, 2.3, 0.0, 0.0, 0.0, 0.0]), build(&[1.2, 2.3, 1e-10, 0.0, 0.0, 0.0]));
        assert!((round.deflection(0.7, 0.4)[0] - nearly.deflection(0.7, 0.4)[0]).abs() < 3e-10);
    }

    #[test]
    fn parameters_outside_their_domain_are_refused() {
        for (theta_e, slope, e) in
            [(-1.0, 2.0, 0.0), (1.0, 1.0, 0.0), (1.0, 3.0, 0.0), (1.0, 2.0, 1.0), (f64::NAN, 2.0, 0.0)]
        {
            assert!(Epl::new(theta_e, slope, [e, 0.0], [0.0, 0.0]).is_err());
        }
    }
}
