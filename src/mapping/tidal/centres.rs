//! Where on the sky the centres of the lenses of a tidal model are seen.

use super::lens::TidalLens;
use super::model::LineOfSightModel;
use crate::mapping::centre::{REACHED_ARCSEC, direction_of};
use crate::profile::mass::MassModel;

impl TidalLens {
    /// Directions in which rays meet the centre of a lens: θ_d(θ) = c.
    ///
    /// There the deflection may jump or diverge. Flexion models take the deflection at θ too, so that the unmoved
    /// centres are among their directions.
    pub fn lens_centres_arcsec(&self) -> Vec<[f64; 2]> {
        let centres: Vec<[f64; 2]> = self.lenses.iter().filter_map(MassModel::centre_arcsec).collect();
        let position = |theta| self.at_lens(theta);
        let mut seen: Vec<[f64; 2]> = centres.iter().filter_map(|&c| direction_of(c, position)).collect();
        if matches!(self.model, LineOfSightModel::Flexion(_)) {
            seen.extend(centres);
        }
        seen.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        seen.dedup_by(|a, b| (a[0] - b[0]).hypot(a[1] - b[1]) <= REACHED_ARCSEC);
        seen
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::super::{Flexion, FlexionModel, Tidal};
    use super::*;
    use crate::profile::mass::PointMass;

    #[test]
    fn a_ray_towards_a_centre_meets_it() {
        let tidal = Tidal { kappa: 0.05, gamma: Complex::new(0.03, -0.1), omega: 0.02 };
        let flexion = Flexion { f: Complex::new(0.01, 0.02), g: Complex::new(-0.01, 0.0) };
        let centre = [0.3, -0.2];
        let lenses = vec![MassModel::PointMass(PointMass::new(1.0, centre).unwrap())];
        let flexed = FlexionModel::minimal(tidal, tidal, flexion, flexion, flexion);
        for (model, number) in [
            (LineOfSightModel::Minimal { od: tidal, los: tidal }, 1),
            (LineOfSightModel::Flexion(flexed), 2),
            (LineOfSightModel::EMPTY, 1),
        ] {
            let lens = TidalLens::new(model, lenses.clone());
            let seen = lens.lens_centres_arcsec();
            assert_eq!(seen.len(), number);
            let miss = |theta: &[f64; 2]| {
                let at = lens.at_lens(*theta);
                (at[0] - centre[0]).hypot(at[1] - centre[1])
            };
            assert!(seen.iter().map(miss).fold(f64::INFINITY, f64::min) < 1e-11);
        }
    }
}
