//! Lenses whose potential depends on one radius: round, or with elliptical isopotentials.

use super::MassProfile;
use super::nfw_radial::U_FLOOR;
use crate::error::{Result, require};
use crate::numerics::complex::Cx;
use crate::numerics::real::{LANES, Lanes, Real};
use crate::profile::mass::Response;

/// How the deflection falls off: α = k·m(u)·θ with u = (r/scale)².
pub trait RadialLaw: Copy + Sync {
    /// (m, u·m′, u²·m″) at u > 0.
    fn radial(&self, u: f64) -> [f64; 3];
    /// ∫m du, the potential in units of k·scale²/2.
    fn potential(&self, u: f64) -> f64;
    /// Names of the parameters of the law followed by e1, e2 and the centre, as in lenstronomy.
    const PARAMETERS: &'static [&'static str];
    /// ∂(k·m)/∂p at a fixed point for the parameters of the law, from those of m at `u` and the scale; unused ones are 0.
    fn by_parameter(&self, at: &Amplitude) -> [f64; 3];

    /// m(u) in every lane, with the bits of [`Self::radial`].
    #[inline(always)]
    fn m_lanes(&self, u: Lanes) -> Lanes {
        Lanes(std::array::from_fn(|i| self.radial(u.0[i])[0]))
    }

    /// (m, u·m′) and [`Self::by_parameter`] in every lane, with the bits of the scalar functions.
    #[inline(always)]
    fn respond_lanes(&self, u: Lanes, k: f64, scale_arcsec: f64) -> ([Lanes; 2], [Lanes; 3]) {
        let (mut radial, mut by_parameter) = ([Lanes::ZERO; 2], [Lanes::ZERO; 3]);
        for i in 0..LANES {
            let [m, p1, _] = self.radial(u.0[i]);
            (radial[0].0[i], radial[1].0[i]) = (m, p1);
            let own = self.by_parameter(&Amplitude { k, scale_arcsec, u: u.0[i], m, p1 });
            by_parameter.iter_mut().zip(own).for_each(|(lanes, own)| lanes.0[i] = own);
        }
        (radial, by_parameter)
    }
}

/// What the law needs to differentiate k·m: k, the scale, u, m and p₁ = u·m′.
#[derive(Debug, Clone, Copy)]
pub struct Amplitude {
    /// Strength k.
    pub k: f64,
    /// Scale radius in arcsec.
    pub scale_arcsec: f64,
    /// u = (r/scale)².
    pub u: f64,
    /// m(u).
    pub m: f64,
    /// u·m′(u).
    pub p1: f64,
}

impl Amplitude {
    /// ∂(k·m)/∂scale at fixed k: u ∝ scale⁻².
    pub fn by_scale(&self) -> f64 {
        -2.0 * self.k * self.p1 / self.scale_arcsec
    }
}

/// A lens of one radial law: ψ(θ) = (k·scale²/2)·P(|Mθ|²/scale²), P = ∫m du.
///
/// M is the identity for a round lens. With [`Radial::with_elliptical_potential`] the isopotentials are ellipses, as in
/// lenstronomy's `*_ELLIPSE_POTENTIAL` (square-average radius): rotate by φ, x√(1−ε), y√(1+ε), ε = (1−q²)/(1+q²).
/// With t = Mθ, n = t/|t|, p₁ = u·m′ and p₂ = u²·m″ the round derivatives are
/// H_ij = k[m δ_ij + 2p₁ n_i n_j], T_ijk = (2k/r)[p₁(δ_ij n_k + δ_ik n_j + δ_jk n_i) + 2p₂ n_i n_j n_k];
/// each index is then carried back by M.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radial<L> {
    law: L,
    pub(super) centre_arcsec: [f64; 2],
    scale_arcsec: f64,
    k: f64,
    ellipticity: [f64; 2],
    /// Rows of M.
    axes: [[f64; 2]; 2],
}

impl<L: RadialLaw> Radial<L> {
    /// A round lens; `scale_arcsec` > 0 and finite `k` are the caller's to name in its errors.
    pub(super) fn round(law: L, scale_arcsec: f64, k: f64, centre_arcsec: [f64; 2]) -> Result<Self> {
        require(true, "centre_x_arcsec", centre_arcsec[0], "finite")?;
        require(true, "centre_y_arcsec", centre_arcsec[1], "finite")?;
        Ok(Self {
            law,
            centre_arcsec,
            scale_arcsec,
            k,
            ellipticity: [0.0; 2],
            axes: [[1.0, 0.0], [0.0, 1.0]],
        })
    }

    /// The same lens with elliptical isopotentials of ellipticity (e1, e2).
    ///
    /// # Errors
    /// When |e| ≥ 1.
    pub fn with_elliptical_potential(mut self, ellipticity: [f64; 2]) -> Result<Self> {
        let e = ellipticity[0].hypot(ellipticity[1]);
        require(e < 1.0, "|e| of the potential", e, "below 1")?;
        let q = (1.0 - e) / (1.0 + e);
        let epsilon = (1.0 - q * q) / (1.0 + q * q);
        let (sin, cos) = (0.5 * ellipticity[1].atan2(ellipticity[0])).sin_cos();
        let (a, b) = ((1.0 - epsilon).sqrt(), (1.0 + epsilon).sqrt());
        self.ellipticity = ellipticity;
        self.axes = [[a * cos, a * sin], [-b * sin, b * cos]];
        Ok(self)
    }

    fn offset(&self, x: f64, y: f64) -> Offset {
        let (dx, dy) = (x - self.centre_arcsec[0], y - self.centre_arcsec[1]);
        let t = self.axes.map(|row| row[0] * dx + row[1] * dy);
        let u = ((t[0] * t[0] + t[1] * t[1]) / (self.scale_arcsec * self.scale_arcsec)).max(U_FLOOR);
        let inv_r = 1.0 / (u.sqrt() * self.scale_arcsec);
        Offset { t, n: [t[0] * inv_r, t[1] * inv_r], inv_r, u }
    }

    fn derivatives(&self, u: f64) -> RadialDerivatives {
        let [m, p1, p2] = self.law.radial(u);
        RadialDerivatives { k: self.k, m, p1, p2 }
    }
}

impl<L: RadialLaw> Radial<L> {
    /// Offset in the frame of the axes, and u.
    #[inline(always)]
    fn offset_lanes(&self, dx: Lanes, dy: Lanes) -> ([Lanes; 2], Lanes) {
        let t = self.axes.map(|row| dx * row[0] + dy * row[1]);
        let u = (t[0] * t[0] + t[1] * t[1]) / Lanes::splat(self.scale_arcsec * self.scale_arcsec);
        (t, u.max(U_FLOOR))
    }

    /// Deflection in every lane.
    #[inline(always)]
    pub(super) fn deflection_lanes(&self, x: Lanes, y: Lanes) -> Cx<Lanes> {
        let (t, u) = self.offset_lanes(x + -self.centre_arcsec[0], y + -self.centre_arcsec[1]);
        let km = self.law.m_lanes(u) * self.k;
        let [re, im] = self.carried_back(t);
        Cx::new(km * re, km * im)
    }

    #[inline(always)]
    fn carried_back(&self, t: [Lanes; 2]) -> [Lanes; 2] {
        [0, 1].map(|a| t[0] * self.axes[0][a] + t[1] * self.axes[1][a])
    }

    /// Deflection, Hessian and parameter derivatives in every lane: the scalar formulae, step by step.
    #[inline(always)]
    pub(super) fn response_lanes(
        &self,
        x: Lanes,
        y: Lanes,
        by_parameter: &mut [Cx<Lanes>],
    ) -> Response<Lanes> {
        let (dx, dy) = (x + -self.centre_arcsec[0], y + -self.centre_arcsec[1]);
        let (t, u) = self.offset_lanes(dx, dy);
        let ([m, p1], own) = self.law.respond_lanes(u, self.k, self.scale_arcsec);
        let [nx, ny] = self.carried_back(t);
        let count = L::PARAMETERS.len() - 4;
        for (out, strength) in by_parameter.iter_mut().zip(own).take(count) {
            *out = Cx::new(strength * nx, strength * ny);
        }
        let hessian = self.hessian_lanes(t, u, m, p1);
        let [xx, xy, yy] = hessian;
        if let [d_e1, d_e2, d_x, d_y] = &mut by_parameter[count..count + 4] {
            for (out, [g1, g2]) in [d_e1, d_e2].into_iter().zip(self.change_of_axes()) {
                let (vx, vy) = (-(dx * g1 + dy * g2), -(dx * g2 - dy * g1));
                let d_m = p1 / u * (dx * vx + dy * vy) / Lanes::splat(self.scale_arcsec * self.scale_arcsec);
                *out = Cx::new((d_m * nx + m * vx) * self.k, (d_m * ny + m * vy) * self.k);
            }
            *d_x = Cx::new(-xx, -xy);
            *d_y = Cx::new(-xy, -yy);
        }
        let km = m * self.k;
        Response {
            deflection: Cx::new(km * nx, km * ny),
            convergence: (xx + yy) * 0.5,
            shear: Cx::new((xx - yy) * 0.5, xy),
        }
    }

    #[inline(always)]
    fn hessian_lanes(&self, t: [Lanes; 2], u: Lanes, m: Lanes, p1: Lanes) -> [Lanes; 3] {
        let inv_r = Lanes::splat(1.0) / (u.sqrt() * self.scale_arcsec);
        let n = t.map(|t| t * inv_r);
        let (isotropic, directed) = (m * self.k, p1 * (2.0 * self.k));
        let [xx, xy, yy] =
            [isotropic + directed * n[0] * n[0], directed * n[0] * n[1], isotropic + directed * n[1] * n[1]];
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

/// Position in the frame of the axes: offset, unit vector, 1/r and u, floored at the centre.
struct Offset {
    t: [f64; 2],
    n: [f64; 2],
    inv_r: f64,
    u: f64,
}

impl<L: RadialLaw> MassProfile for Radial<L> {
    fn potential(&self, x: f64, y: f64) -> f64 {
        0.5 * self.k * self.scale_arcsec.powi(2) * self.law.potential(self.offset(x, y).u)
    }

    fn deflection(&self, x: f64, y: f64) -> [f64; 2] {
        let o = self.offset(x, y);
        let km = self.k * self.law.radial(o.u)[0];
        let m = &self.axes;
        [0, 1].map(|a| km * (m[0][a] * o.t[0] + m[1][a] * o.t[1]))
    }

    fn hessian(&self, x: f64, y: f64) -> [f64; 3] {
        let o = self.offset(x, y);
        let [xx, xy, yy] = self.derivatives(o.u).hessian(o.n);
        let m = &self.axes;
        [(0, 0), (0, 1), (1, 1)]
            .map(|(a, b)| m[0][a] * (xx * m[0][b] + xy * m[1][b]) + m[1][a] * (xy * m[0][b] + yy * m[1][b]))
    }

    fn third_derivatives(&self, x: f64, y: f64) -> [f64; 4] {
        let o = self.offset(x, y);
        let t = self.derivatives(o.u).third_derivatives(o.n, o.inv_r);
        let m = &self.axes;
        [(0, 0, 0), (0, 0, 1), (0, 1, 1), (1, 1, 1)].map(|(a, b, c)| {
            let mut sum = 0.0;
            for (i, j, k) in TRIPLES {
                sum += m[i][a] * m[j][b] * m[k][c] * t[i + j + k];
            }
            sum
        })
    }

    fn parameters(&self) -> &'static [&'static str] {
        L::PARAMETERS
    }

    /// α = k·m(u)·Nd with d = θ − c, u = dᵀNd/scale² and N = MᵀM = 1 − [[E1, E2], [E2, −E1]], E = 2e/(1+|e|²).
    fn parameter_derivatives(&self, x: f64, y: f64, by_parameter: &mut [Cx<f64>]) {
        let o = self.offset(x, y);
        let [m, p1, _] = self.law.radial(o.u);
        let axes = &self.axes;
        let [nx, ny] = [0, 1].map(|a| axes[0][a] * o.t[0] + axes[1][a] * o.t[1]);
        let at = Amplitude { k: self.k, scale_arcsec: self.scale_arcsec, u: o.u, m, p1 };
        let own = self.law.by_parameter(&at);
        let count = L::PARAMETERS.len() - 4;
        for (out, strength) in by_parameter.iter_mut().zip(own).take(count) {
            *out = Cx::new(strength * nx, strength * ny);
        }
        let [d_e1, d_e2, d_x, d_y] = &mut by_parameter[count..count + 4] else { return };
        let (dx, dy) = (x - self.centre_arcsec[0], y - self.centre_arcsec[1]);
        for (out, [g1, g2]) in [d_e1, d_e2].into_iter().zip(self.change_of_axes()) {
            // δN d and δu from the changes g of E.
            let (vx, vy) = (-(g1 * dx + g2 * dy), -(g2 * dx - g1 * dy));
            let d_m = p1 / o.u * (dx * vx + dy * vy) / (self.scale_arcsec * self.scale_arcsec);
            *out = Cx::new(self.k * (d_m * nx + m * vx), self.k * (d_m * ny + m * vy));
        }
        let [xx, xy, yy] = self.hessian(x, y);
        *d_x = Cx::new(-xx, -xy);
        *d_y = Cx::new(-xy, -yy);
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
