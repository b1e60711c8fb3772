//! Which point of det A = 0 follows which along its curve: every curve once, whatever grids its points are from.

use super::critical_points::{Slope, Vertex, vertex};
use super::sky_window::SkyWindow;
use crate::error::Result;
use crate::mapping::{Mapping, Order};
use crate::monitor::Monitor;

/// Largest angle between a link and the curve at its ends and middle, rad.
const LARGEST_TURN_RAD: f64 = 0.35;
/// A vertex ahead within this angle is the next one to be tried, rad.
const AHEAD_RAD: f64 = 1.05;
/// Largest distance of the middle of a link from the curve, in units of its length: an arc that turns by twice
/// [`LARGEST_TURN_RAD`] strays by 0.09.
const LARGEST_SAG: f64 = 0.12;
/// Vertices closer than this part of the finer cell are one.
const SAME: f64 = 1e-3;
/// Largest correction of an inserted vertex in units of its distance, and Newton steps that bring it onto the curve.
const LARGEST_CORRECTION: f64 = 0.3;
const NEWTON_STEPS: usize = 5;
/// Cell of an inserted vertex in units of its distance: the next is inserted at half of it, half as far again.
const GROWTH: f64 = 3.0;
/// Halvings of the distance at which a vertex is inserted before a curve is taken to end.
const HALVINGS: i32 = 30;
const ROUNDS: usize = 400;
const VERTICES_MAX: usize = 200_000;

/// Vertices in order along one curve.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    pub vertices: Vec<Vertex>,
    pub closed: bool,
}

/// Joins vertices to curves; where the next one is not in sight of a vertex, others are inserted between.
///
/// A link is accepted when the curve leaves its start, passes its middle and reaches its end in its direction. Two
/// curves side by side run in opposite directions, since det A > 0 lies on the left of each, so a link cannot change
/// from one to the other; each vertex has one next vertex, so a curve cannot be found twice.
pub(super) fn chains(
    mapping: &(impl Mapping + ?Sized),
    vertices: Vec<Vertex>,
    window: &SkyWindow,
    monitor: &dyn Monitor,
) -> Result<Vec<Chain>> {
    let mut links = Links::new(vertices);
    for _ in 0..ROUNDS {
        let open: Vec<usize> =
            (0..links.vertices.len()).filter(|&i| links.next[i] == Next::Unknown).collect();
        if open.is_empty() || links.vertices.len() > VERTICES_MAX {
            break;
        }
        let candidates: Vec<(usize, Option<usize>)> = open.iter().map(|&i| (i, links.ahead(i))).collect();
        let unjoined = links.join(mapping, &candidates, monitor)?;
        links.insert(mapping, &unjoined, window, monitor)?;
    }
    Ok(links.chains())
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Next {
    Unknown,
    End,
    Vertex(usize),
}

struct Links {
    vertices: Vec<Vertex>,
    next: Vec<Next>,
    /// Halvings of the distance at which the next vertex is inserted.
    halvings: Vec<i32>,
    coarsest: f64,
}

fn between(a: &Vertex, b: &Vertex) -> ([f64; 2], f64) {
    let d = [b.theta[0] - a.theta[0], b.theta[1] - a.theta[1]];
    (d, d[0].hypot(d[1]))
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl Links {
    fn new(mut all: Vec<Vertex>) -> Self {
        // Finest first, so that of two vertices in one place the one of the finer grid stays.
        all.sort_by(|a, b| a.cell.total_cmp(&b.cell));
        let mut vertices: Vec<Vertex> = Vec::with_capacity(all.len());
        for v in all {
            if vertices.iter().all(|kept| between(kept, &v).1 > SAME * kept.cell) {
                vertices.push(v);
            }
        }
        let coarsest = vertices.iter().map(|v| v.cell).fold(0.0, f64::max);
        let (next, halvings) = (vec![Next::Unknown; vertices.len()], vec![0; vertices.len()]);
        Self { vertices, next, halvings, coarsest }
    }

    /// The nearest vertex that lies ahead of vertex `i` and whose curve runs away from it.
    fn ahead(&self, i: usize) -> Option<usize> {
        let own = &self.vertices[i];
        let mut best = (2.0 * self.coarsest, None);
        for (j, other) in self.vertices.iter().enumerate() {
            let (d, length) = between(own, other);
            let least = AHEAD_RAD.cos() * length;
            if length < best.0 && j != i && dot(d, own.along) >= least && dot(d, other.along) >= least {
                best = (length, Some(j));
            }
        }
        best.1
    }

    /// Joins the pairs whose link follows the curve; returns the others.
    fn join(
        &mut self,
        mapping: &(impl Mapping + ?Sized),
        candidates: &[(usize, Option<usize>)],
        monitor: &dyn Monitor,
    ) -> Result<Vec<(usize, Option<usize>)>> {
        let turn = LARGEST_TURN_RAD.cos();
        let runs_straight = |&(i, j): &(usize, Option<usize>)| {
            j.is_some_and(|j| {
                let (own, other) = (&self.vertices[i], &self.vertices[j]);
                let (d, length) = between(own, other);
                dot(d, own.along) >= turn * length && dot(d, other.along) >= turn * length
            })
        };
        let (tried, mut unjoined): (Vec<_>, Vec<_>) = candidates.iter().copied().partition(runs_straight);
        let middles: Vec<[f64; 2]> = tried
            .iter()
            .map(|&(i, j)| {
                let (a, b) = (self.vertices[i].theta, self.vertices[j.unwrap_or(i)].theta);
                [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
            })
            .collect();
        let rays = mapping.trace(&middles, Order::SecondDerivatives, monitor)?;
        for (k, &(i, j)) in tried.iter().enumerate() {
            let j = j.unwrap_or(i);
            let (d, length) = between(&self.vertices[i], &self.vertices[j]);
            let slope = Slope::of(&rays, k);
            // Beside a pole |det A| may be small against its own slope and yet far from a zero.
            let [a, b] = [i, j].map(|k| self.vertices[k].steepness);
            let steepness = slope.steepness().min(a).min(b);
            let is_on_curve = slope.det.abs() <= LARGEST_SAG * length * steepness;
            if is_on_curve && dot(d, slope.along()) >= turn * length {
                self.next[i] = Next::Vertex(j);
            } else {
                unjoined.push((i, Some(j)));
            }
        }
        Ok(unjoined)
    }

    /// Inserts a vertex ahead of each; a curve that leaves the window, or cannot be followed, ends.
    fn insert(
        &mut self,
        mapping: &(impl Mapping + ?Sized),
        unjoined: &[(usize, Option<usize>)],
        window: &SkyWindow,
        monitor: &dyn Monitor,
    ) -> Result<()> {
        let distance = |&(i, j): &(usize, Option<usize>)| {
            let own = &self.vertices[i];
            let far = j.map_or(own.cell, |j| between(own, &self.vertices[j]).1.min(own.cell));
            far * 0.5_f64.powi(1 + self.halvings[i])
        };
        let lengths: Vec<f64> = unjoined.iter().map(distance).collect();
        let mut theta: Vec<[f64; 2]> = unjoined
            .iter()
            .zip(&lengths)
            .map(|(&(i, _), h)| {
                let v = &self.vertices[i];
                [v.theta[0] + h * v.along[0], v.theta[1] + h * v.along[1]]
            })
            .collect();
        let predicted = theta.clone();
        for _ in 0..NEWTON_STEPS {
            let rays = mapping.trace(&theta, Order::SecondDerivatives, monitor)?;
            for (k, at) in theta.iter_mut().enumerate() {
                let slope = Slope::of(&rays, k);
                let step = slope.det / slope.steepness().powi(2);
                *at = [at[0] - step * slope.gradient[0], at[1] - step * slope.gradient[1]];
            }
        }
        let rays = mapping.trace(&theta, Order::SecondDerivatives, monitor)?;
        for (k, &(i, _)) in unjoined.iter().enumerate() {
            let (at, from, h) = (theta[k], predicted[k], lengths[k]);
            let moved = (at[0] - from[0]).hypot(at[1] - from[1]);
            let found = vertex(at, &rays, k, GROWTH * h).filter(|v| {
                let turn = dot(v.along, self.vertices[i].along);
                moved <= LARGEST_CORRECTION * h && turn >= LARGEST_TURN_RAD.cos()
            });
            match found {
                Some(v) if window.contains(v.theta) => {
                    self.vertices.push(v);
                    self.next.push(Next::Unknown);
                    self.halvings.push(0);
                    self.next[i] = Next::Vertex(self.vertices.len() - 1);
                }
                Some(_) => self.next[i] = Next::End,
                None if self.halvings[i] >= HALVINGS => self.next[i] = Next::End,
                None => self.halvings[i] += 1,
            }
        }
        Ok(())
    }

    /// Closed curves are the circles of `next`; open ones begin where nothing leads to.
    fn chains(self) -> Vec<Chain> {
        let n = self.vertices.len();
        let follows = |i: usize| match self.next[i] {
            Next::Vertex(j) => Some(j),
            Next::Unknown | Next::End => None,
        };
        let mut has_former = vec![false; n];
        (0..n).filter_map(follows).for_each(|j| has_former[j] = true);
        let (mut walk, mut chains) = (vec![usize::MAX; n], Vec::new());
        let chain = |numbers: &[usize], closed| Chain {
            vertices: numbers.iter().map(|&i| self.vertices[i]).collect(),
            closed,
        };
        let starts = (0..n).filter(|&i| !has_former[i]).chain(0..n);
        for start in starts {
            let mut numbers = Vec::new();
            let mut at = Some(start);
            while let Some(i) = at.filter(|&i| walk[i] == usize::MAX) {
                walk[i] = start;
                numbers.push(i);
                at = follows(i);
            }
            match at {
                // The walk met itself: a circle, perhaps behind a tail of vertices that were passed over.
                Some(met) if walk[met] == start => {
                    let first = numbers.iter().position(|&i| i == met).unwrap_or(0);
                    chains.push(chain(&numbers[first..], true));
                }
                None => chains.push(chain(&numbers, false)),
                Some(_) => {}
            }
        }
        chains.retain(|chain| chain.vertices.len() > 2);
        chains
    }
}
