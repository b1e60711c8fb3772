//! Where on the sky a point in the lens plane is seen.

/// Iterations of θ ← θ + c − x(θ); each gains a factor of the foreground's distortion, at least two where that is weak.
const ITERATIONS: usize = 60;
/// Distance from the point that counts as reached, arcsec.
pub(super) const REACHED_ARCSEC: f64 = 1e-12;

/// The direction whose ray meets its plane at `point`, where `position` is that of a ray by its direction, arcsec.
///
/// `None` where what lies in front deflects too strongly; of several directions one is found.
pub(super) fn direction_of(point: [f64; 2], position: impl Fn([f64; 2]) -> [f64; 2]) -> Option<[f64; 2]> {
    let mut theta = point;
    for _ in 0..ITERATIONS {
        let at = position(theta);
        let left = [point[0] - at[0], point[1] - at[1]];
        if left[0].hypot(left[1]) <= REACHED_ARCSEC {
            return Some(theta);
        }
        theta = [theta[0] + left[0], theta[1] + left[1]];
    }
    None
}
