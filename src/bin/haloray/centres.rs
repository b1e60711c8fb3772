//! Rays that meet the very centre of a lens, where derivatives may have no bound.

use haloray::Result;

use crate::summary::counted;
use crate::terminal::warn;

/// A point this near a centre is looked at, arcsec; profiles keep their numbers finite within 1e-9″ or less.
const NEAR_ARCSEC: f64 = 1e-8;
/// How far aside A is compared: far outside the floor of every profile, far inside every core that is one.
const ASIDE_ARCSEC: f64 = 1e-7;
/// Largest difference of elements of A, relative to them where they are above one, at a point that is no cusp.
const SAME: f64 = 1e-3;

/// Warns of points on the `centres` of lenses where A is another than a little aside: of cusps, not of cores, nor of centres
/// that the ray misses because nearer lenses bend it. `jacobian` is A at the points, `trace` gives it elsewhere.
pub fn warn_of_centres(
    points_arcsec: &[[f64; 2]],
    jacobian: &[[f64; 4]],
    centres_arcsec: &[[f64; 2]],
    trace: impl FnOnce(&[[f64; 2]]) -> Result<Vec<[f64; 4]>>,
) -> Result<()> {
    let mut points = points_on_centres(points_arcsec, centres_arcsec);
    if points.is_empty() {
        return Ok(());
    }
    let aside: Vec<[f64; 2]> =
        points.iter().map(|&i| [points_arcsec[i][0] + ASIDE_ARCSEC, points_arcsec[i][1]]).collect();
    let mut there = trace(&aside)?.into_iter();
    points.retain(|&i| {
        let there = there.next().unwrap_or(jacobian[i]);
        (0..4).any(|k| (there[k] - jacobian[i][k]).abs() > SAME * there[k].abs().max(1.0))
    });
    if let [first, ..] = points.as_slice() {
        let count = counted(points.len(), "ray meets", "rays meet");
        warn(format_args!(
            "{count} the centre of a lens (row {} first): derivatives there have no bound, and those written are of the profile's \
             innermost 1e-9 arcsec or less",
            first + 1
        ));
    }
    Ok(())
}

/// The points on a centre, counted from 0.
fn points_on_centres(points_arcsec: &[[f64; 2]], centres_arcsec: &[[f64; 2]]) -> Vec<usize> {
    let mut centres = centres_arcsec.to_vec();
    centres.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let is_on_one = |point: [f64; 2]| {
        let first = centres.partition_point(|centre| centre[0] < point[0] - NEAR_ARCSEC);
        let beside = centres[first..].iter().take_while(|centre| centre[0] <= point[0] + NEAR_ARCSEC);
        beside.into_iter().any(|centre| (centre[1] - point[1]).abs() <= NEAR_ARCSEC)
    };
    (0..points_arcsec.len()).filter(|&i| is_on_one(points_arcsec[i])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_points_on_a_centre_are_found() {
        let centres = [[0.5, 0.0], [-1.0, 2.0], [0.5, 1.0], [0.5, 0.0]];
        let points = [[0.5, 1.0], [0.5, 0.5], [0.5 + 5e-9, -5e-9], [-1.0 + 2e-8, 2.0], [3.0, 0.0]];
        assert_eq!(points_on_centres(&points, &centres), [0, 2]);
        assert!(points_on_centres(&points, &[]).is_empty());
    }
}
