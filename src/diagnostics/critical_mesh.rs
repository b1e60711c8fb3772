//! Contours of det A = 0 on a mesh of triangles that is refined until each of its links follows the curve.

use std::collections::HashMap;

use super::critical_points::{Slope, Vertex, on_edges};
use super::sky_window::SkyWindow;
use crate::error::Result;
use crate::mapping::{Mapping, Order};
use crate::monitor::Monitor;
use crate::numerics::contour::Contour;
use crate::numerics::triangle_mesh::TriangleMesh;

/// Cells a side of the first mesh for every cell of the window, and the most.
const CELLS_PER_WINDOW_CELL: usize = 4;
const CELLS_MAX: usize = 512;
/// Triangles about lens centres, poles and jumps are no smaller than this, arcsec: smaller radial curves are not drawn.
pub(super) const SMALLEST_ARCSEC: f64 = 1e-5;
/// Largest triangle in units of the distance from a lens centre.
const GRADING: f64 = 0.25;
/// Islands are looked for down to this part of the triangles that stand there anyway.
const ISLAND: f64 = 1.0 / 32.0;
/// A minimum between two nodes below this part of their |det A| may be a zero.
const CLOSE: f64 = 0.25;
/// Largest angle between a link and the curve at its ends and middle, rad.
const LARGEST_TURN_RAD: f64 = 0.35;
/// Largest distance of the middle of a link from the curve, in units of its length: an arc that turns by twice
/// [`LARGEST_TURN_RAD`] strays by 0.09.
const LARGEST_SAG: f64 = 0.12;
/// Links shorter than this part of their triangle are judged by the directions of their ends alone.
const SHORT: f64 = 1e-3;
/// Triangles that a curve crosses are no smaller than this, arcsec.
const FINEST_ARCSEC: f64 = 1e-7;
const ROUNDS: usize = 100;
const TRIANGLES_MAX: usize = 4_000_000;

/// Vertices in order along one curve.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    pub vertices: Vec<Vertex>,
    pub closed: bool,
}

/// All curves in the window.
///
/// Neighbouring triangles share their sides, so that contours neither end nor meet but at the edge of the window, and
/// none is there twice. A triangle is bisected where it is large for its distance from a lens centre; where its link
/// does not leave one end, pass the middle and reach the other along the curve; where a pole or jump crosses its sides; and
/// where |det A| comes so close to zero at a node or between two that an island may hide there.
///
/// # Errors
/// When cancelled.
pub(super) fn chains(
    mapping: &(impl Mapping + ?Sized),
    window: &SkyWindow,
    monitor: &dyn Monitor,
) -> Result<Vec<Chain>> {
    let mut search = Search::new(window);
    let mut fresh: Vec<usize> = (0..search.mesh.count()).collect();
    for round in 0.. {
        search.measure(mapping, &fresh, monitor)?;
        let crude = search.crude(mapping, &fresh, monitor)?;
        fresh.clear();
        if crude.is_empty() || round == ROUNDS || search.mesh.count() > TRIANGLES_MAX {
            break;
        }
        for (triangle, corners) in crude {
            if search.mesh.corners(triangle) == corners {
                search.mesh.bisect(triangle, &mut fresh);
            }
        }
        fresh.sort_unstable();
        fresh.dedup();
    }
    Ok(search.mesh.contours(&search.is_positive).iter().flat_map(|contour| search.chains(contour)).collect())
}

/// A side of a triangle by its nodes, the negative one first.
type Side = [usize; 2];

struct Search<'a> {
    window: &'a SkyWindow,
    first_size: f64,
    mesh: TriangleMesh,
    /// det A at the nodes, and whether it counts as positive.
    slopes: Vec<Slope>,
    is_positive: Vec<bool>,
    /// Where sides are crossed; `None` for poles and jumps.
    vertices: HashMap<Side, Option<Vertex>>,
}

impl<'a> Search<'a> {
    fn new(window: &'a SkyWindow) -> Self {
        let cells = (CELLS_PER_WINDOW_CELL * window.cells).min(CELLS_MAX);
        let mesh = TriangleMesh::square(window.centre_arcsec, window.half_width_arcsec, cells);
        let first_size = mesh.size(0);
        Self {
            window,
            first_size,
            mesh,
            slopes: Vec::new(),
            is_positive: Vec::new(),
            vertices: HashMap::new(),
        }
    }

    /// det A at the new nodes, and the vertices on the new sides.
    fn measure(
        &mut self,
        mapping: &(impl Mapping + ?Sized),
        fresh: &[usize],
        monitor: &dyn Monitor,
    ) -> Result<()> {
        let new = &self.mesh.nodes[self.slopes.len()..];
        let rays = mapping.trace(new, Order::SecondDerivatives, monitor)?;
        self.slopes.extend((0..new.len()).map(|i| Slope::of(&rays, i)));
        self.is_positive.extend(self.slopes[self.is_positive.len()..].iter().map(|slope| slope.det >= 0.0));
        let mut sides: Vec<Side> = fresh
            .iter()
            .filter_map(|&t| self.mesh.segment(t, &self.is_positive))
            .flatten()
            .filter(|side| !self.vertices.contains_key(side))
            .collect();
        sides.sort_unstable();
        sides.dedup();
        let ends: Vec<[[f64; 2]; 2]> = sides.iter().map(|side| side.map(|n| self.mesh.nodes[n])).collect();
        self.vertices.extend(sides.into_iter().zip(on_edges(mapping, &ends, monitor)?));
        Ok(())
    }

    /// The triangles among these that are to be bisected, with their nodes.
    fn crude(
        &self,
        mapping: &(impl Mapping + ?Sized),
        fresh: &[usize],
        monitor: &dyn Monitor,
    ) -> Result<Vec<(usize, [usize; 3])>> {
        let (mut crude, mut links, mut middles) = (Vec::new(), Vec::new(), Vec::new());
        for &t in fresh {
            let size = self.mesh.size(t);
            let allowed = self.allowed(t);
            if size > allowed || (size > ISLAND * allowed && self.may_hide_an_island(t)) {
                crude.push(t);
            } else if let Some(sides) = self.mesh.segment(t, &self.is_positive) {
                match sides.map(|side| self.vertices[&side]) {
                    [Some(a), Some(b)] if size > FINEST_ARCSEC => match Link::of(&a, &b, size) {
                        Link::Straight => {
                            links.push((t, a, b));
                            middles.push([0, 1].map(|c| 0.5 * (a.theta[c] + b.theta[c])));
                        }
                        Link::Short => {}
                        Link::Bent => crude.push(t),
                    },
                    [Some(_), Some(_)] => {}
                    _ if size > SMALLEST_ARCSEC => crude.push(t),
                    _ => {}
                }
            }
        }
        let rays = mapping.trace(&middles, Order::SecondDerivatives, monitor)?;
        let strays =
            links.iter().enumerate().filter(|(k, (_, a, b))| !is_on_curve(a, b, &Slope::of(&rays, *k)));
        crude.extend(strays.map(|(_, &(t, _, _))| t));
        crude.sort_unstable();
        crude.dedup();
        Ok(crude.into_iter().map(|t| (t, self.mesh.corners(t))).collect())
    }

    /// Largest size of a triangle there, whatever it looks like, arcsec.
    fn allowed(&self, triangle: usize) -> f64 {
        let corners = self.mesh.corners(triangle).map(|node| self.mesh.nodes[node]);
        let middle = [0, 1].map(|c| corners.iter().map(|p| p[c]).sum::<f64>() / 3.0);
        let distance = |p: &[f64; 2]| (p[0] - middle[0]).hypot(p[1] - middle[1]);
        let nearest = self.window.lens_centres_arcsec.iter().map(distance).fold(f64::INFINITY, f64::min);
        (GRADING * nearest).max(SMALLEST_ARCSEC).min(self.first_size)
    }

    /// True where det A at the nodes, and its slope there, lead one to think that it may change sign within the triangle: twice
    /// on a side, or about a node where it has a minimum.
    fn may_hide_an_island(&self, triangle: usize) -> bool {
        let [a, b, c] = self.mesh.corners(triangle);
        [[a, b], [b, c], [c, a]].iter().any(|&side| self.dips(side))
            || [a, b, c].iter().any(|&node| self.is_low(triangle, node))
    }

    /// True where the cubic of values and slopes at the ends of a side of one sign comes close to zero between them.
    fn dips(&self, [a, b]: Side) -> bool {
        let sign = if self.is_positive[a] { 1.0 } else { -1.0 };
        let [p, q] = [a, b].map(|node| self.mesh.nodes[node]);
        let along = [q[0] - p[0], q[1] - p[1]];
        let [(f0, g0), (f1, g1)] =
            [a, b].map(|n| (sign * self.slopes[n].det, sign * dot(self.slopes[n].gradient, along)));
        if self.is_positive[a] != self.is_positive[b] || !(g0 < 0.0 && g1 > 0.0) {
            return false;
        }
        let (square, cube) = (3.0 * (f1 - f0) - 2.0 * g0 - g1, 2.0 * (f0 - f1) + g0 + g1);
        let t = -g0 / (square + (square * square - 3.0 * cube * g0).sqrt());
        f0 + t * (g0 + t * (square + t * cube)) < CLOSE * f0.min(f1)
    }

    /// True where |det A| is least at a node of all about it, which have its sign, and by less than it differs among them.
    fn is_low(&self, triangle: usize, node: usize) -> bool {
        let (own, sign) = (self.slopes[node].det.abs(), self.is_positive[node]);
        let mut most = 0.0_f64;
        for around in self.mesh.star(triangle, node).into_iter().flat_map(|t| self.mesh.corners(t)) {
            let det = self.slopes[around].det.abs();
            if self.is_positive[around] != sign || det < own {
                return false;
            }
            most = most.max(det);
        }
        own < most - own
    }

    /// The pieces of a contour between poles and jumps.
    fn chains(&self, contour: &Contour) -> Vec<Chain> {
        let mut vertices: Vec<Option<Vertex>> =
            contour.crossings.iter().map(|side| self.vertices[side]).collect();
        let gap = vertices.iter().position(Option::is_none);
        if let (true, Some(gap)) = (contour.closed, gap) {
            vertices.rotate_left(gap);
        }
        let closed = contour.closed && gap.is_none();
        let pieces = vertices.split(Option::is_none);
        let pieces =
            pieces.map(|piece| Chain { vertices: piece.iter().copied().flatten().collect(), closed });
        pieces.filter(|chain| chain.vertices.len() > 2).collect()
    }
}

enum Link {
    /// Along the curve at both ends.
    Straight,
    /// So short that its own direction says nothing, with ends that agree.
    Short,
    Bent,
}

impl Link {
    fn of(a: &Vertex, b: &Vertex, size: f64) -> Self {
        let (d, length) = between(a, b);
        let turn = LARGEST_TURN_RAD.cos();
        if length < SHORT * size {
            if dot(a.along, b.along) >= turn { Self::Short } else { Self::Bent }
        } else if dot(d, a.along) >= turn * length && dot(d, b.along) >= turn * length {
            Self::Straight
        } else {
            Self::Bent
        }
    }
}

/// True where det A in the middle of a link is that of a point beside the curve, which runs along there too.
fn is_on_curve(a: &Vertex, b: &Vertex, middle: &Slope) -> bool {
    let (d, length) = between(a, b);
    // Beside a pole |det A| may be small against its own slope and yet far from a zero.
    let steepness = middle.steepness().min(a.steepness).min(b.steepness);
    middle.det.abs() <= LARGEST_SAG * length * steepness
        && dot(d, middle.along()) >= LARGEST_TURN_RAD.cos() * length
}

fn between(a: &Vertex, b: &Vertex) -> ([f64; 2], f64) {
    let d = [b.theta[0] - a.theta[0], b.theta[1] - a.theta[1]];
    (d, d[0].hypot(d[1]))
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}
