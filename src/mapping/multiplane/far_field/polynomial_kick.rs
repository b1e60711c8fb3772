//! The part of a rough halo's kick that a polynomial across the field follows, so that little is left for the deviation.

use super::chebyshev::{Field, Fit, terms};
use crate::mapping::multiplane::plane::Plane;
use crate::mapping::multiplane::recursion::{Lanes, TILE};

/// Total degree of the polynomial; any would do: a higher one leaves smaller deviations but a less smooth skeleton.
const DEGREE: usize = 4;
const TERMS: usize = terms(DEGREE);

/// f·α of one halo as a polynomial in the direction at its plane.
#[derive(Clone)]
pub(super) struct PolynomialKick {
    centre_arcsec: [f64; 2],
    inv_half: [f64; 2],
    coefficients: [[f64; 2]; TERMS],
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
        let [x, y] = [0, 1].map(|c| fit.by_degree(|i| kicks[i][c], DEGREE).0);
        let coefficients = std::array::from_fn(|k| [x[k], y[k]]);
        Self { centre_arcsec, inv_half: half_arcsec.map(|h| 1.0 / h), coefficients }
    }

    /// The polynomial at a tile of directions.
    #[inline(always)]
    pub fn at(&self, theta_x: &Lanes, theta_y: &Lanes) -> [Lanes; 2] {
        let (mut tx, mut ty) = ([[1.0; TILE]; DEGREE + 1], [[1.0; TILE]; DEGREE + 1]);
        for i in 0..TILE {
            tx[1][i] = (theta_x[i] - self.centre_arcsec[0]) * self.inv_half[0];
            ty[1][i] = (theta_y[i] - self.centre_arcsec[1]) * self.inv_half[1];
        }
        for a in 2..=DEGREE {
            for i in 0..TILE {
                tx[a][i] = 2.0 * tx[1][i] * tx[a - 1][i] - tx[a - 2][i];
                ty[a][i] = 2.0 * ty[1][i] * ty[a - 1][i] - ty[a - 2][i];
            }
        }
        let (mut sum_x, mut sum_y) = ([0.0; TILE], [0.0; TILE]);
        let mut k = 0;
        for total in 0..=DEGREE {
            for b in 0..=total {
                let [cx, cy] = self.coefficients[k];
                for i in 0..TILE {
                    let product = tx[total - b][i] * ty[b][i];
                    sum_x[i] += cx * product;
                    sum_y[i] += cy * product;
                }
                k += 1;
            }
        }
        [sum_x, sum_y]
    }
}
