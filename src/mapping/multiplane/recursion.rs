//! The ray loop: a block of rays through a run of halo planes, positions and derivatives in one pass.
//!
//! Per plane (CONVENTIONS: x comoving position over arcsec, s slope, X = ∂x/∂θ, S = ∂s/∂θ):
//! x ← x + Δχ·s, s ← s − f·α; X ← X + Δχ·S, S ← S − (f/χ)·H·X;
//! X₂ ← X₂ + Δχ·S₂, S₂ ← S₂ − (f/χ)[H·X₂ + T:(X,X)/χ].

use super::kick::{Distortion, Kick, Kicked};
use super::plane::{LensPlane, Plane};
use crate::mapping::RayBundle;
use crate::numerics::dispatch::kernel;

/// Rays that travel together: their state in all three orders fits the first-level cache.
///
/// Whole cache lines, and no power of two: else arrays lie 4096 bytes apart and their loads wait for one
/// another's stores (order 2 took 18% longer with 64).
pub(super) const BLOCK: usize = 48;
/// Rays of a small block: one takes a fifth of the time of a large one.
pub(super) const FEW: usize = 8;

/// Many rays that travel together.
pub(super) type RayBlock = RaysTogether<BLOCK>;
/// A few rays that travel together.
pub(super) type FewRays = RaysTogether<FEW>;

/// State of a block of rays at comoving distance `chi_cmpc`, its lanes on cache lines.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct RaysTogether<const N: usize> {
    /// Position x (Mpc·arcsec) and slope s (arcsec).
    pub x: [[f64; N]; 2],
    pub s: [[f64; N]; 2],
    pub by_theta: Derivatives<N>,
    pub chi_cmpc: f64,
}

/// Derivatives of positions and slopes; in one place, so that the compiler sees that its columns do not overlap.
#[derive(Clone)]
#[repr(C, align(64))]
pub(super) struct Derivatives<const N: usize> {
    /// First derivatives (xx, xy, yx, yy).
    pub dx: [[f64; N]; 4],
    pub ds: [[f64; N]; 4],
    /// Second derivatives (xxx, xxy, xyy, yxx, yxy, yyy).
    pub d2x: [[f64; N]; 6],
    pub d2s: [[f64; N]; 6],
}

/// Index pairs (j, k) of the three second derivatives of one component.
const PAIRS: [(usize, usize); 3] = [(0, 0), (0, 1), (1, 1)];

impl<const N: usize> RaysTogether<N> {
    /// Rays of direction `theta` leaving the point `x` (Mpc·arcsec) at `chi_cmpc` with slope `s` + θ.
    pub fn start(chi_cmpc: f64, x: [f64; 2], s: [f64; 2], theta: &[[f64; 2]]) -> Self {
        let slope = |i: usize| [s[0] + theta[i][0], s[1] + theta[i][1]];
        Self::from_points(chi_cmpc, theta.len(), |_| x, slope)
    }

    /// `used` rays at `chi_cmpc`, each at a place `x` with a slope `s` of its own, with respect to which derivatives are
    /// taken; lanes beyond repeat the last.
    pub fn from_points(
        chi_cmpc: f64,
        used: usize,
        x: impl Fn(usize) -> [f64; 2],
        s: impl Fn(usize) -> [f64; 2],
    ) -> Self {
        let mut rays = Self {
            chi_cmpc,
            x: [[0.0; N]; 2],
            s: [[0.0; N]; 2],
            by_theta: Derivatives {
                dx: [[0.0; N]; 4],
                ds: [[1.0; N], [0.0; N], [0.0; N], [1.0; N]],
                d2x: [[0.0; N]; 6],
                d2s: [[0.0; N]; 6],
            },
        };
        for i in 0..N {
            let (x, s) = (x(i.min(used - 1)), s(i.min(used - 1)));
            for c in 0..2 {
                (rays.x[c][i], rays.s[c][i]) = (x[c], s[c]);
            }
        }
        rays
    }

    /// A lens here changes the slope of every ray by −f·α(x), its distortion left out.
    pub fn turn(&mut self, f: f64, deflection: impl Fn([f64; 2]) -> [f64; 2]) {
        for i in 0..N {
            let alpha = deflection(self.position(i));
            (0..2).for_each(|c| self.s[c][i] -= f * alpha[c]);
        }
    }

    /// The first `used` rays with derivatives by their slopes here.
    pub fn starting_here(&self, used: usize) -> Self {
        Self::from_points(self.chi_cmpc, used, |i| self.position(i), |i| self.slope(i))
    }

    /// From here on derivatives of ray `i` are with respect to what changes from here on.
    pub fn forget_derivatives(&mut self, i: usize) {
        let Derivatives { dx, ds, d2x, d2s } = &mut self.by_theta;
        dx.iter_mut().chain(ds).for_each(|lanes| lanes[i] = 0.0);
        d2x.iter_mut().chain(d2s).for_each(|lanes| lanes[i] = 0.0);
    }

    /// Ray `i` becomes that of another block at the same distance.
    pub fn take(&mut self, i: usize, other: &Self) {
        let pairs = |own: &mut [[f64; N]], others: &[[f64; N]]| {
            own.iter_mut().zip(others).for_each(|(own, others)| own[i] = others[i]);
        };
        pairs(&mut self.x, &other.x);
        pairs(&mut self.s, &other.s);
        let (own, others) = (&mut self.by_theta, &other.by_theta);
        pairs(&mut own.dx, &others.dx);
        pairs(&mut own.ds, &others.ds);
        pairs(&mut own.d2x, &others.d2x);
        pairs(&mut own.d2s, &others.d2s);
    }

    /// Carries positions and derivatives to comoving distance `chi_cmpc`.
    #[inline(always)]
    pub fn advance<const ORDER: usize>(&mut self, chi_cmpc: f64) {
        let step = chi_cmpc - self.chi_cmpc;
        self.chi_cmpc = chi_cmpc;
        drift(&mut self.x, &self.s, step);
        if ORDER >= 1 {
            drift(&mut self.by_theta.dx, &self.by_theta.ds, step);
        }
        if ORDER >= 2 {
            drift(&mut self.by_theta.d2x, &self.by_theta.d2s, step);
        }
    }

    /// Carries positions, slopes and derivatives to comoving distance `chi_cmpc` by a linear map.
    #[inline(always)]
    pub fn carry<const ORDER: usize>(&mut self, carry: &Carry, chi_cmpc: f64) {
        self.chi_cmpc = chi_cmpc;
        let ([x, y], [u, v]) = (&mut self.x, &mut self.s);
        carry.apply([x, y, u, v]);
        let Derivatives { dx, ds, d2x, d2s } = &mut self.by_theta;
        if ORDER >= 1 {
            let ([xx, xy, yx, yy], [ux, uy, vx, vy]) = (dx, ds);
            carry.apply([xx, yx, ux, vx]);
            carry.apply([xy, yy, uy, vy]);
        }
        if ORDER >= 2 {
            let ([x0, x1, x2, y0, y1, y2], [u0, u1, u2, v0, v1, v2]) = (d2x, d2s);
            carry.apply([x0, y0, u0, v0]);
            carry.apply([x1, y1, u1, v1]);
            carry.apply([x2, y2, u2, v2]);
        }
    }

    /// Position of ray `i`, Mpc·arcsec.
    pub fn position(&self, i: usize) -> [f64; 2] {
        [self.x[0][i], self.x[1][i]]
    }

    /// Slope of ray `i`, arcsec.
    pub fn slope(&self, i: usize) -> [f64; 2] {
        [self.s[0][i], self.s[1][i]]
    }

    /// The first `used` rays as seen from the start: (x − `origin`)/`length_cmpc` and its derivatives.
    ///
    /// A division, not the product with an inverse, lest empty space have a convergence of 1e-16.
    pub fn bundle<const ORDER: usize>(&self, used: usize, origin: [f64; 2], length_cmpc: f64) -> RayBundle {
        let position = |i: usize| [0, 1].map(|c| (self.x[c][i] - origin[c]) / length_cmpc);
        let mut rays = RayBundle { beta_arcsec: (0..used).map(position).collect(), ..RayBundle::default() };
        if ORDER >= 1 {
            rays.jacobian =
                (0..used).map(|i| std::array::from_fn(|c| self.by_theta.dx[c][i] / length_cmpc)).collect();
        }
        if ORDER >= 2 {
            rays.second_per_arcsec =
                (0..used).map(|i| std::array::from_fn(|c| self.by_theta.d2x[c][i] / length_cmpc)).collect();
        }
        rays
    }

    /// On to the plane of a lens and through it, ray by ray.
    pub fn through_lens<const ORDER: usize>(&mut self, lens: &LensPlane, used: usize) {
        self.advance::<ORDER>(lens.chi_cmpc);
        let inv_chi = 1.0 / self.chi_cmpc;
        let theta = |i: usize| [self.x[0][i] * inv_chi, self.x[1][i] * inv_chi];
        if ORDER >= 1 {
            let mut distortion = Distortion::none();
            let Distortion { h, t } = &mut distortion;
            for i in 0..used {
                [h[0][i], h[1][i], h[2][i]] = lens.hessian(theta(i));
                if ORDER >= 2 {
                    [t[0][i], t[1][i], t[2][i], t[3][i]] = lens.third_derivatives(theta(i));
                }
            }
            self.by_theta.kick::<ORDER>(&distortion, inv_chi);
        }
        for i in 0..used {
            let kick = lens.kick([self.x[0][i] * inv_chi, self.x[1][i] * inv_chi]);
            self.s[0][i] -= kick[0];
            self.s[1][i] -= kick[1];
        }
    }
}

/// What empty space and linear kicks do to (x, y) and their slopes, row by row.
#[derive(Clone)]
pub(super) struct Carry([[f64; 4]; 4]);

impl Carry {
    /// Nothing.
    pub fn identity() -> Self {
        Self(std::array::from_fn(|i| std::array::from_fn(|k| f64::from(u8::from(i == k)))))
    }

    /// Then empty space: x ← x + step·s.
    pub fn drift(&mut self, step: f64) {
        let Self([x, y, u, v]) = self;
        for k in 0..4 {
            x[k] += step * u[k];
            y[k] += step * v[k];
        }
    }

    /// Then a linear kick: s ← s − Hx, H = (xx, xy, yy).
    pub fn kick(&mut self, [xx, xy, yy]: [f64; 3]) {
        let Self([x, y, u, v]) = self;
        for k in 0..4 {
            u[k] -= xx * x[k] + xy * y[k];
            v[k] -= xy * x[k] + yy * y[k];
        }
    }

    #[inline(always)]
    fn apply<const N: usize>(&self, [x, y, u, v]: [&mut [f64; N]; 4]) {
        for i in 0..N {
            let old = [x[i], y[i], u[i], v[i]];
            let new = |row: &[f64; 4]| row[0] * old[0] + row[1] * old[1] + row[2] * old[2] + row[3] * old[3];
            [x[i], y[i], u[i], v[i]] = [new(&self.0[0]), new(&self.0[1]), new(&self.0[2]), new(&self.0[3])];
        }
    }
}

impl RayBlock {
    /// On through halo planes.
    pub fn through<const ORDER: usize>(&mut self, planes: &[Plane]) {
        match ORDER {
            0 => trace_positions(self, planes),
            1 => trace_jacobians(self, planes),
            _ => trace_second_derivatives(self, planes),
        }
    }
}

impl FewRays {
    /// On through halo planes, with first derivatives or with second ones.
    pub fn through<const ORDER: usize>(&mut self, planes: &[Plane]) {
        match ORDER {
            1 => trace_few_jacobians(self, planes),
            _ => trace_few_second_derivatives(self, planes),
        }
    }
}

impl<const N: usize> Derivatives<N> {
    /// S and S₂ of all rays after a plane.
    #[allow(clippy::needless_range_loop, reason = "lanes of many columns")]
    #[inline(always)]
    pub fn kick<const ORDER: usize>(&mut self, Distortion { h, t }: &Distortion<N>, inv_chi: f64) {
        let Self { dx, ds, d2x, d2s } = self;
        for a in 0..2 {
            for j in 0..2 {
                let (x, y, ds) = (&dx[j], &dx[2 + j], &mut ds[2 * a + j]);
                for i in 0..N {
                    ds[i] -= inv_chi * (h[a][i] * x[i] + h[a + 1][i] * y[i]);
                }
            }
        }
        if ORDER >= 2 {
            for a in 0..2 {
                // T restricted to component a: symmetric 2×2 in the last two indices.
                let (t0, t1, t2) = (&t[a], &t[a + 1], &t[a + 2]);
                for (p, (j, k)) in PAIRS.into_iter().enumerate() {
                    let ([xj, yj], [xk, yk]) = ([&dx[j], &dx[2 + j]], [&dx[k], &dx[2 + k]]);
                    let (x2, y2, d2s) = (&d2x[p], &d2x[3 + p], &mut d2s[3 * a + p]);
                    for i in 0..N {
                        let quadratic = t0[i] * xj[i] * xk[i]
                            + t1[i] * (xj[i] * yk[i] + yj[i] * xk[i])
                            + t2[i] * yj[i] * yk[i];
                        let linear = h[a][i] * x2[i] + h[a + 1][i] * y2[i];
                        d2s[i] -= inv_chi * (linear + inv_chi * quadratic);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn drift<const N: usize, const C: usize>(x: &mut [[f64; N]; C], s: &[[f64; N]; C], step: f64) {
    for (x, s) in x.iter_mut().zip(s) {
        for i in 0..N {
            x[i] += step * s[i];
        }
    }
}

#[inline(always)]
fn trace<const ORDER: usize, const N: usize>(rays: &mut RaysTogether<N>, planes: &[Plane]) {
    // Truncated haloes and others have loops of their own: in one, registers run out.
    for run in planes.chunk_by(|a, b| a.is_truncated() == b.is_truncated()) {
        match run[0].is_truncated() {
            true => trace_run::<ORDER, N, true>(rays, run),
            false => trace_run::<ORDER, N, false>(rays, run),
        }
    }
}

#[inline(always)]
fn trace_run<const ORDER: usize, const N: usize, const TRUNCATED: bool>(
    rays: &mut RaysTogether<N>,
    planes: &[Plane],
) {
    let mut distortion = Distortion::none();
    for plane in planes {
        rays.advance::<ORDER>(plane.chi_cmpc);
        let RaysTogether { x, s, by_theta, .. } = &mut *rays;
        let slopes = Slopes::<ORDER, N> { s, by_theta, inv_chi: plane.inv_chi };
        plane.kick_as::<ORDER, N, TRUNCATED>(x, plane.inv_chi, &mut distortion, slopes);
    }
}

/// What a plane changes of a block of rays.
struct Slopes<'a, const ORDER: usize, const N: usize> {
    s: &'a mut [[f64; N]; 2],
    by_theta: &'a mut Derivatives<N>,
    inv_chi: f64,
}

impl<const ORDER: usize, const N: usize> Kicked<N> for Slopes<'_, ORDER, N> {
    #[inline(always)]
    fn distort(&mut self, distortion: &Distortion<N>) {
        self.by_theta.kick::<ORDER>(distortion, self.inv_chi);
    }

    #[inline(always)]
    fn turn(&mut self, i: usize, kick: Kick) {
        self.s[0][i] -= kick.f_alpha_arcsec[0];
        self.s[1][i] -= kick.f_alpha_arcsec[1];
    }
}

kernel! {
    fn trace_positions(rays: &mut RayBlock, planes: &[Plane]) {
        trace::<0, BLOCK>(rays, planes);
    }
}

kernel! {
    fn trace_jacobians(rays: &mut RayBlock, planes: &[Plane]) {
        trace::<1, BLOCK>(rays, planes);
    }
}

kernel! {
    fn trace_second_derivatives(rays: &mut RayBlock, planes: &[Plane]) {
        trace::<2, BLOCK>(rays, planes);
    }
}

kernel! {
    fn trace_few_jacobians(rays: &mut FewRays, planes: &[Plane]) {
        trace::<1, FEW>(rays, planes);
    }
}

kernel! {
    fn trace_few_second_derivatives(rays: &mut FewRays, planes: &[Plane]) {
        trace::<2, FEW>(rays, planes);
    }
}
