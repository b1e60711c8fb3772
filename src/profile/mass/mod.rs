//! Mass profiles: potential ψ, deflection α = ∇ψ, Hessian and third derivatives, all analytic.

mod einstein_radius;
mod epl;
mod external;
mod kind;
mod nfw;
pub mod nfw_radial;
mod point_mass;
mod radial;
mod response;
mod sersic;
mod truncated_nfw;

pub use einstein_radius::{einstein_radius_arcsec, mean_convergence};
pub use epl::Epl;
pub use external::External;
pub use kind::MassKind;
pub use nfw::Nfw;
pub use point_mass::PointMass;
pub(crate) use radial::RadialDerivatives;
pub use radial::{Amplitude, Radial, RadialLaw};
pub(crate) use response::MOST_PARAMETERS;
pub use response::{Response, Responses, deflections, responses};
pub use sersic::SersicMass;
pub use truncated_nfw::{TruncatedNfw, potential as truncated_potential, truncated};

use crate::numerics::complex::Cx;

/// A thin lens in angular units, its deflection reduced to one source.
///
/// Arguments are angles (arcsec) from the observer's axis; ψ is in arcsec², α in arcsec,
/// its Hessian without unit, third derivatives per arcsec.
pub trait MassProfile: Sync {
    /// Lensing potential ψ(θ) in arcsec², zero at the centre of the profile.
    fn potential(&self, x_arcsec: f64, y_arcsec: f64) -> f64;
    /// Reduced deflection (∂ψ/∂x, ∂ψ/∂y) in arcsec.
    fn deflection(&self, x_arcsec: f64, y_arcsec: f64) -> [f64; 2];
    /// Hessian (ψ_xx, ψ_xy, ψ_yy).
    fn hessian(&self, x_arcsec: f64, y_arcsec: f64) -> [f64; 3];
    /// Third derivatives (ψ_xxx, ψ_xxy, ψ_xyy, ψ_yyy) per arcsec.
    fn third_derivatives(&self, x_arcsec: f64, y_arcsec: f64) -> [f64; 4];
    /// Names of the parameters, as in lenstronomy; the centre comes last.
    fn parameters(&self) -> &'static [&'static str];
    /// ∂(α_x + iα_y)/∂p for each of [`Self::parameters`], whose number is the length of `by_parameter`.
    fn parameter_derivatives(&self, x_arcsec: f64, y_arcsec: f64, by_parameter: &mut [Cx<f64>]);
}

/// Every mass profile that can stand in a lens plane: one match lists them all.
#[derive(Debug, Clone)]
pub enum MassModel {
    /// Elliptical power law.
    Epl(Epl),
    /// Navarro–Frenk–White halo.
    Nfw(Nfw),
    /// Truncated NFW halo.
    TruncatedNfw(TruncatedNfw),
    /// Sérsic profile of the convergence.
    Sersic(SersicMass),
    /// Point mass.
    PointMass(PointMass),
    /// Convergence, shear and flexion from outside.
    External(External),
}

macro_rules! each_model {
    ($self:ident, $model:ident => $call:expr) => {
        match $self {
            MassModel::Epl($model) => $call,
            MassModel::Nfw($model) => $call,
            MassModel::TruncatedNfw($model) => $call,
            MassModel::Sersic($model) => $call,
            MassModel::PointMass($model) => $call,
            MassModel::External($model) => $call,
        }
    };
}

impl MassProfile for MassModel {
    fn potential(&self, x: f64, y: f64) -> f64 {
        each_model!(self, model => model.potential(x, y))
    }

    fn deflection(&self, x: f64, y: f64) -> [f64; 2] {
        each_model!(self, model => model.deflection(x, y))
    }

    fn hessian(&self, x: f64, y: f64) -> [f64; 3] {
        each_model!(self, model => model.hessian(x, y))
    }

    fn third_derivatives(&self, x: f64, y: f64) -> [f64; 4] {
        each_model!(self, model => model.third_derivatives(x, y))
    }

    fn parameters(&self) -> &'static [&'static str] {
        each_model!(self, model => model.parameters())
    }

    fn parameter_derivatives(&self, x: f64, y: f64, by_parameter: &mut [Cx<f64>]) {
        each_model!(self, model => model.parameter_derivatives(x, y, by_parameter))
    }
}

#[cfg(test)]
pub(crate) mod derivative_checks {
    //! Finite-difference checks shared by the tests of all mass profiles.
    use super::MassProfile;
    use crate::numerics::complex::Cx;

    /// Each ∂α/∂p against differences of the profiles that `build` makes of parameters, to `relative` of the largest.
    pub fn assert_parameter_derivatives<P: MassProfile>(
        build: impl Fn(&[f64]) -> P,
        parameters: &[f64],
        [x, y]: [f64; 2],
        relative: f64,
    ) {
        let profile = build(parameters);
        let names = profile.parameters();
        assert_eq!(names.len(), parameters.len());
        let mut got = vec![Cx::new(0.0, 0.0); names.len()];
        profile.parameter_derivatives(x, y, &mut got);
        for (i, name) in names.iter().enumerate() {
            let step = 1e-2 * parameters[i].abs().clamp(0.02, 1.0);
            let want = [0, 1].map(|c| {
                derivative(
                    |p| {
                        let mut moved = parameters.to_vec();
                        moved[i] = p;
                        build(&moved).deflection(x, y)[c]
                    },
                    parameters[i],
                    step,
                )
            });
            let scale = want[0].hypot(want[1]).max(1e-6);
            for (got, want) in [(got[i].re, want[0]), (got[i].im, want[1])] {
                assert!(
                    (got - want).abs() <= relative * scale,
                    "∂α/∂{name} at ({x}, {y}) of {parameters:?}: {got:e}, differences {want:e}"
                );
            }
        }
    }

    /// Richardson-extrapolated central difference of `f` at `x`: error O(h⁶).
    pub fn derivative(f: impl Fn(f64) -> f64, x: f64, h: f64) -> f64 {
        let d = |h: f64| (f(x + h) - f(x - h)) / (2.0 * h);
        let (d1, d2, d4) = (d(h), d(h / 2.0), d(h / 4.0));
        let (r1, r2) = ((4.0 * d2 - d1) / 3.0, (4.0 * d4 - d2) / 3.0);
        (16.0 * r2 - r1) / 15.0
    }

    /// α = ∇ψ, H = ∂α, T = ∂H at (x, y), each to `relative` of the largest component.
    pub fn assert_consistent(profile: &impl MassProfile, x: f64, y: f64, step: f64, relative: f64) {
        let check = |name: &str, got: f64, want: f64, scale: f64| {
            assert!(
                (got - want).abs() <= relative * scale,
                "{name} at ({x}, {y}): {got:e}, differences {want:e}"
            );
        };
        let alpha = profile.deflection(x, y);
        let scale = alpha[0].hypot(alpha[1]).max(1e-300);
        check("α_x", alpha[0], derivative(|x| profile.potential(x, y), x, step), scale);
        check("α_y", alpha[1], derivative(|y| profile.potential(x, y), y, step), scale);
        let h = profile.hessian(x, y);
        let scale = h.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        check("ψ_xx", h[0], derivative(|x| profile.deflection(x, y)[0], x, step), scale);
        check("ψ_xy", h[1], derivative(|y| profile.deflection(x, y)[0], y, step), scale);
        check("ψ_yx", h[1], derivative(|x| profile.deflection(x, y)[1], x, step), scale);
        check("ψ_yy", h[2], derivative(|y| profile.deflection(x, y)[1], y, step), scale);
        let t = profile.third_derivatives(x, y);
        let scale = t.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        check("ψ_xxx", t[0], derivative(|x| profile.hessian(x, y)[0], x, step), scale);
        check("ψ_xxy", t[1], derivative(|y| profile.hessian(x, y)[0], y, step), scale);
        check("ψ_xyy", t[2], derivative(|y| profile.hessian(x, y)[1], y, step), scale);
        check("ψ_yyy", t[3], derivative(|y| profile.hessian(x, y)[2], y, step), scale);
    }
}
