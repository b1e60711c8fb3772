//! Where on the sky the centres of lenses in planes are seen.

use super::general::GeneralMultiPlane;
use super::recursion::Tile;
use crate::profile::mass::MassModel;

/// Iterations of θ ← θ + c − x(θ)/χ.
const ITERATIONS: usize = 60;
/// Distance from the centre that counts as reached, arcsec.
const REACHED_ARCSEC: f64 = 1e-12;

impl GeneralMultiPlane {
    /// Directions in which rays meet the centre of a lens, one a lens where the planes in front deflect weakly.
    ///
    /// A lens behind a strong lens is seen in several directions; of these one at most is found.
    pub fn lens_centres_arcsec(&self) -> Vec<[f64; 2]> {
        let with_centre = |i: usize| self.planes[i].profile.centre_arcsec().map(|centre| (i, centre));
        (0..self.planes.len())
            .filter_map(with_centre)
            .filter_map(|(i, centre)| self.direction_of(i, centre))
            .collect()
    }

    fn direction_of(&self, plane: usize, centre: [f64; 2]) -> Option<[f64; 2]> {
        let mut theta = centre;
        for _ in 0..ITERATIONS {
            let at = self.position_at(plane, theta);
            let left = [centre[0] - at[0], centre[1] - at[1]];
            if left[0].hypot(left[1]) <= REACHED_ARCSEC {
                return Some(theta);
            }
            theta = [theta[0] + left[0], theta[1] + left[1]];
        }
        None
    }

    /// Where a ray meets plane number `plane`, arcsec from the axis.
    fn position_at(&self, plane: usize, theta: [f64; 2]) -> [f64; 2] {
        let mut tile = Tile::start(0.0, [0.0; 2], [0.0; 2], &[theta]);
        let end = &self.planes[plane];
        for in_front in self.planes[..plane].iter().filter(|p| p.chi_cmpc < end.chi_cmpc) {
            tile.advance::<0>(in_front.chi_cmpc);
            let profile: &MassModel = &in_front.profile;
            tile.kick_lens::<0>(profile, self.strength(in_front), 1);
        }
        tile.advance::<0>(end.chi_cmpc);
        tile.bundle::<0>(1, [0.0; 2], 1.0 / end.chi_cmpc).beta_arcsec[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::Background;
    use crate::profile::mass::{External, PointMass};

    #[test]
    fn a_sheared_foreground_moves_the_centre() {
        let lens = MassModel::PointMass(PointMass::new(1.0, [0.5, 0.0]).unwrap());
        let sheet = MassModel::External(External::new(0.1, [0.0; 2], [0.0; 4], [0.0; 2]).unwrap());
        let through =
            GeneralMultiPlane::new(&Background::paper(), 1.5, &[(0.5, lens.clone()), (0.2, sheet)]).unwrap();
        let [x, y] = through.lens_centres_arcsec()[0];
        assert!(x > 0.5 && x < 0.5 / 0.9 && y == 0.0, "{x}");
        let alone = GeneralMultiPlane::new(&Background::paper(), 1.5, &[(0.5, lens)]).unwrap();
        assert_eq!(alone.lens_centres_arcsec(), [[0.5, 0.0]]);
    }
}
