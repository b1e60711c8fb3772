//! The tree of tiles: a bundle is quartered while that pays, then its rays are traced through what is left.

use super::bundle::{Budget, Bundle};
use super::event::{IDENTITY, Kick, Rows, Way};
use super::field::Field;
use super::rays::{LANES, Rays};
use crate::mapping::multiplane::plane::Plane;
use crate::mapping::{Order, RayBundle};

use rayon::prelude::*;

/// Parts of the accuracy that one level of the tree may use: for truncating and for merging.
const TRUNCATION_SHARE: f64 = 0.15;
const MERGING_SHARE: f64 = 0.04;
/// Errors count at least as this part of the accuracy: the Lipschitz constant of a cusp grows with their logarithm.
const FLOOR_SHARE: f64 = 1e-3;
/// Errors may grow by more only where bundles are about to be quartered.
const GAIN_MAX: f64 = 30.0;

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

/// The root of the tree: the bundle that fills the field.
pub(super) struct Root<'a> {
    pub way: Way<'a>,
    pub field: Field,
    pub accuracy_arcsec: f64,
    bundle: Bundle,
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
    /// Goes once through all planes.
    pub fn new(way: Way<'a>, planes: &[Plane], field: Field, accuracy_arcsec: f64) -> Self {
        let unit: Rows = [
            [IDENTITY[0][0], 0.0, 1.0, 0.0],
            [0.0, 1.0, 0.0, 1.0],
        ];
        let theta = field.centre_arcsec;
        let descend = |gain: f64| {
            let lens = way.lens_event(theta);
            let split = way.lens.map_or(planes.len(), |(chi, ..)| planes.partition_point(|p| p.chi_cmpc < chi));
            let (nearer, farther) = planes.split_at(split);
            let nearer = nearer.iter().map(|plane| way.plane(plane, theta));
            let farther = farther.iter().map(|plane| way.plane(plane, theta));
            let events = nearer.chain(lens).chain(farther);
            let budget = budget(accuracy_arcsec, gain);
            let beta = way.straight_beta(theta);
            Bundle::descend(
                &way,
                events,
                planes.len(),
                beta,
                &unit,
                [0.0; 2],
                field.radius_arcsec(),
                budget,
            )
        };
        let mut bundle = descend(2.0);
        // Where errors grow much, little may be spent; an unbounded gain belongs to the centre of the main lens.
        if false {
            bundle = descend(bundle.gain);
        }
        Self { way, field, accuracy_arcsec, bundle }
    }

    /// Traces rays of the field.
    pub fn trace(&self, theta: &[[f64; 2]], order: Order) -> Traced {
        let all: Vec<u32> = (0..theta.len() as u32).collect();
        let (inside, outside): (Vec<u32>, Vec<u32>) =
            all.into_iter().partition(|&i| self.field.contains(theta[i as usize]));
        let mut traced = if inside.is_empty() {
            Traced::default()
        } else {
            self.tile(&self.bundle, &self.field, inside, theta, order, 0)
        };
        traced.refused.extend(outside);
        traced
    }

    fn tile(
        &self,
        bundle: &Bundle,
        field: &Field,
        rays: Vec<u32>,
        theta: &[[f64; 2]],
        order: Order,
        depth: usize,
    ) -> Traced {
        let accurate = bundle.bound_arcsec <= self.accuracy_arcsec;
        let degenerate = depth == DEEPEST || field.radius_arcsec() == 0.0;
        if !accurate && (rays.len() <= FEW || degenerate) {
            return Traced { refused: rays, ..Traced::default() };
        }
        let a_ray = cost_of_a_ray(bundle) * (1 + 3 * order as usize) as f64;
        let blocks = rays.len().div_ceil(LANES) * LANES;
        let direct = blocks as f64 * a_ray;
        if accurate && (degenerate || direct * (1.0 - QUARTERED) <= COST_DESCENT * 4.0 * bundle.events.len() as f64) {
            return self.leaf(bundle, field, rays, theta, order);
        }
        let mut quarters: [Vec<u32>; 4] = Default::default();
        for ray in rays {
            quarters[field.quarter_of(theta[ray as usize])].push(ray);
        }
        let gain = 2.0;
        let parts: Vec<Traced> = quarters
            .into_par_iter()
            .enumerate()
            .filter(|(_, rays)| !rays.is_empty())
            .map(|(k, rays)| {
                let quarter = field.quarter(k);
                let offset = [0, 1].map(|c| quarter.centre_arcsec[c] - field.centre_arcsec[c]);
                let narrower = Bundle::descend(
                    &self.way,
                    bundle.events.iter(),
                    bundle.events.len(),
                    bundle.beta_ref,
                    &bundle.end_rows,
                    offset,
                    quarter.radius_arcsec(),
                    budget(self.accuracy_arcsec, gain),
                );
                self.tile(&narrower, &quarter, rays, theta, order, depth + 1)
            })
            .collect();
        parts.into_iter().fold(Traced::default(), Traced::and)
    }

    fn leaf(
        &self,
        bundle: &Bundle,
        field: &Field,
        rays: Vec<u32>,
        theta: &[[f64; 2]],
        order: Order,
    ) -> Traced {
        let haloes = bundle.events.iter().filter(|event| matches!(event.kick, Kick::Halo(_))).count();
        let mut traced = Traced { bound_arcsec: bundle.bound_arcsec, met: haloes * rays.len(), ..Traced::default() };
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
                traced.bundle.beta_arcsec.push(ends.beta.map(|b| b[i]));
                if order >= Order::Jacobian {
                    traced.bundle.jacobian.push(ends.jacobian.map(|a| a[i]));
                }
                if order >= Order::SecondDerivatives {
                    traced.bundle.second_per_arcsec.push(ends.second.map(|b| b[i]));
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

fn budget(accuracy_arcsec: f64, gain: f64) -> Budget {
    Budget {
        truncation_arcsec: TRUNCATION_SHARE * accuracy_arcsec / gain,
        merging_arcsec: std::env::var("MS").map_or(0.04, |s| s.parse().unwrap()) * accuracy_arcsec / gain,
        floor_arcsec: FLOOR_SHARE * accuracy_arcsec,
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
