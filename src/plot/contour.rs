//! Closed contours of a field on a grid, by marching squares.

use std::collections::BTreeMap;

/// A field on a rectangular grid of nodes.
pub(super) struct Field {
    /// Abscissae of the nodes, increasing.
    pub x: Vec<f64>,
    /// Ordinates of the nodes, increasing.
    pub y: Vec<f64>,
    /// Values, row by row from the lowest ordinate.
    pub values: Vec<f64>,
}

impl Field {
    /// Rings around the regions above `level`, higher values on their left; along the border of the grid they
    /// are closed.
    pub fn rings_above(&self, level: f64) -> Vec<Vec<(f64, f64)>> {
        let mut next: BTreeMap<Edge, Edge> = BTreeMap::new();
        for j in 0..=self.y.len() {
            for i in 0..=self.x.len() {
                self.segments_of_cell(i, j, level, &mut next);
            }
        }
        let mut rings = Vec::new();
        while let Some((&first, _)) = next.first_key_value() {
            let mut ring = Vec::new();
            let mut edge = first;
            while let Some(following) = next.remove(&edge) {
                ring.push(self.crossing(edge, level));
                edge = following;
            }
            rings.push(ring);
        }
        rings
    }

    /// Node (i, j) of the grid with a border of low nodes around it, at the coordinates of the outermost ones.
    fn node(&self, (i, j): (usize, usize)) -> (f64, f64, f64) {
        let inside = |k: usize, count: usize| (1..=count).contains(&k);
        let clamped = |k: usize, count: usize| k.clamp(1, count) - 1;
        let (nx, ny) = (self.x.len(), self.y.len());
        let value = if inside(i, nx) && inside(j, ny) { self.values[(j - 1) * nx + i - 1] } else { f64::MIN };
        (self.x[clamped(i, nx)], self.y[clamped(j, ny)], value)
    }

    /// Where the level is met between the two nodes of an edge.
    fn crossing(&self, edge: Edge, level: f64) -> (f64, f64) {
        let far = if edge.is_upright { (edge.i, edge.j + 1) } else { (edge.i + 1, edge.j) };
        let (a, b) = (self.node((edge.i, edge.j)), self.node(far));
        let t = ((level - a.2) / (b.2 - a.2)).clamp(0.0, 1.0);
        (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
    }

    /// Walking around a cell counter-clockwise, a contour enters the cell where the walk steps down and leaves
    /// it where the walk steps up.
    fn segments_of_cell(&self, i: usize, j: usize, level: f64, next: &mut BTreeMap<Edge, Edge>) {
        let values = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|node| self.node(node).2);
        let high = values.map(|value| value > level);
        let edges = [Edge::level(i, j), Edge::upright(i + 1, j), Edge::level(i, j + 1), Edge::upright(i, j)];
        let steps = |down: bool| {
            (0..4).filter(move |&k| high[k] != high[(k + 1) % 4] && high[k] == down).collect::<Vec<usize>>()
        };
        let (downs, ups) = (steps(true), steps(false));
        // At a saddle the mean of the corners decides which two are connected.
        let is_centre_high = 0.25 * values.iter().sum::<f64>() > level;
        for &down in &downs {
            let up = match ups.len() {
                1 => ups[0],
                _ if is_centre_high => (down + 1) % 4,
                _ => (down + 3) % 4,
            };
            next.insert(edges[down], edges[up]);
        }
    }
}

/// An edge between a node and its right or upper neighbour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    j: usize,
    i: usize,
    is_upright: bool,
}

impl Edge {
    fn level(i: usize, j: usize) -> Self {
        Self { j, i, is_upright: false }
    }

    fn upright(i: usize, j: usize) -> Self {
        Self { j, i, is_upright: true }
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
    fn area(ring: &[(f64, f64)]) -> f64 {
        let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
        0.5 * pairs.map(|(a, b)| a.0 * b.1 - a.1 * b.0).sum::<f64>()
    }

    #[test]
    fn a_hill_has_one_round_ring() {
        let rings = field(101, |x, y| -(x * x + y * y)).rings_above(-1.0);
        assert_eq!(rings.len(), 1);
        assert!((area(&rings[0]) - std::f64::consts::PI).abs() < 2e-3);
        assert!(rings[0].iter().all(|(x, y)| (x.hypot(*y) - 1.0).abs() < 1e-3));
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
        let rings = field(11, |x, _| x).rings_above(1.0);
        assert_eq!(rings.len(), 1);
        assert!((area(&rings[0]) - 4.0).abs() < 1e-9);
        let all = field(11, |_, _| 1.0).rings_above(0.0);
        assert!(all.len() == 1 && (area(&all[0]) - 16.0).abs() < 1e-9);
        assert!(field(11, |_, _| 0.0).rings_above(1.0).is_empty());
    }

    #[test]
    fn saddles_keep_their_rings_apart_and_closed() {
        let rings = field(40, |x, y| (3.0 * x).sin() * (3.0 * y).sin()).rings_above(0.0);
        assert!(rings.iter().all(|ring| ring.len() > 3 && area(ring) > 0.0), "{}", rings.len());
    }
}
