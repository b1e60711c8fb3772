//! Which cylinders of many a halo of the sky lies in: a k-d tree of their directions on the unit sphere.

use std::num::NonZeroUsize;

use kiddo::{ImmutableKdTree, SquaredEuclidean};

use super::direction::{Direction, TangentFrame};
use crate::constants::ARCSEC_RAD;
use crate::cosmology::Background;
use crate::error::{Error, Result};
use crate::numerics::spline::UniformSpline;

/// Haloes farther from an axis than this are in no cylinder: the sky is not flat out there. Within it lies all of a cylinder
/// of 18 Mpc but for its nearest 35 Mpc.
pub const LARGEST_SEPARATION_DEG: f64 = 30.0;

/// Knots of χ(z) between the observer and the source.
const KNOTS: usize = 2048;

/// Cylinders of one comoving radius about several directions, to one redshift.
pub struct Cylinders {
    frames: Vec<TangentFrame>,
    tree: ImmutableKdTree<f64, 3>,
    radius_cmpc: f64,
    background: Background,
    chi_cmpc: UniformSpline,
}

/// A halo in a cylinder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Member {
    /// Which, from 0.
    pub cylinder: usize,
    /// Position, arcsec from the axis.
    pub theta_arcsec: [f64; 2],
}

impl Cylinders {
    /// Cylinders of `radius_cmpc` about `directions`, out to `z_max`.
    ///
    /// # Errors
    /// No direction at all.
    pub fn new(
        directions: &[Direction],
        radius_cmpc: f64,
        z_max: f64,
        background: Background,
    ) -> Result<Self> {
        let frames: Vec<TangentFrame> = directions.iter().map(|&d| TangentFrame::at(d)).collect();
        let centres: Vec<[f64; 3]> = frames.iter().map(TangentFrame::centre).collect();
        let tree = ImmutableKdTree::new_from_slice(&centres).map_err(|error| {
            Error::out_of_range("number of sightlines", format!("{} ({error})", centres.len()), "at least 1")
        })?;
        let step = z_max / (KNOTS - 1) as f64;
        let chi: Vec<f64> = (0..KNOTS).map(|i| background.comoving_distance_mpc(step * i as f64)).collect();
        let chi_cmpc = UniformSpline::new(0.0, step, &chi)?;
        Ok(Self { frames, tree, radius_cmpc, background, chi_cmpc })
    }

    /// Adds to `found` the cylinders that a halo lies in: χ(z)·θ at most the radius, θ the separation from the axis.
    ///
    /// `unit` is the halo's unit vector, `z` at most the redshift of the cylinders' end.
    pub fn members(&self, unit: [f64; 3], z: f64, found: &mut Vec<Member>) {
        /// What the table of χ may be wrong by, and rounding.
        const SLACK: f64 = 1.0 + 1e-5;
        let largest = LARGEST_SEPARATION_DEG.to_radians();
        let near = (SLACK * self.radius_cmpc / self.chi_cmpc.value(z).max(f64::MIN_POSITIVE)).min(largest);
        let half_chord = (0.5 * near).sin();
        let squared = SLACK * 4.0 * half_chord * half_chord;
        let hits = self.tree.query(&unit).within::<SquaredEuclidean<f64>>(squared).unsorted().execute();
        if hits.is_empty() {
            return;
        }
        let chi_cmpc = self.background.comoving_distance_mpc(z);
        for hit in hits {
            let cylinder = hit.item as usize;
            let theta_arcsec = self.frames[cylinder].offsets_arcsec(unit);
            let theta = theta_arcsec[0].hypot(theta_arcsec[1]) * ARCSEC_RAD;
            if theta <= largest && chi_cmpc * theta <= self.radius_cmpc {
                found.push(Member { cylinder, theta_arcsec });
            }
        }
    }

    /// How many there are.
    pub fn count(&self) -> Option<NonZeroUsize> {
        NonZeroUsize::new(self.frames.len())
    }
}

#[cfg(test)]
mod tests {
    use super::super::footprint::Footprint;
    use super::*;

    #[test]
    fn the_tree_finds_what_a_loop_over_all_finds() {
        let background = Background::paper();
        let centres: Vec<Direction> = (0..300)
            .map(|k| Footprint::FULL_SKY.random_direction(1, k))
            .chain([90.0, -90.0].map(|dec_deg| Direction { ra_deg: 0.0, dec_deg }))
            .chain([Direction { ra_deg: 0.0, dec_deg: 0.0 }; 40])
            .collect();
        let cylinders = Cylinders::new(&centres, 18.46, 1.5, background).unwrap();
        assert_eq!(cylinders.count().unwrap().get(), 342);
        let (mut total, mut found) = (0, Vec::new());
        for k in 0..20_000_u64 {
            let halo = Footprint::FULL_SKY.random_direction(2, k).unit_vector();
            // Many of the same redshift, and some that are very near.
            let z = [0.001, 0.01, 0.1, 0.5, 1.4999][k as usize % 5];
            found.clear();
            cylinders.members(halo, z, &mut found);
            found.sort_by_key(|member| member.cylinder);
            let chi = background.comoving_distance_mpc(z);
            let separation = |d: &Direction| {
                let n = d.unit_vector();
                let chord = (0..3).map(|i| (n[i] - halo[i]).powi(2)).sum::<f64>().sqrt();
                2.0 * (0.5 * chord).asin()
            };
            let expected: Vec<usize> = (0..centres.len())
                .filter(|&i| {
                    let theta = separation(&centres[i]);
                    chi * theta <= 18.46 && theta <= LARGEST_SEPARATION_DEG.to_radians()
                })
                .collect();
            assert_eq!(found.iter().map(|m| m.cylinder).collect::<Vec<_>>(), expected, "halo {k}");
            total += expected.len();
        }
        assert!(total > 10_000, "{total}");
    }
}
