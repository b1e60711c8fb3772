//! A tile's surroundings when no wider tile holds it: all planes, traced exactly.

use super::chebyshev::corner;
use super::edge::{EDGE, Edge, edge_through};
use super::field::Field;
use super::kick::Kick;
use super::survey::{RAYS, ROW_NODES, Rough, Survey, rays, row_nodes};
use super::tile::Met;
use super::way::{Rows, Way};
use crate::mapping::multiplane::plane::Plane;
use crate::mapping::multiplane::recursion::{TILE, Tile, trace_jacobians, trace_positions};
use crate::mapping::multiplane::segment::Segment;
use crate::profile::mass::MassProfile;

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
    // Rows take as long as one and a half blocks of positions. Two threads end together if the second block is left
    // at about two thirds of the way, for the one that is done with the rows.
    let (first, second) = theta_arcsec.split_at(TILE);
    let two_thirds = halts.partition_point(|halt| 3 * halt.after < 2 * segment.planes.len());
    let (rows, (first, second)) = rayon::join(
        || record_rows(segment, &way, &halts, &row_nodes(&theta_arcsec)[1..]),
        || {
            let second = Positions::start(&way, second).record(segment, &halts[..two_thirds]);
            rayon::join(
                || Positions::start(&way, first).record(segment, &halts).end(segment, &way),
                || second.record(segment, &halts[two_thirds..]).end(segment, &way),
            )
        },
    );
    let scale = 1.0 / way.length_cmpc();
    let end = |x: [f64; 2]| [0, 1].map(|c| (x[c] - way.x_axis_end[c]) * scale);
    let beta_arcsec = first.1.into_iter().chain(second.1).map(end).collect();
    let met = Met::joined([first.0, second.0]);
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
        let spot = edge.advance(lens.chi_cmpc, 1.0 / lens.chi_cmpc);
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

/// A block of rays on its way through all planes.
struct Positions {
    tile: Tile,
    rays: usize,
    /// The number of the next plane.
    next: usize,
    /// Directions and kicks at every halt so far.
    met: Vec<Met>,
}

impl Positions {
    fn start(way: &Way, theta: &[[f64; 2]]) -> Self {
        let tile = Tile::start(way.chi_start, way.x_start, way.s_start, theta);
        Self { tile, rays: theta.len(), next: 0, met: Vec::new() }
    }

    /// On through the next halts.
    fn record(mut self, segment: &Segment, halts: &[Halt]) -> Self {
        let n = self.rays;
        for halt in halts {
            trace_positions(&mut self.tile, &segment.planes[self.next..halt.after]);
            self.tile.advance::<0>(halt.kick.chi_cmpc());
            let inv_chi = 1.0 / self.tile.chi_cmpc;
            let mut met = Met::with_room(RAYS);
            met.theta_arcsec.extend((0..n).map(|i| [0, 1].map(|c| self.tile.x[c][i] * inv_chi)));
            let before = self.tile.s;
            self.next = pass(&mut self.tile, segment, halt, n);
            met.kick_arcsec.extend((0..n).map(|i| [0, 1].map(|c| before[c][i] - self.tile.s[c][i])));
            self.met.push(met);
        }
        self
    }

    /// What was met, and where the rays end.
    fn end(mut self, segment: &Segment, way: &Way) -> (Vec<Met>, Vec<[f64; 2]>) {
        trace_positions(&mut self.tile, &segment.planes[self.next..]);
        self.tile.advance::<0>(way.chi_end);
        (self.met, (0..self.rays).map(|i| [0, 1].map(|c| self.tile.x[c][i])).collect())
    }
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
