//! Squares of the sky that hold rays, and their quarters.

/// A rectangle on the sky, sides along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// Centre in arcsec.
    pub centre_arcsec: [f64; 2],
    /// Half the sides in arcsec.
    pub half_arcsec: [f64; 2],
}

impl Field {
    /// The smallest rectangle around `theta_arcsec`, widened by a millionth so that rounding leaves none outside;
    /// none for no points or points that are not finite.
    pub fn around(theta_arcsec: &[[f64; 2]]) -> Option<Self> {
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for theta in theta_arcsec {
            for c in 0..2 {
                low[c] = low[c].min(theta[c]);
                high[c] = high[c].max(theta[c]);
            }
        }
        let half_arcsec = [0, 1].map(|c| 0.5 * (high[c] - low[c]) * (1.0 + 1e-6));
        let centre_arcsec = [0, 1].map(|c| 0.5 * (high[c] + low[c]));
        let finite = theta_arcsec.iter().flatten().all(|v| v.is_finite());
        (finite && !theta_arcsec.is_empty()).then_some(Self { centre_arcsec, half_arcsec })
    }

    /// False for a point, and for sides that are not finite.
    pub(super) fn is_extended(&self) -> bool {
        self.half_arcsec.iter().all(|h| h.is_finite()) && self.half_arcsec != [0.0; 2]
    }

    /// The smallest square about the same centre.
    pub(super) fn square(&self) -> Self {
        Self { half_arcsec: [self.half_arcsec[0].max(self.half_arcsec[1]); 2], ..*self }
    }

    /// True for θ inside.
    pub(super) fn contains(&self, theta: [f64; 2]) -> bool {
        (0..2).all(|c| (theta[c] - self.centre_arcsec[c]).abs() <= self.half_arcsec[c])
    }

    /// The quarter that θ lies in: bit 0 right, bit 1 upper.
    pub(super) fn quarter_of(&self, theta: [f64; 2]) -> usize {
        let upper = |c: usize| usize::from(theta[c] > self.centre_arcsec[c]);
        upper(0) + 2 * upper(1)
    }

    /// Quarter number `k` in the order of [`Self::quarter_of`], wide enough to hold its rays whatever the rounding.
    pub(super) fn quarter(&self, k: usize) -> Self {
        let mut quarter = *self;
        for c in 0..2 {
            quarter.half_arcsec[c] *= 0.5;
            quarter.centre_arcsec[c] += if k >> c & 1 == 1 { 0.5 } else { -0.5 } * self.half_arcsec[c];
            quarter.half_arcsec[c] *= 1.0 + 1e-9;
        }
        quarter
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_cover_the_field_and_hold_their_points() {
        let field = Field::around(&[[-1.0, 0.5], [3.0, 2.5], [0.0, 1.0]]).unwrap();
        for theta in [[-0.9, 0.6], [2.0, 0.6], [0.3, 2.4], [2.9, 2.2]] {
            assert!(field.contains(theta));
            let square = field.square();
            assert!(square.quarter(square.quarter_of(theta)).contains(theta), "{theta:?}");
        }
        assert!(Field::around(&[]).is_none() && Field::around(&[[f64::NAN, 0.0]]).is_none());
    }
}
