//! Lenses whose potential depends on one radius: round, or with elliptical isopotentials.

use super::nfw_radial::U_FLOOR;
use super::{Described, MassProfile, Response};
use crate::error::Result;
use crate::numerics::complex::Cx;
use crate::numerics::real::Real;
use crate::profile::parameter::{Name, Parameter, checked_centre, checked_ellipticity};

/// How the deflection falls off: α = k·m(u)·θ with u = (r/scale)².
pub trait RadialLaw: Copy + Sync {
    /// lenstronomy's names for the lens of this law.
    const NAMES: &'static [Name];
    /// The parameters of the law, at most three, followed by e1, e2 and the centre.
    const PARAMETERS: &'static [Parameter];

    /// The lens of as many values as it has parameters.
    ///
    /// # Errors
    /// Another number of values, or one outside its domain.
    fn of_parameters(values: &[f64]) -> Result<Radial<Self>>;
    /// (m, u·m′, u²·m″) at u > 0.
    fn radial<R: Real>(&self, u: R) -> [R; 3];
    /// ∫m du, the potential in units of k·scale²/2.
    fn potential(&self, u: f64) -> f64;
    /// m(u), with the bits of [`Self::radial`].
    fn m<R: Real>(&self, u: R) -> R;
    /// (m, u·m′), and ∂(k·m)/∂p at a fixed point for the parameters of the law; unused ones are 0.
    fn respond<R: Real>(&self, u: R, k: f64, scale_arcsec: f64) -> ([R; 2], [R; 3]);
}

/// ∂(k·m)/∂scale at fixed k, p₁ = u·m′: u ∝ scale⁻².
#[inline(always)]
pub(super) fn by_scale<R: Real>(p1: R, k: f64, scale_arcsec: f64) -> R {
    p1 * (-2.0 * k) / R::splat(scale_arcsec)
}

/// A lens of one radial law: ψ(θ) = (k·scale²/2)·P(|Mθ|²/scale²), P = ∫m du.
///
/// M is the identity for a round lens. With [`Radial::with_elliptical_potential`] the isopotentials are ellipses, as in
/// lenstronomy's `*_ELLIPSE_POTENTIAL` (square-average radius): rotate by φ, x√(1−ε), y√(1+ε), ε = (1−q²)/(1+q²).
/// With t = Mθ, r = |t|, p₁ = u·m′ and p₂ = u²·m″ the round derivatives are
/// H_ij = k[m δ_ij + 2p₁ t_i t_j/r²], T_ijk = (2k/r²)[p₁(δ_ij t_k + δ_ik t_j + δ_jk t_i) + 2p₂ t_i t_j t_k/r²];
/// each index is then carried back by M.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radial<L> {
    law: L,
    centre_arcsec: [f64; 2],
    scale_arcsec: f64,
    k: f64,
    ellipticity: [f64; 2],
    /// Rows of M.
    axes: [[f64; 2]; 2],
}

impl<L: RadialLaw> Radial<L> {
    /// A round lens; `scale_arcsec` > 0 and finite `k` are the caller's to name in its errors.
    pub(super) fn round(law: L, scale_arcsec: f64, k: f64, centre_arcsec: [f64; 2]) -> Result<Self> {
        let (centre_arcsec, ellipticity) = (checked_centre(centre_arcsec)?, [0.0; 2]);
        Ok(Self { law, centre_arcsec, scale_arcsec, k, ellipticity, axes: [[1.0, 0.0], [0.0, 1.0]] })
    }

    /// The same lens with elliptical isopotentials of ellipticity (e1, e2).
    ///
    /// # Errors
    /// When |e| ≥ 1.
    pub fn with_elliptical_potential(mut self, ellipticity: [f64; 2]) -> Result<Self> {
        let e = checked_ellipticity("potential", ellipticity)?;
        let q = (1.0 - e) / (1.0 + e);
        let epsilon = (1.0 - q * q) / (1.0 + q * q);
        let (sin, cos) = (0.5 * ellipticity[1].atan2(ellipticity[0])).sin_cos();
        let (a, b) = ((1.0 - epsilon).sqrt(), (1.0 + epsilon).sqrt());
        self.ellipticity = ellipticity;
        self.axes = [[a * cos, a * sin], [-b * sin, b * cos]];
        Ok(self)
    }

    #[inline(always)]
    fn offset<R: Real>(&self, x: R, y: R) -> Offset<R> {
        let d = [x + -self.centre_arcsec[0], y + -self.centre_arcsec[1]];
        let t = self.axes.map(|row| d[0] * row[0] + d[1] * row[1]);
        let u = (t[0] * t[0] + t[1] * t[1]) / R::splat(self.scale_arcsec * self.scale_arcsec);
        Offset { d, t, u: u.max(U_FLOOR) }
    }

    /// 1/r².
    #[inline(always)]
    fn inv_r2<R: Real>(&self, at: &Offset<R>) -> R {
        R::splat(1.0) / (at.u * (self.scale_arcsec * self.scale_arcsec))
    }

    /// A vector of the frame of the axes, back on the sky.
    #[inline(always)]
    fn carried_back<R: Real>(&self, t: [R; 2]) -> [R; 2] {
        [0, 1].map(|a| t[0] * self.axes[0][a] + t[1] * self.axes[1][a])
    }

    #[inline(always)]
    fn hessian_at<R: Real>(&self, at: &Offset<R>, m: R, p1: R) -> [R; 3] {
        let [xx, xy, yy] = radial_hessian(self.k, m, p1, at.t, self.inv_r2(at));
        let m = &self.axes;
        [(0, 0), (0, 1), (1, 1)]
            .map(|(a, b)| (xx * m[0][b] + xy * m[1][b]) * m[0][a] + (xy * m[0][b] + yy * m[1][b]) * m[1][a])
    }

    /// Changes (∂E1, ∂E2) of E = 2e/(1+|e|²) by e1 and by e2.
    #[inline(always)]
    fn change_of_axes(&self) -> [[f64; 2]; 2] {
        let [e1, e2] = self.ellipticity;
        let inverse = 1.0 / (1.0 + e1 * e1 + e2 * e2);
        let (own, cross) =
            (|e: f64| 2.0 * inverse * (1.0 - 2.0 * e * e * inverse), -4.0 * e1 * e2 * inverse * inverse);
        [[own(e1), cross], [cross, own(e2)]]
    }
}

/// Offset from the centre, the same in the frame of the axes, and u, floored at the centre.
struct Offset<R> {
    d: [R; 2],
    t: [R; 2],
    u: R,
}

impl<L: RadialLaw> MassProfile for Radial<L> {
    fn potential(&self, x: f64, y: f64) -> f64 {
        0.5 * self.k * self.scale_arcsec.powi(2) * self.law.potential(self.offset(x, y).u)
    }

    #[inline(always)]
    fn deflect<R: Real>(&self, x: R, y: R) -> Cx<R> {
        let at = self.offset(x, y);
        let km = self.law.m(at.u) * self.k;
        let [re, im] = self.carried_back(at.t);
        Cx::new(km * re, km * im)
    }

    /// α = k·m(u)·Nd with d = θ − c, u = dᵀNd/scale² and N = MᵀM = 1 − [[E1, E2], [E2, −E1]], E = 2e/(1+|e|²).
    #[inline(always)]
    fn respond<R: Real>(&self, x: R, y: R, by_parameter: &mut [Cx<R>]) -> Response<R> {
        let at = self.offset(x, y);
        let ([m, p1], own) = self.law.respond(at.u, self.k, self.scale_arcsec);
        let [nx, ny] = self.carried_back(at.t);
        let hessian = self.hessian_at(&at, m, p1);
        let [xx, xy, yy] = hessian;
        let (of_law, of_place) = by_parameter.split_at_mut(L::PARAMETERS.len() - 4);
        for (out, strength) in of_law.iter_mut().zip(own) {
            *out = Cx::new(strength * nx, strength * ny);
        }
        if let [d_e1, d_e2, d_x, d_y] = of_place {
            let [dx, dy] = at.d;
            for (out, [g1, g2]) in [d_e1, d_e2].into_iter().zip(self.change_of_axes()) {
                // δN d and δu from the changes g of E.
                let (vx, vy) = (-(dx * g1 + dy * g2), -(dx * g2 - dy * g1));
                let scale_sqr = R::splat(self.scale_arcsec * self.scale_arcsec);
                let d_m = p1 / at.u * (dx * vx + dy * vy) / scale_sqr;
                *out = Cx::new((d_m * nx + m * vx) * self.k, (d_m * ny + m * vy) * self.k);
            }
            *d_x = Cx::new(-xx, -xy);
            *d_y = Cx::new(-xy, -yy);
        }
        let km = m * self.k;
        Response::new(Cx::new(km * nx, km * ny), hessian)
    }

    #[inline(always)]
    fn expand<R: Real>(&self, x: R, y: R) -> (Cx<R>, [R; 3]) {
        let at = self.offset(x, y);
        let [m, p1, _] = self.law.radial(at.u);
        let (km, [nx, ny]) = (m * self.k, self.carried_back(at.t));
        (Cx::new(km * nx, km * ny), self.hessian_at(&at, m, p1))
    }

    fn third_derivatives(&self, x: f64, y: f64) -> [f64; 4] {
        let at = self.offset(x, y);
        let [m, p1, p2] = self.law.radial(at.u);
        let (t, inv_r2) = (at.t, self.inv_r2(&at));
        let t = RadialDerivatives { k: self.k, m, p1, p2, t, inv_r2 }.third_derivatives();
        let m = &self.axes;
        [(0, 0, 0), (0, 0, 1), (0, 1, 1), (1, 1, 1)].map(|(a, b, c)| {
            let mut sum = 0.0;
            for (i, j, k) in TRIPLES {
                sum += m[i][a] * m[j][b] * m[k][c] * t[i + j + k];
            }
            sum
        })
    }
}

impl<L: RadialLaw> Described for Radial<L> {
    const NAMES: &'static [Name] = L::NAMES;
    const PARAMETERS: &'static [Parameter] = L::PARAMETERS;

    fn of_parameters(values: &[f64]) -> Result<Self> {
        L::of_parameters(values)
    }

    fn centre_arcsec(&self) -> Option<[f64; 2]> {
        Some(self.centre_arcsec)
    }
}

/// All index triples of a 2×2×2 tensor.
const TRIPLES: [(usize, usize, usize); 8] =
    [(0, 0, 0), (0, 0, 1), (0, 1, 0), (0, 1, 1), (1, 0, 0), (1, 0, 1), (1, 1, 0), (1, 1, 1)];

/// Hessian and third derivatives of a round lens from its radial functions (see [`Radial`]).
#[derive(Debug, Clone, Copy)]
pub(crate) struct RadialDerivatives {
    pub k: f64,
    pub m: f64,
    pub p1: f64,
    pub p2: f64,
    /// Offset from the centre, arcsec.
    pub t: [f64; 2],
    /// 1/r², per arcsec².
    pub inv_r2: f64,
}

impl RadialDerivatives {
    #[inline(always)]
    pub fn hessian(&self) -> [f64; 3] {
        radial_hessian(self.k, self.m, self.p1, self.t, self.inv_r2)
    }

    #[inline(always)]
    pub fn third_derivatives(&self) -> [f64; 4] {
        let by_r2 = 2.0 * self.k * self.inv_r2;
        let (a, b) = (by_r2 * self.p1, 2.0 * by_r2 * self.inv_r2 * self.p2);
        let [x, y] = self.t;
        let (xx, yy) = (b * x * x, b * y * y);
        [x * (3.0 * a + xx), y * (a + xx), x * (a + yy), y * (3.0 * a + yy)]
    }
}

/// Hessian of a round lens at `t`.
#[inline(always)]
fn radial_hessian<R: Real>(k: f64, m: R, p1: R, t: [R; 2], inv_r2: R) -> [R; 3] {
    let (isotropic, directed) = (m * k, p1 * (2.0 * k) * inv_r2);
    [isotropic + directed * t[0] * t[0], directed * t[0] * t[1], isotropic + directed * t[1] * t[1]]
}
