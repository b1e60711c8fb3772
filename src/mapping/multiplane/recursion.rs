//! The ray loop: a tile of rays through a run of halo planes, positions and derivatives in one pass.
//!
//! Per plane (CONVENTIONS: x comoving position over arcsec, s slope, X = ∂x/∂θ, S = ∂s/∂θ):
//! x ← x + Δχ·s, s ← s − f·α; X ← X + Δχ·S, S ← S − (f/χ)·H·X;
//! X₂ ← X₂ + Δχ·S₂, S₂ ← S₂ − (f/χ)[H·X₂ + T:(X,X)/χ].

use multiversion::multiversion;

use super::plane::Plane;
use crate::mapping::RayBundle;
use crate::profile::mass::{MassProfile, RadialDerivatives, nfw_radial, truncated};

/// Rays that travel together: their state in all three orders fits the first-level cache.
///
/// Whole cache lines, and no power of two: else arrays lie 4096 bytes apart and their loads wait for one
/// another's stores (order 2 took 18% longer with 64).
pub(super) const TILE: usize = 48;

pub(super) type Lanes = [f64; TILE];

/// State of a tile of rays at comoving distance `chi_cmpc`, its lanes on cache lines.
#[repr(C, align(64))]
pub(super) struct Tile {
    /// Position x (Mpc·arcsec) and slope s (arcsec).
    pub x: [Lanes; 2],
    pub s: [Lanes; 2],
    /// First derivatives (xx, xy, yx, yy).
    pub dx: [Lanes; 4],
    pub ds: [Lanes; 4],
    /// Second derivatives (xxx, xxy, xyy, yxx, yxy, yyy).
    pub d2x: [Lanes; 6],
    pub d2s: [Lanes; 6],
    pub chi_cmpc: f64,
}

/// Index pairs (j, k) of the three second derivatives of one component.
const PAIRS: [(usize, usize); 3] = [(0, 0), (0, 1), (1, 1)];

impl Tile {
    /// Rays of direction `theta` leaving the point `x` (Mpc·arcsec) at `chi_cmpc` with slope `s` + θ.
    pub fn start(chi_cmpc: f64, x: [f64; 2], s: [f64; 2], theta: &[[f64; 2]]) -> Self {
        let mut tile = Self {
            chi_cmpc,
            x: [[x[0]; TILE], [x[1]; TILE]],
            s: [[0.0; TILE]; 2],
            dx: [[0.0; TILE]; 4],
            ds: [[1.0; TILE], [0.0; TILE], [0.0; TILE], [1.0; TILE]],
            d2x: [[0.0; TILE]; 6],
            d2s: [[0.0; TILE]; 6],
        };
        let last = theta.len() - 1;
        for i in 0..TILE {
            let [x, y] = theta[i.min(last)];
            tile.s[0][i] = s[0] + x;
            tile.s[1][i] = s[1] + y;
        }
        tile
    }

    /// From here on derivatives are with respect to what changes from here on.
    pub fn forget_derivatives(&mut self) {
        for lanes in self.dx.iter_mut().chain(&mut self.ds) {
            *lanes = [0.0; TILE];
        }
        for lanes in self.d2x.iter_mut().chain(&mut self.d2s) {
            *lanes = [0.0; TILE];
        }
    }

    /// Carries positions and derivatives to comoving distance `chi_cmpc`.
    #[inline(always)]
    pub fn advance<const ORDER: usize>(&mut self, chi_cmpc: f64) {
        let step = chi_cmpc - self.chi_cmpc;
        self.chi_cmpc = chi_cmpc;
        drift(&mut self.x, &self.s, step);
        if ORDER >= 1 {
            drift(&mut self.dx, &self.ds, step);
        }
        if ORDER >= 2 {
            drift(&mut self.d2x, &self.d2s, step);
        }
    }

    /// The first `used` rays as seen from the start: (x − `origin`)·`scale` and its derivatives.
    pub fn bundle<const ORDER: usize>(&self, used: usize, origin: [f64; 2], scale: f64) -> RayBundle {
        let position = |i: usize| [(self.x[0][i] - origin[0]) * scale, (self.x[1][i] - origin[1]) * scale];
        let mut rays = RayBundle { beta_arcsec: (0..used).map(position).collect(), ..RayBundle::default() };
        if ORDER >= 1 {
            rays.jacobian = (0..used).map(|i| std::array::from_fn(|c| self.dx[c][i] * scale)).collect();
        }
        if ORDER >= 2 {
            rays.second_per_arcsec =
                (0..used).map(|i| std::array::from_fn(|c| self.d2x[c][i] * scale)).collect();
        }
        rays
    }

    /// Kick of a general lens plane, ray by ray (the main lens).
    pub fn kick_lens<const ORDER: usize>(&mut self, lens: &impl MassProfile, f: f64, used: usize) {
        let inv_chi = 1.0 / self.chi_cmpc;
        for i in 0..used {
            let (tx, ty) = (self.x[0][i] * inv_chi, self.x[1][i] * inv_chi);
            if ORDER >= 1 {
                let h = lens.hessian(tx, ty);
                let t = if ORDER >= 2 { lens.third_derivatives(tx, ty) } else { [0.0; 4] };
                self.kick_derivatives::<ORDER>(i, h.map(|v| f * v), t.map(|v| f * v), inv_chi);
            }
            let alpha = lens.deflection(tx, ty);
            self.s[0][i] -= f * alpha[0];
            self.s[1][i] -= f * alpha[1];
        }
    }

    /// S and S₂ after a plane with f·H = (xx, xy, yy) and f·T = (xxx, xxy, xyy, yyy).
    #[allow(clippy::needless_range_loop, reason = "tensor indices")]
    #[inline(always)]
    fn kick_derivatives<const ORDER: usize>(&mut self, i: usize, h: [f64; 3], t: [f64; 4], inv_chi: f64) {
        let h = [[h[0], h[1]], [h[1], h[2]]];
        let x = [[self.dx[0][i], self.dx[1][i]], [self.dx[2][i], self.dx[3][i]]];
        for a in 0..2 {
            for j in 0..2 {
                self.ds[2 * a + j][i] -= inv_chi * (h[a][0] * x[0][j] + h[a][1] * x[1][j]);
            }
        }
        if ORDER >= 2 {
            for a in 0..2 {
                // T restricted to component a: symmetric 2×2 in the last two indices.
                let (t0, t1, t2) = (t[a], t[a + 1], t[a + 2]);
                for (p, (j, k)) in PAIRS.into_iter().enumerate() {
                    let quadratic = t0 * x[0][j] * x[0][k]
                        + t1 * (x[0][j] * x[1][k] + x[1][j] * x[0][k])
                        + t2 * x[1][j] * x[1][k];
                    let linear = h[a][0] * self.d2x[p][i] + h[a][1] * self.d2x[3 + p][i];
                    self.d2s[3 * a + p][i] -= inv_chi * (linear + inv_chi * quadratic);
                }
            }
        }
    }
}

#[inline(always)]
fn drift<const N: usize>(x: &mut [Lanes; N], s: &[Lanes; N], step: f64) {
    for (x, s) in x.iter_mut().zip(s) {
        for i in 0..TILE {
            x[i] += step * s[i];
        }
    }
}

/// The regime of u in which all rays of the tile lie, if there is one.
enum Regime {
    Inner,
    Outer,
    Far,
    Mixed,
}

#[inline(always)]
fn regime<const N: usize>(u: &[f64; N]) -> Regime {
    let (mut inner, mut outer, mut far) = (0_u64, 0_u64, 0_u64);
    for v in u {
        inner += u64::from(*v < nfw_radial::INNER_END);
        outer += u64::from(*v > nfw_radial::OUTER_START);
        far += u64::from(*v > nfw_radial::FAR_START);
    }
    let all = N as u64;
    match (inner, outer, far) {
        (_, _, n) if n == all => Regime::Far,
        (n, _, _) if n == all => Regime::Inner,
        (_, n, 0) if n == all => Regime::Outer,
        _ => Regime::Mixed,
    }
}

#[inline(always)]
fn trace<const ORDER: usize>(tile: &mut Tile, planes: &[Plane]) {
    for plane in planes {
        tile.advance::<ORDER>(plane.chi_cmpc);
        let (mut tx, mut ty, mut u) = ([0.0; TILE], [0.0; TILE], [0.0; TILE]);
        for i in 0..TILE {
            tx[i] = tile.x[0][i] * plane.inv_chi - plane.centre_arcsec[0];
            ty[i] = tile.x[1][i] * plane.inv_chi - plane.centre_arcsec[1];
            u[i] = plane.u(tx[i], ty[i]);
        }
        let (mut m, mut p1, mut p2) = ([0.0; TILE], [0.0; TILE], [0.0; TILE]);
        radial_functions::<ORDER, TILE>(plane.tau, &u, &mut m, &mut p1, &mut p2);
        if ORDER >= 1 {
            for i in 0..TILE {
                let inv_r = (plane.inv_r_s2 / u[i]).sqrt();
                let n = [tx[i] * inv_r, ty[i] * inv_r];
                let radial = RadialDerivatives { k: plane.fk, m: m[i], p1: p1[i], p2: p2[i] };
                let mut h = radial.hessian(n);
                h[0] -= plane.f_sheet;
                h[2] -= plane.f_sheet;
                let t = if ORDER >= 2 { radial.third_derivatives(n, inv_r) } else { [0.0; 4] };
                tile.kick_derivatives::<ORDER>(i, h, t, plane.inv_chi);
            }
        }
        let sheet = plane.f_sheet * plane.inv_chi;
        for i in 0..TILE {
            let km = plane.fk * m[i];
            tile.s[0][i] -= km * tx[i] - sheet * tile.x[0][i];
            tile.s[1][i] -= km * ty[i] - sheet * tile.x[1][i];
        }
    }
}

/// m (and u·m′, u²·m″) of all rays; the loops over one regime are branch-free.
#[inline(always)]
pub(super) fn radial_functions<const ORDER: usize, const N: usize>(
    tau: f64,
    u: &[f64; N],
    m: &mut [f64; N],
    p1: &mut [f64; N],
    p2: &mut [f64; N],
) {
    match regime(u) {
        _ if tau.is_finite() => {
            for i in 0..N {
                [m[i], p1[i], p2[i]] = truncated(u[i], &nfw_radial::basis(u[i]), tau);
            }
        }
        Regime::Far if ORDER == 0 => {
            for i in 0..N {
                m[i] = nfw_radial::far(u[i]).m;
            }
        }
        Regime::Outer if ORDER == 0 => {
            for i in 0..N {
                m[i] = nfw_radial::m_outer(u[i]);
            }
        }
        Regime::Inner if ORDER == 0 => {
            for i in 0..N {
                m[i] = nfw_radial::m_inner(u[i]);
            }
        }
        Regime::Mixed if ORDER == 0 => {
            for i in 0..N {
                m[i] = nfw_radial::m(u[i]);
            }
        }
        Regime::Far => {
            for i in 0..N {
                [m[i], p1[i], p2[i]] = nfw_radial::far(u[i]).nfw();
            }
        }
        Regime::Outer => {
            for i in 0..N {
                [m[i], p1[i], p2[i]] = nfw_radial::outer(u[i]).nfw();
            }
        }
        Regime::Inner => {
            for i in 0..N {
                [m[i], p1[i], p2[i]] = nfw_radial::inner(u[i]).nfw();
            }
        }
        Regime::Mixed => {
            for i in 0..N {
                [m[i], p1[i], p2[i]] = nfw_radial::basis(u[i]).nfw();
            }
        }
    }
}

/// Traces a tile through `planes`; compiled for each instruction set and chosen at run time.
#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn trace_positions(tile: &mut Tile, planes: &[Plane]) {
    trace::<0>(tile, planes);
}

/// As [`trace_positions`], with first derivatives.
#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn trace_jacobians(tile: &mut Tile, planes: &[Plane]) {
    trace::<1>(tile, planes);
}

/// As [`trace_positions`], with first and second derivatives.
#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn trace_second_derivatives(tile: &mut Tile, planes: &[Plane]) {
    trace::<2>(tile, planes);
}
