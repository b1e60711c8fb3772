//! What planes do to rays: the one place with the equations of a halo's kick, its derivatives and its potential.
//!
//! A ray that meets a plane in the direction θ changes its slope by −f·α(θ). A halo with its sheet has
//! f·α = f·k·m(u)·t − f·κ·θ, t = θ − c, u = |t|²/r_s²; H = ∂α/∂θ and T = ∂H/∂θ follow from m, u·m′ and u²·m″.

use super::plane::{LensPlane, Plane};
use crate::profile::mass::nfw_radial::{self, Basis, Regime, Together};
use crate::profile::mass::{MassProfile, RadialDerivatives, Truncation, truncated_potential};

/// How one ray is kicked by a halo and its sheet.
pub(super) struct Kick {
    /// f·α in arcsec.
    pub f_alpha_arcsec: [f64; 2],
    /// f·k·m and u: the halo alone deflects by f·k·m·√u·r_s.
    pub fkm: f64,
    pub u: f64,
}

/// How a plane distorts `N` rays that meet it together: f·H (xx, xy, yy) and, in second order, f·T (xxx, xxy, xyy, yyy).
///
/// Its lanes lie on cache lines.
#[repr(C, align(64))]
pub(super) struct Distortion<const N: usize> {
    pub h: [[f64; N]; 3],
    pub t: [[f64; N]; 4],
}

impl<const N: usize> Distortion<N> {
    pub fn none() -> Self {
        Self { h: [[0.0; N]; 3], t: [[0.0; N]; 4] }
    }
}

/// What is kicked. A trait, since closures are not always compiled into their caller and for its instruction set.
pub(super) trait Kicked<const N: usize> {
    /// Rays meet a plane that distorts them.
    fn distort(&mut self, _distortion: &Distortion<N>) {}
    /// Ray `i` is kicked, after [`Self::distort`].
    fn turn(&mut self, i: usize, kick: Kick);
}

impl<const N: usize, T: FnMut(usize, Kick)> Kicked<N> for T {
    #[inline(always)]
    fn turn(&mut self, i: usize, kick: Kick) {
        self(i, kick);
    }
}

impl Plane {
    /// Kicks of `N` rays that go together and meet the plane in the directions θ = `per_x`·`x`: comoving positions and
    /// 1/χ, or directions and 1.
    ///
    /// From `ORDER` 1 on `distortion` is written: one for all planes, since to clear it for each takes 3% of the
    /// instructions of a Jacobian. The loops are branch-free where all rays lie in one regime of u.
    #[inline(always)]
    pub fn kick<const ORDER: usize, const N: usize>(
        &self,
        x: &[[f64; N]; 2],
        per_x: f64,
        distortion: &mut Distortion<N>,
        rays: impl Kicked<N>,
    ) {
        match self.is_truncated() {
            true => self.kick_as::<ORDER, N, true>(x, per_x, distortion, rays),
            false => self.kick_as::<ORDER, N, false>(x, per_x, distortion, rays),
        }
    }

    /// The same of a plane of which is known whether its halo is truncated.
    #[inline(always)]
    pub fn kick_as<const ORDER: usize, const N: usize, const TRUNCATED: bool>(
        &self,
        x: &[[f64; N]; 2],
        per_x: f64,
        distortion: &mut Distortion<N>,
        mut rays: impl Kicked<N>,
    ) {
        let (mut tx, mut ty, mut u) = ([0.0; N], [0.0; N], [0.0; N]);
        for i in 0..N {
            tx[i] = x[0][i] * per_x - self.centre_arcsec[0];
            ty[i] = x[1][i] * per_x - self.centre_arcsec[1];
            u[i] = self.u(tx[i], ty[i]);
        }
        let (mut m, mut p1, mut p2, mut inv_u) = ([0.0; N], [0.0; N], [0.0; N], [0.0; N]);
        radial_functions::<ORDER, N, TRUNCATED>(self.tau, &u, &mut m, &mut p1, &mut p2, &mut inv_u);
        if ORDER >= 1 {
            // Columns first: loops as short as these are vectorised, one over all that happens to a ray is not.
            let Distortion { h, t } = distortion;
            for i in 0..N {
                let radial = RadialDerivatives {
                    k: self.fk,
                    m: m[i],
                    p1: p1[i],
                    p2: p2[i],
                    t: [tx[i], ty[i]],
                    inv_r2: self.inv_r_s2 * inv_u[i],
                };
                let [xx, xy, yy] = radial.hessian();
                [h[0][i], h[1][i], h[2][i]] = [xx - self.f_sheet, xy, yy - self.f_sheet];
                if ORDER >= 2 {
                    [t[0][i], t[1][i], t[2][i], t[3][i]] = radial.third_derivatives();
                }
            }
            rays.distort(distortion);
        }
        let sheet = self.f_sheet * per_x;
        for i in 0..N {
            let fkm = self.fk * m[i];
            let f_alpha_arcsec = [fkm * tx[i] - sheet * x[0][i], fkm * ty[i] - sheet * x[1][i]];
            rays.turn(i, Kick { f_alpha_arcsec, fkm, u: u[i] });
        }
    }

    /// Whether the halo ends.
    #[inline(always)]
    pub fn is_truncated(&self) -> bool {
        self.tau.is_finite()
    }

    /// f·α in one direction, arcsec.
    pub fn kick_at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let mut kick = [0.0; 2];
        let turn = |_, own: Kick| kick = own.f_alpha_arcsec;
        self.kick::<0, 1>(&[[x], [y]], 1.0, &mut Distortion::none(), turn);
        kick
    }

    /// f·H (xx, xy, yy) in one direction.
    pub fn hessian(&self, theta: [f64; 2]) -> [f64; 3] {
        self.linear(theta).1
    }

    /// f·α in arcsec and f·H (xx, xy, yy) in one direction.
    #[inline(always)]
    pub fn linear(&self, [x, y]: [f64; 2]) -> ([f64; 2], [f64; 3]) {
        let (mut distortion, mut kick) = (Distortion::none(), [0.0; 2]);
        let turn = |_, own: Kick| kick = own.f_alpha_arcsec;
        self.kick::<1, 1>(&[[x], [y]], 1.0, &mut distortion, turn);
        (kick, distortion.h.map(|[h]| h))
    }

    /// The size of a kick f·α in one direction, its sheet left out, arcsec.
    #[inline(always)]
    pub fn without_sheet(&self, kick: [f64; 2], theta: [f64; 2]) -> f64 {
        let [x, y] = [0, 1].map(|c| kick[c] + self.f_sheet * theta[c]);
        (x * x + y * y).sqrt()
    }

    /// f·ψ in one direction, arcsec²; zero at the halo's centre but for the sheet.
    pub fn potential(&self, theta: [f64; 2]) -> f64 {
        let u = self.u(theta[0] - self.centre_arcsec[0], theta[1] - self.centre_arcsec[1]);
        let integral =
            if self.is_truncated() { truncated_potential(u, self.tau) } else { nfw_radial::potential(u) };
        let sheet = self.f_sheet * (theta[0] * theta[0] + theta[1] * theta[1]);
        0.5 * (self.fk / self.inv_r_s2 * integral - sheet)
    }
}

impl LensPlane {
    fn off_origin(&self, theta: [f64; 2]) -> [f64; 2] {
        [theta[0] - self.origin_arcsec[0], theta[1] - self.origin_arcsec[1]]
    }

    /// f·α in one direction, arcsec.
    pub fn kick(&self, theta: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.off_origin(theta);
        self.profile.deflection(x, y).map(|alpha| self.f * alpha)
    }

    /// f·H (xx, xy, yy) in one direction.
    pub fn hessian(&self, theta: [f64; 2]) -> [f64; 3] {
        let [x, y] = self.off_origin(theta);
        self.profile.hessian(x, y).map(|h| self.f * h)
    }

    /// f·T (xxx, xxy, xyy, yyy) in one direction, per arcsec.
    pub fn third_derivatives(&self, theta: [f64; 2]) -> [f64; 4] {
        let [x, y] = self.off_origin(theta);
        self.profile.third_derivatives(x, y).map(|t| self.f * t)
    }

    /// f·ψ in one direction, arcsec².
    pub fn potential(&self, theta: [f64; 2]) -> f64 {
        let [x, y] = self.off_origin(theta);
        self.f * self.profile.potential(x, y)
    }

    /// The middle of the profile, arcsec from the line of sight's own origin.
    pub fn centre_arcsec(&self) -> Option<[f64; 2]> {
        self.profile.centre_arcsec().map(|centre| [0, 1].map(|c| centre[c] + self.origin_arcsec[c]))
    }
}

/// m (and u·m′, u²·m″, 1/u) of all rays; the loops over one regime are branch-free.
#[inline(always)]
fn radial_functions<const ORDER: usize, const N: usize, const TRUNCATED: bool>(
    tau: f64,
    u: &[f64; N],
    m: &mut [f64; N],
    p1: &mut [f64; N],
    p2: &mut [f64; N],
    inv_u: &mut [f64; N],
) {
    macro_rules! for_all {
        (|$u:ident| $regime:expr, $functions:expr) => {
            for i in 0..N {
                let $u = u[i];
                let basis = nfw_radial::functions($u, $regime);
                let values: [f64; 3] = $functions($u, basis);
                m[i] = values[0];
                if ORDER >= 1 {
                    [_, p1[i], p2[i]] = values;
                    inv_u[i] = basis.inv_u;
                }
            }
        };
    }
    macro_rules! in_regime {
        ($functions:expr) => {
            match Together::of(u) {
                Together::Inner => for_all!(|u| Regime::INNER, $functions),
                Together::Outer => for_all!(|u| Regime::OUTER, $functions),
                Together::Far => for_all!(|u| Regime::FAR, $functions),
                Together::Mixed => for_all!(|u| Regime::of(u), $functions),
            }
        };
    }
    if TRUNCATED {
        let edge = Truncation::at(tau);
        in_regime!(|u, basis: Basis| edge.radial(u, &basis));
    } else {
        in_regime!(|_, basis: Basis| basis.nfw());
    }
}
