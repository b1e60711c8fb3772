//! Shear from outside by its strength and direction.

use std::f64::consts::FRAC_PI_2;

use super::external::{ORIGIN_X, ORIGIN_Y};
use super::{Described, External, MassProfile, Response};
use crate::error::Result;
use crate::numerics::complex::Cx;
use crate::numerics::real::Real;
use crate::profile::parameter::{Name, Parameter, PriorShape, exactly};

/// Shear γ·e^{2iψ} about an origin, as lenstronomy's `SHEAR_GAMMA_PSI`: [`External`] by other parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolarShear {
    strength: f64,
    /// (cos 2ψ, sin 2ψ).
    direction: [f64; 2],
    field: External,
}

impl PolarShear {
    /// Shear of `strength` that stretches images along `angle_rad`, counted from the x axis.
    ///
    /// # Errors
    /// When a number is not finite.
    pub fn new(strength: f64, angle_rad: f64, origin_arcsec: [f64; 2]) -> Result<Self> {
        let (sin, cos) = (2.0 * angle_rad).sin_cos();
        let field = External::new(0.0, [strength * cos, strength * sin], [0.0; 4], origin_arcsec)?;
        Ok(Self { strength, direction: [cos, sin], field })
    }
}

impl MassProfile for PolarShear {
    fn potential(&self, x: f64, y: f64) -> f64 {
        self.field.potential(x, y)
    }

    #[inline(always)]
    fn deflect<R: Real>(&self, x: R, y: R) -> Cx<R> {
        self.field.deflect(x, y)
    }

    #[inline(always)]
    fn respond<R: Real>(&self, x: R, y: R, by_parameter: &mut [Cx<R>]) -> Response<R> {
        let mut by_field = [Cx::zero(); External::PARAMETERS.len()];
        let response = self.field.respond(x, y, &mut by_field);
        let ([_, by_1, by_2, .., by_x, by_y], [cos, sin], turned) =
            (by_field, self.direction, 2.0 * self.strength);
        let own = [by_1 * cos + by_2 * sin, by_2 * (turned * cos) - by_1 * (turned * sin), by_x, by_y];
        by_parameter.iter_mut().zip(own).for_each(|(out, own)| *out = own);
        response
    }

    #[inline(always)]
    fn expand<R: Real>(&self, x: R, y: R) -> (Cx<R>, [R; 3]) {
        self.field.expand(x, y)
    }

    fn third_derivatives(&self, x: f64, y: f64) -> [f64; 4] {
        self.field.third_derivatives(x, y)
    }
}

impl Described for PolarShear {
    const NAMES: &'static [Name] = &[Name { name: "SHEAR_GAMMA_PSI", held: &[] }];
    const PARAMETERS: &'static [Parameter] = &[
        Parameter {
            name: "gamma_ext",
            label: "γ_{ext}",
            usual_prior: PriorShape::Uniform([0.0, 0.5]),
            ..Parameter::FIELD
        },
        Parameter {
            name: "psi_ext",
            unit: "rad",
            label: "ψ_{ext}",
            usual_prior: PriorShape::Uniform([-FRAC_PI_2, FRAC_PI_2]),
            ..Parameter::FIELD
        },
        ORIGIN_X,
        ORIGIN_Y,
    ];

    fn of_parameters(values: &[f64]) -> Result<Self> {
        let [strength, angle_rad, x, y] = exactly(values)?;
        Self::new(strength, angle_rad, [x, y])
    }
}
