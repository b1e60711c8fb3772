//! The smooth haloes on one side of the main lens: their linear parts, and what is gathered of the rest.

use rayon::prelude::*;

use super::stops::What;
use crate::mapping::multiplane::adaptive::chebyshev::{
    Basis, Jet, LANES, ROW_SIDE, SIDE, Series, fine_number, nodes,
};
use crate::mapping::multiplane::adaptive::field::Field;
use crate::mapping::multiplane::adaptive::sample::{FINE_NODES, ROW_NODES, Spot};
use crate::mapping::multiplane::axis::State;
use crate::mapping::multiplane::kick::{Distortion, Kick};
use crate::mapping::multiplane::plane::Plane;
use crate::numerics::dispatch::kernel;

/// Distances between which a cubic is drawn.
const STENCIL: usize = 4;
/// Parts of the accuracy by which interpolation may miss the kick of a single smooth halo, and of a gathered plane.
const HALO_SHARE: f64 = 1e-3;
const PLANE_SHARE: f64 = 1e-3;
/// Numbers at the nodes of either grid, whole cache lines of them.
const FINE_LANES: usize = FINE_NODES.next_multiple_of(8);
const COARSE_LANES: usize = ROW_NODES.next_multiple_of(8);

/// x and y of the kick at each node.
type AtNodes<const N: usize> = [[f64; N]; 2];

/// Nodes of the square of half side 1, lanes beyond the last node repeat it; and those of them at corners and in the middles of sides.
struct Nodes<const N: usize> {
    places: [[f64; N]; 2],
    edge: [usize; 8],
}

impl<const N: usize> Nodes<N> {
    fn new(places: &[[f64; 2]]) -> Self {
        let last = places.len() - 1;
        let is_edge = |i: &usize| places[*i].iter().all(|x| x.abs() < 1e-9 || x.abs() > 1.0 - 1e-9);
        let mut edge = (0..=last).filter(is_edge).filter(|i| *i != last / 2);
        Self {
            places: [0, 1].map(|c| std::array::from_fn(|i| places[i.min(last)][c])),
            edge: std::array::from_fn(|_| edge.next().unwrap_or(last)),
        }
    }

    /// What a halo does at the nodes beyond its linear part; the largest of that, and the largest kick without its sheet.
    #[inline(always)]
    fn beyond_linear(&self, plane: &Plane, at: &Middle, kicks: &mut AtNodes<N>) -> [f64; 2] {
        let (mut offsets, mut theta) = ([[0.0; N]; 2], [[0.0; N]; 2]);
        for c in 0..2 {
            for i in 0..N {
                offsets[c][i] = at.half_arcsec * self.places[c][i];
                theta[c][i] = at.theta_arcsec[c] + offsets[c][i];
            }
        }
        plane.kick::<0, N>(&theta, 1.0, &mut Distortion::none(), |i: usize, kick: Kick| {
            kicks[0][i] = kick.f_alpha_arcsec[0];
            kicks[1][i] = kick.f_alpha_arcsec[1];
        });
        // hypot would take longer than all the rest.
        let largest = |[x, y]: &AtNodes<N>, per: f64| {
            let square =
                |i: &usize| (x[*i] + per * theta[0][*i]).powi(2) + (y[*i] + per * theta[1][*i]).powi(2);
            self.edge.iter().map(square).fold(0.0, f64::max).sqrt()
        };
        let alpha = largest(kicks, plane.f_sheet);
        let [x, y] = &offsets;
        for (c, kicks) in kicks.iter_mut().enumerate() {
            for i in 0..N {
                kicks[i] -= at.kick_arcsec[c] + (at.h[c] * x[i] + at.h[c + 1] * y[i]);
            }
        }
        [largest(kicks, 0.0), alpha]
    }
}

/// Where the ray through the middle of the field meets a halo, how wide the rays spread there, and what the halo does to that ray.
struct Middle {
    theta_arcsec: [f64; 2],
    half_arcsec: f64,
    kick_arcsec: [f64; 2],
    h: [f64; 3],
}

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
    let ends: Vec<usize> = (0..=steps)
        .map(|k| match k {
            0 => 0,
            _ if k == steps => planes.len(),
            _ => planes.partition_point(|plane| plane.chi_cmpc < distance(k)),
        })
        .collect();
    let unit = Field { centre_arcsec: [0.0; 2], half_arcsec: [1.0; 2] };
    let places = nodes(&unit);
    let coarse_places: [[f64; 2]; ROW_NODES] = std::array::from_fn(|k| places[fine_number(k)]);
    let (fine, coarse) = (Nodes::new(&places), Nodes::new(&coarse_places));
    let parts: Vec<Gathering> = (0..steps)
        .into_par_iter()
        .map(|k| {
            let own = ends[k]..ends[k + 1];
            let first = k.saturating_sub(1).min(steps + 1 - STENCIL);
            let mut part = Gathering::empty(first, |n| distance(first + n));
            add(&mut part, &planes[own.clone()], &met[own], (bundle, &fine, &coarse), bounds);
            part
        })
        .collect();
    let mut sums = vec![([[0.0; 2]; FINE_NODES], [[0.0; 2]; ROW_NODES]); steps + 1];
    for part in &parts {
        for ((fine, coarse), (own_fine, own_coarse)) in sums[part.first..].iter_mut().zip(&part.kicks) {
            fine.iter_mut().enumerate().for_each(|(i, sum)| (0..2).for_each(|c| sum[c] += own_fine[c][i]));
            coarse
                .iter_mut()
                .enumerate()
                .for_each(|(i, sum)| (0..2).for_each(|c| sum[c] += own_coarse[c][i]));
        }
    }
    let tolerance = PLANE_SHARE * bounds.accuracy_arcsec;
    for (fine, coarse) in &mut sums {
        let series = Series::coarse(coarse, [1.0; 2], tolerance);
        let mut jet = Jet::zero();
        for (places, fine) in places.chunks(LANES).zip(fine.chunks_mut(LANES)) {
            series.at::<0>(&Basis::at::<0>(&unit, places), &mut jet);
            fine.iter_mut().enumerate().for_each(|(i, sum)| (0..2).for_each(|c| sum[c] += jet.value[c][i]));
        }
    }
    let linear: Vec<Option<[f64; 3]>> = parts.into_iter().flat_map(|part| part.linear).collect();
    let rough = planes.iter().zip(met).zip(&linear).filter(|(_, linear)| linear.is_none());
    let rough = rough.map(|((plane, met), _)| {
        let plane = plane.seen_from(met.direction_arcsec());
        (plane.chi_cmpc, What::Halo(plane, plane.kick_at([0.0; 2])))
    });
    let gathered = sums.iter().enumerate().map(|(node, (kicks, _))| {
        let series = Series::fine(kicks, [1.0; 2], tolerance);
        (distance(node), What::Gathered(series, bundle.square(distance(node))))
    });
    let mut stops: Vec<(f64, What)> = rough.chain(gathered).collect();
    stops.sort_by(|a, b| a.0.total_cmp(&b.0));
    Side { stops, linear }
}

/// What the haloes between two neighbouring distances leave at the four about them.
struct Gathering {
    /// Which of all distances is the first of the four.
    first: usize,
    distances: [f64; STENCIL],
    /// Kicks at the nodes less their linear part, of haloes that need the finer grid and of those that do not.
    kicks: Vec<(AtNodes<FINE_LANES>, AtNodes<COARSE_LANES>)>,
    /// Of each halo its linear part, where it is smooth.
    linear: Vec<Option<[f64; 3]>>,
}

impl Gathering {
    fn empty(first: usize, distance: impl Fn(usize) -> f64) -> Self {
        let nothing = ([[0.0; FINE_LANES]; 2], [[0.0; COARSE_LANES]; 2]);
        Self {
            first,
            distances: std::array::from_fn(distance),
            kicks: vec![nothing; STENCIL],
            linear: Vec::new(),
        }
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

#[inline(always)]
fn accumulate<const N: usize>(sums: &mut AtNodes<N>, weight: f64, kicks: &AtNodes<N>) {
    for c in 0..2 {
        for i in 0..N {
            sums[c][i] += weight * kicks[c][i];
        }
    }
}

kernel! {
    /// Adds planes, which the ray through the middle meets as in `met`, to what is gathered.
    fn add(
        part: &mut Gathering,
        planes: &[Plane],
        met: &[State],
        (bundle, fine, coarse): (&Bundle, &Nodes<FINE_LANES>, &Nodes<COARSE_LANES>),
        bounds: &Bounds,
    ) {
        let tolerance = HALO_SHARE * bounds.accuracy_arcsec;
        let (mut fine_kicks, mut coarse_kicks) = ([[0.0; FINE_LANES]; 2], [[0.0; COARSE_LANES]; 2]);
        for (plane, reference) in planes.iter().zip(met) {
            let theta_arcsec = reference.x.map(|x| x * plane.inv_chi);
            let [half_arcsec, _] = bundle.square(plane.chi_cmpc).half_arcsec;
            let spot = Spot { mean_arcsec: theta_arcsec, radius_arcsec: half_arcsec * std::f64::consts::SQRT_2 };
            let (kick_arcsec, h) = plane.linear(theta_arcsec);
            let middle = Middle { theta_arcsec, half_arcsec, kick_arcsec, h };
            let is_far = spot.is_far(plane, plane.without_sheet(kick_arcsec, theta_arcsec), tolerance);
            let (most, is_rough) = if is_far {
                (coarse.beyond_linear(plane, &middle, &mut coarse_kicks)[0], false)
            } else {
                let [most, alpha] = fine.beyond_linear(plane, &middle, &mut fine_kicks);
                (most, spot.is_rough(plane, alpha, tolerance))
            };
            if is_rough || most > bounds.largest_arcsec {
                part.linear.push(None);
                continue;
            }
            part.linear.push(Some(h));
            let weights = part.weights(plane.chi_cmpc);
            for ((fine, coarse), weight) in part.kicks.iter_mut().zip(weights) {
                match is_far {
                    true => accumulate(coarse, weight, &coarse_kicks),
                    false => accumulate(fine, weight, &fine_kicks),
                }
            }
        }
    }
}

const _: () = assert!(SIDE % 2 == 1 && ROW_SIDE % 2 == 1, "nodes lie in the middles of sides");
