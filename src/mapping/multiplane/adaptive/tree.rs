//! The tree of tiles: the field is quartered while sampling a quarter costs less than tracing its rays.

use rayon::prelude::*;

use super::all_planes;
use super::field::Field;
use super::tile::Tile;
use crate::error::Result;
use crate::mapping::multiplane::segment::Segment;
use crate::mapping::{Order, RayBundle};
use crate::monitor::Monitor;

/// The fewest rays for which a square is sampled through all planes: the exact recursion of so many costs as much.
pub(super) const FEW_RAYS: usize = 600;

/// The fewest rays for which a quarter of a tile with so many events becomes a tile of its own.
///
/// It spares its rays about two thirds of the events; a sample is a hundred rays through the wider tile, and some time
/// however few the events. Numbers from 100 to 300 and from 2500 to 30,000 were not clearly faster.
fn few(events: usize) -> usize {
    140 + 4000 / events.max(1)
}

/// Levels below the root, for rays that coincide.
const DEEPEST: usize = 24;
/// Part of the accuracy by which interpolation may miss the kick of a single smooth halo.
const ROUGH_SHARE: f64 = 1e-3;

/// What all tiles of a field have in common.
pub(super) struct Tree {
    segment: Segment,
    accuracy_arcsec: f64,
    square: Field,
    /// The tile of the whole field, where one is accurate enough to trace the nodes of others.
    root: Option<Tile>,
}

/// Rays by their indices, and what became of them.
pub(super) struct Part {
    pub rays: Vec<u32>,
    pub bundle: RayBundle,
}

/// Rays traced, tile by tile.
#[derive(Default)]
pub(super) struct Traced {
    pub parts: Vec<Part>,
    /// Rays left for the exact recursion.
    pub refused: Vec<u32>,
    pub bound_arcsec: f64,
    /// Rough planes met, summed over the rays.
    pub met: usize,
}

impl Tree {
    /// Samples the whole field.
    pub fn new(segment: Segment, field: &Field, accuracy_arcsec: f64) -> Self {
        let mut tree = Self { segment, accuracy_arcsec, square: field.square(), root: None };
        tree.root = tree.tile(None, tree.square, 0);
        tree
    }

    /// A tile whose bound leaves room for those of `generation`s to come.
    fn tile(&self, source: Option<&Tile>, square: Field, generation: usize) -> Option<Tile> {
        let tolerance = ROUGH_SHARE * self.accuracy_arcsec;
        let sample = match source {
            None => all_planes::sample(&self.segment, square, tolerance)?,
            Some(tile) => tile.sample(square, tolerance),
        };
        let inherited = source.map_or(0.0, |tile| tile.bound_arcsec);
        let tile = Tile::new(&sample, self.segment.span, self.accuracy_arcsec, inherited);
        let allowed = self.accuracy_arcsec * (1.0 - 0.5_f64.powi(generation as i32 + 1));
        (tile.bound_arcsec <= allowed).then_some(tile)
    }

    /// Traces rays; refuses those outside the field and those that no accurate tile holds.
    ///
    /// `monitor` is told of those that are not refused.
    pub fn trace(&self, theta: &[[f64; 2]], order: Order, monitor: &dyn Monitor) -> Result<Traced> {
        let all: Vec<u32> = (0..theta.len() as u32).collect();
        let (inside, outside): (Vec<u32>, Vec<u32>) =
            all.into_iter().partition(|&i| self.square.contains(theta[i as usize]));
        let descent = Descent { tree: self, theta, order, monitor };
        let mut traced = descent.quarters(self.root.as_ref(), self.square, inside, 0, 1)?;
        traced.refused.extend(outside);
        Ok(traced)
    }
}

/// What all squares of one call have in common.
struct Descent<'a> {
    tree: &'a Tree,
    theta: &'a [[f64; 2]],
    order: Order,
    monitor: &'a dyn Monitor,
}

impl Descent<'_> {
    fn quarters(
        &self,
        source: Option<&Tile>,
        square: Field,
        rays: Vec<u32>,
        depth: usize,
        generation: usize,
    ) -> Result<Traced> {
        self.monitor.check()?;
        let mut quarters: [Vec<u32>; 4] = std::array::from_fn(|_| Vec::with_capacity(rays.len() / 3));
        for ray in rays {
            quarters[square.quarter_of(self.theta[ray as usize])].push(ray);
        }
        let parts: Result<Vec<Traced>> = quarters
            .into_par_iter()
            .enumerate()
            .map(|(k, rays)| {
                let few = source.map_or(FEW_RAYS, |tile| few(tile.events.len()));
                if rays.len() <= few || depth == DEEPEST {
                    return self.through(source, rays);
                }
                let quarter = square.quarter(k);
                let tile = self.tree.tile(source, quarter, generation);
                let generation = generation + usize::from(tile.is_some());
                self.quarters(tile.as_ref().or(source), quarter, rays, depth + 1, generation)
            })
            .collect();
        Ok(parts?.into_iter().fold(Traced::default(), Traced::and))
    }

    /// Traces rays through a tile; without one they are refused.
    fn through(&self, tile: Option<&Tile>, rays: Vec<u32>) -> Result<Traced> {
        let Some(tile) = tile else { return Ok(Traced { refused: rays, ..Traced::default() }) };
        if rays.is_empty() {
            return Ok(Traced::default());
        }
        self.monitor.check()?;
        let own: Vec<[f64; 2]> = rays.iter().map(|&ray| self.theta[ray as usize]).collect();
        let bundle = tile.trace(&own, self.order);
        self.monitor.advance(own.len() as u64);
        Ok(Traced {
            met: rays.len() * tile.events.len(),
            parts: vec![Part { bundle, rays }],
            refused: Vec::new(),
            bound_arcsec: tile.bound_arcsec,
        })
    }
}

impl Traced {
    pub fn and(mut self, other: Self) -> Self {
        self.parts.extend(other.parts);
        self.refused.extend(other.refused);
        self.bound_arcsec = self.bound_arcsec.max(other.bound_arcsec);
        self.met += other.met;
        self
    }
}
