//! The rays that only the smooth haloes and the sheets bend, as polynomials in θ, and the tides along them.

use multiversion::multiversion;
use rayon::prelude::*;

use super::chebyshev::{Field, Fit, terms};
use super::classify::Reach;
use super::polynomial_kick::PolynomialKick;
use crate::mapping::multiplane::plane::Plane;
use crate::mapping::multiplane::recursion::{Lanes, TILE, Tile, radial_functions};
use crate::profile::mass::RadialDerivatives;

/// A cell is at most this part of the whole path deep; every rough halo is the border of cells besides.
const CELLS: usize = 768;
/// Total degrees in θ of H and of T.
const TIDE_DEGREES: [usize; 2] = [10, 6];
/// Components of the tides of a station: H (xx, xy, yy) and T (xxx, xxy, xyy, yyy).
pub(super) const TIDES: usize = 7;
/// Aliased coefficients equal those left out: twice their sum bounds the interpolation (docs/ADAPTIVE_TRACING.md).
const ALIASING: f64 = 2.0;
/// The bundle may be this much wider than the field anywhere along the way.
const WIDENING: f64 = 1.1;

/// A halo too near for a polynomial; its sheet and a polynomial part of its kick belong to the skeleton.
pub(super) struct Rough {
    pub plane: Plane,
    pub kick: PolynomialKick,
    /// The cell that begins at this plane.
    pub cell: usize,
    /// The skeleton's position there, arcsec, and its error.
    pub path: Polynomials<2>,
    pub error_arcsec: f64,
}

/// N polynomials of one degree, term by term in the order of [`Fit::by_degree`].
pub(super) type Polynomials<const N: usize> = Vec<[f64; N]>;

/// Fits N functions with the lowest degree up to `degree_max` that leaves out at most `tolerance` of each.
fn fit_many<const N: usize>(
    fit: &Fit,
    value: impl Fn(usize, usize) -> f64,
    degree_max: usize,
    tolerance: f64,
) -> (Polynomials<N>, [f64; N]) {
    let each: [_; N] = std::array::from_fn(|c| fit.by_degree(|node| value(c, node), degree_max));
    let enough = |d: &usize| each.iter().all(|(_, left_out)| left_out[*d] <= tolerance);
    let degree = (0..degree_max).find(enough).unwrap_or(degree_max);
    let polynomials = (0..terms(degree)).map(|k| std::array::from_fn(|c| each[c].0[k])).collect();
    // What is left out on purpose is known; only what the highest degrees leave also stands for aliases.
    let errors = std::array::from_fn(|c| each[c].1[degree] + (ALIASING - 1.0) * each[c].1[degree_max]);
    (polynomials, errors)
}

/// Upper bounds over the smooth planes of one cell, all times (1/χ)^(derivatives of α).
#[derive(Clone, Copy, Default)]
pub(super) struct CellBounds {
    /// Σ|H|, Σ|H|√(w_a w_b), Σ|H|·w_a w_b Δ², Σ|T|, Σ|∂T|.
    pub tide: f64,
    pub tide_root: f64,
    pub tide_spread: f64,
    pub flexion: f64,
    pub fourth: f64,
}

/// Skeleton rays and tides.
pub(super) struct Skeleton {
    /// Nodes a side; all polynomials are of lower degree.
    pub nodes: usize,
    pub chi_start: f64,
    /// Borders of the cells, Mpc; the tides of the smooth haloes act there.
    pub borders_cmpc: Vec<f64>,
    pub rough: Vec<Rough>,
    /// x and y (Mpc·arcsec) at the end: n² coefficients each, and their error.
    pub end: [Vec<f64>; 2],
    pub end_error: f64,
    /// At each border H (xx, xy, yy) and T (xxx, xxy, xyy, yyy), and their errors.
    pub tides: Vec<(Polynomials<3>, Polynomials<4>)>,
    pub tide_errors: Vec<[f64; 2]>,
    pub cells: Vec<CellBounds>,
    /// Largest deviation (arcsec) for which the bounds hold.
    pub room_arcsec: f64,
}

/// A typical deviation in field radii, to weigh T against H when degrees are chosen.
const DEVIATION: f64 = 0.01;

/// What polynomials of lower degree may leave out.
#[derive(Clone, Copy)]
pub(super) struct Tolerances {
    /// Of a path, arcsec.
    pub path_arcsec: f64,
    /// Of the tides of the whole way, dimensionless.
    pub tide: f64,
}

/// What a tile of nodes brings home.
struct NodeTile {
    rough_theta: Vec<[Lanes; 2]>,
    tides: Vec<[Lanes; TIDES]>,
    end: [Lanes; 2],
}

/// The smooth planes between two distances, with what says which are rough.
pub(super) struct Stretch<'a> {
    pub planes: &'a [Plane],
    pub is_rough: &'a [bool],
    pub central: &'a [[f64; 2]],
    pub reaches: &'a [Reach],
    pub chi_start: f64,
    pub chi_end: f64,
    pub x_start: [f64; 2],
    pub s_start: [f64; 2],
}

impl Stretch<'_> {
    /// Start, end, every rough plane, and points between them where they lie far apart.
    fn borders_cmpc(&self, rough_planes: &[usize]) -> Vec<f64> {
        let step = (self.chi_end - self.chi_start) / CELLS as f64;
        let mut borders: Vec<f64> = (0..CELLS).map(|g| self.chi_start + g as f64 * step).collect();
        borders.push(self.chi_end);
        borders.extend(rough_planes.iter().map(|&i| self.planes[i].chi_cmpc));
        borders.sort_by(f64::total_cmp);
        borders.dedup();
        borders
    }

    /// Traces n×n nodes through the smooth planes and fits; none when the bundle grows wider than the bounds allow.
    pub fn skeleton(&self, field: &Field, n: usize, tolerances: Tolerances) -> Option<Skeleton> {
        let fit = Fit::new(n);
        let nodes = fit.nodes_arcsec(field);
        let lane = |node: usize| (node / TILE, node % TILE);
        let (degree, radius) = (n - 1, field.radius_arcsec());
        let rough_planes: Vec<usize> = (0..self.planes.len()).filter(|&i| self.is_rough[i]).collect();
        let borders = self.borders_cmpc(&rough_planes);
        let kicks: Vec<PolynomialKick> = rough_planes
            .par_iter()
            .map(|&i| PolynomialKick::of(&self.planes[i], self.central[i], field.half_arcsec))
            .collect();
        let tiles: Vec<NodeTile> =
            nodes.par_chunks(TILE).map(|nodes| trace_nodes(self, &borders, &kicks, nodes)).collect();
        for (k, &i) in rough_planes.iter().enumerate() {
            for node in 0..nodes.len() {
                let (tile, lane) = lane(node);
                let offset = [0, 1].map(|c| tiles[tile].rough_theta[k][c][lane] - self.central[i][c]);
                if offset[0].hypot(offset[1]) > 0.5 * (1.0 + WIDENING) * radius {
                    return None;
                }
            }
        }
        let value = |node: usize| (&tiles[node / TILE], node % TILE);
        let rough: Vec<Rough> = rough_planes.par_iter().zip(kicks).enumerate().map(|(k, (&i, kick))| {
            let theta = |c: usize, node: usize| {
                let (tile, lane) = value(node);
                tile.rough_theta[k][c][lane]
            };
            let (path, errors) = fit_many::<2>(&fit, theta, degree, tolerances.path_arcsec);
            let cell = borders.partition_point(|b| *b < self.planes[i].chi_cmpc);
            Rough { plane: self.planes[i], kick, path, cell, error_arcsec: errors[0].hypot(errors[1]) }
        }).collect();
        let ends = [0, 1].map(|c| {
            fit.all(|node| {
                let (tile, lane) = value(node);
                tile.end[c][lane]
            })
        });
        let end_error = ends[0].1.hypot(ends[1].1);
        let degrees = TIDE_DEGREES.map(|d| d.min(degree));
        let fitted_tides: Vec<_> = borders
            .par_iter()
            .enumerate()
            .map(|(g, chi)| {
                let tide = |c: usize, node: usize| {
                    let (tile, lane) = value(node);
                    tile.tides[g][c][lane]
                };
                // A deviation of y changes the end by y·H·χ_end.
                let tolerance = tolerances.tide / (chi.max(self.chi_end / CELLS as f64) * borders.len() as f64);
                let (h, eh) = fit_many::<3>(&fit, tide, degrees[0], tolerance);
                let reach = DEVIATION * radius * chi.max(self.chi_end / CELLS as f64);
                let (t, et) = fit_many::<4>(&fit, |c, node| tide(c + 3, node), degrees[1], tolerance / reach);
                ((h, t), [eh[1] + eh[0].max(eh[2]), et.iter().sum()])
            })
            .collect();
        let (tides, tide_errors) = fitted_tides.into_iter().unzip();
        Some(Skeleton {
            nodes: n,
            chi_start: self.chi_start,
            rough,
            end: ends.map(|(coefficients, _)| coefficients),
            end_error,
            tides,
            tide_errors,
            cells: self.bounds(&borders, WIDENING * radius),
            borders_cmpc: borders,
            room_arcsec: 0.5 * (WIDENING - 1.0) * radius,
        })
    }

    /// Sums of bounds per cell: for a halo of deflection k·m·t whose nearest ray passes at t,
    /// |H| ≤ k m, |T| ≤ 3 k m/t, |∂T| ≤ 15 k m/t² (five times as much when truncated).
    fn bounds(&self, borders: &[f64], radius_arcsec: f64) -> Vec<CellBounds> {
        let mut cells = vec![CellBounds::default(); borders.len() - 1];
        let mut g = 0;
        for (i, plane) in self.planes.iter().enumerate() {
            g = cell_after(borders, g, plane.chi_cmpc);
            let cell = &mut cells[g];
            let mut tide = plane.f_sheet.abs();
            if !self.is_rough[i] {
                let t = self.reaches[i].distance_arcsec - radius_arcsec;
                let km = plane.fk.abs() * plane.radial(plane.u(t, 0.0))[0];
                let steep = if plane.tau.is_finite() { 5.0 } else { 1.0 };
                let inv_chi = plane.inv_chi;
                tide += km;
                cell.flexion += 3.0 * steep * km / t * inv_chi * inv_chi;
                cell.fourth += 15.0 * steep * km / (t * t) * inv_chi * inv_chi * inv_chi;
            }
            cell.tide += tide * plane.inv_chi;
            let spread = (plane.chi_cmpc - borders[g]) * (borders[g + 1] - plane.chi_cmpc);
            cell.tide_spread += tide * plane.inv_chi * spread;
            cell.tide_root += tide * plane.inv_chi * spread.sqrt() / (borders[g + 1] - borders[g]);
        }
        cells
    }
}

/// The cell at or after `g` in which `chi` lies.
fn cell_after(borders: &[f64], mut g: usize, chi: f64) -> usize {
    while g + 2 < borders.len() && borders[g + 1] <= chi {
        g += 1;
    }
    g
}

/// A tile of nodes through the smooth planes: positions at the rough ones, tides at the stations.
#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn trace_nodes(stretch: &Stretch, borders: &[f64], kicks: &[PolynomialKick], theta: &[[f64; 2]]) -> NodeTile {
    let mut tile = Tile::start(stretch.chi_start, stretch.x_start, stretch.s_start, theta);
    let mut home = NodeTile {
        rough_theta: Vec::new(),
        tides: vec![[[0.0; TILE]; TIDES]; borders.len()],
        end: [[0.0; TILE]; 2],
    };
    let mut g = 0;
    for (plane, rough) in stretch.planes.iter().zip(stretch.is_rough) {
        tile.advance::<0>(plane.chi_cmpc);
        g = cell_after(borders, g, plane.chi_cmpc);
        let far = (plane.chi_cmpc - borders[g]) / (borders[g + 1] - borders[g]);
        let weights = [1.0 - far, far];
        let sheet = plane.f_sheet * plane.inv_chi;
        if *rough {
            home.rough_theta.push(tile.x.map(|lanes| lanes.map(|x| x * plane.inv_chi)));
            for (tides, w) in home.tides[g..].iter_mut().zip(weights) {
                for i in 0..TILE {
                    tides[0][i] -= w * sheet;
                    tides[2][i] -= w * sheet;
                }
            }
            let [theta_x, theta_y] = &home.rough_theta[home.rough_theta.len() - 1];
            let kick = kicks[home.rough_theta.len() - 1].at(theta_x, theta_y);
            for i in 0..TILE {
                tile.s[0][i] += sheet * tile.x[0][i] - kick[0][i];
                tile.s[1][i] += sheet * tile.x[1][i] - kick[1][i];
            }
            continue;
        }
        let (mut tx, mut ty, mut u) = ([0.0; TILE], [0.0; TILE], [0.0; TILE]);
        for i in 0..TILE {
            tx[i] = tile.x[0][i] * plane.inv_chi - plane.centre_arcsec[0];
            ty[i] = tile.x[1][i] * plane.inv_chi - plane.centre_arcsec[1];
            u[i] = plane.u(tx[i], ty[i]);
        }
        let (mut m, mut p1, mut p2) = ([0.0; TILE], [0.0; TILE], [0.0; TILE]);
        radial_functions::<2>(plane, &u, &mut m, &mut p1, &mut p2);
        let [near, far] = &mut home.tides[g..g + 2] else { continue };
        for i in 0..TILE {
            let inv_r2 = plane.inv_r_s2 / u[i];
            let inv_r = inv_r2.sqrt();
            let n = [tx[i] * inv_r, ty[i] * inv_r];
            let radial = RadialDerivatives { k: plane.fk * plane.inv_chi, m: m[i], p1: p1[i], p2: p2[i] };
            let h = radial.hessian(n);
            let t = radial.third_derivatives(n, inv_r * plane.inv_chi);
            let all = [h[0] - sheet, h[1], h[2] - sheet, t[0], t[1], t[2], t[3]];
            for c in 0..TIDES {
                near[c][i] += weights[0] * all[c];
                far[c][i] += weights[1] * all[c];
            }
            let km = plane.fk * m[i];
            tile.s[0][i] -= km * tx[i] - sheet * tile.x[0][i];
            tile.s[1][i] -= km * ty[i] - sheet * tile.x[1][i];
        }
    }
    tile.advance::<0>(stretch.chi_end);
    home.end = tile.x;
    home
}
