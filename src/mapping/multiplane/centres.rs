//! Where on the sky the centres of lenses in planes are seen.

use super::general::GeneralMultiPlane;
use super::recursion::RayBlock;
use crate::mapping::centre::direction_of;

impl GeneralMultiPlane {
    /// Directions in which rays meet the centre of a lens, one a lens where the planes in front deflect weakly.
    ///
    /// A lens behind a strong lens is seen in several directions; of these one at most is found.
    pub fn lens_centres_arcsec(&self) -> Vec<[f64; 2]> {
        let with_centre = |i: usize| self.planes[i].profile.centre_arcsec().map(|centre| (i, centre));
        (0..self.planes.len())
            .filter_map(with_centre)
            .filter_map(|(i, centre)| direction_of(centre, |theta| self.position_at(i, theta)))
            .collect()
    }

    /// Where a ray meets plane number `plane`, arcsec from the axis.
    fn position_at(&self, plane: usize, theta: [f64; 2]) -> [f64; 2] {
        let mut rays = RayBlock::start(0.0, [0.0; 2], [0.0; 2], &[theta]);
        let chi_end = self.planes[plane].chi_cmpc;
        for in_front in self.planes[..plane].iter().filter(|p| p.chi_cmpc < chi_end) {
            rays.through_lens::<0>(in_front, 1);
        }
        rays.advance::<0>(chi_end);
        rays.bundle::<0>(1, [0.0; 2], 1.0 / chi_end).beta_arcsec[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::Background;
    use crate::profile::mass::{External, MassModel, PointMass};

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
