//! The smooth haloes on one side of the main lens: their linear parts, and what is gathered of the rest.

use rayon::prelude::*;

use super::stops::What;
use crate::mapping::multiplane::adaptive::chebyshev::{SIDE, Series, nodes};
use crate::mapping::multiplane::adaptive::field::Field;
use crate::mapping::multiplane::adaptive::sample::{EDGE_NODES, FINE_NODES, Spot};
use crate::mapping::multiplane::axis::State;
use crate::mapping::multiplane::kick::{Distortion, Kick};
use crate::mapping::multiplane::plane::Plane;
use crate::numerics::dispatch::kernel;

/// Distances between which a cubic is drawn.
const STENCIL: usize = 4;
/// Parts of the accuracy by which interpolation may miss the kick of a single smooth halo, and of a gathered plane.
const HALO_SHARE: f64 = 1e-3;
const PLANE_SHARE: f64 = 1e-3;
/// Node in the middle of the square.
const MIDDLE: usize = FINE_NODES / 2;
/// Numbers at the nodes, whole cache lines of them; lanes beyond repeat the last.
const LANES_OF_NODES: usize = FINE_NODES.next_multiple_of(8);
type OfNodes = [[f64; LANES_OF_NODES]; 2];

/// What may be gathered.
pub(super) struct Bounds {
    pub accuracy_arcsec: f64,
    /// The largest kick beyond its linear part.
    pub largest_arcsec: f64,
}

/// How wide the rays spread between two distances, if nothing turns them between.
pub(super) struct Bundle {
    pub chi_cmpc: [f64; 2],
    pub half_arcsec: [f64; 2],
}

impl Bundle {
    fn square(&self, chi_cmpc: f64) -> Field {
        let [near, far] = self.chi_cmpc.map(|chi| 1.0 / chi);
        let share = if near > far { (1.0 / chi_cmpc - far) / (near - far) } else { 1.0 };
        let half = share * self.half_arcsec[0] + (1.0 - share) * self.half_arcsec[1];
        Field { centre_arcsec: [0.0; 2], half_arcsec: [half; 2] }
    }
}

/// What one side of the main lens comes to.
pub(super) struct Side {
    /// Distances of stops, in order.
    pub stops: Vec<(f64, What)>,
    /// Of each plane f·H of a smooth halo, which is carried along; nothing of a rough one.
    pub linear: Vec<Option<[f64; 3]>>,
}

/// The stops of one side of the main lens, whose planes the ray through the middle of the field meets as in `met`.
pub(super) fn gather(planes: &[Plane], met: &[State], bundle: &Bundle, step: f64, bounds: &Bounds) -> Side {
    let (Some(first), Some(last)) = (planes.first(), planes.last()) else {
        return Side { stops: Vec::new(), linear: Vec::new() };
    };
    let (first, length) = (first.chi_cmpc, last.chi_cmpc - first.chi_cmpc);
    let steps = ((length / step).ceil() as usize).max(STENCIL - 1);
    let distance = |node: usize| first + length * node as f64 / steps as f64;
    let stencil = |k: usize| k.saturating_sub(1).min(steps + 1 - STENCIL);
    let ends: Vec<usize> = (0..=steps)
        .map(|k| match k {
            0 => 0,
            _ if k == steps => planes.len(),
            _ => planes.partition_point(|plane| plane.chi_cmpc < distance(k)),
        })
        .collect();
    let unit = Field { centre_arcsec: [0.0; 2], half_arcsec: [1.0; 2] };
    let nodes = nodes(&unit);
    let places: OfNodes = [0, 1].map(|c| std::array::from_fn(|i| nodes[i.min(FINE_NODES - 1)][c]));
    let parts: Vec<Gathering> = (0..steps)
        .into_par_iter()
        .map(|k| {
            let own = ends[k]..ends[k + 1];
            let mut part = Gathering::empty(std::array::from_fn(|n| distance(stencil(k) + n)));
            add(&mut part, &planes[own.clone()], &met[own], (bundle, &places), bounds);
            part
        })
        .collect();
    let mut sums = vec![[[0.0; 2]; FINE_NODES]; steps + 1];
    for (k, part) in parts.iter().enumerate() {
        for (n, own) in part.kicks.iter().enumerate() {
            for (i, sum) in sums[stencil(k) + n].iter_mut().enumerate() {
                (0..2).for_each(|c| sum[c] += own[c][i]);
            }
        }
    }
    let linear: Vec<Option<[f64; 3]>> = parts.into_iter().flat_map(|part| part.linear).collect();
    let rough = planes.iter().zip(met).zip(&linear).filter(|(_, linear)| linear.is_none());
    let rough = rough.map(|((plane, met), _)| {
        let plane = plane.seen_from(met.direction_arcsec());
        (plane.chi_cmpc, What::Halo(plane, plane.kick_at([0.0; 2])))
    });
    let gathered = sums.iter().enumerate().map(|(node, kicks)| {
        let series = Series::fine(kicks, [1.0; 2], PLANE_SHARE * bounds.accuracy_arcsec);
        (distance(node), What::Gathered(series, bundle.square(distance(node))))
    });
    let mut stops: Vec<(f64, What)> = rough.chain(gathered).collect();
    stops.sort_by(|a, b| a.0.total_cmp(&b.0));
    Side { stops, linear }
}

/// What the haloes between two neighbouring distances leave at the four about them.
struct Gathering {
    distances: [f64; STENCIL],
    /// Kicks at the nodes of the square, less their linear part.
    kicks: Vec<OfNodes>,
    /// Of each halo its linear part, where it is smooth.
    linear: Vec<Option<[f64; 3]>>,
}

impl Gathering {
    fn empty(distances: [f64; STENCIL]) -> Self {
        Self { distances, kicks: vec![[[0.0; LANES_OF_NODES]; 2]; STENCIL], linear: Vec::new() }
    }

    /// Weights of the cubic through the four distances at another one.
    #[inline(always)]
    fn weights(&self, chi: f64) -> [f64; STENCIL] {
        std::array::from_fn(|n| {
            let others = (0..STENCIL).filter(|m| *m != n).map(|m| self.distances[m]);
            others.map(|other| (chi - other) / (self.distances[n] - other)).product()
        })
    }
}

kernel! {
    /// Adds planes, which the ray through the middle meets as in `met`, to what is gathered.
    fn add(
        part: &mut Gathering,
        planes: &[Plane],
        met: &[State],
        (bundle, places): (&Bundle, &OfNodes),
        bounds: &Bounds,
    ) {
        let mut distortion = Distortion::none();
        let (mut offsets, mut theta, mut kicks) = (*places, *places, *places);
        for (plane, reference) in planes.iter().zip(met) {
            let mean_arcsec = reference.x.map(|x| x * plane.inv_chi);
            let [half, _] = bundle.square(plane.chi_cmpc).half_arcsec;
            for c in 0..2 {
                for i in 0..LANES_OF_NODES {
                    offsets[c][i] = half * places[c][i];
                    theta[c][i] = mean_arcsec[c] + offsets[c][i];
                }
            }
            plane.kick::<0, LANES_OF_NODES>(&theta, 1.0, &mut distortion, |i: usize, kick: Kick| {
                kicks[0][i] = kick.f_alpha_arcsec[0];
                kicks[1][i] = kick.f_alpha_arcsec[1];
            });
            // hypot would take longer than all the rest.
            let largest = |[x, y]: &OfNodes, per: f64| {
                let square = |i: &usize| (x[*i] + per * theta[0][*i]).powi(2) + (y[*i] + per * theta[1][*i]).powi(2);
                EDGE_NODES.iter().map(square).fold(0.0, f64::max).sqrt()
            };
            let spot = Spot { mean_arcsec, radius_arcsec: half * std::f64::consts::SQRT_2 };
            let alpha = largest(&kicks, plane.f_sheet);
            if spot.is_rough(plane, alpha, HALO_SHARE * bounds.accuracy_arcsec) {
                part.linear.push(None);
                continue;
            }
            let h = plane.hessian(mean_arcsec);
            let [x, y] = &offsets;
            for c in 0..2 {
                let middle = kicks[c][MIDDLE];
                for i in 0..LANES_OF_NODES {
                    kicks[c][i] -= middle + (h[c] * x[i] + h[c + 1] * y[i]);
                }
            }
            if largest(&kicks, 0.0) > bounds.largest_arcsec {
                part.linear.push(None);
                continue;
            }
            part.linear.push(Some(h));
            let weights = part.weights(plane.chi_cmpc);
            for (sums, weight) in part.kicks.iter_mut().zip(weights) {
                for c in 0..2 {
                    for i in 0..LANES_OF_NODES {
                        sums[c][i] += weight * kicks[c][i];
                    }
                }
            }
        }
    }
}

const _: () = assert!(SIDE % 2 == 1, "a node lies in the middle of the square");
