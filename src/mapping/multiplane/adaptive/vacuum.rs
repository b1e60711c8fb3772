//! A tile's surroundings when no wider tile holds it: all planes, traced exactly.

use multiversion::multiversion;

use super::chebyshev::corner;
use super::field::Field;
use super::kick::Kick;
use super::survey::{ROW_NODES, Rough, Spot, Survey, rays, row_nodes};
use super::tile::Met;
use super::way::{Rows, Way};
use crate::mapping::multiplane::plane::Plane;
use crate::mapping::multiplane::recursion::{TILE, Tile, radial_functions, trace_jacobians, trace_positions};
use crate::mapping::multiplane::segment::Segment;
use crate::profile::mass::MassProfile;

/// Rays on the edge of a square that show where its rays go.
const EDGE: usize = 8;
/// The main lens must be this many times farther from the middle of a square than its corners.
const CLEAR_OF_LENS: f64 = 1.5;
/// A square for which a greater part of all planes is rough is not worth a survey.
const ROUGH_SHARE: f64 = 0.3;

/// Where the exact recursion halts: after so many planes, for this kick.
struct Halt<'a> {
    after: usize,
    kick: Kick<'a>,
}

/// Surveys a square through all planes; nothing if too many are rough for that to help, or if it holds the main lens.
pub(super) fn survey<'a>(
    segment: &Segment<'a>,
    way: Way,
    square: Field,
    tolerance_arcsec: f64,
) -> Option<Survey<'a>> {
    let (halts, images) = halts(segment, &way, &square, tolerance_arcsec)?;
    let theta_arcsec = rays(&square, &images);
    let positions =
        |block: usize| record(segment, &way, &halts, &theta_arcsec[block * TILE..(block + 1) * TILE]);
    let (rows, (first, second)) = rayon::join(
        || record_rows(segment, &way, &halts, &row_nodes(&theta_arcsec)[1..]),
        || rayon::join(|| positions(0), || positions(1)),
    );
    let scale = 1.0 / way.length_cmpc();
    let end = |x: [f64; 2]| [0, 1].map(|c| (x[c] - way.x_axis_end[c]) * scale);
    let beta_arcsec = first.1.into_iter().chain(second.1).map(end).collect();
    let met = first.0.into_iter().zip(second.0).map(|(mut met, more)| {
        met.theta_arcsec.extend(more.theta_arcsec);
        met.kick_arcsec.extend(more.kick_arcsec);
        met
    });
    let rough = halts
        .iter()
        .zip(met)
        .zip(rows.0)
        .map(|((halt, met), rows)| Rough { kick: halt.kick, met, rows })
        .collect();
    Some(Survey { square, theta_arcsec, rough, beta_arcsec, end_rows: rows.1 })
}

/// Rough planes in order with the main lens among them, and the directions in which haloes inside the square are
/// seen, strongest first.
fn halts<'a>(
    segment: &Segment<'a>,
    way: &Way,
    square: &Field,
    tolerance: f64,
) -> Option<(Vec<Halt<'a>>, Vec<[f64; 2]>)> {
    let mut edge = Edge::start(way, square);
    let (mut halts, mut images) = (Vec::new(), Vec::new());
    let split = segment.lens.map_or(segment.planes.len(), |lens| lens.after);
    let (nearer, farther) = segment.planes.split_at(split);
    let limit = (ROUGH_SHARE * segment.planes.len() as f64) as usize;
    let mut through = |edge: &mut Edge, planes: &[Plane], first: usize, halts: &mut Vec<Halt<'a>>| {
        let mut rough = Vec::new();
        edge_through(edge, planes, tolerance, &mut rough);
        for (number, strength, image) in rough {
            halts.push(Halt { after: first + number, kick: Kick::Halo(planes[number]) });
            if square.contains(image) {
                images.push((strength, image));
            }
        }
        halts.len() <= limit
    };
    if !through(&mut edge, nearer, 0, &mut halts) {
        return None;
    }
    if let Some(lens) = segment.lens {
        let f = segment.chi_source_cmpc / (segment.chi_source_cmpc - lens.chi_cmpc);
        let kick = Kick::Lens(lens.chi_cmpc, f, lens.profile);
        let spot = edge.advance(lens.chi_cmpc);
        let [x, y] = lens.profile.centre_arcsec().unwrap_or(spot.mean_arcsec);
        let distance = (x - spot.mean_arcsec[0]).hypot(y - spot.mean_arcsec[1]);
        let is_clear = distance > CLEAR_OF_LENS * spot.radius_arcsec;
        if !is_clear {
            return None;
        }
        for i in 0..EDGE {
            let at = [0, 1].map(|c| edge.x[c][i] / lens.chi_cmpc);
            let alpha = lens.profile.deflection(at[0], at[1]);
            (0..2).for_each(|c| edge.s[c][i] -= f * alpha[c]);
        }
        halts.push(Halt { after: split, kick });
    }
    if !through(&mut edge, farther, split, &mut halts) {
        return None;
    }
    images.sort_by(|a, b| b.0.total_cmp(&a.0));
    Some((halts, images.into_iter().map(|(_, image)| image).collect()))
}

/// Rays on the edge of a square: corners and middles of the sides.
struct Edge {
    square: Field,
    x: [[f64; EDGE]; 2],
    s: [[f64; EDGE]; 2],
    chi_cmpc: f64,
}

impl Edge {
    /// Where the edge rays lie in the square, in units of half its side.
    const PLACES: [[f64; 2]; EDGE] = [
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [-1.0, 1.0],
        [-1.0, 0.0],
        [-1.0, -1.0],
        [0.0, -1.0],
        [1.0, -1.0],
    ];

    fn start(way: &Way, square: &Field) -> Self {
        let slope = |c: usize, place: &[f64; 2]| {
            way.s_start[c] + square.centre_arcsec[c] + square.half_arcsec[c] * place[c]
        };
        Self {
            square: *square,
            x: way.x_start.map(|x| [x; EDGE]),
            s: [0, 1].map(|c| std::array::from_fn(|i| slope(c, &Self::PLACES[i]))),
            chi_cmpc: way.chi_start,
        }
    }

    /// On to `chi_cmpc`: where the rays are seen there.
    #[inline(always)]
    fn advance(&mut self, chi_cmpc: f64) -> Spot {
        let step = chi_cmpc - self.chi_cmpc;
        self.chi_cmpc = chi_cmpc;
        for c in 0..2 {
            for i in 0..EDGE {
                self.x[c][i] += step * self.s[c][i];
            }
        }
        let inv = 1.0 / chi_cmpc;
        let mean = [0, 1].map(|c| self.x[c].iter().sum::<f64>() * inv / EDGE as f64);
        let mut radius = 0.0_f64;
        for i in 0..EDGE {
            let [x, y] = [0, 1].map(|c| self.x[c][i] * inv - mean[c]);
            radius = radius.max(x * x + y * y);
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

#[inline(always)]
fn edge_loop(edge: &mut Edge, planes: &[Plane], tolerance: f64, rough: &mut Vec<(usize, f64, [f64; 2])>) {
    for (number, plane) in planes.iter().enumerate() {
        let spot = edge.advance(plane.chi_cmpc);
        let (mut tx, mut ty, mut u) = ([0.0; EDGE], [0.0; EDGE], [0.0; EDGE]);
        for i in 0..EDGE {
            tx[i] = edge.x[0][i] * plane.inv_chi - plane.centre_arcsec[0];
            ty[i] = edge.x[1][i] * plane.inv_chi - plane.centre_arcsec[1];
            u[i] = plane.u(tx[i], ty[i]);
        }
        let (mut m, mut p1, mut p2) = ([0.0; EDGE], [0.0; EDGE], [0.0; EDGE]);
        radial_functions::<0, EDGE>(plane.tau, &u, &mut m, &mut p1, &mut p2);
        let sheet = plane.f_sheet * plane.inv_chi;
        let mut alpha = 0.0_f64;
        for i in 0..EDGE {
            let km = plane.fk * m[i];
            alpha = alpha.max(km * km * u[i]);
            edge.s[0][i] -= km * tx[i] - sheet * edge.x[0][i];
            edge.s[1][i] -= km * ty[i] - sheet * edge.x[1][i];
        }
        let alpha = (alpha / plane.inv_r_s2).sqrt();
        if spot.is_rough(plane, alpha, tolerance) {
            rough.push((number, alpha, edge.image(plane.centre_arcsec)));
        }
    }
}

#[allow(unsafe_code, reason = "the dispatcher that `multiversion` generates")]
#[multiversion(targets("x86_64+avx512f+avx512dq", "x86_64+avx2", "aarch64+neon"))]
fn edge_through(edge: &mut Edge, planes: &[Plane], tolerance: f64, rough: &mut Vec<(usize, f64, [f64; 2])>) {
    edge_loop(edge, planes, tolerance, rough);
}

/// Directions and kicks of a block of rays at every halt, and where the rays end.
fn record(segment: &Segment, way: &Way, halts: &[Halt], theta: &[[f64; 2]]) -> (Vec<Met>, Vec<[f64; 2]>) {
    let mut tile = Tile::start(way.chi_start, way.x_start, way.s_start, theta);
    let mut met = Vec::with_capacity(halts.len());
    let mut next = 0;
    let n = theta.len();
    for halt in halts {
        trace_positions(&mut tile, &segment.planes[next..halt.after]);
        tile.advance::<0>(halt.kick.chi_cmpc());
        let inv_chi = 1.0 / tile.chi_cmpc;
        let theta_arcsec = (0..n).map(|i| [0, 1].map(|c| tile.x[c][i] * inv_chi)).collect();
        let before = tile.s;
        next = pass(&mut tile, segment, halt, n);
        let kick_arcsec = (0..n).map(|i| [0, 1].map(|c| before[c][i] - tile.s[c][i])).collect();
        met.push(Met { theta_arcsec, kick_arcsec });
    }
    trace_positions(&mut tile, &segment.planes[next..]);
    tile.advance::<0>(way.chi_end);
    (met, (0..n).map(|i| [tile.x[0][i], tile.x[1][i]]).collect())
}

/// Kicks positions alone; returns the number of the next plane.
fn pass(tile: &mut Tile, segment: &Segment, halt: &Halt, used: usize) -> usize {
    match &halt.kick {
        Kick::Halo(plane) => {
            trace_positions(tile, std::slice::from_ref(plane));
            halt.after + 1
        }
        Kick::Lens(_, f, profile) => {
            tile.kick_lens::<0>(*profile, *f, used);
            debug_assert!(segment.lens.is_some());
            halt.after
        }
    }
}

/// Rows at every halt and at the end for rays that only smooth haloes bend relative to each other.
///
/// Lanes i and n + i hold ray i with derivatives by a and by b. The n rays, all coarse nodes but the first, fill a tile.
fn record_rows(
    segment: &Segment,
    way: &Way,
    halts: &[Halt],
    theta: &[[f64; 2]],
) -> (Vec<[Rows; ROW_NODES]>, [Rows; ROW_NODES]) {
    let n = theta.len();
    let twice: Vec<[f64; 2]> = theta.iter().chain(theta).copied().collect();
    let mut tile = Tile::start(way.chi_start, way.x_start, way.s_start, &twice);
    for c in [0, 3] {
        tile.dx[c][n..2 * n].fill(way.length_cmpc());
        tile.ds[c][n..2 * n].fill(0.0);
    }
    let rows = |tile: &Tile, inv_chi: f64| -> [Rows; ROW_NODES] {
        let by = |c: usize, i: usize| inv_chi * tile.dx[c][i];
        let mut rows = [[[0.0; 4]; 2]; ROW_NODES];
        for i in 0..n {
            rows[i + 1] = [0, 2].map(|c| [by(c, i), by(c + 1, i), by(c, n + i), by(c + 1, n + i)]);
        }
        rows[0] = [0, 1].map(|c| std::array::from_fn(|m| corner(|k| rows[k][c][m])));
        rows
    };
    let mut all = Vec::with_capacity(halts.len());
    let mut next = 0;
    for halt in halts {
        trace_jacobians(&mut tile, &segment.planes[next..halt.after]);
        tile.advance::<1>(halt.kick.chi_cmpc());
        all.push(rows(&tile, 1.0 / tile.chi_cmpc));
        next = pass(&mut tile, segment, halt, 2 * n);
    }
    trace_jacobians(&mut tile, &segment.planes[next..]);
    tile.advance::<1>(way.chi_end);
    let end = rows(&tile, 1.0 / way.length_cmpc());
    (all, end)
}
