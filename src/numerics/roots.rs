//! Root of a continuous function inside a bracket, by Chandrupatla's method.

/// Upper limit of iterations; bisection alone would need about 60 for a bracket of width one.
const ITERATIONS_MAX: usize = 200;

/// Root x of `function` between `low` and `high`, to within `tolerance` in x.
///
/// Inverse quadratic interpolation where it is safe, bisection elsewhere (Chandrupatla 1997,
/// Adv. Eng. Softw. 28, 145): it never leaves the bracket and takes about 8 evaluations on smooth
/// functions. `None` when the function has the same sign at both ends, or is not a number there.
///
/// ```
/// let root = haloray::numerics::roots::bracketed_root(|x| x * x - 2.0, 0.0, 2.0, 1e-14);
/// assert!((root.unwrap() - 2f64.sqrt()).abs() < 1e-13);
/// ```
pub fn bracketed_root(function: impl Fn(f64) -> f64, low: f64, high: f64, tolerance: f64) -> Option<f64> {
    let (mut older, mut newer) = (high, low);
    let (mut f_older, mut f_newer) = (function(older), function(newer));
    if f_newer == 0.0 {
        return Some(newer);
    }
    if f_older == 0.0 {
        return Some(older);
    }
    if f_older.is_nan() || f_newer.is_nan() || (f_older > 0.0) == (f_newer > 0.0) {
        return None;
    }
    let mut fraction = 0.5;
    for _ in 0..ITERATIONS_MAX {
        let x = newer + fraction * (older - newer);
        let f = function(x);
        // The replaced point stays at hand as the third point of the interpolation.
        let (third, f_third) = if (f > 0.0) == (f_newer > 0.0) {
            (newer, f_newer)
        } else {
            let third = (older, f_older);
            (older, f_older) = (newer, f_newer);
            third
        };
        (newer, f_newer) = (x, f);
        let best = if f_newer.abs() < f_older.abs() { newer } else { older };
        let width = (older - newer).abs();
        let resolution = 2.0 * f64::EPSILON * best.abs() + 0.5 * tolerance;
        if f_newer == 0.0 || width <= 2.0 * resolution {
            return Some(best);
        }
        let (xi, phi) = ((newer - older) / (third - older), (f_newer - f_older) / (f_third - f_older));
        let interpolate = phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi;
        let guess = if interpolate {
            f_newer / (f_older - f_newer) * f_third / (f_older - f_third)
                + (third - newer) / (older - newer) * f_newer / (f_third - f_newer) * f_older
                    / (f_third - f_older)
        } else {
            0.5
        };
        let margin = resolution / width;
        fraction = guess.clamp(margin, 1.0 - margin);
    }
    Some(newer)
}
