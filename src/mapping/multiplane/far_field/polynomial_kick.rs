//! The part of a rough halo's kick that a polynomial across the field follows, so that little is left for the deviation.

use super::chebyshev::{Field, Fit, terms};
use crate::mapping::multiplane::plane::Plane;

/// Total degree of the polynomial; any would do, a higher one leaves smaller deviations.
const DEGREE: usize = 4;
const TERMS: usize = terms(DEGREE);

/// f·α of one halo as a polynomial in the direction at its plane.
#[derive(Clone)]
pub(super) struct PolynomialKick {
    centre_arcsec: [f64; 2],
    inv_half: [f64; 2],
    coefficients: [[f64; TERMS]; 2],
}

impl PolynomialKick {
    /// Fits the kick of `plane` on a rectangle of half sides `half_arcsec` about `centre_arcsec`.
    pub fn of(plane: &Plane, centre_arcsec: [f64; 2], half_arcsec: [f64; 2]) -> Self {
        let fit = Fit::new(DEGREE + 2);
        let nodes = fit.nodes_arcsec(&Field { centre_arcsec, half_arcsec });
        let kicks: Vec<[f64; 2]> = nodes
            .iter()
            .map(|theta| {
                let t = [theta[0] - plane.centre_arcsec[0], theta[1] - plane.centre_arcsec[1]];
                let km = plane.fk * plane.radial(plane.u(t[0], t[1]))[0];
                t.map(|t| km * t)
            })
            .collect();
        let coefficients = [0, 1].map(|c| {
            let mut fitted = Vec::with_capacity(TERMS);
            fit.append(|i| kicks[i][c], DEGREE, &mut fitted);
            std::array::from_fn(|k| fitted[k])
        });
        Self { centre_arcsec, inv_half: half_arcsec.map(|h| 1.0 / h), coefficients }
    }

    /// The polynomial at θ.
    #[inline(always)]
    pub fn at(&self, theta_x: f64, theta_y: f64) -> [f64; 2] {
        let x = (theta_x - self.centre_arcsec[0]) * self.inv_half[0];
        let y = (theta_y - self.centre_arcsec[1]) * self.inv_half[1];
        let (mut tx, mut ty) = ([1.0; DEGREE + 1], [1.0; DEGREE + 1]);
        tx[1] = x;
        ty[1] = y;
        for a in 2..=DEGREE {
            tx[a] = 2.0 * x * tx[a - 1] - tx[a - 2];
            ty[a] = 2.0 * y * ty[a - 1] - ty[a - 2];
        }
        let mut sum = [0.0; 2];
        let mut k = 0;
        for total in 0..=DEGREE {
            for b in 0..=total {
                let product = tx[total - b] * ty[b];
                sum[0] += self.coefficients[0][k] * product;
                sum[1] += self.coefficients[1][k] * product;
                k += 1;
            }
        }
        sum
    }
}
