//! Which points are nearest to another, in vector lanes: among thousands, in a few dimensions.

use crate::numerics::dispatch::kernel;

kernel! {
    /// The `count` points nearest to x and their squared distances, the nearest first; `points` holds all
    /// first coordinates, then all second ones, and so on.
    pub(super) fn nearest(points: &[f64], x: &[f64], count: usize) -> Vec<(usize, f64)> {
        /// Distances taken at once; mostly none of so many is small enough.
        const TOGETHER: usize = 64;
        let n = points.len() / x.len();
        let mut nearest: Vec<(usize, f64)> = Vec::with_capacity(count + 1);
        let mut farthest = f64::INFINITY;
        for start in (0..n).step_by(TOGETHER) {
            let end = (start + TOGETHER).min(n);
            let mut squared = [0.0; TOGETHER];
            let squared = &mut squared[..end - start];
            for (coordinates, x) in points.chunks_exact(n).zip(x) {
                for (squared, coordinate) in squared.iter_mut().zip(&coordinates[start..end]) {
                    *squared += (coordinate - x) * (coordinate - x);
                }
            }
            if !squared.iter().fold(false, |any, squared| any | (*squared < farthest)) {
                continue;
            }
            for (i, squared) in (start..).zip(squared.iter().copied()) {
                if squared < farthest {
                    nearest.insert(nearest.partition_point(|(_, nearer)| *nearer <= squared), (i, squared));
                    nearest.truncate(count);
                    farthest = nearest.get(count - 1).map_or(f64::INFINITY, |last| last.1);
                }
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_are_those_that_sorting_finds() {
        let (n, x) = (1000, [0.3, -0.2, 0.1]);
        let points: Vec<f64> = (0..3 * n).map(|i| (0.7 * f64::from(i)).sin()).collect();
        let squared = |i: usize| (0..3).map(|c| (points[c * 1000 + i] - x[c]).powi(2)).sum::<f64>();
        let mut sorted: Vec<(usize, f64)> = (0..1000).map(|i| (i, squared(i))).collect();
        sorted.sort_by(|a, b| a.1.total_cmp(&b.1));
        assert_eq!(nearest(&points, &x, 17), sorted[..17]);
        assert_eq!(nearest(&points[..9], &x, 17).len(), 3);
    }
}
