//! The planes that rays meet one by one, a halo or the main lens, for many rays in SIMD lanes.

use super::chebyshev::{LANES, Lanes};
use crate::mapping::multiplane::kick::{Distortion, Kick};
use crate::mapping::multiplane::plane::{LensPlane, Plane};

/// A plane that rays meet one by one.
#[derive(Clone)]
pub(super) enum RoughPlane {
    /// A halo with its sheet.
    Halo(Plane),
    /// The main lens.
    Lens(LensPlane),
}

/// The kick f·α of rays and its derivatives.
pub(super) struct Kicks {
    pub kick: [Lanes; 2],
    pub distortion: Distortion<LANES>,
}

impl Kicks {
    pub fn zero() -> Self {
        Self { kick: [[0.0; LANES]; 2], distortion: Distortion::none() }
    }
}

impl RoughPlane {
    /// Comoving distance, Mpc.
    pub fn chi_cmpc(&self) -> f64 {
        match self {
            Self::Halo(plane) => plane.chi_cmpc,
            Self::Lens(plane) => plane.chi_cmpc,
        }
    }

    /// Kicks of the first `used` rays, which meet the plane in the directions `theta`.
    #[inline(always)]
    pub fn kick<const ORDER: usize>(&self, theta: &[Lanes; 2], used: usize, kicks: &mut Kicks) {
        let Kicks { kick, distortion } = kicks;
        match self {
            Self::Halo(plane) => plane.kick::<ORDER, LANES>(theta, 1.0, distortion, |i: usize, own: Kick| {
                (0..2).for_each(|c| kick[c][i] = own.f_alpha_arcsec[c])
            }),
            Self::Lens(plane) => {
                for i in 0..used {
                    let at = [theta[0][i], theta[1][i]];
                    [kick[0][i], kick[1][i]] = plane.kick(at);
                    if ORDER >= 1 {
                        let h = plane.hessian(at);
                        (0..3).for_each(|c| distortion.h[c][i] = h[c]);
                    }
                    if ORDER >= 2 {
                        let t = plane.third_derivatives(at);
                        (0..4).for_each(|c| distortion.t[c][i] = t[c]);
                    }
                }
            }
        }
    }

    /// The Hessian (xx, xy, yy) in one direction.
    pub fn hessian(&self, theta: [f64; 2]) -> [f64; 3] {
        match self {
            Self::Halo(plane) => plane.hessian(theta),
            Self::Lens(plane) => plane.hessian(theta),
        }
    }
}
