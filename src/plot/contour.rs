//! Rings around the regions of a field that lie above a level.

use super::mark::Point;
use crate::numerics::contour::zero_contours;

/// Corners of a ring around one node.
const AROUND_ONE_NODE: usize = 4;

/// A field on a rectangular grid of nodes.
pub struct Field {
    /// Abscissae of the nodes, increasing.
    pub x: Vec<f64>,
    /// Ordinates of the nodes, increasing.
    pub y: Vec<f64>,
    /// Values, row by row from the lowest ordinate.
    pub values: Vec<f64>,
}

impl Field {
    /// Rings around the regions above `level`, higher values on their left; along the border of the grid they
    /// are closed. Beside larger ones no ring about a single node.
    pub fn rings_above(&self, level: f64) -> Vec<Vec<Point>> {
        let (columns, rows) = (self.x.len() + 2, self.y.len() + 2);
        let nodes = (0..columns * rows).map(|k| self.node(k % columns, k / columns));
        let (nodes, heights): (Vec<Point>, Vec<f64>) = nodes.map(|(at, value)| (at, value - level)).unzip();
        let crossing = |&[low, high]: &[usize; 2]| {
            let t = heights[low] / (heights[low] - heights[high]);
            [0, 1].map(|i| nodes[low][i] + t * (nodes[high][i] - nodes[low][i]))
        };
        let contours = zero_contours(&heights, columns, rows);
        // Around single nodes, beside a region of many: beads at the tips of what the grid cannot resolve.
        let has_region = contours.iter().any(|contour| contour.crossings.len() > AROUND_ONE_NODE);
        let is_shown = |ring: &Vec<Point>| !has_region || ring.len() > AROUND_ONE_NODE;
        let rings = contours.iter().map(|contour| contour.crossings.iter().map(crossing).collect());
        rings.filter(is_shown).collect()
    }

    /// Node (i, j) of the grid with a border of low nodes around it, at the coordinates of the outermost ones.
    fn node(&self, i: usize, j: usize) -> (Point, f64) {
        let inside = |k: usize, count: usize| (1..=count).contains(&k);
        let clamped = |k: usize, count: usize| k.clamp(1, count) - 1;
        let (nx, ny) = (self.x.len(), self.y.len());
        let value = if inside(i, nx) && inside(j, ny) { self.values[(j - 1) * nx + i - 1] } else { f64::MIN };
        ([self.x[clamped(i, nx)], self.y[clamped(j, ny)]], value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(count: usize, value: impl Fn(f64, f64) -> f64) -> Field {
        let axis: Vec<f64> = (0..count).map(|i| -2.0 + 4.0 * i as f64 / (count - 1) as f64).collect();
        let values = axis.iter().flat_map(|&y| axis.iter().map(move |&x| (x, y))).map(|(x, y)| value(x, y));
        Field { values: values.collect(), x: axis.clone(), y: axis }
    }

    /// Area on the left of the ring.
    fn area(ring: &[Point]) -> f64 {
        let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
        0.5 * pairs.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
    }

    #[test]
    fn a_crater_has_a_hole_of_opposite_sense() {
        let rings = field(201, |x, y| -(x.hypot(y) - 1.0).abs()).rings_above(-0.5);
        let mut areas: Vec<f64> = rings.iter().map(|ring| area(ring)).collect();
        areas.sort_by(f64::total_cmp);
        assert_eq!(areas.len(), 2);
        assert!((areas[0] / std::f64::consts::PI + 0.25).abs() < 0.01);
        assert!((areas[1] / std::f64::consts::PI - 2.25).abs() < 0.01);
    }

    #[test]
    fn a_region_at_the_border_is_closed_there() {
        for (rings, wanted) in
            [(field(11, |x, _| x).rings_above(1.0), 4.0), (field(11, |_, _| 1.0).rings_above(0.0), 16.0)]
        {
            assert!(rings.len() == 1 && (area(&rings[0]) - wanted).abs() < 1e-9);
        }
        assert!(field(11, |_, _| 0.0).rings_above(1.0).is_empty());
    }
}
