//! The tree of tiles: the field is quartered while surveying a quarter costs less than tracing its rays.

use rayon::prelude::*;

use super::field::Field;
use super::tile::Tile;
use super::vacuum;
use super::way::Way;
use crate::mapping::multiplane::segment::Segment;
use crate::mapping::{Order, RayBundle};

/// The fewest rays for which a square is surveyed through all planes: the exact recursion of so many costs as much.
pub(super) const FEW_IN_VACUUM: usize = 600;

/// The fewest rays for which a quarter of a tile with so many events becomes a tile of its own.
///
/// It spares its rays about two thirds of the events; a survey is a hundred rays through the wider tile, and some time
/// however few the events. Numbers from 100 to 300 and from 2500 to 30,000 were not clearly faster.
fn few(events: usize) -> usize {
    140 + 4000 / events.max(1)
}

/// Levels below the root, for rays that coincide.
const DEEPEST: usize = 24;
/// Part of the accuracy by which interpolation may miss the kick of a single smooth halo.
const ROUGH_SHARE: f64 = 1e-3;

/// What all tiles of a field have in common.
pub(super) struct Tree<'a> {
    segment: Segment<'a>,
    way: Way,
    accuracy_arcsec: f64,
    square: Field,
    /// The tile of the whole field, where one is accurate enough to trace the nodes of others.
    root: Option<Tile<'a>>,
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

impl<'a> Tree<'a> {
    /// Surveys the whole field.
    pub fn new(segment: Segment<'a>, field: &Field, accuracy_arcsec: f64) -> Self {
        let way = Way {
            chi_start: segment.chi_start,
            chi_end: segment.chi_end,
            x_start: segment.x_start,
            s_start: segment.s_start,
            x_axis_end: segment.x_axis_end,
        };
        let mut tree = Self { segment, way, accuracy_arcsec, square: field.square(), root: None };
        tree.root = tree.tile(None, tree.square, 0);
        tree
    }

    /// A tile whose bound leaves room for those of `generation`s to come.
    fn tile(&self, source: Option<&Tile<'a>>, square: Field, generation: usize) -> Option<Tile<'a>> {
        let tolerance = ROUGH_SHARE * self.accuracy_arcsec;
        let survey = match source {
            None => vacuum::survey(&self.segment, self.way, square, tolerance)?,
            Some(tile) => tile.survey(square, tolerance),
        };
        let inherited = source.map_or(0.0, |tile| tile.bound_arcsec);
        let tile = Tile::new(&survey, self.way, self.accuracy_arcsec, inherited);
        let allowed = self.accuracy_arcsec * (1.0 - 0.5_f64.powi(generation as i32 + 1));
        (tile.bound_arcsec <= allowed).then_some(tile)
    }

    /// Traces rays; refuses those outside the field and those that no accurate tile holds.
    pub fn trace(&self, theta: &[[f64; 2]], order: Order) -> Traced {
        let all: Vec<u32> = (0..theta.len() as u32).collect();
        let (inside, outside): (Vec<u32>, Vec<u32>) =
            all.into_iter().partition(|&i| self.square.contains(theta[i as usize]));
        let mut traced = self.quarters(self.root.as_ref(), self.square, inside, theta, order, 0, 1);
        traced.refused.extend(outside);
        traced
    }

    #[allow(clippy::too_many_arguments, reason = "the state of a descent")]
    fn quarters(
        &self,
        source: Option<&Tile<'a>>,
        square: Field,
        rays: Vec<u32>,
        theta: &[[f64; 2]],
        order: Order,
        depth: usize,
        generation: usize,
    ) -> Traced {
        let mut quarters: [Vec<u32>; 4] = std::array::from_fn(|_| Vec::with_capacity(rays.len() / 3));
        for ray in rays {
            quarters[square.quarter_of(theta[ray as usize])].push(ray);
        }
        let parts: Vec<Traced> = quarters
            .into_par_iter()
            .enumerate()
            .map(|(k, rays)| {
                let few = source.map_or(FEW_IN_VACUUM, |tile| few(tile.events.len()));
                if rays.len() <= few || depth == DEEPEST {
                    return through(source, rays, theta, order);
                }
                let quarter = square.quarter(k);
                let tile = self.tile(source, quarter, generation);
                let generation = generation + usize::from(tile.is_some());
                self.quarters(tile.as_ref().or(source), quarter, rays, theta, order, depth + 1, generation)
            })
            .collect();
        parts.into_iter().fold(Traced::default(), Traced::and)
    }
}

/// Traces rays through a tile; without one they are refused.
fn through(tile: Option<&Tile>, rays: Vec<u32>, theta: &[[f64; 2]], order: Order) -> Traced {
    let Some(tile) = tile else { return Traced { refused: rays, ..Traced::default() } };
    if rays.is_empty() {
        return Traced::default();
    }
    let own: Vec<[f64; 2]> = rays.iter().map(|&ray| theta[ray as usize]).collect();
    Traced {
        met: rays.len() * tile.events.len(),
        parts: vec![Part { bundle: tile.trace(&own, order), rays }],
        refused: Vec::new(),
        bound_arcsec: tile.bound_arcsec,
    }
}

impl Traced {
    fn and(mut self, other: Self) -> Self {
        self.parts.extend(other.parts);
        self.refused.extend(other.refused);
        self.bound_arcsec = self.bound_arcsec.max(other.bound_arcsec);
        self.met += other.met;
        self
    }
}
