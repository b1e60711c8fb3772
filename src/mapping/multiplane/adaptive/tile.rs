//! A square of the sky in which smooth haloes are a polynomial map and rays meet only the rough ones one by one.

use rayon::prelude::*;

use super::chebyshev::{Basis, Jet, LANES, Lanes, Series};
use super::field::Field;
use super::kicks::Kicks;
use super::sample::{Met, RAYS};
use crate::mapping::multiplane::kick::Distortion;
use crate::mapping::multiplane::plane::Plane;
use crate::mapping::multiplane::span::Span;
use crate::mapping::{Order, RayBundle};
use crate::numerics::dispatch::kernel;

/// A rough plane of a tile: met in the direction θ = S(θ₀) + Q(θ₀)z, and there kicked by K(θ).
pub(super) struct Event {
    pub plane: Plane,
    /// S.
    pub path: Series<2>,
    /// Q, row by row.
    pub rows: Series<8>,
    /// About where the centre of the halo is seen, arcsec, and how much its kicks differ over the tile.
    pub image_arcsec: [f64; 2],
    pub contrast_arcsec: f64,
}

/// β = S(θ₀) + Q(θ₀)z at the end of all events.
pub(super) struct Tile {
    pub square: Field,
    pub span: Span,
    pub events: Vec<Event>,
    pub end: Series<2>,
    pub end_rows: Series<8>,
    /// Bound of |β − β_exact| over the tile, arcsec.
    pub bound_arcsec: f64,
}

/// Index pairs (j, k) of the second derivatives.
const PAIRS: [(usize, usize); 3] = [(0, 0), (0, 1), (1, 1)];
/// Component of z that Ωᵀ pairs with each, and its sign.
const PARTNERS: [(usize, f64); 4] = [(2, -1.0), (3, -1.0), (0, 1.0), (1, 1.0)];

/// z and its derivatives, ∂z at `[n][j]`, ∂²z at `[n][pair]`.
pub(super) struct State {
    z: [Lanes; 4],
    first: [[Lanes; 2]; 4],
    second: [[Lanes; 3]; 4],
}

impl Tile {
    /// Traces rays of the tile.
    pub fn trace(&self, theta_arcsec: &[[f64; 2]], order: Order) -> RayBundle {
        let mut rays = RayBundle::default();
        for block in theta_arcsec.chunks(LANES) {
            match order {
                Order::Position => positions(self, block, &mut rays),
                Order::Jacobian => jacobians(self, block, &mut rays),
                Order::SecondDerivatives => second_derivatives(self, block, &mut rays),
            }
        }
        rays
    }

    /// β of rays, and where they meet every event.
    pub fn record(&self, theta_arcsec: &[[f64; 2]]) -> (Vec<[f64; 2]>, Vec<Met>) {
        let block = |theta: &[[f64; 2]]| {
            let mut rays = RayBundle::default();
            let mut met: Vec<Met> = self.events.iter().map(|_| Met::with_room(RAYS)).collect();
            recorded(self, theta, &mut rays, &mut met);
            (rays.beta_arcsec, met)
        };
        let (beta, met): (Vec<_>, Vec<_>) = theta_arcsec.par_chunks(LANES).map(block).unzip();
        (beta.concat(), Met::joined(met))
    }
}

#[inline(always)]
fn trace<const ORDER: usize, const RECORD: bool>(
    tile: &Tile,
    theta: &[[f64; 2]],
    rays: &mut RayBundle,
    met: &mut [Met],
) {
    let used = theta.len();
    let basis = Basis::at::<ORDER>(&tile.square, theta);
    let (mut path, mut rows, mut kicks) = (Jet::<2>::zero(), Jet::<8>::zero(), Kicks::zero());
    let mut state = State::unkicked();
    for (number, event) in tile.events.iter().enumerate() {
        event.path.at::<ORDER>(&basis, &mut path);
        event.rows.at::<ORDER>(&basis, &mut rows);
        state.locate::<ORDER>(&mut path, &rows);
        kicks.set::<ORDER>(&event.plane, &path.value);
        if RECORD {
            let met = &mut met[number];
            met.theta_arcsec.extend((0..used).map(|i| [path.value[0][i], path.value[1][i]]));
            met.kick_arcsec.extend((0..used).map(|i| [kicks.kick[0][i], kicks.kick[1][i]]));
        }
        state.kick::<ORDER>(&path, &rows, &kicks, tile.span.weight(event.plane.chi_cmpc));
    }
    tile.end.at::<ORDER>(&basis, &mut path);
    tile.end_rows.at::<ORDER>(&basis, &mut rows);
    state.locate::<ORDER>(&mut path, &rows);
    for i in 0..used {
        rays.beta_arcsec.push([path.value[0][i], path.value[1][i]]);
        if ORDER >= 1 {
            let [x, y] = &path.first;
            rays.jacobian.push([x[0][i], y[0][i], x[1][i], y[1][i]]);
        }
        if ORDER >= 2 {
            let [xx, xy, yy] = &path.second;
            rays.second_per_arcsec.push([xx[0][i], xy[0][i], yy[0][i], xx[1][i], xy[1][i], yy[1][i]]);
        }
    }
}

impl State {
    /// Before the first event.
    pub fn unkicked() -> Self {
        Self { z: [[0.0; LANES]; 4], first: [[[0.0; LANES]; 2]; 4], second: [[[0.0; LANES]; 3]; 4] }
    }

    /// `path` ← S + Qz with derivatives.
    #[inline(always)]
    pub fn locate<const ORDER: usize>(&self, path: &mut Jet<2>, rows: &Jet<8>) {
        for c in 0..2 {
            for n in 0..4 {
                let q = 4 * c + n;
                for i in 0..LANES {
                    path.value[c][i] += rows.value[q][i] * self.z[n][i];
                }
                if ORDER >= 1 {
                    for j in 0..2 {
                        for i in 0..LANES {
                            path.first[j][c][i] +=
                                rows.first[j][q][i] * self.z[n][i] + rows.value[q][i] * self.first[n][j][i];
                        }
                    }
                }
                if ORDER >= 2 {
                    for (p, (j, k)) in PAIRS.into_iter().enumerate() {
                        for i in 0..LANES {
                            path.second[p][c][i] += rows.second[p][q][i] * self.z[n][i]
                                + rows.first[j][q][i] * self.first[n][k][i]
                                + rows.first[k][q][i] * self.first[n][j][i]
                                + rows.value[q][i] * self.second[n][p][i];
                        }
                    }
                }
            }
        }
    }

    /// z ← z + wΩQᵀK with derivatives; K's are ∂K = H∂θ and ∂²K = H∂²θ + T(∂θ, ∂θ).
    #[allow(clippy::needless_range_loop, reason = "tensor indices")]
    #[inline(always)]
    pub fn kick<const ORDER: usize>(&mut self, path: &Jet<2>, rows: &Jet<8>, kicks: &Kicks, w: f64) {
        let Distortion { h, t } = &kicks.distortion;
        let mut first = [[[0.0; LANES]; 2]; 2];
        let mut second = [[[0.0; LANES]; 3]; 2];
        for c in 0..2 {
            if ORDER >= 1 {
                for j in 0..2 {
                    for i in 0..LANES {
                        first[c][j][i] = h[c][i] * path.first[j][0][i] + h[c + 1][i] * path.first[j][1][i];
                    }
                }
            }
            if ORDER >= 2 {
                for (p, (j, k)) in PAIRS.into_iter().enumerate() {
                    for i in 0..LANES {
                        let ([xj, yj], [xk, yk]) =
                            ([0, 1].map(|d| path.first[j][d][i]), [0, 1].map(|d| path.first[k][d][i]));
                        second[c][p][i] = h[c][i] * path.second[p][0][i]
                            + h[c + 1][i] * path.second[p][1][i]
                            + t[c][i] * xj * xk
                            + t[c + 1][i] * (xj * yk + yj * xk)
                            + t[c + 2][i] * yj * yk;
                    }
                }
            }
        }
        for (n, (partner, sign)) in PARTNERS.into_iter().enumerate() {
            let w = sign * w;
            for c in 0..2 {
                let q = 4 * c + partner;
                for i in 0..LANES {
                    self.z[n][i] += w * rows.value[q][i] * kicks.kick[c][i];
                }
                if ORDER >= 1 {
                    for j in 0..2 {
                        for i in 0..LANES {
                            self.first[n][j][i] += w
                                * (rows.first[j][q][i] * kicks.kick[c][i]
                                    + rows.value[q][i] * first[c][j][i]);
                        }
                    }
                }
                if ORDER >= 2 {
                    for (p, (j, k)) in PAIRS.into_iter().enumerate() {
                        for i in 0..LANES {
                            self.second[n][p][i] += w
                                * (rows.second[p][q][i] * kicks.kick[c][i]
                                    + rows.first[j][q][i] * first[c][k][i]
                                    + rows.first[k][q][i] * first[c][j][i]
                                    + rows.value[q][i] * second[c][p][i]);
                        }
                    }
                }
            }
        }
    }
}

kernel! {
    fn positions(tile: &Tile, theta: &[[f64; 2]], rays: &mut RayBundle) {
        trace::<0, false>(tile, theta, rays, &mut []);
    }
}

kernel! {
    fn recorded(tile: &Tile, theta: &[[f64; 2]], rays: &mut RayBundle, met: &mut [Met]) {
        trace::<0, true>(tile, theta, rays, met);
    }
}

kernel! {
    fn jacobians(tile: &Tile, theta: &[[f64; 2]], rays: &mut RayBundle) {
        trace::<1, false>(tile, theta, rays, &mut []);
    }
}

kernel! {
    fn second_derivatives(tile: &Tile, theta: &[[f64; 2]], rays: &mut RayBundle) {
        trace::<2, false>(tile, theta, rays, &mut []);
    }
}
