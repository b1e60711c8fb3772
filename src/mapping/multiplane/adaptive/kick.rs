//! What kicks rays on their way, one halo plane or the main lens, for many rays in SIMD lanes.

use super::chebyshev::{LANES, Lanes};
use crate::mapping::multiplane::plane::Plane;
use crate::mapping::multiplane::recursion::radial_functions;
use crate::profile::mass::{MassModel, MassProfile, RadialDerivatives};

/// A plane that rays meet one by one.
#[derive(Clone, Copy)]
pub(super) enum Kick<'a> {
    /// A halo with its sheet.
    Halo(Plane),
    /// The main lens: χ, f = χ_s/(χ_s − χ) and the profile.
    Lens(f64, f64, &'a MassModel),
}

/// The kick f·α of rays, its Hessian (xx, xy, yy) and its third derivatives (xxx, xxy, xyy, yyy).
pub(super) struct Kicks {
    pub kick: [Lanes; 2],
    pub hessian: [Lanes; 3],
    pub third: [Lanes; 4],
}

impl Kicks {
    pub fn zero() -> Self {
        Self { kick: [[0.0; LANES]; 2], hessian: [[0.0; LANES]; 3], third: [[0.0; LANES]; 4] }
    }
}

impl Kick<'_> {
    /// Comoving distance, Mpc.
    pub fn chi_cmpc(&self) -> f64 {
        match self {
            Self::Halo(plane) => plane.chi_cmpc,
            Self::Lens(chi, ..) => *chi,
        }
    }

    /// Kicks of the first `used` rays, which meet the plane in the directions (`x`, `y`).
    #[inline(always)]
    pub fn at<const ORDER: usize>(&self, [x, y]: &[Lanes; 2], used: usize, kicks: &mut Kicks) {
        match self {
            Self::Halo(plane) => halo::<ORDER>(plane, x, y, kicks),
            Self::Lens(_, f, profile) => {
                for i in 0..used {
                    let alpha = profile.deflection(x[i], y[i]);
                    (kicks.kick[0][i], kicks.kick[1][i]) = (f * alpha[0], f * alpha[1]);
                    if ORDER >= 1 {
                        let h = profile.hessian(x[i], y[i]);
                        (0..3).for_each(|c| kicks.hessian[c][i] = f * h[c]);
                    }
                    if ORDER >= 2 {
                        let t = profile.third_derivatives(x[i], y[i]);
                        (0..4).for_each(|c| kicks.third[c][i] = f * t[c]);
                    }
                }
            }
        }
    }

    /// The Hessian (xx, xy, yy) in one direction.
    pub fn hessian(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        match self {
            Self::Halo(plane) => {
                let (tx, ty) = (x - plane.centre_arcsec[0], y - plane.centre_arcsec[1]);
                let u = plane.u(tx, ty);
                let [m, p1, p2] = plane.radial(u);
                let inv_r = (plane.inv_r_s2 / u).sqrt();
                let [xx, xy, yy] =
                    RadialDerivatives { k: plane.fk, m, p1, p2 }.hessian([tx * inv_r, ty * inv_r]);
                [xx - plane.f_sheet, xy, yy - plane.f_sheet]
            }
            Self::Lens(_, f, profile) => profile.hessian(x, y).map(|h| f * h),
        }
    }
}

#[inline(always)]
fn halo<const ORDER: usize>(plane: &Plane, x: &Lanes, y: &Lanes, kicks: &mut Kicks) {
    let (mut tx, mut ty, mut u) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        tx[i] = x[i] - plane.centre_arcsec[0];
        ty[i] = y[i] - plane.centre_arcsec[1];
        u[i] = plane.u(tx[i], ty[i]);
    }
    let (mut m, mut p1, mut p2) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    radial_functions::<ORDER, LANES>(plane.tau, &u, &mut m, &mut p1, &mut p2);
    for i in 0..LANES {
        let km = plane.fk * m[i];
        kicks.kick[0][i] = km * tx[i] - plane.f_sheet * x[i];
        kicks.kick[1][i] = km * ty[i] - plane.f_sheet * y[i];
        if ORDER >= 1 {
            let inv_r = (plane.inv_r_s2 / u[i]).sqrt();
            let n = [tx[i] * inv_r, ty[i] * inv_r];
            let radial = RadialDerivatives { k: plane.fk, m: m[i], p1: p1[i], p2: p2[i] };
            let [xx, xy, yy] = radial.hessian(n);
            kicks.hessian[0][i] = xx - plane.f_sheet;
            kicks.hessian[1][i] = xy;
            kicks.hessian[2][i] = yy - plane.f_sheet;
            if ORDER >= 2 {
                let t = radial.third_derivatives(n, inv_r);
                (0..4).for_each(|c| kicks.third[c][i] = t[c]);
            }
        }
    }
}
