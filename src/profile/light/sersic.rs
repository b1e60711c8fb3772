//! The elliptical Sérsic light profile (Sérsic 1963), as lenstronomy's `SERSIC_ELLIPSE`.

use statrs::function::gamma::ln_gamma;

use super::LightProfile;
use crate::error::{Domain, Result};
use crate::numerics::complex::Cx;
use crate::numerics::dispatch::kernel;
use crate::numerics::elementary::Elementary;
use crate::numerics::real::{Lanes, Real};
use crate::profile::parameter::{
    Description, Guess, Name, Parameter, PriorShape, checked_centre, checked_ellipticity, exactly,
    placed_ellipse,
};

/// Elliptical Sérsic profile I = I_R·exp{−b_n[(R/R_s)^{1/n} − 1]}, R = √(qx² + y²/q) in its own axes.
///
/// Without rotation, R² = [(1+|e|²)(x²+y²) − 2e1(x²−y²) − 4e2 xy]/(1−|e|²), smooth at e = 0.
///
/// b_n = 1.9992n − 0.3271 (Capaccioli 1989), good to 1e-3 for 0.5 < n < 10 and exact by convention here:
/// the flux below uses the same b_n. At R ≤ 1e-4″ the brightness is that of R = 1e-4″, as in lenstronomy 1.14.2, and flat; an n = 6
/// profile loses 1e-4 of its flux there.
#[derive(Debug, Clone, Copy)]
pub struct Sersic {
    amplitude: f64,
    radius_arcsec: f64,
    index: f64,
    b_n: f64,
    ellipticity: [f64; 2],
    centre_arcsec: [f64; 2],
}

/// R² within which the brightness is flat, arcsec².
const LEAST_R_SQR: f64 = 1e-4 * 1e-4;

/// ∂b_n/∂n.
pub const B_N_SLOPE: f64 = 1.9992;

/// b_n of the Sérsic profile, 1.9992n − 0.3271.
pub fn b_n(index: f64) -> f64 {
    B_N_SLOPE * index - 0.3271
}

/// Surface brightness at the half-light radius for a total flux: F/(2πnR²eᵇb⁻²ⁿΓ(2n)), per arcsec².
///
/// ```
/// use haloray::profile::light::Sersic;
/// // Magnitude 23, zero point 25.96, R = 0.3″, n = 6 (CONVENTIONS.md section 5).
/// let flux = 10f64.powf(-0.4 * (23.0 - 25.96));
/// let s = Sersic::with_flux(flux, 0.3, 6.0, [0.0, 0.0], [0.0, 0.0]).unwrap();
/// assert!((s.amplitude() / 6.150082191862573 - 1.0).abs() < 1e-13);
/// ```
fn amplitude_of_flux(flux: f64, radius: f64, index: f64) -> f64 {
    let b = b_n(index);
    let ln_shape = b - 2.0 * index * b.ln() + ln_gamma(2.0 * index);
    flux / (2.0 * std::f64::consts::PI * index * radius * radius * ln_shape.exp())
}

impl Sersic {
    /// Profile of the given total flux.
    ///
    /// # Errors
    /// When flux < 0, radius ≤ 0, the index is outside 0.3–10 or |e| ≥ 1.
    pub fn with_flux(
        flux: f64,
        radius_arcsec: f64,
        index: f64,
        ellipticity: [f64; 2],
        centre_arcsec: [f64; 2],
    ) -> Result<Self> {
        Domain::NON_NEGATIVE.check("flux", flux)?;
        Parameter::SERSIC_RADIUS.domain.check("radius_arcsec", radius_arcsec)?;
        Parameter::SERSIC_INDEX.domain.check("sersic_index", index)?;
        checked_ellipticity("light", ellipticity)?;
        checked_centre(centre_arcsec)?;
        Ok(Self {
            amplitude: amplitude_of_flux(flux, radius_arcsec, index),
            radius_arcsec,
            index,
            b_n: b_n(index),
            ellipticity,
            centre_arcsec,
        })
    }

    /// Profile of surface brightness 1 at the half-light radius, for `parameters` = [`Self::PARAMETERS`].
    ///
    /// # Errors
    /// As [`Self::with_flux`].
    pub fn of_unit_amplitude(parameters: [f64; 6]) -> Result<Self> {
        let [radius, index, e1, e2, x, y] = parameters;
        Ok(Self { amplitude: 1.0, ..Self::with_flux(1.0, radius, index, [e1, e2], [x, y])? })
    }

    /// The same profile with another surface brightness at the half-light radius.
    ///
    /// # Errors
    /// A negative one.
    pub fn of_amplitude(self, amplitude: f64) -> Result<Self> {
        Domain::NON_NEGATIVE.check("amplitude", amplitude)?;
        Ok(Self { amplitude, ..self })
    }

    /// The parameters beside the amplitude, as those of a lens.
    pub const PARAMETERS: [Parameter; 6] = placed_ellipse![
        Parameter::SERSIC_RADIUS,
        Parameter { guess: Guess::Fixed(3.0), ..Parameter::SERSIC_INDEX }
    ];

    /// The same parameters as those of a source.
    const PARAMETERS_OF_SOURCE: [Parameter; 6] = {
        const NEAR: PriorShape = PriorShape::Uniform([-1.0, 1.0]);
        let [radius, index, e1, e2, x, y] = Self::PARAMETERS;
        [
            Parameter { guess: Guess::SourceRadius, ..radius },
            Parameter { guess: Guess::About([1.5, 0.3]), ..index },
            e1,
            e2,
            Parameter { usual_prior: NEAR, ..x },
            Parameter { usual_prior: NEAR, ..y },
        ]
    };

    #[inline(always)]
    fn radius<R: Real>(&self, at: Cx<R>) -> SersicRadius<R> {
        let [e1, e2] = self.ellipticity;
        let e_sqr = e1 * e1 + e2 * e2;
        let inverse = 1.0 / (1.0 - e_sqr);
        let (x, y) = (at.re + -self.centre_arcsec[0], at.im + -self.centre_arcsec[1]);
        let (rho, difference, product) = (x * x + y * y, x * x - y * y, x * y);
        let r_sqr = (rho * (1.0 + e_sqr) - difference * (2.0 * e1) - product * (4.0 * e2)) * inverse;
        let r_sqr = r_sqr.max(LEAST_R_SQR);
        let exponent = (r_sqr * (1.0 / (self.radius_arcsec * self.radius_arcsec))).ln() * (0.5 / self.index);
        SersicRadius { x, y, rho, difference, product, r_sqr, exponent, inverse }
    }

    /// Surface brightness at one point or in the lanes.
    #[inline(always)]
    fn brightness<R: Real>(&self, at: Cx<R>) -> R {
        let s = self.radius(at).exponent.exp();
        ((s + -1.0) * -self.b_n).exp() * self.amplitude
    }

    /// Surface brightness, its gradient ∂I/∂x + i∂I/∂y, and its derivatives by [`Self::PARAMETERS`] in `by_parameter`.
    #[inline(always)]
    fn response<R: Real>(&self, at: Cx<R>, by_parameter: &mut [R; 6]) -> (R, Cx<R>) {
        let f = self.radius(at);
        let s = f.exponent.exp();
        let brightness = ((s + -1.0) * -self.b_n).exp() * self.amplitude;
        let [e1, e2] = self.ellipticity;
        // dI = −I[b s dy + b′(s−1)dn] with y = ln(R²/R_s²)/2n the exponent.
        let by_exponent = -(brightness * s * self.b_n);
        let flat = LEAST_R_SQR.next_up();
        let by_r_sqr = (by_exponent / (f.r_sqr * (2.0 * self.index))).unless_below(f.r_sqr, flat, 0.0);
        let scaled = by_r_sqr * (2.0 * f.inverse);
        let e_sqr = e1 * e1 + e2 * e2;
        let gradient = Cx::new(
            scaled * (f.x * (1.0 + e_sqr - 2.0 * e1) - f.y * (2.0 * e2)),
            scaled * (f.y * (1.0 + e_sqr + 2.0 * e1) - f.x * (2.0 * e2)),
        );
        by_parameter[0] = by_exponent * (-1.0 / (self.index * self.radius_arcsec));
        by_parameter[1] =
            by_exponent * f.exponent * (-1.0 / self.index) - brightness * (s + -1.0) * B_N_SLOPE;
        // ∂R²/∂e_j = [2e_j ρ − 2(x²−y²) or 4xy]/(1−e²) + 2e_j R²/(1−e²).
        by_parameter[2] = scaled * ((f.rho + f.r_sqr) * e1 - f.difference);
        by_parameter[3] = scaled * ((f.rho + f.r_sqr) * e2 - f.product * 2.0);
        by_parameter[4] = -gradient.re;
        by_parameter[5] = -gradient.im;
        (brightness, gradient)
    }

    /// [`Self::brightness`] in lanes.
    pub(crate) fn brightness_lanes(&self, at: Cx<Lanes>) -> Lanes {
        brightness_lanes(self, &at)
    }

    /// [`Self::response`] in lanes.
    pub(crate) fn response_lanes(&self, at: Cx<Lanes>, by_parameter: &mut [Lanes; 6]) -> (Lanes, Cx<Lanes>) {
        response_lanes(self, &at, by_parameter)
    }

    /// Surface brightness at the half-light radius, flux per arcsec².
    pub fn amplitude(&self) -> f64 {
        self.amplitude
    }

    /// Centre in arcsec.
    pub fn centre_arcsec(&self) -> [f64; 2] {
        self.centre_arcsec
    }
}

const NAMES: &[Name] =
    &[Name { name: "SERSIC_ELLIPSE", held: &[] }, Name { name: "SERSIC", held: &[("e1", 0.0), ("e2", 0.0)] }];

/// The light profiles that a lens may have, of unit amplitude.
pub static LENS_LIGHTS: &[Description<Sersic>] = &[Description {
    names: NAMES,
    parameters: &Sersic::PARAMETERS,
    builder: |values| Sersic::of_unit_amplitude(exactly(values)?),
}];

/// The light profiles that a source may have, of unit amplitude.
pub static SOURCES: &[Description<Sersic>] = &[Description {
    names: NAMES,
    parameters: &Sersic::PARAMETERS_OF_SOURCE,
    builder: |values| Sersic::of_unit_amplitude(exactly(values)?),
}];

impl LightProfile for Sersic {
    fn surface_brightness(&self, x: f64, y: f64) -> f64 {
        self.brightness(Cx::new(x, y))
    }
}

// Compiled once for each instruction set and called once for all lanes.
kernel! {
    fn brightness_lanes(light: &Sersic, at: &Cx<Lanes>) -> Lanes {
        light.brightness(*at)
    }
}

kernel! {
    fn response_lanes(light: &Sersic, at: &Cx<Lanes>, by_parameter: &mut [Lanes; 6]) -> (Lanes, Cx<Lanes>) {
        light.response(*at, by_parameter)
    }
}

/// What value and derivatives of the brightness share at one point.
struct SersicRadius<R> {
    x: R,
    y: R,
    /// x² + y², x² − y², xy.
    rho: R,
    difference: R,
    product: R,
    /// R², floored.
    r_sqr: R,
    /// ln(R/R_s)/n.
    exponent: R,
    /// 1/(1 − |e|²).
    inverse: f64,
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::numerics::differences::derivative;

    /// Derivatives at `at` equal differences over steps of `step`.
    fn derivatives_are_differences(parameters: [f64; 6], [x, y]: [f64; 2], step: f64) {
        let brightness =
            |p: [f64; 6], x: f64, y: f64| Sersic::of_unit_amplitude(p).unwrap().surface_brightness(x, y);
        let mut by = [0.0; 6];
        let light = Sersic::of_unit_amplitude(parameters).unwrap();
        let (value, gradient) = light.response(Cx::new(x, y), &mut by);
        assert_eq!(value, brightness(parameters, x, y));
        let check = |name: &str, got: f64, moved: &dyn Fn(f64) -> f64, at: f64| {
            let want = derivative(moved, at, step);
            assert!(
                (got - want).abs() <= 1e-7 * (value + want.abs()),
                "{name}: {got:e}, differences {want:e}"
            );
        };
        check("x", gradient.re, &|x| brightness(parameters, x, y), x);
        check("y", gradient.im, &|y| brightness(parameters, x, y), y);
        for (i, by) in by.into_iter().enumerate() {
            let moved = |v: f64| {
                let mut p = parameters;
                p[i] = v;
                brightness(p, x, y)
            };
            check(Sersic::PARAMETERS[i].name, by, &moved, parameters[i]);
        }
    }

    proptest! {
        #[test]
        fn derivatives_are_those_of_the_brightness(
            n in 0.5..8.0_f64, e1 in -0.4..0.4_f64, e2 in -0.4..0.4_f64, x in -1.0..1.0_f64, y in 0.1..1.0_f64,
        ) {
            derivatives_are_differences([0.3, n, e1, e2, 0.02, -0.05], [x, y], 1e-3);
        }

        #[test]
        fn it_is_flat_at_its_centre(n in 0.5..8.0_f64, e1 in -0.4..0.4_f64, x in -3e-5..3e-5_f64, y in -3e-5..3e-5_f64) {
            derivatives_are_differences([0.3, n, e1, 0.1, 0.0, 0.0], [x, y], 2e-6);
        }
    }
}
