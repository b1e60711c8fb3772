//! Cells of sky that may hold an image: thrown away, polished by Newton's method, or quartered.

use nalgebra::{Matrix2, Vector2};

use super::sky_window::SkyWindow;
use crate::error::Result;
use crate::mapping::{Mapping, Order, RayBundle};
use crate::monitor::Monitor;

/// Cells are quartered down to this half side, arcsec.
pub(super) const SMALLEST_HALF_ARCSEC: f64 = 1e-8;
/// Cells a level beyond which the source has no isolated images (an Einstein ring).
const CELLS_MAX: usize = 60_000;
/// A cell is injective when A⁻¹A(corner) − 1 stays below this (Frobenius) at its corners; 1 would do for the points seen.
const VARIATION_MAX: f64 = 0.5;
/// Safety factor on the part of β within a cell that is not linear.
const NONLINEAR_SAFETY: f64 = 1.5;
/// Roots this far outside a cell, in half sides, still count as its own; neighbours then find them twice.
const MARGIN: f64 = 0.1;
/// Newton steps at most, and the length that ends them, arcsec.
const NEWTON_STEPS: usize = 40;
const NEWTON_ARCSEC: f64 = 1e-13;
/// Largest |β − β_s| at a polished image, arcsec.
const RESIDUAL_ARCSEC: f64 = 1e-9;

/// What a search of cells leaves.
#[derive(Debug, Default)]
pub(super) struct Search {
    /// Polished images.
    pub roots: Vec<Root>,
    /// Cells of the smallest size that could be neither thrown away nor polished.
    pub unresolved: Vec<[f64; 2]>,
    /// True when there were too many cells to go on.
    pub overflow: bool,
}

/// A polished image and half the side of the cell it was found in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Root {
    pub theta: [f64; 2],
    pub jacobian: [f64; 4],
    pub half: f64,
}

impl Root {
    /// Sign of det A.
    pub fn parity(&self) -> i64 {
        let [xx, xy, yx, yy] = self.jacobian;
        if xx * yy - xy * yx > 0.0 { 1 } else { -1 }
    }
}

#[derive(Debug, Clone, Copy)]
struct Cell {
    centre: [f64; 2],
    half: f64,
}

enum Verdict {
    Empty,
    Polish,
    Quarter,
}

/// Searches the window for directions with β(θ) = `source`.
///
/// β is taken at the centre and corners of every cell. With u one of the two principal directions of A at the centre,
/// a cell is empty when |u·(β − β_s)| there exceeds what uᵀA and its change over the cell can make up; it holds one
/// image at most when A changes by less than half of itself over the cell, and Newton's method then decides.
///
/// # Errors
/// When cancelled.
pub(super) fn search(
    mapping: &(impl Mapping + ?Sized),
    window: &SkyWindow,
    source: [f64; 2],
    monitor: &dyn Monitor,
) -> Result<Search> {
    let mut found = Search::default();
    let half = window.half_cell_arcsec();
    let mut cells: Vec<Cell> = (0..window.cells * window.cells)
        .map(|k| window.node(k % window.cells, k / window.cells))
        .map(|[x, y]| Cell { centre: [x + half, y + half], half })
        .collect();
    while !cells.is_empty() {
        if cells.len() > CELLS_MAX.max(window.cells * window.cells) {
            found.overflow = true;
            return Ok(found);
        }
        monitor.check()?;
        monitor.tell(&format!(
            "{} cells of {:.1e}″, {} images",
            cells.len(),
            2.0 * cells[0].half,
            found.roots.len()
        ));
        let theta: Vec<[f64; 2]> = cells.iter().flat_map(Cell::points).collect();
        let rays = mapping.map(&theta, Order::Jacobian);
        let (mut quarter, mut polish) = (Vec::new(), Vec::new());
        for (i, cell) in cells.iter().enumerate() {
            let near_a_centre = window.lens_centres_arcsec.iter().any(|&c| cell.is_near(c));
            match if near_a_centre { Verdict::Quarter } else { cell.judge(&rays, 5 * i, source) } {
                Verdict::Empty => {}
                Verdict::Polish => polish.push(*cell),
                Verdict::Quarter => quarter.push(*cell),
            }
        }
        for cell in polish {
            match cell.polished(mapping, source) {
                Polished::Image(root) => found.roots.push(root),
                Polished::Outside => {}
                Polished::Failed => quarter.push(cell),
            }
        }
        let (small, large): (Vec<Cell>, Vec<Cell>) =
            quarter.into_iter().partition(|cell| cell.half <= SMALLEST_HALF_ARCSEC);
        found.unresolved.extend(small.iter().map(|cell| cell.centre));
        cells = large.iter().flat_map(Cell::quarters).collect();
    }
    Ok(found)
}

enum Polished {
    Image(Root),
    Outside,
    Failed,
}

fn matrix(a: &[f64; 4]) -> Matrix2<f64> {
    Matrix2::new(a[0], a[1], a[2], a[3])
}

impl Cell {
    /// Centre and corners.
    fn points(&self) -> [[f64; 2]; 5] {
        [[0.0, 0.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
            .map(|[u, v]| [self.centre[0] + u * self.half, self.centre[1] + v * self.half])
    }

    fn quarters(&self) -> [Self; 4] {
        let half = 0.5 * self.half;
        [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
            .map(|[u, v]| Self { centre: [self.centre[0] + u * half, self.centre[1] + v * half], half })
    }

    /// True when `point` lies in the cell or closer to it than half its side.
    fn is_near(&self, point: [f64; 2]) -> bool {
        (0..2).all(|c| (point[c] - self.centre[c]).abs() <= 2.0 * self.half)
    }

    fn judge(&self, rays: &RayBundle, first: usize, source: [f64; 2]) -> Verdict {
        let a = matrix(&rays.jacobian[first]);
        let corners = [1, 2, 3, 4].map(|k| matrix(&rays.jacobian[first + k]));
        let beta = rays.beta_arcsec[first];
        let offset = Vector2::new(beta[0] - source[0], beta[1] - source[1]);
        // Left singular vectors of A: the eigenvectors of AAᵀ.
        let (p, q, r) = {
            let aat = a * a.transpose();
            (aat[(0, 0)], aat[(0, 1)], aat[(1, 1)])
        };
        let (sin, cos) = (0.5 * (2.0 * q).atan2(p - r)).sin_cos();
        for u in [Vector2::new(cos, sin), Vector2::new(-sin, cos)] {
            let row = a.transpose() * u;
            let linear = (row.x.abs() + row.y.abs()) * self.half;
            let change = corners.iter().map(|c| ((c - a).transpose() * u).norm()).fold(0.0, f64::max);
            let curved = NONLINEAR_SAFETY * change * self.half;
            if offset.dot(&u).abs() > linear + curved {
                return Verdict::Empty;
            }
        }
        let Some(inverse) = a.try_inverse() else { return Verdict::Quarter };
        let variation =
            corners.iter().map(|c| (inverse * c - Matrix2::identity()).norm()).fold(0.0, f64::max);
        if variation < VARIATION_MAX { Verdict::Polish } else { Verdict::Quarter }
    }

    fn polished(&self, mapping: &(impl Mapping + ?Sized), source: [f64; 2]) -> Polished {
        match newton(mapping, self.centre, source, 4.0 * self.half) {
            Newton::Root(theta, jacobian) => {
                let reach = (1.0 + MARGIN) * self.half;
                let inside = (0..2).all(|c| (theta[c] - self.centre[c]).abs() <= reach);
                let root = Root { theta, jacobian, half: self.half };
                if inside { Polished::Image(root) } else { Polished::Outside }
            }
            Newton::FirstStepTooLong => Polished::Outside,
            Newton::Lost => Polished::Failed,
        }
    }
}

/// How Newton's method ended.
pub(super) enum Newton {
    /// At an image, with A there.
    Root([f64; 2], [f64; 4]),
    /// The first step led further than the image of an injective cell can lie.
    FirstStepTooLong,
    /// Elsewhere, nowhere, or too slowly.
    Lost,
}

/// Newton's method for β(θ) = `source` from `start`, no further than `reach` from there.
pub(super) fn newton(
    mapping: &(impl Mapping + ?Sized),
    start: [f64; 2],
    source: [f64; 2],
    reach: f64,
) -> Newton {
    let mut theta = start;
    for step in 0..NEWTON_STEPS {
        let ray = mapping.map(&[theta], Order::Jacobian);
        let (beta, jacobian) = (ray.beta_arcsec[0], ray.jacobian[0]);
        let left = Vector2::new(source[0] - beta[0], source[1] - beta[1]);
        let Some(inverse) = matrix(&jacobian).try_inverse() else { return Newton::Lost };
        let move_by = inverse * left;
        let length = move_by.norm();
        if !length.is_finite() {
            return Newton::Lost;
        }
        if step == 0 && length > reach {
            return Newton::FirstStepTooLong;
        }
        if length <= NEWTON_ARCSEC && left.norm() <= RESIDUAL_ARCSEC {
            return Newton::Root(theta, jacobian);
        }
        theta = [theta[0] + move_by.x, theta[1] + move_by.y];
        if (theta[0] - start[0]).hypot(theta[1] - start[1]) > 2.0 * reach {
            return Newton::Lost;
        }
    }
    // Rounding may keep the steps of a strongly magnified image above the limit.
    let ray = mapping.map(&[theta], Order::Jacobian);
    let left = (ray.beta_arcsec[0][0] - source[0]).hypot(ray.beta_arcsec[0][1] - source[1]);
    if left <= 1e-3 * RESIDUAL_ARCSEC { Newton::Root(theta, ray.jacobian[0]) } else { Newton::Lost }
}
