//! Critical curves and caustics of any mapping, as ordered polylines.

use super::critical_mesh::{Chain, SMALLEST_ARCSEC, chains};
use super::sky_window::SkyWindow;
use crate::error::Result;
use crate::mapping::Mapping;
use crate::monitor::Monitor;

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
    fn of(chain: &Chain) -> Self {
        let trace: f64 = chain.vertices.iter().map(|v| v.trace.signum()).sum();
        Self {
            kind: if trace >= 0.0 { CurveKind::Tangential } else { CurveKind::Radial },
            closed: chain.closed,
            theta_arcsec: chain.vertices.iter().map(|v| v.theta).collect(),
            beta_arcsec: chain.vertices.iter().map(|v| v.beta).collect(),
        }
    }

    /// False for what is smaller than the smallest triangles about a lens centre, as softened poles are.
    fn is_drawn(&self) -> bool {
        let [x, y] = self.theta_arcsec[0];
        self.theta_arcsec.iter().any(|p| (p[0] - x).hypot(p[1] - y) > 0.1 * SMALLEST_ARCSEC)
    }

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
    /// The contours of a mesh of triangles, four cells for each cell of the window (at most 512 a side) to begin with, that
    /// is refined about lens centres (down to 1e-5″), where a curve bends or another is near, and where an island may
    /// hide (`critical_mesh`): no curve ends but at the edge of the window or in a pole, and none is there twice. On
    /// each side that a curve crosses the zero of det A is bracketed to rounding (`critical_points`). Tangential
    /// and radial curves are told apart by the eigenvalue that is left, tr A: 2γ on the one, −2γ on the other. The jump
    /// of an isothermal or the pole of a steeper lens at its centre is no critical curve and has no caustic here.
    ///
    /// # Errors
    /// When `monitor`, which is told of every ray, cancels.
    pub fn of(mapping: &(impl Mapping + ?Sized), window: &SkyWindow, monitor: &dyn Monitor) -> Result<Self> {
        let chains = chains(mapping, window, monitor)?;
        let mut curves: Vec<CriticalCurve> =
            chains.iter().map(CriticalCurve::of).filter(|curve| !curve.closed || curve.is_drawn()).collect();
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
            assert!((x.hypot(*y) - r).abs() < 1e-10, "{phi}");
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
    fn a_point_mass_has_its_ring_alone() {
        use crate::profile::mass::PointMass;
        for centre in [[0.0, 0.0], [0.13, -0.21]] {
            let (found, _) =
                curves(vec![MassModel::PointMass(PointMass::new(1.0, centre).unwrap()), shear(0.02)]);
            assert_eq!(found.curves.len(), 1, "{found:?}");
        }
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
        for i in (0..n).step_by(n / 40) {
            let (a, b) = (curve.beta_arcsec[i], curve.beta_arcsec[(i + 1) % n]);
            let along = [b[0] - a[0], b[1] - a[1]];
            let length = along[0].hypot(along[1]);
            // Leave out the neighbourhood of the cusps, where the caustic turns.
            if length < 4e-3 {
                continue;
            }
            let across = [-1e-4 * along[1] / length, 1e-4 * along[0] / length];
            let count = |sign: f64| {
                let found = PointImages::of(&lens, &window, [0, 1].map(|c| a[c] + sign * across[c]), &Silent)
                    .unwrap();
                assert!(found.is_complete(), "{found:?}");
                found.images.len() as i64
            };
            assert_eq!((count(1.0) - count(-1.0)).abs(), 2, "vertex {i}");
            tried += 1;
        }
        assert!(tried >= 4, "{tried}");
    }
}
