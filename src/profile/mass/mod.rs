//! Mass profiles: potential ψ, deflection α = ∇ψ, Hessian and third derivatives, all analytic.

mod epl;
mod nfw;
pub mod nfw_radial;
mod truncated_nfw;

pub use epl::Epl;
pub use nfw::Nfw;
pub use truncated_nfw::{TruncatedNfw, potential as truncated_potential, truncated};

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
}

/// Every mass profile that can stand in a lens plane: one match lists them all.
#[derive(Debug, Clone, Copy)]
pub enum MassModel {
    /// Elliptical power law.
    Epl(Epl),
    /// Navarro–Frenk–White halo.
    Nfw(Nfw),
    /// Truncated NFW halo.
    TruncatedNfw(TruncatedNfw),
}

macro_rules! each_model {
    ($self:ident, $model:ident => $call:expr) => {
        match $self {
            MassModel::Epl($model) => $call,
            MassModel::Nfw($model) => $call,
            MassModel::TruncatedNfw($model) => $call,
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
}

/// Hessian and third derivatives of an axisymmetric lens from its radial functions.
///
/// With u = (r/r_s)², α = k·m(u)·θ, p₁ = u·m′ and p₂ = u²·m″ (unit vector n = θ/r):
/// H_ij = k[m δ_ij + 2p₁ n_i n_j] and
/// T_ijk = (2k/r)[p₁(δ_ij n_k + δ_ik n_j + δ_jk n_i) + 2p₂ n_i n_j n_k].
#[derive(Debug, Clone, Copy)]
pub(crate) struct RadialDerivatives {
    pub k: f64,
    pub m: f64,
    pub p1: f64,
    pub p2: f64,
}

impl RadialDerivatives {
    #[inline(always)]
    pub fn hessian(&self, n: [f64; 2]) -> [f64; 3] {
        let (isotropic, directed) = (self.k * self.m, 2.0 * self.k * self.p1);
        [isotropic + directed * n[0] * n[0], directed * n[0] * n[1], isotropic + directed * n[1] * n[1]]
    }

    #[inline(always)]
    pub fn third_derivatives(&self, n: [f64; 2], inv_r: f64) -> [f64; 4] {
        let (a, b) = (2.0 * self.k * inv_r * self.p1, 4.0 * self.k * inv_r * self.p2);
        let [nx, ny] = n;
        [
            nx * (3.0 * a + b * nx * nx),
            ny * (a + b * nx * nx),
            nx * (a + b * ny * ny),
            ny * (3.0 * a + b * ny * ny),
        ]
    }
}

#[cfg(test)]
pub(crate) mod derivative_checks {
    //! Finite-difference checks shared by the tests of all mass profiles.
    use super::MassProfile;

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
