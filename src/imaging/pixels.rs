//! Flux of every pixel: one point, or an adaptive integral over the pixel.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::grid::SkyGrid;
use super::scene::Scene;

/// How the surface brightness is summed over a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PixelSampling {
    /// The centre of the pixel stands for all of it: the paper's choice, poor at the cusp of a Sérsic source.
    Point,
    /// Cells are quartered until their contribution no longer changes.
    Adaptive,
}

/// A square part of a pixel with the brightness at its centre.
#[derive(Clone, Copy)]
struct Cell {
    pixel: usize,
    centre: [f64; 2],
    brightness: f64,
}

/// Deepest quartering: cells of 1/128 pixel.
const DEEPEST: u32 = 7;

/// Flux of every pixel of `grid` in flux units (surface brightness times pixel area), before PSF and noise.
///
/// Adaptive: a pixel is quartered when the second differences of its neighbourhood say that its centre is off by
/// more than `tolerance` (in flux units); a cell of a quartered pixel is quartered again until the extrapolated
/// correction, (Σ quarters − cell)/3, is below tolerance/2^depth. All cells of a depth are traced together.
pub fn integrate_pixels(scene: &Scene, grid: &SkyGrid, sampling: PixelSampling, tolerance: f64) -> Vec<f64> {
    let area = grid.pixel_scale_arcsec().powi(2);
    let centres = grid.theta_arcsec();
    let at_centre = scene.surface_brightness(&centres);
    let mut flux: Vec<f64> = at_centre.iter().map(|b| b * area).collect();
    if sampling == PixelSampling::Point {
        return flux;
    }
    let mut cells: Vec<Cell> = (0..centres.len())
        .filter(|&k| curvature_error(&flux, grid.pixels(), k) > tolerance)
        .map(|k| Cell { pixel: k, centre: centres[k], brightness: at_centre[k] })
        .collect();
    for cell in &cells {
        flux[cell.pixel] = 0.0;
    }
    for depth in 1..=DEEPEST {
        let quarter_width = grid.pixel_scale_arcsec() * 0.5f64.powi(depth as i32);
        let quarter_area = area * 0.25f64.powi(depth as i32);
        let allowed = tolerance * 0.5f64.powi(depth as i32);
        let quarters = quarter(scene, &cells, 0.5 * quarter_width);
        let mut unresolved = Vec::new();
        for (cell, four) in cells.iter().zip(quarters.chunks(4)) {
            let sum: f64 = four.iter().map(|q| q.brightness * quarter_area).sum();
            let correction = (sum - 4.0 * cell.brightness * quarter_area) / 3.0;
            if correction.abs() <= allowed || depth == DEEPEST {
                flux[cell.pixel] += sum + correction;
            } else {
                unresolved.extend_from_slice(four);
            }
        }
        cells = unresolved;
    }
    flux
}

/// Error of the midpoint rule, |I_xx + I_yy|Δ²/24, from the largest second differences in the 3×3 neighbourhood.
///
/// Pixels on the edge of the image are always integrated.
fn curvature_error(flux: &[f64], n: usize, k: usize) -> f64 {
    let (x, y) = (k % n, k / n);
    if x == 0 || y == 0 || x + 1 == n || y + 1 == n {
        return f64::INFINITY;
    }
    let second = |a: usize, b: usize, c: usize| (flux[a] - 2.0 * flux[b] + flux[c]).abs();
    let rows = [k - n, k, k + n].map(|m| second(m - 1, m, m + 1));
    let columns = [k - 1, k, k + 1].map(|m| second(m - n, m, m + n));
    let largest = |v: [f64; 3]| v.into_iter().fold(0.0, f64::max);
    (largest(rows) + largest(columns)) / 24.0
}

fn quarter(scene: &Scene, cells: &[Cell], offset: f64) -> Vec<Cell> {
    const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
    let centres: Vec<[f64; 2]> = cells
        .iter()
        .flat_map(|cell| {
            CORNERS.map(|[x, y]| [cell.centre[0] + x * offset, cell.centre[1] + y * offset])
        })
        .collect();
    let brightness = scene.surface_brightness(&centres);
    centres
        .into_iter()
        .zip(brightness)
        .enumerate()
        .map(|(i, (centre, brightness))| Cell { pixel: cells[i / 4].pixel, centre, brightness })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::{Mapping, Order, RayBundle};
    use crate::profile::light::{LightProfile, Sersic};

    struct Identity;

    impl Mapping for Identity {
        fn map(&self, theta: &[[f64; 2]], _: Order) -> RayBundle {
            RayBundle { beta_arcsec: theta.to_vec(), ..RayBundle::default() }
        }

        fn delay_days(&self, theta: &[[f64; 2]]) -> Vec<f64> {
            vec![0.0; theta.len()]
        }
    }

    #[test]
    fn adaptive_integration_meets_its_tolerance_where_the_centre_does_not() {
        // An exponential disc against 64×64 points a pixel, whose own error is below 1e-6 of the tolerance.
        let source = Sersic::with_flux(3.0, 0.25, 1.0, [0.1, -0.05], [0.013, 0.02]).unwrap();
        let scene = Scene { mapping: &Identity, source: &source, lens_light: None };
        let grid = SkyGrid::new(21, 0.08).unwrap();
        let tolerance = 1e-5;
        let got = integrate_pixels(&scene, &grid, PixelSampling::Adaptive, tolerance);
        let crude = integrate_pixels(&scene, &grid, PixelSampling::Point, tolerance);
        let (mut worst, mut worst_crude) = (0.0_f64, 0.0_f64);
        for (k, theta) in grid.theta_arcsec().into_iter().enumerate() {
            let fine = 64;
            let step = 0.08 / f64::from(fine);
            let mut sum = 0.0;
            for i in 0..fine * fine {
                let at = |c: f64, j: i32| c + (f64::from(j) - 0.5 * f64::from(fine - 1)) * step;
                sum += source.surface_brightness(at(theta[0], i % fine), at(theta[1], i / fine));
            }
            let want = sum * step * step;
            worst = worst.max((got[k] - want).abs());
            worst_crude = worst_crude.max((crude[k] - want).abs());
        }
        assert!(worst < 3.0 * tolerance, "{worst:e}");
        assert!(worst_crude > 30.0 * worst, "the test must be able to fail: {worst_crude:e}");
    }
}
