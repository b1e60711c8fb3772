//! Points of det A = 0, each on the edge of a grid cell whose ends differ in sign, with the direction of the curve.

use super::sky_window::SkyWindow;
use crate::error::Result;
use crate::mapping::{Mapping, Order, RayBundle};
use crate::monitor::Monitor;
use crate::numerics::contour::zero_contours;

/// A step along an edge shorter than this is the last, arcsec: Newton's method has then converged.
const LAST_STEP_ARCSEC: f64 = 1e-11;
/// Newton steps and bisections of an edge; bisections alone reach rounding in 52.
const ROUNDS: usize = 60;
/// Largest |det A| of a vertex in units of ‖A‖² (at least 1): a jump or pole keeps a value of order one.
const SMALL: f64 = 1e-8;
/// Cells a side of the first grid for every cell of the window, and of the nested grids (odd: no node in the middle).
const CELLS_PER_WINDOW_CELL: usize = 4;
const NESTED_CELLS: usize = 49;
/// Most cells a side of the first grid.
const CELLS_MAX: usize = 512;
/// Half width of the widest nested grid in cells of the first.
const NESTED_HALF_CELLS: f64 = 12.0;
/// Half width of the innermost nested grid about a lens centre, arcsec; smaller radial curves are not drawn.
pub(super) const SMALLEST_HALF_ARCSEC: f64 = 1e-5;
/// Each nested grid is narrower than the one before by this factor.
const NESTING: f64 = 6.0;

/// A point of a critical curve.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    pub theta: [f64; 2],
    pub beta: [f64; 2],
    /// Unit vector along the curve, det A > 0 on the left.
    pub along: [f64; 2],
    /// |∇ det A| there, per arcsec.
    pub steepness: f64,
    /// tr A: twice the eigenvalue that is left.
    pub trace: f64,
    /// Width of the cells around, arcsec.
    pub cell: f64,
}

/// det A and its gradient at one ray.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slope {
    pub det: f64,
    pub gradient: [f64; 2],
}

impl Slope {
    /// From A and its derivatives.
    pub fn of(rays: &RayBundle, i: usize) -> Self {
        let ([xx, xy, yx, yy], b) = (rays.jacobian[i], rays.second_per_arcsec[i]);
        let [b_xxx, b_xxy, b_xyy, b_yxx, b_yxy, b_yyy] = b;
        let gradient = [
            b_xxx * yy + xx * b_yxy - b_xxy * yx - xy * b_yxx,
            b_xxy * yy + xx * b_yyy - b_xyy * yx - xy * b_yxy,
        ];
        Self { det: determinant(&rays.jacobian[i]), gradient }
    }

    /// |∇ det A|, per arcsec.
    pub fn steepness(&self) -> f64 {
        self.gradient[0].hypot(self.gradient[1])
    }

    /// The direction of the curve, det A > 0 on the left.
    pub fn along(&self) -> [f64; 2] {
        let steepness = self.steepness();
        [self.gradient[1] / steepness, -self.gradient[0] / steepness]
    }
}

/// The vertex at ray `i` of a bundle, where det A is small there.
pub(super) fn vertex(theta: [f64; 2], rays: &RayBundle, i: usize, cell: f64) -> Option<Vertex> {
    let (slope, a) = (Slope::of(rays, i), rays.jacobian[i]);
    let scale = a.iter().map(|v| v * v).sum::<f64>().max(1.0);
    let steepness = slope.steepness();
    let is_good = slope.det.abs() <= SMALL * scale && steepness > 0.0 && steepness.is_finite();
    let (beta, along, trace) = (rays.beta_arcsec[i], slope.along(), a[0] + a[3]);
    is_good.then_some(Vertex { theta, beta, along, steepness, trace, cell })
}

/// Vertices on a grid over the window, on nested grids about the lens centres, and where the first grid comes so close
/// to a change of sign that it may hide an island.
pub(super) fn critical_points(
    mapping: &(impl Mapping + ?Sized),
    window: &SkyWindow,
    monitor: &dyn Monitor,
) -> Result<Vec<Vertex>> {
    let first = Grid {
        centre: window.centre_arcsec,
        half: window.half_width_arcsec,
        cells: (CELLS_PER_WINDOW_CELL * window.cells).min(CELLS_MAX),
    };
    let (mut vertices, mut suspects) = first.vertices(mapping, monitor)?;
    for &centre in window.lens_centres_arcsec.iter().filter(|&&c| window.contains(c)) {
        let mut half = NESTED_HALF_CELLS * first.cell();
        while half >= SMALLEST_HALF_ARCSEC {
            let (own, islands) = Grid { centre, half, cells: NESTED_CELLS }.vertices(mapping, monitor)?;
            vertices.extend(own);
            suspects.extend(islands);
            half /= NESTING;
        }
    }
    for grid in suspects {
        vertices.extend(grid.vertices(mapping, monitor)?.0);
    }
    vertices.retain(|v| window.contains(v.theta));
    Ok(vertices)
}

#[derive(Debug, Clone, Copy)]
struct Grid {
    centre: [f64; 2],
    half: f64,
    cells: usize,
}

impl Grid {
    fn cell(&self) -> f64 {
        2.0 * self.half / self.cells as f64
    }

    fn node(&self, k: usize) -> [f64; 2] {
        let n = self.cells + 1;
        let at = |c: usize, i: usize| self.centre[c] - self.half + self.cell() * i as f64;
        [at(0, k % n), at(1, k / n)]
    }

    /// The vertices on this grid's edges, and finer grids where it may hide an island.
    fn vertices(
        &self,
        mapping: &(impl Mapping + ?Sized),
        monitor: &dyn Monitor,
    ) -> Result<(Vec<Vertex>, Vec<Self>)> {
        let n = self.cells + 1;
        let theta: Vec<[f64; 2]> = (0..n * n).map(|k| self.node(k)).collect();
        let rays = mapping.trace(&theta, Order::Jacobian, monitor)?;
        let values: Vec<f64> = rays.jacobian.iter().map(determinant).collect();
        let contours = zero_contours(&values, n, n);
        let edges: Vec<Edge> = contours
            .iter()
            .flat_map(|contour| &contour.crossings)
            .map(|&[a, b]| Edge {
                ends: [self.node(a), self.node(b)],
                bracket: [0.0, 1.0],
                at: values[a] / (values[a] - values[b]),
            })
            .collect();
        Ok((on_edges(mapping, edges, self.cell(), monitor)?, self.islands(&values)))
    }

    /// Grids about nodes where |det A| is least among nine of one sign, and by less than it differs among them.
    fn islands(&self, values: &[f64]) -> Vec<Self> {
        let n = self.cells + 1;
        let interior = (1..n - 1).flat_map(|row| (1..n - 1).map(move |column| row * n + column));
        let hides = |&k: &usize| {
            let around = [k - n - 1, k - n, k - n + 1, k - 1, k + 1, k + n - 1, k + n, k + n + 1];
            let sign = values[k].signum();
            let own = values[k].abs();
            let of = |i: &usize| sign * values[*i];
            around.iter().all(|i| of(i) >= own) && own < around.iter().map(of).fold(0.0, f64::max) - own
        };
        let grid = |k: usize| Self { centre: self.node(k), half: 1.5 * self.cell(), cells: NESTED_CELLS };
        interior.filter(hides).map(grid).collect()
    }
}

/// An edge of a cell, from its negative to its positive end, and where between them det A vanishes.
#[derive(Debug, Clone, Copy)]
struct Edge {
    ends: [[f64; 2]; 2],
    bracket: [f64; 2],
    at: f64,
}

impl Edge {
    fn theta(&self) -> [f64; 2] {
        let [a, b] = self.ends;
        [a[0] + self.at * (b[0] - a[0]), a[1] + self.at * (b[1] - a[1])]
    }

    /// Newton's step within the bracket, else its middle; true when converged.
    fn advance(&mut self, slope: Slope, round: usize) -> bool {
        let [a, b] = self.ends;
        let along = [b[0] - a[0], b[1] - a[1]];
        self.bracket[usize::from(slope.det >= 0.0)] = self.at;
        let step = -slope.det / (slope.gradient[0] * along[0] + slope.gradient[1] * along[1]);
        let [low, high] = self.bracket;
        let next = self.at + step;
        // Every third round halves, so that a kink cannot hold Newton's method up.
        let is_newton = next > low && next < high && round % 3 != 2;
        let length = along[0].hypot(along[1]);
        let is_last = (is_newton && (step * length).abs() <= LAST_STEP_ARCSEC) || slope.det == 0.0;
        if slope.det != 0.0 {
            self.at = if is_newton { next } else { 0.5 * (low + high) };
        }
        is_last
    }
}

/// The vertices that lie on edges; an edge over a jump or pole has none.
fn on_edges(
    mapping: &(impl Mapping + ?Sized),
    mut edges: Vec<Edge>,
    cell: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<Vertex>> {
    let mut active: Vec<usize> = (0..edges.len()).collect();
    for round in 0..ROUNDS {
        if active.is_empty() {
            break;
        }
        let at: Vec<[f64; 2]> = active.iter().map(|&i| edges[i].theta()).collect();
        let rays = mapping.trace(&at, Order::SecondDerivatives, monitor)?;
        let mut left = Vec::new();
        for (k, &i) in active.iter().enumerate() {
            if !edges[i].advance(Slope::of(&rays, k), round) {
                left.push(i);
            }
        }
        active = left;
    }
    let theta: Vec<[f64; 2]> = edges.iter().map(Edge::theta).collect();
    let rays = mapping.trace(&theta, Order::SecondDerivatives, monitor)?;
    Ok((0..theta.len()).filter_map(|i| vertex(theta[i], &rays, i, cell)).collect())
}

pub(super) fn determinant(a: &[f64; 4]) -> f64 {
    a[0] * a[3] - a[1] * a[2]
}
