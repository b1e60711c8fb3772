//! Critical curves and caustics of any mapping, as ordered polylines.

use super::sky_window::SkyWindow;
use crate::error::Result;
use crate::mapping::{Mapping, Order, RayBundle};
use crate::monitor::Monitor;
use crate::numerics::contour::{Contour, zero_contours};

/// Vertices lie this close to det A = 0, arcsec.
const ACCURACY_ARCSEC: f64 = 1e-10;
/// Newton steps along the gradient.
const NEWTON_STEPS: usize = 8;
/// Halvings of a grid edge for the vertices that Newton's method loses.
const BISECTIONS: usize = 48;
/// Cells a side of the first grid for every cell of the window, and of the nested grids.
const CELLS_PER_WINDOW_CELL: usize = 4;
const NESTED_CELLS: usize = 48;
/// A closed curve less wide than this many cells is traced again on a grid of its own.
const CELLS_ACROSS: f64 = 12.0;
/// Half width of the innermost nested grid about a lens centre, arcsec; smaller radial curves are not drawn.
const SMALLEST_HALF_ARCSEC: f64 = 1e-5;
/// Each nested grid is narrower than the one before by this factor.
const NESTING: f64 = 6.0;

/// Which eigenvalue of A vanishes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveKind {
    /// 1 − κ − γ = 0: images are stretched along the curve.
    Tangential,
    /// 1 − κ + γ = 0: images are stretched across the curve.
    Radial,
}

impl CurveKind {
    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tangential => "tangential",
            Self::Radial => "radial",
        }
    }
}

/// One critical curve with its caustic, point by point.
#[derive(Debug, Clone, PartialEq)]
pub struct CriticalCurve {
    /// Which eigenvalue vanishes.
    pub kind: CurveKind,
    /// False where the curve leaves the window. The first point of a closed curve is not repeated at its end.
    pub closed: bool,
    /// The critical curve, det A = 0, in arcsec; det A > 0 on the left.
    pub theta_arcsec: Vec<[f64; 2]>,
    /// The caustic: its image under β.
    pub beta_arcsec: Vec<[f64; 2]>,
}

impl CriticalCurve {
    /// Area inside the critical curve in arcsec²; an open one is closed by a straight line.
    pub fn area_arcsec2(&self) -> f64 {
        let next = self.theta_arcsec.iter().cycle().skip(1);
        let twice: f64 = self.theta_arcsec.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
        0.5 * twice.abs()
    }
}

/// All critical curves of a mapping inside a window.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CriticalCurves {
    /// The curves, largest first.
    pub curves: Vec<CriticalCurve>,
}

impl CriticalCurves {
    /// Traces det A = 0 in the window.
    ///
    /// Marching squares on a grid of four cells for each cell of the window, nested grids about the lens centres (down
    /// to 1e-5″) and about every curve less than 12 cells wide; each vertex is then moved along the gradient of det A
    /// by Newton's method, or bisected along its grid edge, until it is within 1e-10″ of the curve. Tangential and
    /// radial curves are told apart by the eigenvalue that is left, tr A: 2γ on the one, −2γ on the other. The jump of
    /// an isothermal or the pole of a steeper lens at its centre is no critical curve and has no caustic here.
    ///
    /// # Errors
    /// When `monitor`, which is told of every ray, cancels.
    pub fn of(mapping: &(impl Mapping + ?Sized), window: &SkyWindow, monitor: &dyn Monitor) -> Result<Self> {
        let first = Grid {
            centre: window.centre_arcsec,
            half: window.half_width_arcsec,
            cells: CELLS_PER_WINDOW_CELL * window.cells,
        };
        let mut curves = first.curves(mapping, monitor)?;
        for &centre in window.lens_centres_arcsec.iter().filter(|&&c| window.contains(c)) {
            let mut half = CELLS_ACROSS * first.cell();
            while half >= SMALLEST_HALF_ARCSEC {
                refine(&mut curves, mapping, Grid { centre, half, cells: NESTED_CELLS }, monitor)?;
                half /= NESTING;
            }
        }
        let small: Vec<Grid> = curves.iter().filter_map(|(curve, cell)| own_grid(curve, *cell)).collect();
        for grid in small {
            refine(&mut curves, mapping, grid, monitor)?;
        }
        let mut curves: Vec<CriticalCurve> = curves.into_iter().map(|(curve, _)| curve).collect();
        curves.sort_by(|a, b| b.area_arcsec2().total_cmp(&a.area_arcsec2()));
        Ok(Self { curves })
    }

    /// The same curves with caustics counted from `origin_arcsec` in the source plane.
    pub fn about(&self, origin_arcsec: [f64; 2]) -> Self {
        let mut curves = self.clone();
        for beta in curves.curves.iter_mut().flat_map(|curve| &mut curve.beta_arcsec) {
            *beta = [beta[0] - origin_arcsec[0], beta[1] - origin_arcsec[1]];
        }
        curves
    }

    /// √(area/π) inside the tangential critical curves, arcsec; `None` where none is closed.
    ///
    /// For an isothermal ellipsoid this is its Einstein radius, whatever its ellipticity; shear and line of sight enter.
    pub fn einstein_radius_arcsec(&self) -> Option<f64> {
        let tangential = self.curves.iter().filter(|c| c.closed && c.kind == CurveKind::Tangential);
        let area: f64 = tangential.map(CriticalCurve::area_arcsec2).sum();
        (area > 0.0).then(|| (area / std::f64::consts::PI).sqrt())
    }
}

/// Smallest box around a curve: middle and half of the longer side.
fn bounds(curve: &CriticalCurve) -> ([f64; 2], f64) {
    let range = |c: usize| {
        let values = curve.theta_arcsec.iter().map(|p| p[c]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let (x, y) = (range(0), range(1));
    ([0.5 * (x.0 + x.1), 0.5 * (y.0 + y.1)], 0.5 * (x.1 - x.0).max(y.1 - y.0))
}

/// A grid of its own for a closed curve that is too small for the one it was found on.
fn own_grid(curve: &CriticalCurve, cell: f64) -> Option<Grid> {
    let (centre, half) = bounds(curve);
    let poor = curve.closed && 2.0 * half < CELLS_ACROSS * cell;
    poor.then(|| Grid { centre, half: 1.5 * half.max(cell), cells: NESTED_CELLS })
}

/// Replaces the closed curves inside `grid` by those traced on it, which are finer.
fn refine(
    curves: &mut Vec<(CriticalCurve, f64)>,
    mapping: &(impl Mapping + ?Sized),
    grid: Grid,
    monitor: &dyn Monitor,
) -> Result<()> {
    let finer: Vec<_> =
        grid.curves(mapping, monitor)?.into_iter().filter(|(curve, _)| curve.closed).collect();
    let inside = |curve: &CriticalCurve| {
        let (centre, half) = bounds(curve);
        let margin = grid.half - 2.0 * grid.cell();
        curve.closed && (0..2).all(|c| (centre[c] - grid.centre[c]).abs() + half <= margin)
    };
    curves.retain(|(curve, cell)| *cell <= grid.cell() || !inside(curve));
    curves.extend(finer.into_iter().filter(|(curve, _)| inside(curve)));
    Ok(())
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

    /// The curves on this grid, each with the width of a cell.
    fn curves(
        &self,
        mapping: &(impl Mapping + ?Sized),
        monitor: &dyn Monitor,
    ) -> Result<Vec<(CriticalCurve, f64)>> {
        let n = self.cells + 1;
        let theta: Vec<[f64; 2]> = (0..n * n).map(|k| self.node(k)).collect();
        let rays = mapping.trace(&theta, Order::Jacobian, monitor)?;
        let values: Vec<f64> = rays.jacobian.iter().map(determinant).collect();
        let contours = zero_contours(&values, n, n);
        let curve = |contour: Contour| {
            let edges: Vec<[[f64; 2]; 2]> =
                contour.crossings.iter().map(|&[a, b]| [self.node(a), self.node(b)]).collect();
            let starts = contour.crossings.iter().map(|&[a, b]| {
                let (p, q, u, v) = (self.node(a), self.node(b), values[a], values[b]);
                let t = u / (u - v);
                [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]
            });
            let theta_arcsec = onto_curve(mapping, starts.collect(), &edges, self.cell(), monitor)?;
            let rays = mapping.trace(&theta_arcsec, Order::Jacobian, monitor)?;
            let trace: f64 = rays.jacobian.iter().map(|a| (a[0] + a[3]).signum()).sum();
            let kind = if trace >= 0.0 { CurveKind::Tangential } else { CurveKind::Radial };
            let curve =
                CriticalCurve { kind, closed: contour.closed, theta_arcsec, beta_arcsec: rays.beta_arcsec };
            Ok((curve, self.cell()))
        };
        contours.into_iter().map(curve).collect()
    }
}

fn determinant(a: &[f64; 4]) -> f64 {
    a[0] * a[3] - a[1] * a[2]
}

/// ∇ det A from A and its derivatives.
fn gradient(rays: &RayBundle, i: usize) -> [f64; 2] {
    let ([xx, xy, yx, yy], b) = (rays.jacobian[i], rays.second_per_arcsec[i]);
    let [b_xxx, b_xxy, b_xyy, b_yxx, b_yxy, b_yyy] = b;
    [b_xxx * yy + xx * b_yxy - b_xxy * yx - xy * b_yxx, b_xxy * yy + xx * b_yyy - b_xyy * yx - xy * b_yxy]
}

/// Moves points onto det A = 0: θ ← θ − det A·∇/|∇|² where that stays within a cell, else bisection along the edge.
fn onto_curve(
    mapping: &(impl Mapping + ?Sized),
    starts: Vec<[f64; 2]>,
    edges: &[[[f64; 2]; 2]],
    cell: f64,
    monitor: &dyn Monitor,
) -> Result<Vec<[f64; 2]>> {
    let mut theta = starts.clone();
    let mut done = vec![false; theta.len()];
    for _ in 0..NEWTON_STEPS {
        let active: Vec<usize> = (0..theta.len()).filter(|&i| !done[i]).collect();
        if active.is_empty() {
            return Ok(theta);
        }
        let at: Vec<[f64; 2]> = active.iter().map(|&i| theta[i]).collect();
        let rays = mapping.trace(&at, Order::SecondDerivatives, monitor)?;
        for (k, &i) in active.iter().enumerate() {
            let (det, [gx, gy]) = (determinant(&rays.jacobian[k]), gradient(&rays, k));
            let step = det / (gx * gx + gy * gy);
            theta[i] = [theta[i][0] - step * gx, theta[i][1] - step * gy];
            // Quadratic convergence: the step after one of √accuracy is below the accuracy.
            done[i] = (step * gx.hypot(gy)).abs() <= ACCURACY_ARCSEC;
        }
    }
    let drift = |i: usize| (theta[i][0] - starts[i][0]).hypot(theta[i][1] - starts[i][1]);
    let lost: Vec<usize> = (0..theta.len()).filter(|&i| !(done[i] && drift(i) <= cell)).collect();
    let mut ends: Vec<[[f64; 2]; 2]> = lost.iter().map(|&i| edges[i]).collect();
    for _ in 0..BISECTIONS {
        if ends.is_empty() {
            break;
        }
        let middle: Vec<[f64; 2]> =
            ends.iter().map(|[a, b]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]).collect();
        let rays = mapping.trace(&middle, Order::Jacobian, monitor)?;
        for ((end, middle), a) in ends.iter_mut().zip(middle).zip(&rays.jacobian) {
            end[usize::from(determinant(a) >= 0.0)] = middle;
        }
    }
    for (&i, [a, b]) in lost.iter().zip(&ends) {
        theta[i] = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
    }
    Ok(theta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mapping::tidal::{LineOfSightModel, TidalLens};
    use crate::monitor::Silent;
    use crate::profile::mass::{Epl, External, MassModel, MassProfile, Nfw, SersicMass};

    fn curves(lenses: Vec<MassModel>) -> (CriticalCurves, TidalLens) {
        let lens = TidalLens::new(LineOfSightModel::EMPTY, lenses);
        let window = SkyWindow::about_axis(3.0, lens.lens_centres_arcsec()).unwrap();
        (CriticalCurves::of(&lens, &window, &Silent).unwrap(), lens)
    }

    fn epl(slope: f64, e: [f64; 2]) -> MassModel {
        MassModel::Epl(Epl::new(1.0, slope, e, [0.0; 2]).unwrap())
    }

    fn shear(gamma: f64) -> MassModel {
        MassModel::External(External::new(0.0, [gamma, 0.0], [0.0; 4], [0.0; 2]).unwrap())
    }

    #[test]
    fn sheared_isothermal_sphere_has_one_curve_and_an_astroid() {
        let gamma = 0.1;
        let (found, _) = curves(vec![epl(2.0, [0.0; 2]), shear(gamma)]);
        assert_eq!(found.curves.len(), 1, "{:?}", found.curves.iter().map(|c| c.kind).collect::<Vec<_>>());
        let curve = &found.curves[0];
        assert!(curve.closed && curve.kind == CurveKind::Tangential);
        for [x, y] in &curve.theta_arcsec {
            let phi = y.atan2(*x);
            let r = (1.0 - gamma * (2.0 * phi).cos()) / (1.0 - gamma * gamma);
            assert!((x.hypot(*y) - r).abs() < ACCURACY_ARCSEC, "{phi}");
        }
        // Cusps on the axes at 2γ/(1 + γ) and 2γ/(1 − γ), approached to second order in the spacing.
        let reach = |c: usize| curve.beta_arcsec.iter().map(|b| b[c].abs()).fold(0.0, f64::max);
        assert!((reach(0) - 2.0 * gamma / (1.0 + gamma)).abs() < 2e-3, "{}", reach(0));
        assert!((reach(1) - 2.0 * gamma / (1.0 - gamma)).abs() < 2e-3, "{}", reach(1));
    }

    #[test]
    fn an_isothermal_ellipsoid_encloses_the_area_of_its_einstein_radius() {
        for e in [[0.0, 0.0], [0.1, 0.1], [0.0, -0.3]] {
            let (found, _) = curves(vec![epl(2.0, e)]);
            // A polygon of n vertices on the curve lacks about 2π²/3n² of the area.
            let radius = found.einstein_radius_arcsec().unwrap();
            assert!((radius - 1.0).abs() < 2e-4, "{radius}");
            assert_eq!(found.curves.len(), 1);
        }
    }

    #[test]
    fn an_nfw_lens_has_its_radial_curve() {
        let nfw = Nfw::new(3.0, 1.5, [0.2, -0.1]).unwrap();
        let (found, _) = curves(vec![MassModel::Nfw(nfw)]);
        assert_eq!(found.curves.len(), 2);
        let radial = found.curves.iter().find(|c| c.kind == CurveKind::Radial).unwrap();
        let tangential = found.curves.iter().find(|c| c.kind == CurveKind::Tangential).unwrap();
        let radius = |p: &[f64; 2]| (p[0] - 0.2).hypot(p[1] + 0.1);
        let along = |r: f64| nfw.deflection(0.2 + r, -0.1)[0];
        for p in &radial.theta_arcsec {
            assert!((nfw.hessian(0.2 + radius(p), -0.1)[0] - 1.0).abs() < 1e-9);
        }
        for p in &tangential.theta_arcsec {
            assert!((along(radius(p)) / radius(p) - 1.0).abs() < 1e-9);
        }
        // The tangential caustic of a round lens is a point.
        assert!(tangential.beta_arcsec.iter().all(|b| (b[0] - 0.2).hypot(b[1] + 0.1) < 1e-9));
    }

    #[test]
    fn a_tiny_radial_curve_is_found_at_the_centre() {
        // Round, t = slope − 1, θ_E = 1: α = r^(1−t), so dα/dr = 1 at r = (1 − t)^(1/t).
        for (slope, number) in [(1.5, 2), (1.9, 2), (1.98, 2), (2.4, 1)] {
            let t: f64 = slope - 1.0;
            let (found, _) = curves(vec![epl(slope, [0.0; 2])]);
            let radial: Vec<_> = found.curves.iter().filter(|c| c.kind == CurveKind::Radial).collect();
            assert_eq!(found.curves.len(), number, "slope {slope}");
            for p in radial.iter().flat_map(|c| &c.theta_arcsec) {
                let want = (1.0 - t).powf(1.0 / t);
                assert!((p[0].hypot(p[1]) / want - 1.0).abs() < 1e-6, "slope {slope}: {p:?} {want}");
            }
        }
    }

    #[test]
    fn caustics_are_where_the_number_of_images_changes() {
        use crate::diagnostics::PointImages;
        let stars = SersicMass::new(0.5, 0.7, 3.0, [0.0; 2]).unwrap().with_elliptical_potential([0.1, 0.0]);
        let halo = MassModel::Nfw(Nfw::new(6.0, 1.2, [0.0; 2]).unwrap());
        let (found, lens) = curves(vec![MassModel::Sersic(stars.unwrap()), halo, shear(0.05)]);
        let window = SkyWindow::about_axis(3.0, lens.lens_centres_arcsec()).unwrap();
        let curve = found.curves.iter().find(|c| c.kind == CurveKind::Tangential).unwrap();
        let n = curve.beta_arcsec.len();
        let mut tried = 0;
        for i in (0..n).step_by(n / 12) {
            let (a, b) = (curve.beta_arcsec[i], curve.beta_arcsec[(i + 1) % n]);
            let along = [b[0] - a[0], b[1] - a[1]];
            let length = along[0].hypot(along[1]);
            // Leave out the neighbourhood of the cusps, where the caustic turns.
            if length < 4e-3 {
                continue;
            }
            let across = [-1e-4 * along[1] / length, 1e-4 * along[0] / length];
            let count = |sign: f64| {
                let found =
                    PointImages::of(&lens, &window, [a[0] + sign * across[0], a[1] + sign * across[1]]);
                assert!(found.is_complete(), "{found:?}");
                found.images.len() as i64
            };
            assert_eq!((count(1.0) - count(-1.0)).abs(), 2, "vertex {i}");
            tried += 1;
        }
        assert!(tried >= 4, "{tried}");
    }
}
