//! What haloes do along rays that a lens bends: od, os and ds tensors of beams, the lens's own distortion left out.

use rayon::prelude::*;

use super::circle::{RAYS, turn};
use super::line_of_sight::LineOfSight;
use super::recursion::{BLOCK, FewRays, RaysTogether};
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
            let at_lens = through.clone();
            through.turn(f, |at| deflection([0, 1].map(|c| at[c] / chi - origin[c])));
            let mut behind = through.starting_here(theta.len());
            for rays in [&mut through, &mut behind] {
                rays.through::<1>(farther);
                rays.advance::<1>(chi_source);
            }
            (0..theta.len()).map(|i| beam(i, [&at_lens, &through, &behind], chi, chi_source)).collect()
        };
        Ok(theta_arcsec.par_chunks(BLOCK).map(block).collect::<Vec<_>>().concat())
    }

    /// The average of beams all around the Einstein ring: of directions at `radius_arcsec` from the axis, in which a lens about
    /// the direction `centre_arcsec` turns rays by so much towards the axis at the source.
    ///
    /// Eight rays with what they miss of haloes near the ring, which is R_E before the lens and
    /// R_E(χ_d/χ)(χ_s − χ)/(χ_s − χ_d) behind it.
    ///
    /// # Errors
    /// When the lens does not lie between observer and source.
    pub fn ring_beam(&self, z_lens: f64, radius_arcsec: f64, centre_arcsec: [f64; 2]) -> Result<Beam> {
        let f = self.slope_per_reduced_deflection(z_lens)?;
        let (chi, chi_source) = (self.distance(z_lens)?, self.chi_source_cmpc);
        if chi >= chi_source {
            return Err(Error::out_of_range("z_lens", z_lens, "below z_source"));
        }
        let behind_lens = self.planes.partition_point(|p| p.chi_cmpc < chi);
        let radius = |d: f64| {
            radius_arcsec * if d < chi { 1.0 } else { chi * (chi_source - d) / (d * (chi_source - chi)) }
        };
        let nearby = self.nearby(radius);
        let theta = nearby.angles.map(|angle| turn(angle).map(|c| radius_arcsec * c));
        let mut through = FewRays::start(0.0, [0.0; 2], [0.0; 2], &theta);
        let nearer = self.through_meeting::<1>(&mut through, 0..behind_lens, &nearby);
        through.advance::<1>(chi);
        let at_lens = through.clone();
        let origin = self.origin(chi).direction_arcsec();
        through.turn(f, |at| [0, 1].map(|c| at[c] / chi - origin[c] - centre_arcsec[c]));
        let mut behind = through.starting_here(RAYS);
        let farther = self.through_meeting::<1>(&mut through, behind_lens..self.planes.len(), &nearby);
        behind.through::<1>(&self.planes[behind_lens..]);
        through.advance::<1>(chi_source);
        behind.advance::<1>(chi_source);
        let mut mean = Beam { od: [0.0; 4], os: [0.0; 4], ds: [0.0; 4] };
        for i in 0..RAYS {
            mean.add(&beam(i, [&at_lens, &through, &behind], chi, chi_source), [1.0 / RAYS as f64; 3]);
        }
        for meeting in nearer.iter().chain(&farther) {
            let [xx, xy, yy] = meeting.missed(|_, halo| halo.hessian);
            let (h, d) = ([xx, xy, xy, yy], meeting.chi_cmpc);
            // H is reduced to the source; by how much more it counts on the way to the lens, or from it.
            let od = (chi - d).max(0.0) / chi * chi_source / (chi_source - d);
            let ds = (d - chi).max(0.0) / d * chi_source / (chi_source - chi);
            mean.add(&Beam { od: h, os: h, ds: h }, [-od, -1.0, -ds]);
        }
        Ok(mean)
    }
}

impl Beam {
    fn add(&mut self, other: &Self, times: [f64; 3]) {
        let parts = [(&mut self.od, &other.od), (&mut self.os, &other.os), (&mut self.ds, &other.ds)];
        for ((sum, part), times) in parts.into_iter().zip(times) {
            sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += times * part);
        }
    }
}

/// Beam `i` of rays at the lens, at the source, and at the source with derivatives by the slope at the lens.
fn beam<const N: usize>(
    i: usize,
    [at_lens, through, behind]: [&RaysTogether<N>; 3],
    chi: f64,
    chi_source: f64,
) -> Beam {
    let jacobian = |rays: &RaysTogether<N>, length: f64| rays.by_theta.dx.each_ref().map(|c| c[i] / length);
    Beam {
        od: jacobian(at_lens, chi),
        os: jacobian(through, chi_source),
        ds: jacobian(behind, chi_source - chi),
    }
}
