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
