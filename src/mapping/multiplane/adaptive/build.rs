//! From a sample to a tile, and from a tile to the sample of a narrower one.

use rayon::prelude::*;

use super::chebyshev::{Basis, Jet, LANES, Lanes, Series, fine_number};
use super::field::Field;
use super::kicks::Kicks;
use super::phase_space::{Linear, Rows};
use super::sample::{EDGE_NODES, FINE_NODES, Met, ROW_NODES, Sample, SampledPlane, Spot, rays, row_nodes};
use super::tile::{Event, State, Tile};
use crate::mapping::Order;
use crate::mapping::multiplane::plane::Plane;
use crate::mapping::multiplane::span::Span;
use crate::numerics::dispatch::kernel;

/// Terms left out of a series may add up to these parts of the accuracy: in β; in paths, of which the Hessian of a
/// halo passes on little; in rows per arcsec, which multiply what smoothing leaves of kicks.
const END_SHARE: f64 = 1e-4;
const PATH_SHARE: f64 = 1e-3;
const ROWS_SHARE: f64 = 5.0;
/// By how much the largest error over a tile may exceed that of the rays compared.
const SAFETY: f64 = 4.0;

impl Tile {
    /// Makes a tile from a sample; `inherited_arcsec` bounds the error of the sample itself.
    pub fn new(sample: &Sample, span: Span, accuracy_arcsec: f64, inherited_arcsec: f64) -> Self {
        let mut tile = build(sample, span, accuracy_arcsec);
        let first = FINE_NODES;
        let ours = tile.trace(&sample.theta_arcsec[first..], Order::Position).beta_arcsec;
        let gaps = ours.iter().zip(&sample.beta_arcsec[first..]);
        let worst = gaps.map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
        // Not a number must not pass.
        let worst = worst.fold(0.0, |most, gap| if gap > most || gap.is_nan() { gap } else { most });
        tile.bound_arcsec = inherited_arcsec + SAFETY * worst;
        tile
    }

    /// Samples a square inside this tile.
    pub fn sample(&self, square: Field, tolerance_arcsec: f64) -> Sample {
        let mut strongest: Vec<&Event> = self.events.iter().collect();
        strongest.sort_by(|a, b| b.contrast_arcsec.total_cmp(&a.contrast_arcsec));
        let images: Vec<[f64; 2]> = strongest.into_iter().map(|event| event.image_arcsec).collect();
        let theta_arcsec = rays(&square, &images);
        let (beta_arcsec, met) = self.record(&theta_arcsec);
        let is_rough = |Event { plane, .. }: &Event, met: &Met| {
            let spot = Spot::of(EDGE_NODES.iter().map(|i| met.theta_arcsec[*i]));
            let halo = |i: &usize| {
                let (t, k) = (met.theta_arcsec[*i], met.kick_arcsec[*i]);
                (0..2).map(|c| (k[c] + plane.f_sheet * t[c]).powi(2)).sum::<f64>()
            };
            let alpha = EDGE_NODES.iter().map(halo).fold(0.0, f64::max).sqrt();
            spot.is_rough(plane, alpha, tolerance_arcsec)
        };
        let keep: Vec<bool> = self.events.iter().zip(&met).map(|(event, met)| is_rough(event, met)).collect();
        let (rows, end_rows) = narrower_rows(self, &row_nodes(&theta_arcsec), &met, &keep);
        let kept = self.events.iter().zip(met).zip(keep).filter(|(_, keep)| *keep);
        let rough =
            kept.zip(rows).map(|(((event, met), _), rows)| SampledPlane { plane: event.plane, met, rows });
        Sample { square, theta_arcsec, rough: rough.collect(), beta_arcsec, end_rows }
    }
}

/// Rows of the events kept and at the end at the coarse nodes, with the Hessians of those that are not.
fn narrower_rows(
    tile: &Tile,
    theta: &[[f64; 2]],
    met: &[Met],
    keep: &[bool],
) -> (Vec<[Rows; ROW_NODES]>, [Rows; ROW_NODES]) {
    let basis = Basis::at::<0>(&tile.square, theta);
    let mut jet = Jet::<8>::zero();
    let mut linear = [Linear::identity(); ROW_NODES];
    let mut all = Vec::new();
    for ((event, met), keep) in tile.events.iter().zip(met).zip(keep) {
        sum_rows(&event.rows, &basis, &mut jet);
        if *keep {
            all.push(std::array::from_fn(|i| linear[i].rows(&rows_of(&jet, i))));
        }
        let w = tile.span.weight(event.plane.chi_cmpc);
        for (i, linear) in linear.iter_mut().enumerate() {
            if !keep {
                linear.kick(&rows_of(&jet, i), w, event.plane.hessian(met.theta_arcsec[fine_number(i)]));
            }
        }
    }
    sum_rows(&tile.end_rows, &basis, &mut jet);
    (all, std::array::from_fn(|i| linear[i].rows(&rows_of(&jet, i))))
}

kernel! {
    fn sum_rows(rows: &Series<8>, basis: &Basis, jet: &mut Jet<8>) {
        rows.at::<0>(basis, jet);
    }
}

fn rows_of(jet: &Jet<8>, i: usize) -> Rows {
    unflattened(std::array::from_fn(|q| jet.value[q][i]))
}

/// Interpolates rows, and what rough kicks leave of the paths.
fn build(sample: &Sample, span: Span, accuracy: f64) -> Tile {
    /// Events that are worth a thread of their own.
    const MANY: usize = 64;
    let square = &sample.square;
    let all = sample.rough.par_iter().with_min_len(MANY);
    let rows: Vec<Series<8>> =
        all.clone().map(|rough| series(&rough.rows, span.weight(rough.plane.chi_cmpc), accuracy)).collect();
    let end_rows = series(&sample.end_rows, 1.0, accuracy);
    let blocks: Vec<usize> = (0..FINE_NODES).step_by(LANES).collect();
    let left: Vec<Vec<[Lanes; 2]>> =
        blocks.into_par_iter().map(|first| paths_left(sample, span, &rows, &end_rows, first)).collect();
    let path = |event: usize, scale: f64| {
        let values: [[f64; 2]; FINE_NODES] =
            std::array::from_fn(|i| [0, 1].map(|c| left[i / LANES][event][c][i % LANES]));
        Series::fine(&values, [1.0; 2], scale * accuracy)
    };
    let events = all
        .zip(rows)
        .enumerate()
        .map(|(number, (rough, rows))| Event {
            plane: rough.plane,
            path: path(number, PATH_SHARE),
            rows,
            image_arcsec: image(square, &rough.plane, &rough.met.theta_arcsec),
            contrast_arcsec: Spot::of(rough.met.kick_arcsec[..FINE_NODES].iter().copied()).radius_arcsec,
        })
        .collect();
    let end = path(sample.rough.len(), END_SHARE);
    Tile { square: sample.square, span, events, end, end_rows, bound_arcsec: 0.0 }
}

kernel! {
    /// S = θ − Qz at a block of fine nodes, from node `first` on: at every event, and at the end.
    fn paths_left(
        sample: &Sample,
        span: Span,
        rows: &[Series<8>],
        end_rows: &Series<8>,
        first: usize,
    ) -> Vec<[Lanes; 2]> {
        let nodes = first..FINE_NODES.min(first + LANES);
        let basis = Basis::at::<0>(&sample.square, &sample.theta_arcsec[nodes.clone()]);
        let (mut path, mut jet, mut kicks) = (Jet::<2>::zero(), Jet::<8>::zero(), Kicks::zero());
        // Of −z: kicks act on it with −w, and S is θ + Q(−z).
        let mut state = State::unkicked();
        let mut all = Vec::with_capacity(rows.len() + 1);
        for (rough, rows) in sample.rough.iter().zip(rows) {
            rows.at::<0>(&basis, &mut jet);
            fill(&mut path.value, &rough.met.theta_arcsec[nodes.clone()]);
            fill(&mut kicks.kick, &rough.met.kick_arcsec[nodes.clone()]);
            state.locate::<0>(&mut path, &jet);
            all.push(path.value);
            state.kick::<0>(&path, &jet, &kicks, -span.weight(rough.plane.chi_cmpc));
        }
        end_rows.at::<0>(&basis, &mut jet);
        fill(&mut path.value, &sample.beta_arcsec[nodes]);
        state.locate::<0>(&mut path, &jet);
        all.push(path.value);
        all
    }
}

#[inline(always)]
fn fill(lanes: &mut [Lanes; 2], values: &[[f64; 2]]) {
    for (i, value) in values.iter().enumerate() {
        lanes[0][i] = value[0];
        lanes[1][i] = value[1];
    }
}

/// Interpolates rows.
fn series(rows: &[Rows; ROW_NODES], w: f64, accuracy: f64) -> Series<8> {
    let flat = rows.map(|[x, y]| std::array::from_fn(|q| if q < 4 { x[q] } else { y[q - 4] }));
    let scale = std::array::from_fn(|q| if q % 4 < 2 { 1.0 } else { w });
    Series::coarse(&flat, scale, ROWS_SHARE * accuracy)
}

fn unflattened(q: [f64; 8]) -> Rows {
    [[q[0], q[1], q[2], q[3]], [q[4], q[5], q[6], q[7]]]
}

/// The direction in which a halo's centre is seen, to first order from the corners of the square.
fn image(square: &Field, plane: &Plane, theta: &[[f64; 2]]) -> [f64; 2] {
    let side = super::chebyshev::SIDE;
    let corner = |x: usize, y: usize| theta[(1 - x) * (side - 1) + (1 - y) * side * (side - 1)];
    let [ll, hl, lh, hh] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
    let [[xx, xy], [yx, yy]] =
        [0, 1].map(|c| [0.25 * (hl[c] + hh[c] - ll[c] - lh[c]), 0.25 * (lh[c] + hh[c] - ll[c] - hl[c])]);
    let [u, v] = [0, 1].map(|c| plane.centre_arcsec[c] - 0.25 * (ll[c] + hl[c] + lh[c] + hh[c]));
    let determinant = xx * yy - xy * yx;
    let place = [(yy * u - xy * v) / determinant, (xx * v - yx * u) / determinant];
    [0, 1].map(|c| square.centre_arcsec[c] + square.half_arcsec[c] * place[c])
}
