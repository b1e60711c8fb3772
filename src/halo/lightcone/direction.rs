//! Directions on the sky, and offsets of one from another.

use crate::constants::ARCSEC_RAD;

/// A direction on the sky.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// Right ascension.
    pub ra_deg: f64,
    /// Declination.
    pub dec_deg: f64,
}

impl Direction {
    /// The unit vector (cos δ cos α, cos δ sin α, sin δ).
    pub fn unit_vector(self) -> [f64; 3] {
        let (sin_ra, cos_ra) = self.ra_deg.to_radians().sin_cos();
        let (sin_dec, cos_dec) = self.dec_deg.to_radians().sin_cos();
        [cos_dec * cos_ra, cos_dec * sin_ra, sin_dec]
    }
}

/// A direction with its east and north, from which others are measured.
#[derive(Debug, Clone, Copy)]
pub struct TangentFrame {
    centre: [f64; 3],
    east: [f64; 3],
    north: [f64; 3],
}

impl TangentFrame {
    /// The frame of a direction; at a pole, east and north are those of its right ascension.
    pub fn at(direction: Direction) -> Self {
        let (sin_ra, cos_ra) = direction.ra_deg.to_radians().sin_cos();
        let (sin_dec, cos_dec) = direction.dec_deg.to_radians().sin_cos();
        Self {
            centre: direction.unit_vector(),
            east: [-sin_ra, cos_ra, 0.0],
            north: [-sin_dec * cos_ra, -sin_dec * sin_ra, cos_dec],
        }
    }

    /// The unit vector of the direction itself.
    pub fn centre(&self) -> [f64; 3] {
        self.centre
    }

    /// (θ_x, θ_y) in arcsec of a unit vector: its separation from the centre, along its direction from there; x grows to the
    /// west, y to the north, as in an image with north up and east to the left.
    ///
    /// The zenithal equidistant projection (`ARC` of FITS): separation and direction from the centre, on which a halo's effect
    /// on the axis depends, are exact. Lengths across that direction are too long by (θ/sin θ − 1) ≈ θ²/6: 5e-5 at 1°,
    /// 5e-3 at 10°.
    ///
    /// ```
    /// use haloray::halo::lightcone::{Direction, TangentFrame};
    /// let frame = TangentFrame::at(Direction { ra_deg: 359.9, dec_deg: 0.0 });
    /// let [x, y] = frame.offsets_arcsec(Direction { ra_deg: 0.1, dec_deg: 0.0 }.unit_vector());
    /// assert!((x + 720.0).abs() < 1e-8 && y.abs() < 1e-8);
    /// ```
    pub fn offsets_arcsec(&self, unit: [f64; 3]) -> [f64; 2] {
        let [east, north, along] = [self.east, self.north, self.centre].map(|axis| dot(axis, unit));
        let across = east.hypot(north);
        if across == 0.0 {
            // The centre itself, or the point opposite to it.
            return [0.0, if along < 0.0 { std::f64::consts::PI / ARCSEC_RAD } else { 0.0 }];
        }
        let separation = across.atan2(along) / ARCSEC_RAD;
        [-separation * (east / across), separation * (north / across)]
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offsets(centre: [f64; 2], other: [f64; 2]) -> [f64; 2] {
        let direction = |[ra_deg, dec_deg]: [f64; 2]| Direction { ra_deg, dec_deg };
        TangentFrame::at(direction(centre)).offsets_arcsec(direction(other).unit_vector())
    }

    #[test]
    fn separations_are_exact_across_the_wrap_and_the_poles() {
        // Haversine's separation and Euler's bearing, by other formulas than those above.
        for (centre, other) in [
            ([0.001, 0.0], [359.999, 0.001]),
            ([10.0, 89.999], [190.0, 89.998]),
            ([200.0, -90.0], [20.0, -89.5]),
            ([150.0, 2.0], [157.0, -3.0]),
        ] {
            let [x, y] = offsets(centre, other);
            let [[a0, d0], [a1, d1]] = [centre, other].map(|pair| pair.map(f64::to_radians));
            let haversine =
                ((d1 - d0) / 2.0).sin().powi(2) + d0.cos() * d1.cos() * ((a1 - a0) / 2.0).sin().powi(2);
            let separation = 2.0 * haversine.sqrt().asin() / ARCSEC_RAD;
            assert!((x.hypot(y) - separation).abs() < 1e-6, "{centre:?} {other:?}");
            let bearing = ((a1 - a0).sin() * d1.cos())
                .atan2(d0.cos() * d1.sin() - d0.sin() * d1.cos() * (a1 - a0).cos());
            let along = -x * bearing.sin() + y * bearing.cos();
            assert!((along - separation).abs() < 1e-6, "{centre:?} {other:?}: {along} {separation}");
        }
    }

    #[test]
    fn west_is_right_and_north_is_up() {
        let [x, y] = offsets([150.0, 0.0], [149.9, 0.1]);
        assert!(x > 0.0 && y > 0.0 && (x - 360.0).abs() < 1e-2 && (y - 360.0).abs() < 1e-2, "{x} {y}");
        assert_eq!(offsets([30.0, 90.0], [30.0, 90.0]), [0.0, 0.0]);
    }
}
