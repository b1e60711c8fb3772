//! Points of det A = 0, each on an edge whose ends differ in sign, with the direction of the curve.

use crate::error::Result;
use crate::mapping::{Mapping, Order, RayBundle};
use crate::monitor::Monitor;

/// A step along an edge shorter than this is the last, arcsec: Newton's method has then converged.
const LAST_STEP_ARCSEC: f64 = 1e-11;
/// Newton steps and bisections of an edge; bisections alone reach rounding in 52.
const ROUNDS: usize = 60;
/// Largest |det A| of a vertex in units of ‖A‖² (at least 1): a jump or pole keeps a value of order one.
const SMALL: f64 = 1e-8;

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
fn vertex(theta: [f64; 2], rays: &RayBundle, i: usize) -> Option<Vertex> {
    let (slope, a) = (Slope::of(rays, i), rays.jacobian[i]);
    let scale = a.iter().map(|v| v * v).sum::<f64>().max(1.0);
    let steepness = slope.steepness();
    let is_good = slope.det.abs() <= SMALL * scale && steepness > 0.0 && steepness.is_finite();
    let (beta, along, trace) = (rays.beta_arcsec[i], slope.along(), a[0] + a[3]);
    is_good.then_some(Vertex { theta, beta, along, steepness, trace })
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

/// The vertices on edges, given from their negative to their positive ends; an edge over a jump or pole has none.
pub(super) fn on_edges(
    mapping: &(impl Mapping + ?Sized),
    ends: &[[[f64; 2]; 2]],
    monitor: &dyn Monitor,
) -> Result<Vec<Option<Vertex>>> {
    let start = |&ends| Edge { ends, bracket: [0.0, 1.0], at: 0.5 };
    let mut edges: Vec<Edge> = ends.iter().map(start).collect();
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
    Ok((0..theta.len()).map(|i| vertex(theta[i], &rays, i)).collect())
}

fn determinant(a: &[f64; 4]) -> f64 {
    a[0] * a[3] - a[1] * a[2]
}
