//! The tree of tiles: a bundle is quartered while that pays, then its rays are traced through what is left.

use super::bundle::{Budget, Bundle};
use super::correction::{Correction, NODES};
use super::event::{Kick, Rows, Way};
use super::field::Field;
use super::rays::{LANES, Rays};
use crate::mapping::multiplane::segment::Segment;
use crate::mapping::{Mapping, Order, RayBundle};

use rayon::prelude::*;

/// Part of the accuracy that truncating may use at one level of the tree (most haloes use far less than their share).
const TRUNCATION_SHARE: f64 = 0.15;
/// The same for merging, where that is corrected and where it is not.
const MERGING_SHARES: [f64; 2] = [50.0, 0.15];
/// Errors count at least as this part of the accuracy: the Lipschitz constant of a cusp grows with their logarithm.
const FLOOR_SHARE: f64 = 1e-3;
/// Costs in nanoseconds: a ray past a halo, past a term of a polynomial, past the main lens; an event in a descent.
const COST_HALO: f64 = 5.0;
const COST_TERM: f64 = 0.25;
const COST_LENS: f64 = 150.0;
const COST_DESCENT: f64 = 180.0;
/// What is left of a ray's cost after a quartering.
const QUARTERED: f64 = 0.5;

/// Bundles narrower than this many rays are traced exactly when their bound is too large.
const FEW: usize = 8;
/// Levels below the root.
const DEEPEST: usize = 24;

/// The tree over one field.
pub(super) struct Root<'a> {
    way: Way<'a>,
    accuracy_arcsec: f64,
    tile: Tile,
}

/// A tile of the field: its bundle, what is added to its β, and the bound of all errors.
struct Tile {
    field: Field,
    bundle: Bundle,
    correction: Option<Correction>,
    bound_arcsec: f64,
}

/// Rays traced: indices and results, in the order of the tiles.
#[derive(Default)]
pub(super) struct Traced {
    pub rays: Vec<u32>,
    pub bundle: RayBundle,
    /// Rays whose bound exceeds the accuracy.
    pub refused: Vec<u32>,
    pub bound_arcsec: f64,
    /// Haloes met one by one, summed over the rays.
    pub met: usize,
}

impl<'a> Root<'a> {
    /// Goes once through all planes, and traces a few rays exactly to correct what merging did.
    pub fn new(exact: &Segment, way: Way<'a>, field: Field, accuracy_arcsec: f64) -> Self {
        let unit: Rows = [[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0]];
        let (theta, planes) = (field.centre_arcsec, exact.planes);
        let corrected = way.lens.is_none();
        let descend = || {
            let split =
                way.lens.map_or(planes.len(), |(chi, ..)| planes.partition_point(|p| p.chi_cmpc < chi));
            let (nearer, farther) = planes.split_at(split);
            let nearer = nearer.iter().map(|plane| way.plane(plane, theta));
            let farther = farther.iter().map(|plane| way.plane(plane, theta));
            Bundle::descend(
                &way,
                nearer.chain(way.lens_event(theta)).chain(farther),
                planes.len(),
                way.straight_beta(theta),
                &unit,
                [0.0; 2],
                field.radius_arcsec(),
                budget(accuracy_arcsec, corrected),
            )
        };
        let nodes = Correction::nodes(&field);
        let targets = || -> Option<[[f64; 2]; NODES]> {
            let at = nodes.map(|n| [theta[0] + n[0], theta[1] + n[1]]);
            corrected.then(|| exact.map(&at, Order::Position).beta_arcsec.try_into().ok()).flatten()
        };
        let (bundle, targets) = rayon::join(descend, targets);
        let tile = Tile::new(&way, field, bundle, targets.as_ref(), 0.0);
        Self { way, accuracy_arcsec, tile }
    }

    /// Traces rays of the field.
    pub fn trace(&self, theta: &[[f64; 2]], order: Order) -> Traced {
        let all: Vec<u32> = (0..theta.len() as u32).collect();
        let (inside, outside): (Vec<u32>, Vec<u32>) =
            all.into_iter().partition(|&i| self.tile.field.contains(theta[i as usize]));
        let mut traced = if inside.is_empty() {
            Traced::default()
        } else {
            self.descend(&self.tile, inside, theta, order, 0)
        };
        traced.refused.extend(outside);
        traced
    }

    fn descend(&self, tile: &Tile, rays: Vec<u32>, theta: &[[f64; 2]], order: Order, depth: usize) -> Traced {
        let accurate = tile.bound() <= self.accuracy_arcsec;
        let degenerate = depth == DEEPEST || tile.field.radius_arcsec() == 0.0;
        if !accurate && (rays.len() <= FEW || degenerate) {
            return Traced { refused: rays, ..Traced::default() };
        }
        let a_ray = cost_of_a_ray(&tile.bundle) * (1 + 3 * order as usize) as f64;
        let blocks = rays.len().div_ceil(LANES) * LANES;
        let quartering = 4.0 * COST_DESCENT * tile.bundle.events.len() as f64 + 5.0 * LANES as f64 * a_ray;
        if accurate && (degenerate || blocks as f64 * a_ray * (1.0 - QUARTERED) <= quartering) {
            return self.leaf(tile, rays, theta, order);
        }
        let mut quarters: [Vec<u32>; 4] = Default::default();
        for ray in rays {
            quarters[tile.field.quarter_of(theta[ray as usize])].push(ray);
        }
        let ready = tile.correction.as_ref().map(|_| Rays::through(&tile.bundle, &self.way));
        let parts: Vec<Traced> = quarters
            .into_par_iter()
            .enumerate()
            .filter(|(_, rays)| !rays.is_empty())
            .map(|(k, rays)| {
                let quarter = self.quarter(tile, k, ready.as_ref());
                self.descend(&quarter, rays, theta, order, depth + 1)
            })
            .collect();
        parts.into_iter().fold(Traced::default(), Traced::and)
    }

    /// Quarter number `k` of a tile; `ready` are the tile's own rays.
    fn quarter(&self, tile: &Tile, k: usize, ready: Option<&Rays>) -> Tile {
        let field = tile.field.quarter(k);
        let offset = [0, 1].map(|c| field.centre_arcsec[c] - tile.field.centre_arcsec[c]);
        let bundle = Bundle::descend(
            &self.way,
            tile.bundle.events.iter(),
            tile.bundle.events.len(),
            tile.bundle.beta_ref,
            &tile.bundle.end_rows,
            offset,
            field.radius_arcsec(),
            budget(self.accuracy_arcsec, ready.is_some()),
        );
        let targets = ready.zip(tile.correction.as_ref()).map(|(ready, correction)| {
            let nodes = Correction::nodes(&field).map(|n| [n[0] + offset[0], n[1] + offset[1]]);
            let ends = ready.trace(&nodes, 0);
            std::array::from_fn(|i| {
                let more = correction.at(nodes[i]);
                [ends.beta[0][i] + more[0], ends.beta[1][i] + more[1]]
            })
        });
        Tile::new(&self.way, field, bundle, targets.as_ref(), tile.bound_arcsec)
    }

    fn leaf(&self, tile: &Tile, rays: Vec<u32>, theta: &[[f64; 2]], order: Order) -> Traced {
        let (bundle, field) = (&tile.bundle, &tile.field);
        let haloes = bundle.events.iter().filter(|event| matches!(event.kick, Kick::Halo(_))).count();
        let mut traced = Traced { bound_arcsec: tile.bound(), met: haloes * rays.len(), ..Traced::default() };
        let ready = Rays::through(bundle, &self.way);
        for block in rays.chunks(LANES) {
            let mut offsets = [[0.0; 2]; LANES];
            for (offset, &ray) in offsets.iter_mut().zip(block) {
                *offset = [0, 1].map(|c| theta[ray as usize][c] - field.centre_arcsec[c]);
            }
            let ends = ready.trace(&offsets[..block.len()], order as usize);
            for (i, &ray) in block.iter().enumerate() {
                if ends.escaped[i] {
                    traced.refused.push(ray);
                    continue;
                }
                traced.rays.push(ray);
                let more = tile.correction.as_ref().map_or([0.0; 2], |more| more.at(offsets[i]));
                traced.bundle.beta_arcsec.push([ends.beta[0][i] + more[0], ends.beta[1][i] + more[1]]);
                if order == Order::Position {
                    continue;
                }
                let (a, b) =
                    tile.correction.as_ref().map_or_else(Default::default, |c| c.derivatives(offsets[i]));
                traced.bundle.jacobian.push(std::array::from_fn(|c| ends.jacobian[c][i] + a[c]));
                if order == Order::SecondDerivatives {
                    traced.bundle.second_per_arcsec.push(std::array::from_fn(|c| ends.second[c][i] + b[c]));
                }
            }
        }
        traced
    }
}

impl Traced {
    fn and(mut self, other: Self) -> Self {
        self.rays.extend(other.rays);
        self.bundle.beta_arcsec.extend(other.bundle.beta_arcsec);
        self.bundle.jacobian.extend(other.bundle.jacobian);
        self.bundle.second_per_arcsec.extend(other.bundle.second_per_arcsec);
        self.refused.extend(other.refused);
        self.bound_arcsec = self.bound_arcsec.max(other.bound_arcsec);
        self.met += other.met;
        self
    }
}

impl Tile {
    /// Corrects a bundle to be what `targets` are at the nodes; `inherited` is the bound of the wider tile's corrections.
    fn new(
        way: &Way,
        field: Field,
        bundle: Bundle,
        targets: Option<&[[f64; 2]; NODES]>,
        inherited_arcsec: f64,
    ) -> Self {
        let t0 = std::time::Instant::now();
        let correction = targets.map(|targets| {
            let ends = Rays::through(&bundle, way).trace(&Correction::nodes(&field), 0);
            let differences =
                std::array::from_fn(|i| [targets[i][0] - ends.beta[0][i], targets[i][1] - ends.beta[1][i]]);
            Correction::through(&field, &differences)
        });
        if std::env::var("FARDBG").is_ok() {
            eprintln!(
                "  own nodes {:?} correction error {:e} inherited {inherited_arcsec:e} trunc {:e}",
                t0.elapsed(),
                correction.as_ref().map_or(0.0, |c| c.error_arcsec),
                bundle.bound_arcsec
            );
        }
        let bound_arcsec = inherited_arcsec + correction.as_ref().map_or(0.0, |c| c.error_arcsec);
        Self { field, bundle, correction, bound_arcsec }
    }

    /// Bound of |β − β_exact|: by truncation, and by what corrections miss.
    fn bound(&self) -> f64 {
        self.bound_arcsec + self.bundle.bound_arcsec
    }
}

fn budget(accuracy_arcsec: f64, corrected: bool) -> Budget {
    let merging = MERGING_SHARES[usize::from(!corrected)];
    Budget {
        truncation_arcsec: TRUNCATION_SHARE * accuracy_arcsec,
        merging_arcsec: std::env::var("MS").map_or(merging, |s| s.parse().unwrap()) * accuracy_arcsec,
        floor_arcsec: FLOOR_SHARE * accuracy_arcsec,
        corrected,
    }
}

fn cost_of_a_ray(bundle: &Bundle) -> f64 {
    let cost = |kick: &Kick| match kick {
        Kick::Halo(_) => COST_HALO,
        Kick::Polynomial(p) if p.degree < 2 => 0.0,
        Kick::Polynomial(p) => 2.0 + COST_TERM * ((p.degree + 1) * (p.degree + 2)) as f64 * 0.5,
        Kick::Lens { .. } => COST_LENS,
    };
    bundle.events.iter().map(|event| cost(&event.kick)).sum()
}
