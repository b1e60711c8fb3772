//! A tile's surroundings when no wider tile holds it: all planes, traced exactly.

use super::chebyshev::corner;
use super::field::Field;
use super::outline::{Outline, outline_through};
use super::phase_space::Rows;
use super::sample::{Met, RAYS, ROW_NODES, Sample, SampledPlane, rays, row_nodes};
use crate::mapping::multiplane::plane::Plane;
use crate::mapping::multiplane::recursion::{BLOCK, RayBlock};
use crate::mapping::multiplane::segment::Segment;
use crate::mapping::multiplane::span::Span;

/// A square for which a greater part of all planes is rough is not worth a sample.
const ROUGH_SHARE: f64 = 0.3;

/// Where the exact recursion halts: after so many planes, for this one.
struct Halt {
    after: usize,
    plane: Plane,
}

/// Samples a square through all planes; nothing if too many are rough for that to help.
pub(super) fn sample(segment: &Segment, square: Field, tolerance_arcsec: f64) -> Option<Sample> {
    let (halts, images) = halts(segment, &square, tolerance_arcsec)?;
    let theta_arcsec = rays(&square, &images);
    // Rows take as long as one and a half blocks of positions. Two threads end together if the second block is left
    // at about two thirds of the way, for the one that is done with the rows.
    let (first, second) = theta_arcsec.split_at(BLOCK);
    let two_thirds = halts.partition_point(|halt| 3 * halt.after < 2 * segment.planes().len());
    let (rows, (first, second)) = rayon::join(
        || record_rows(segment, &halts, &row_nodes(&theta_arcsec)[1..]),
        || {
            let second = Positions::start(segment, second).record(segment, &halts[..two_thirds]);
            rayon::join(
                || Positions::start(segment, first).record(segment, &halts).end(segment),
                || second.record(segment, &halts[two_thirds..]).end(segment),
            )
        },
    );
    let length_cmpc = segment.span.length_cmpc();
    let end = |x: [f64; 2]| [0, 1].map(|c| (x[c] - segment.span.x_axis_end[c]) / length_cmpc);
    let beta_arcsec = first.1.into_iter().chain(second.1).map(end).collect();
    let met = Met::joined([first.0, second.0]);
    let rough = halts
        .into_iter()
        .zip(met)
        .zip(rows.0)
        .map(|((halt, met), rows)| SampledPlane { plane: halt.plane, met, rows })
        .collect();
    Some(Sample { square, theta_arcsec, rough, beta_arcsec, end_rows: rows.1 })
}

/// Rough planes in order, and the directions in which haloes inside the square are
/// seen, strongest first.
fn halts(segment: &Segment, square: &Field, tolerance: f64) -> Option<(Vec<Halt>, Vec<[f64; 2]>)> {
    let (mut outline, mut rough) = (Outline::start(&segment.span, square), Vec::new());
    outline_through(&mut outline, segment.planes(), tolerance, &mut rough);
    if rough.len() > (ROUGH_SHARE * segment.planes().len() as f64) as usize {
        return None;
    }
    let mut images: Vec<(f64, [f64; 2])> =
        rough.iter().map(|(_, strength, image)| (*strength, *image)).collect();
    images.retain(|(_, image)| square.contains(*image));
    let halts = rough.into_iter().map(|(after, ..)| Halt { after, plane: segment.planes()[after] }).collect();
    images.sort_by(|a, b| b.0.total_cmp(&a.0));
    Some((halts, images.into_iter().map(|(_, image)| image).collect()))
}

/// A block of rays on its way through all planes.
struct Positions {
    block: RayBlock,
    rays: usize,
    /// The number of the next plane.
    next: usize,
    /// Directions and kicks at every halt so far.
    met: Vec<Met>,
}

impl Positions {
    fn start(segment: &Segment, theta: &[[f64; 2]]) -> Self {
        let Span { chi_start_cmpc, x_start, s_start, .. } = segment.span;
        let block = RayBlock::start(chi_start_cmpc, x_start, s_start, theta);
        Self { block, rays: theta.len(), next: 0, met: Vec::new() }
    }

    /// On through the next halts.
    fn record(mut self, segment: &Segment, halts: &[Halt]) -> Self {
        let n = self.rays;
        for halt in halts {
            self.block.through::<0>(&segment.planes()[self.next..halt.after]);
            self.block.advance::<0>(halt.plane.chi_cmpc);
            let inv_chi = 1.0 / self.block.chi_cmpc;
            let mut met = Met::with_room(RAYS);
            met.theta_arcsec.extend((0..n).map(|i| [0, 1].map(|c| self.block.x[c][i] * inv_chi)));
            let before = self.block.s;
            self.next = halt.after + 1;
            self.block.through::<0>(&segment.planes()[halt.after..self.next]);
            met.kick_arcsec.extend((0..n).map(|i| [0, 1].map(|c| before[c][i] - self.block.s[c][i])));
            self.met.push(met);
        }
        self
    }

    /// What was met, and where the rays end.
    fn end(mut self, segment: &Segment) -> (Vec<Met>, Vec<[f64; 2]>) {
        self.block.through::<0>(&segment.planes()[self.next..]);
        self.block.advance::<0>(segment.span.chi_end_cmpc);
        (self.met, (0..self.rays).map(|i| self.block.position(i)).collect())
    }
}

/// Rows at every halt and at the end for rays that only smooth haloes bend relative to each other.
///
/// Lanes i and n + i hold ray i with derivatives by a and by b. The n rays, all coarse nodes but the first, fill a tile.
fn record_rows(
    segment: &Segment,
    halts: &[Halt],
    theta: &[[f64; 2]],
) -> (Vec<[Rows; ROW_NODES]>, [Rows; ROW_NODES]) {
    let n = theta.len();
    let twice: Vec<[f64; 2]> = theta.iter().chain(theta).copied().collect();
    let Span { chi_start_cmpc, chi_end_cmpc, x_start, s_start, .. } = segment.span;
    let mut block = RayBlock::start(chi_start_cmpc, x_start, s_start, &twice);
    for c in [0, 3] {
        block.by_theta.dx[c][n..2 * n].fill(segment.span.length_cmpc());
        block.by_theta.ds[c][n..2 * n].fill(0.0);
    }
    let rows = |block: &RayBlock, inv_chi: f64| -> [Rows; ROW_NODES] {
        let by = |c: usize, i: usize| inv_chi * block.by_theta.dx[c][i];
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
        block.through::<1>(&segment.planes()[next..halt.after]);
        block.advance::<1>(halt.plane.chi_cmpc);
        all.push(rows(&block, 1.0 / block.chi_cmpc));
        next = halt.after + 1;
        block.through::<0>(&segment.planes()[halt.after..next]);
    }
    block.through::<1>(&segment.planes()[next..]);
    block.advance::<1>(chi_end_cmpc);
    let end = rows(&block, 1.0 / segment.span.length_cmpc());
    (all, end)
}
