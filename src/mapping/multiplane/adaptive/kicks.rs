//! How the haloes that rays meet one by one kick them, many rays in SIMD lanes.

use super::chebyshev::{LANES, Lanes};
use crate::mapping::multiplane::kick::{Distortion, Kick};
use crate::mapping::multiplane::plane::Plane;

/// The kick f·α of rays and its derivatives.
pub(super) struct Kicks {
    pub kick: [Lanes; 2],
    pub distortion: Distortion<LANES>,
}

impl Kicks {
    pub fn zero() -> Self {
        Self { kick: [[0.0; LANES]; 2], distortion: Distortion::none() }
    }

    /// The kicks of rays that meet a plane in the directions `theta`.
    #[inline(always)]
    pub fn set<const ORDER: usize>(&mut self, plane: &Plane, theta: &[Lanes; 2]) {
        let Self { kick, distortion } = self;
        plane.kick::<ORDER, LANES>(theta, 1.0, distortion, |i: usize, own: Kick| {
            (0..2).for_each(|c| kick[c][i] = own.f_alpha_arcsec[c])
        });
    }
}
