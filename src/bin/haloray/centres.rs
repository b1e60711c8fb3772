//! Points that lie on the centre of a lens, where derivatives may have no bound.

/// A point this near a centre lies on it, arcsec; profiles keep their numbers finite within 1e-9″ or less.
const NEAR_ARCSEC: f64 = 1e-8;

/// The points on a centre, counted from 0.
pub fn points_on_centres(points_arcsec: &[[f64; 2]], centres_arcsec: &[[f64; 2]]) -> Vec<usize> {
    let mut centres = centres_arcsec.to_vec();
    centres.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let is_on_one = |point: [f64; 2]| {
        let first = centres.partition_point(|centre| centre[0] < point[0] - NEAR_ARCSEC);
        let beside = centres[first..].iter().take_while(|centre| centre[0] <= point[0] + NEAR_ARCSEC);
        beside.into_iter().any(|centre| (centre[1] - point[1]).abs() <= NEAR_ARCSEC)
    };
    (0..points_arcsec.len()).filter(|&i| is_on_one(points_arcsec[i])).collect()
}

/// Warns of them.
pub fn warn_of_centres(points: &[usize]) {
    if let [first, ..] = points {
        let count = crate::summary::counted(points.len(), "point lies", "points lie");
        crate::terminal::warn(format_args!(
            "{count} on the centre of a lens (row {} first): derivatives there have no bound, and those written are of the \
             profile's innermost 1e-9 arcsec or less",
            first + 1
        ));
    }
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
