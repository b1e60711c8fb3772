//! Flux of every pixel: one point, or an adaptive integral over the pixel.

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::grid::SkyGrid;
use super::scene::Scene;
use crate::error::Result;
use crate::mapping::Order;
use crate::monitor::Monitor;

/// How the surface brightness is summed over a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PixelSampling {
    /// The centre of the pixel stands for all of it: the paper's choice, poor at the cusp of a Sérsic source.
    Point,
    /// The mapping is expanded to second order in each pixel and the brightness integrated to a tolerance.
    Adaptive,
}

impl PixelSampling {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Adaptive => "adaptive",
        }
    }
}

/// Flux of every pixel of `grid` in flux units (surface brightness times pixel area), before PSF and noise.
///
/// Adaptive: each pixel's ray is traced with second derivatives, β(θ+δ) = β + Aδ + ½b:δδ, and the brightness of
/// that expansion is integrated by quartering until it no longer changes by `tolerance` (flux units). Where the
/// expansions of neighbours disagree at a common corner by more than the tolerance, the pixel is quartered and
/// its quarters are traced again, down to 1/16 of a pixel.
///
/// # Errors
/// When `monitor`, which is told of every ray, cancels.
pub fn integrate_pixels(
    scene: &Scene,
    grid: &SkyGrid,
    sampling: PixelSampling,
    tolerance: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<f64>> {
    let centres = grid.theta_arcsec();
    match sampling {
        PixelSampling::Point => {
            let area = grid.pixel_scale_arcsec().powi(2);
            Ok(scene.surface_brightness(&centres, monitor)?.into_iter().map(|b| b * area).collect())
        }
        PixelSampling::Adaptive => integrate_adaptively(scene, grid, &centres, tolerance, monitor),
    }
}

/// How often a pixel's ray may be quartered and traced again.
const DEEPEST_TRACE: i32 = 4;

/// How often a cell may be quartered for the brightness alone: 1e-4″ of a 0.08″ pixel.
const DEEPEST_BRIGHTNESS: u32 = 10;

fn integrate_adaptively(
    scene: &Scene,
    grid: &SkyGrid,
    centres: &[[f64; 2]],
    tolerance: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<f64>> {
    let n = grid.pixels();
    let mut flux = vec![0.0; n * n];
    let mut width = grid.pixel_scale_arcsec();
    let mut pixels: Vec<usize> = (0..n * n).collect();
    let mut cells = trace_cells(scene, centres, monitor)?;
    let mut smooth = neighbours_agree(scene, &cells, n, width, tolerance);
    for depth in 0..=DEEPEST_TRACE {
        let accepted = |i: usize| smooth[i] || depth == DEEPEST_TRACE;
        let sums: Vec<f64> = (0..cells.len())
            .into_par_iter()
            .map(|i| {
                if accepted(i) {
                    cells[i].integrate(scene, width, tolerance * 0.25f64.powi(depth))
                } else {
                    0.0
                }
            })
            .collect();
        monitor.check()?;
        for (pixel, sum) in pixels.iter().zip(sums) {
            flux[*pixel] += sum;
        }
        let rough: Vec<usize> = (0..cells.len()).filter(|&i| !accepted(i)).collect();
        if rough.is_empty() {
            break;
        }
        width *= 0.5;
        let quarters: Vec<[f64; 2]> =
            rough.iter().flat_map(|&i| CORNERS.map(|c| cells[i].at(c, 0.5 * width))).collect();
        pixels = rough.iter().flat_map(|&i| [pixels[i]; 4]).collect();
        cells = trace_cells(scene, &quarters, monitor)?;
        smooth =
            cells.chunks(4).flat_map(|four| [siblings_agree(scene, four, width, tolerance); 4]).collect();
    }
    Ok(flux)
}

const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];

/// The mapping expanded to second order about θ.
struct Expansion {
    theta: [f64; 2],
    beta: [f64; 2],
    a: [f64; 4],
    b: [f64; 6],
}

fn trace_cells(scene: &Scene, centres: &[[f64; 2]], monitor: &dyn Monitor) -> Result<Vec<Expansion>> {
    let rays = scene.mapping.trace(centres, Order::SecondDerivatives, monitor)?;
    Ok((0..centres.len())
        .map(|i| Expansion {
            theta: centres[i],
            beta: rays.beta_arcsec[i],
            a: rays.jacobian[i],
            b: rays.second_per_arcsec[i],
        })
        .collect())
}

impl Expansion {
    /// The direction at `half` times the corner (±1, ±1).
    fn at(&self, corner: [f64; 2], half: f64) -> [f64; 2] {
        [self.theta[0] + half * corner[0], self.theta[1] + half * corner[1]]
    }

    /// Surface brightness at an offset from the centre.
    fn brightness(&self, scene: &Scene, [dx, dy]: [f64; 2]) -> f64 {
        let [xx, xy, yx, yy] = self.a;
        let b = &self.b;
        let (qx, qy, qc) = (0.5 * dx * dx, 0.5 * dy * dy, dx * dy);
        let beta = [
            self.beta[0] + xx * dx + xy * dy + b[0] * qx + b[1] * qc + b[2] * qy,
            self.beta[1] + yx * dx + yy * dy + b[3] * qx + b[4] * qc + b[5] * qy,
        ];
        scene.brightness([self.theta[0] + dx, self.theta[1] + dy], beta)
    }

    fn integrate(&self, scene: &Scene, width: f64, tolerance: f64) -> f64 {
        let whole = Part { offset: [0.0; 2], width, at_centre: self.brightness(scene, [0.0, 0.0]) };
        self.refine(scene, &self.rule(scene, &whole), tolerance, DEEPEST_BRIGHTNESS)
    }

    /// Quartered while the rule is corrected by more than the tolerance, or disagrees as much with that of the quarters: one
    /// test alone is passed by chance where the curvatures along two directions cancel.
    fn refine(&self, scene: &Scene, rule: &Rule, tolerance: f64, depth: u32) -> f64 {
        let quarters = rule.quarters.each_ref().map(|quarter| self.rule(scene, quarter));
        let fine: f64 = quarters.iter().map(|rule| rule.integral).sum();
        if depth == 0 || (rule.correction.abs() <= tolerance && (fine - rule.integral).abs() <= tolerance) {
            return fine;
        }
        quarters.iter().map(|rule| self.refine(scene, rule, 0.5 * tolerance, depth - 1)).sum()
    }

    /// The midpoint rule on the quarters of a part, extrapolated with that on the part itself.
    fn rule(&self, scene: &Scene, part: &Part) -> Rule {
        let quarters = CORNERS.map(|[x, y]| {
            let offset = [part.offset[0] + 0.25 * part.width * x, part.offset[1] + 0.25 * part.width * y];
            Part { offset, width: 0.5 * part.width, at_centre: self.brightness(scene, offset) }
        });
        let (area, mean) =
            (part.width * part.width, 0.25 * quarters.iter().map(|q| q.at_centre).sum::<f64>());
        let correction = (mean - part.at_centre) / 3.0 * area;
        Rule { integral: mean * area + correction, correction, quarters }
    }
}

/// A square part of a pixel with the brightness at its centre.
struct Part {
    /// From the centre of the expansion, arcsec.
    offset: [f64; 2],
    width: f64,
    at_centre: f64,
}

/// What a rule of five points makes of a part.
struct Rule {
    integral: f64,
    correction: f64,
    quarters: [Part; 4],
}

/// For every pixel: do the expansions that meet at each of its corners agree on the brightness there?
fn neighbours_agree(scene: &Scene, cells: &[Expansion], n: usize, width: f64, tolerance: f64) -> Vec<bool> {
    let half = 0.5 * width;
    let allowed = tolerance / (width * width);
    (0..n * n)
        .into_par_iter()
        .map(|k| {
            let (x, y) = ((k % n) as i64, (k / n) as i64);
            CORNERS.iter().all(|corner| {
                let own = cells[k].brightness(scene, corner.map(|c| c * half));
                [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].iter().all(|step| {
                    let (dx, dy) = (corner[0] * step[0], corner[1] * step[1]);
                    let (nx, ny) = (x + dx as i64, y + dy as i64);
                    let inside = (0..n as i64).contains(&nx) && (0..n as i64).contains(&ny);
                    let offset = [half * (corner[0] - 2.0 * dx), half * (corner[1] - 2.0 * dy)];
                    !inside || {
                        let other = &cells[(ny * n as i64 + nx) as usize];
                        (other.brightness(scene, offset) - own).abs() <= allowed
                    }
                })
            })
        })
        .collect()
}

/// Do four quarters agree on the brightness at the centre of what they are quarters of?
fn siblings_agree(scene: &Scene, four: &[Expansion], width: f64, tolerance: f64) -> bool {
    let half = 0.5 * width;
    let values: Vec<f64> =
        four.iter().zip(CORNERS).map(|(cell, c)| cell.brightness(scene, c.map(|c| -c * half))).collect();
    let spread =
        values.iter().fold(f64::MIN, |m, v| m.max(*v)) - values.iter().fold(f64::MAX, |m, v| m.min(*v));
    spread * width * width <= tolerance
}
