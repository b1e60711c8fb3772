//! Eight rays through all planes: which haloes are rough for a square, and where inside it they are seen.

use super::field::Field;
use super::sample::Spot;
use crate::mapping::multiplane::kick::{Distortion, Kick};
use crate::mapping::multiplane::plane::Plane;
use crate::mapping::multiplane::span::Span;
use crate::numerics::dispatch::kernel;

/// Rays on the edge of a square that show where its rays go.
pub(super) const RAYS: usize = 8;

/// Rays on the edge of a square: corners and middles of the sides.
pub(super) struct Outline {
    square: Field,
    pub x: [[f64; RAYS]; 2],
    pub s: [[f64; RAYS]; 2],
    chi_cmpc: f64,
}

impl Outline {
    /// Where the rays lie in the square, in units of half its side.
    const PLACES: [[f64; 2]; RAYS] = [
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [-1.0, 1.0],
        [-1.0, 0.0],
        [-1.0, -1.0],
        [0.0, -1.0],
        [1.0, -1.0],
    ];

    pub fn start(span: &Span, square: &Field) -> Self {
        let slope = |c: usize, place: &[f64; 2]| {
            span.s_start[c] + square.centre_arcsec[c] + square.half_arcsec[c] * place[c]
        };
        Self {
            square: *square,
            x: span.x_start.map(|x| [x; RAYS]),
            s: [0, 1].map(|c| std::array::from_fn(|i| slope(c, &Self::PLACES[i]))),
            chi_cmpc: span.chi_start_cmpc,
        }
    }

    /// On to `chi_cmpc`, whose inverse is `inv_chi`: where the rays in the corners, the outermost, are seen there.
    #[inline(always)]
    pub fn advance(&mut self, chi_cmpc: f64, inv_chi: f64) -> Spot {
        let step = chi_cmpc - self.chi_cmpc;
        self.chi_cmpc = chi_cmpc;
        for c in 0..2 {
            for i in 0..RAYS {
                self.x[c][i] += step * self.s[c][i];
            }
        }
        let [x, y] = &self.x;
        let quarter = 0.25 * inv_chi;
        let mean = [quarter * ((x[1] + x[3]) + (x[5] + x[7])), quarter * ((y[1] + y[3]) + (y[5] + y[7]))];
        let mut radius = 0.0_f64;
        for i in [1, 3, 5, 7] {
            radius = radius.max((x[i] * inv_chi - mean[0]).powi(2) + (y[i] * inv_chi - mean[1]).powi(2));
        }
        Spot { mean_arcsec: mean, radius_arcsec: radius.sqrt() }
    }

    /// The direction in which `at` on the plane reached is seen, to first order.
    fn image(&self, at: [f64; 2]) -> [f64; 2] {
        let x = |c: usize, i: usize| self.x[c][i] / self.chi_cmpc;
        let [[xx, xy], [yx, yy]] = [0, 1].map(|c| [0.5 * (x(c, 0) - x(c, 4)), 0.5 * (x(c, 2) - x(c, 6))]);
        let centre = [0, 1].map(|c| 0.25 * (x(c, 0) + x(c, 2) + x(c, 4) + x(c, 6)));
        let ([u, v], determinant) = ([at[0] - centre[0], at[1] - centre[1]], xx * yy - xy * yx);
        let place = [(yy * u - xy * v) / determinant, (xx * v - yx * u) / determinant];
        [0, 1].map(|c| self.square.centre_arcsec[c] + self.square.half_arcsec[c] * place[c])
    }
}

/// A plane that is rough for the square: its number, the largest deflection by its halo, and where that is seen.
pub(super) type Found = (usize, f64, [f64; 2]);

kernel! {
    /// On through `planes`, whose rough ones are added to `rough`.
    pub(super) fn outline_through(
        outline: &mut Outline,
        planes: &[Plane],
        tolerance: f64,
        rough: &mut Vec<Found>,
    ) {
        let mut distortion = Distortion::none();
        for (number, plane) in planes.iter().enumerate() {
            let spot = outline.advance(plane.chi_cmpc, plane.inv_chi);
            let Outline { x, s, .. } = &mut *outline;
            let mut alpha = 0.0_f64;
            plane.kick::<0, RAYS>(
                x,
                plane.inv_chi,
                &mut distortion,
                |i: usize, kick: Kick| {
                    alpha = alpha.max(kick.fkm * kick.fkm * kick.u);
                    s[0][i] -= kick.f_alpha_arcsec[0];
                    s[1][i] -= kick.f_alpha_arcsec[1];
                },
            );
            let alpha = (alpha / plane.inv_r_s2).sqrt();
            if spot.is_rough(plane, alpha, tolerance) {
                rough.push((number, alpha, outline.image(plane.centre_arcsec)));
            }
        }
    }
}
