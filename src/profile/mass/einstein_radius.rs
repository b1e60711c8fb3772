//! The Einstein radius of any lens: the circle of mean convergence one.

use std::f64::consts::TAU;

use super::{MassModel, MassProfile};
use crate::numerics::roots::bracketed_root;

/// Radii searched, arcsec, from the largest inwards.
const LARGEST_RADIUS_ARCSEC: f64 = 1e4;
/// Below this radius a circle of mean convergence one is no Einstein ring that anything could see.
const SMALLEST_RADIUS_ARCSEC: f64 = 1e-6;
/// Circles tried a decade of radius.
const CIRCLES_PER_DECADE: f64 = 48.0;
/// Relative change of the mean deflection at which doubling the points on a circle ends.
const CONVERGED: f64 = 1e-13;
/// Points on a circle, at least and at most; lenses whose centres lie on the circle reach the limit.
const POINTS: [usize; 2] = [32, 8192];
/// The root is found to this fraction of the radius.
const ROOT_TOLERANCE: f64 = 1e-14;

/// Mean convergence inside the circle of `radius_arcsec` about `centre_arcsec`.
///
/// By Gauss κ̄(R) = (1/πR²)∫κ d²θ = (1/2πR)∮α·n dφ, exact for any lens. The trapezium rule on the circle is spectral;
/// the points double until the mean no longer changes.
pub fn mean_convergence(lenses: &[MassModel], centre_arcsec: [f64; 2], radius_arcsec: f64) -> f64 {
    let sum = |n: usize, shift: f64| -> f64 {
        let at = |i: usize| {
            let (sin, cos) = ((i as f64 + shift) / n as f64 * TAU).sin_cos();
            let (x, y) = (centre_arcsec[0] + radius_arcsec * cos, centre_arcsec[1] + radius_arcsec * sin);
            lenses.iter().map(|lens| lens.deflection(x, y)).map(|[ax, ay]| ax * cos + ay * sin).sum::<f64>()
        };
        (0..n).map(at).sum()
    };
    let mut n = POINTS[0];
    let mut total = sum(n, 0.0);
    while n < POINTS[1] {
        let between = sum(n, 0.5);
        let change = (between - total).abs();
        let largest = between.abs().max(total.abs());
        total += between;
        n *= 2;
        if change <= CONVERGED * largest {
            break;
        }
    }
    total / (n as f64 * radius_arcsec)
}

/// Einstein radius in arcsec: the largest circle about `centre_arcsec` whose mean convergence falls through one.
///
/// For a round lens this is the radius of its Einstein ring. For any other it is the usual circular definition (as
/// lenstronomy's `effective_einstein_radius`, which sums pixels); an elliptical power law has a slightly different one
/// than its `einstein_radius_arcsec`, which is √(area/π) of its *ellipse* of mean convergence one; √(area/π) inside the
/// tangential critical curve is [`crate::diagnostics::CriticalCurves::einstein_radius_arcsec`], the same for every
/// isothermal ellipsoid. Shear does not enter, a convergence sheet does.
///
/// `None` when there is no such circle between 1e-6″ and 1e4″: a lens too weak, or a sheet of κ ≥ 1.
///
/// ```
/// use haloray::profile::mass::{Epl, MassModel, einstein_radius_arcsec};
/// let lens = MassModel::Epl(Epl::new(1.3, 2.4, [0.0, 0.0], [0.2, 0.1]).unwrap());
/// assert!((einstein_radius_arcsec(&[lens], [0.2, 0.1]).unwrap() - 1.3).abs() < 1e-12);
/// ```
pub fn einstein_radius_arcsec(lenses: &[MassModel], centre_arcsec: [f64; 2]) -> Option<f64> {
    let excess = |ln_radius: f64| mean_convergence(lenses, centre_arcsec, ln_radius.exp()) - 1.0;
    let (low, high) = (SMALLEST_RADIUS_ARCSEC.ln(), LARGEST_RADIUS_ARCSEC.ln());
    let circles = ((high - low) / std::f64::consts::LN_10 * CIRCLES_PER_DECADE).ceil();
    let step = (high - low) / circles;
    let mut outer = high;
    if excess(outer) >= 0.0 {
        return None;
    }
    while outer > low {
        let inner = outer - step;
        if excess(inner) >= 0.0 {
            return bracketed_root(excess, inner, outer, ROOT_TOLERANCE).map(f64::exp);
        }
        outer = inner;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::mass::{Epl, External, Nfw, PointMass, SersicMass};

    fn epl(theta_e: f64, slope: f64, e: [f64; 2]) -> MassModel {
        MassModel::Epl(Epl::new(theta_e, slope, e, [0.0, 0.0]).unwrap())
    }

    fn sheet(kappa: f64, shear: [f64; 2]) -> MassModel {
        MassModel::External(External::new(kappa, shear, [0.0; 4], [0.0; 2]).unwrap())
    }

    #[test]
    fn round_lenses_have_the_radius_of_their_ring() {
        for slope in [1.1, 2.0, 2.9] {
            assert!(
                (einstein_radius_arcsec(&[epl(1.3, slope, [0.0; 2])], [0.0; 2]).unwrap() - 1.3).abs() < 1e-12
            );
        }
        let point = MassModel::PointMass(PointMass::new(0.7, [0.0; 2]).unwrap());
        assert!((einstein_radius_arcsec(&[point], [0.0; 2]).unwrap() - 0.7).abs() < 1e-13);
    }

    #[test]
    fn a_sheet_scales_an_isothermal_sphere_and_shear_does_nothing() {
        let lenses = [epl(1.0, 2.0, [0.0; 2]), sheet(0.2, [0.1, -0.05])];
        assert!((einstein_radius_arcsec(&lenses, [0.0; 2]).unwrap() - 1.25).abs() < 1e-12);
    }

    #[test]
    fn an_isothermal_ellipsoid_has_the_mean_of_its_convergence_over_angle() {
        // κ̄(R) = θ_E/R · ⟨(q cos² + sin²/q)^(−1/2)⟩ over the circle.
        let e = 0.2_f64;
        let q = (1.0 - e) / (1.0 + e);
        let n = 400;
        let mean: f64 = (0..n)
            .map(|i| (i as f64 / n as f64 * TAU).sin_cos())
            .map(|(s, c)| (q * c * c + s * s / q).sqrt().recip())
            .sum::<f64>()
            / n as f64;
        let got = einstein_radius_arcsec(&[epl(1.2, 2.0, [0.0, e])], [0.0; 2]).unwrap();
        assert!((got - 1.2 * mean).abs() < 1e-12, "{got}");
    }

    #[test]
    fn a_composite_lens_has_its_outermost_circle() {
        let halo = MassModel::Nfw(Nfw::new(8.0, 1.5, [0.0; 2]).unwrap());
        let stars = SersicMass::new(0.4, 0.8, 4.0, [0.0; 2]).unwrap();
        let stars = MassModel::Sersic(stars.with_elliptical_potential([0.1, 0.05]).unwrap());
        let both = [halo, stars.clone()];
        let radius = einstein_radius_arcsec(&both, [0.0; 2]).unwrap();
        assert!((mean_convergence(&both, [0.0; 2], radius) - 1.0).abs() < 1e-12);
        assert!(radius > einstein_radius_arcsec(&[stars], [0.0; 2]).unwrap());
        // A heavy ring of satellites gives a second, larger circle.
        let far = |x: f64| MassModel::PointMass(PointMass::new(6.0, [x, 0.0]).unwrap());
        let radius =
            einstein_radius_arcsec(&[epl(1.0, 2.0, [0.0; 2]), far(5.0), far(-5.0)], [0.0; 2]).unwrap();
        assert!((radius - (0.5 + (0.25_f64 + 72.0).sqrt())).abs() < 1e-9, "{radius}");
    }

    #[test]
    fn none_is_said_where_there_is_none() {
        assert_eq!(einstein_radius_arcsec(&[], [0.0; 2]), None);
        assert_eq!(einstein_radius_arcsec(&[sheet(0.3, [0.0; 2])], [0.0; 2]), None);
        assert_eq!(einstein_radius_arcsec(&[epl(1.0, 2.0, [0.0; 2]), sheet(1.1, [0.0; 2])], [0.0; 2]), None);
        assert_eq!(einstein_radius_arcsec(&[epl(0.0, 2.0, [0.0; 2])], [0.0; 2]), None);
    }
}
