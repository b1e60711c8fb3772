//! Which points are nearest to another, in vector lanes: among thousands, in a few dimensions.

use nalgebra::DVector;

use crate::numerics::dispatch::kernel;

/// The points that can be among the nearest to others about a centre: along a trajectory all are searched only where it leaves
/// the vicinity (Verlet 1967, Phys. Rev. 159, 98).
#[derive(Debug, Clone)]
pub(super) struct Vicinity {
    centre: DVector<f64>,
    /// All points nearer to the centre are in it.
    reach: f64,
    /// Which of all points are in it, and where they are, as in [`nearest`].
    members: Vec<usize>,
    points: Vec<f64>,
    /// Which members were nearest last.
    last: Vec<usize>,
}

impl Vicinity {
    /// Of nowhere.
    pub fn empty() -> Self {
        Self { centre: DVector::zeros(0), reach: 0.0, members: vec![], points: vec![], last: vec![] }
    }

    /// The `count` points nearest to y, as [`nearest`] finds them.
    pub fn nearest(&mut self, points: &[f64], y: &DVector<f64>, count: usize) -> Vec<(usize, f64)> {
        /// How much farther the vicinity reaches than the farthest of the nearest.
        const SKIN: f64 = 1.5;
        const ROUNDING: f64 = 1e-9;
        if self.centre.len() == y.len() {
            // No farther than the farthest of those that were nearest before.
            let bound = self.last.iter().map(|member| self.squared_distance(*member, y)).fold(0.0, f64::max);
            let moved = (y - &self.centre).norm();
            if bound.sqrt() + moved < (1.0 - ROUNDING) * self.reach {
                let above = (1.0 + ROUNDING) * bound + f64::MIN_POSITIVE;
                let mut near = nearest(&self.points, y.as_slice(), count, above);
                self.last = near.iter().map(|(member, _)| *member).collect();
                near.iter_mut().for_each(|(member, _)| *member = self.members[*member]);
                return near;
            }
        }
        let near = nearest(points, y.as_slice(), count, f64::INFINITY);
        self.reach = near.last().map_or(0.0, |last| SKIN * last.1.sqrt());
        self.centre = y.clone();
        self.members = within(points, y.as_slice(), self.reach * self.reach);
        self.points.clear();
        for coordinates in points.chunks_exact(points.len() / y.len()) {
            self.points.extend(self.members.iter().map(|member| coordinates[*member]));
        }
        self.last = near.iter().filter_map(|(point, _)| self.members.binary_search(point).ok()).collect();
        near
    }

    fn squared_distance(&self, member: usize, y: &DVector<f64>) -> f64 {
        self.points.chunks_exact(self.members.len()).zip(y).map(|(all, y)| (all[member] - y).powi(2)).sum()
    }
}

kernel! {
    /// The `count` points nearest to x and their squared distances, the nearest first, of those below a bound; `points` holds all
    /// first coordinates, then all second ones, and so on.
    pub(super) fn nearest(points: &[f64], x: &[f64], count: usize, bound: f64) -> Vec<(usize, f64)> {
        /// Distances taken at once; mostly none of so many is small enough.
        const TOGETHER: usize = 64;
        let n = points.len() / x.len();
        let mut nearest: Vec<(usize, f64)> = Vec::with_capacity(count + 1);
        let mut farthest = bound;
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
                    farthest = nearest.get(count - 1).map_or(bound, |last| last.1);
                }
            }
        }
        nearest
    }
}

kernel! {
    /// The points within a distance of x, `points` as in [`nearest`].
    fn within(points: &[f64], x: &[f64], squared_distance: f64) -> Vec<usize> {
        let n = points.len() / x.len();
        let mut squared = vec![0.0; n];
        for (coordinates, x) in points.chunks_exact(n).zip(x) {
            for (squared, coordinate) in squared.iter_mut().zip(coordinates) {
                *squared += (coordinate - x) * (coordinate - x);
            }
        }
        (0..n).filter(|i| squared[*i] < squared_distance).collect()
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
        assert_eq!(nearest(&points, &x, 17, f64::INFINITY), sorted[..17]);
        assert_eq!(nearest(&points[..9], &x, 17, f64::INFINITY).len(), 3);
        // The same along a way through the vicinity of its points.
        let mut vicinity = Vicinity::empty();
        let mut gathered = 0;
        for step in 0..200 {
            let x = [0.3, -0.2, 0.1].map(|x| x + 0.002 * f64::from(step));
            let before = vicinity.centre.clone();
            let found = vicinity.nearest(&points, &DVector::from_column_slice(&x), 17);
            assert_eq!(found, nearest(&points, &x, 17, f64::INFINITY));
            gathered += usize::from(vicinity.centre != before);
        }
        assert!((2..50).contains(&gathered), "{gathered}");
    }

    #[test]
    fn the_only_point_is_nearest_to_itself() {
        let mut vicinity = Vicinity::empty();
        let mut from = |y: f64| vicinity.nearest(&[0.25], &DVector::from_element(1, y), 17);
        assert_eq!([0.75, 0.25, 0.25].map(&mut from), [vec![(0, 0.25)], vec![(0, 0.0)], vec![(0, 0.0)]]);
    }
}
