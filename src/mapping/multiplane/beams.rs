//! What haloes do along rays that a lens bends: od, os and ds tensors of beams, the lens's own distortion left out.

use rayon::prelude::*;

use super::line_of_sight::LineOfSight;
use super::recursion::{BLOCK, RayBlock};
use crate::error::{Error, Result};

/// Jacobians (a_xx, a_xy, a_yx, a_yy) of one beam: observer to lens, observer to source, lens to source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beam {
    /// ∂(x_d/χ_d)/∂θ.
    pub od: [f64; 4],
    /// ∂(x_s/χ_s)/∂θ, as if the lens turned the beam without distorting it.
    pub os: [f64; 4],
    /// ∂(x_s/(χ_s − χ_d))/∂s_d.
    pub ds: [f64; 4],
}

impl LineOfSight {
    /// Follows beams of directions θ that a lens at redshift `z_lens` deflects by what `deflection` says of the
    /// direction x_d/χ_d in which they meet it, reduced to the source.
    ///
    /// # Errors
    /// When the lens does not lie between observer and source.
    pub fn beams(
        &self,
        z_lens: f64,
        theta_arcsec: &[[f64; 2]],
        deflection: impl Fn([f64; 2]) -> [f64; 2] + Sync,
    ) -> Result<Vec<Beam>> {
        let (segment, f) = (self.observer_to(z_lens)?, self.slope_per_reduced_deflection(z_lens)?);
        let (chi, chi_source) = (self.distance(z_lens)?, self.chi_source_cmpc);
        if chi >= chi_source {
            return Err(Error::out_of_range("z_lens", z_lens, "below z_source"));
        }
        let origin = self.origin(chi).direction_arcsec();
        let farther = &self.planes[self.planes.partition_point(|p| p.chi_cmpc < chi)..];
        let block = |theta: &[[f64; 2]]| -> Vec<Beam> {
            let mut through = segment.to_end::<1>(theta);
            let jacobian = |rays: &RayBlock, i: usize, scale: f64| -> [f64; 4] {
                std::array::from_fn(|c| rays.by_theta.dx[c][i] * scale)
            };
            let od: Vec<[f64; 4]> = (0..theta.len()).map(|i| jacobian(&through, i, 1.0 / chi)).collect();
            for i in 0..BLOCK {
                let at = through.position(i);
                let alpha = deflection([0, 1].map(|c| at[c] / chi - origin[c]));
                (0..2).for_each(|c| through.s[c][i] -= f * alpha[c]);
            }
            let (position, slope) = (|i| through.position(i), |i| through.slope(i));
            let mut behind = RayBlock::from_points(chi, theta.len(), position, slope);
            for rays in [&mut through, &mut behind] {
                rays.through::<1>(farther);
                rays.advance::<1>(chi_source);
            }
            let beam = |(i, od)| Beam {
                od,
                os: jacobian(&through, i, 1.0 / chi_source),
                ds: jacobian(&behind, i, 1.0 / (chi_source - chi)),
            };
            od.into_iter().enumerate().map(beam).collect()
        };
        Ok(theta_arcsec.par_chunks(BLOCK).map(block).collect::<Vec<_>>().concat())
    }
}
