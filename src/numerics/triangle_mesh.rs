//! Triangle meshes that are refined where it is asked for and stay without gaps: newest-vertex bisection (Mitchell 1989).

use super::contour::{Contour, join};

/// A mesh of right isosceles triangles over a square.
#[derive(Debug, Clone)]
pub struct TriangleMesh {
    /// Positions of the nodes; new ones are added at the end.
    pub nodes: Vec<[f64; 2]>,
    triangles: Vec<Triangle>,
}

/// Its nodes run counter-clockwise, the longest side from the first to the second.
#[derive(Debug, Clone, Copy)]
struct Triangle {
    nodes: [usize; 3],
    /// The triangle beyond the side opposite to each node.
    across: [Option<usize>; 3],
}

impl TriangleMesh {
    /// A square of `cells` × `cells` squares, each cut in two.
    pub fn square(centre: [f64; 2], half_width: f64, cells: usize) -> Self {
        let side = 2.0 * half_width / cells as f64;
        let at = |c: usize, i: usize| centre[c] - half_width + side * i as f64;
        let n = cells + 1;
        let nodes = (0..n * n).map(|k| [at(0, k % n), at(1, k / n)]).collect();
        let mut triangles = Vec::with_capacity(2 * cells * cells);
        for k in 0..cells * cells {
            let (column, row) = (k % cells, k / cells);
            let corner = row * n + column;
            let [a, b, c, d] = [corner, corner + 1, corner + n + 1, corner + n];
            let (lower, upper) = (2 * k, 2 * k + 1);
            let below = (row > 0).then(|| upper - 2 * cells);
            let right = (column + 1 < cells).then(|| upper + 2);
            let above = (row + 1 < cells).then(|| lower + 2 * cells);
            let left = (column > 0).then(|| lower - 2);
            triangles.push(Triangle { nodes: [c, a, b], across: [below, right, Some(upper)] });
            triangles.push(Triangle { nodes: [a, c, d], across: [above, left, Some(lower)] });
        }
        Self { nodes, triangles }
    }

    /// Number of triangles; each keeps its number until it is bisected, when one half inherits it.
    pub fn count(&self) -> usize {
        self.triangles.len()
    }

    /// The nodes of a triangle, counter-clockwise.
    pub fn corners(&self, triangle: usize) -> [usize; 3] {
        self.triangles[triangle].nodes
    }

    /// The longest side of a triangle.
    pub fn size(&self, triangle: usize) -> f64 {
        let [a, b, _] = self.triangles[triangle].nodes.map(|node| self.nodes[node]);
        (b[0] - a[0]).hypot(b[1] - a[1])
    }

    /// Bisects a triangle, and before it those that would be left with a node in the middle of a side; `changed` gets the
    /// numbers of all that are new.
    pub fn bisect(&mut self, triangle: usize, changed: &mut Vec<usize>) {
        while let Some(other) = self.triangles[triangle].across[2] {
            if self.triangles[other].across[2] == Some(triangle) {
                break;
            }
            self.bisect(other, changed);
        }
        let [a, b, _] = self.triangles[triangle].nodes;
        let (p, q) = (self.nodes[a], self.nodes[b]);
        let middle = self.nodes.len();
        self.nodes.push([0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])]);
        let other = self.triangles[triangle].across[2];
        let second = self.halve(triangle, middle);
        changed.extend([triangle, second]);
        if let Some(other) = other {
            let far = self.halve(other, middle);
            changed.extend([other, far]);
            self.triangles[triangle].across[0] = Some(far);
            self.triangles[second].across[1] = Some(other);
            self.triangles[other].across[0] = Some(second);
            self.triangles[far].across[1] = Some(triangle);
        }
    }

    /// Cuts a triangle from its third node to the `middle` of its longest side; the second half is returned.
    fn halve(&mut self, triangle: usize, middle: usize) -> usize {
        let Triangle { nodes: [a, b, c], across: [beyond_bc, beyond_ca, _] } = self.triangles[triangle];
        let second = self.triangles.len();
        self.triangles[triangle] =
            Triangle { nodes: [c, a, middle], across: [None, Some(second), beyond_ca] };
        self.triangles.push(Triangle { nodes: [b, c, middle], across: [Some(triangle), None, beyond_bc] });
        if let Some(beyond) = beyond_bc {
            let across = &mut self.triangles[beyond].across;
            across.iter_mut().filter(|t| **t == Some(triangle)).for_each(|t| *t = Some(second));
        }
        second
    }

    /// The triangles about a corner of a triangle, that one first.
    pub fn star(&self, triangle: usize, node: usize) -> Vec<usize> {
        let mut star = vec![triangle];
        // Once around; where the edge of the mesh is in the way, from the start the other way too.
        for turn in [1, 2] {
            let mut at = triangle;
            loop {
                let here = &self.triangles[at];
                let Some(corner) = here.nodes.iter().position(|&n| n == node) else { break };
                match here.across[(corner + turn) % 3] {
                    Some(next) if next == triangle => return star,
                    Some(next) => {
                        star.push(next);
                        at = next;
                    }
                    None => break,
                }
            }
        }
        star
    }

    /// The part of a triangle's contour of zero, from one side to another, each as its nodes (the negative one first): what
    /// is positive lies on the left.
    pub fn segment(&self, triangle: usize, is_positive: &[bool]) -> Option<[[usize; 2]; 2]> {
        let nodes = self.triangles[triangle].nodes;
        let sides = [[nodes[0], nodes[1]], [nodes[1], nodes[2]], [nodes[2], nodes[0]]];
        let falls = sides.into_iter().find(|&[a, b]| is_positive[a] && !is_positive[b]);
        let rises = sides.into_iter().find(|&[a, b]| !is_positive[a] && is_positive[b]);
        Some([falls.map(|[a, b]| [b, a])?, rises?])
    }

    /// The contours between the nodes that are positive and those that are not.
    pub fn contours(&self, is_positive: &[bool]) -> Vec<Contour> {
        join((0..self.count()).filter_map(|triangle| self.segment(triangle, is_positive)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every neighbour knows its neighbour and shares two nodes with it.
    fn check(mesh: &TriangleMesh) {
        let mut area = 0.0;
        for (i, t) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = t.nodes.map(|n| mesh.nodes[n]);
            let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert!(twice > 0.0);
            area += 0.5 * twice;
            assert!(((a[0] - c[0]).hypot(a[1] - c[1]) * 2.0_f64.sqrt() / mesh.size(i) - 1.0).abs() < 1e-6);
            for (k, across) in t.across.iter().enumerate() {
                let side = [t.nodes[(k + 1) % 3], t.nodes[(k + 2) % 3]];
                match across {
                    Some(other) => {
                        let other = &mesh.triangles[*other];
                        let back = other.across.iter().position(|&t| t == Some(i)).unwrap();
                        let theirs = [other.nodes[(back + 2) % 3], other.nodes[(back + 1) % 3]];
                        assert_eq!(side, theirs);
                    }
                    None => {
                        let [p, q] = side.map(|n| mesh.nodes[n]);
                        assert!((0..2).any(|c| p[c] == q[c] && p[c].abs() == 1.0), "a gap: {p:?} {q:?}");
                    }
                }
            }
        }
        assert!((area - 4.0).abs() < 1e-12, "{area}");
    }

    #[test]
    fn a_refined_mesh_has_no_gaps() {
        let mut mesh = TriangleMesh::square([0.0; 2], 1.0, 3);
        check(&mesh);
        // Towards a point, as far as 1e-6.
        for _ in 0..60 {
            let distance = |t: usize| {
                let [a, b, c] = mesh.corners(t).map(|n| mesh.nodes[n]);
                ((a[0] + b[0] + c[0]) / 3.0 - 0.3).hypot((a[1] + b[1] + c[1]) / 3.0 + 0.2)
            };
            let nearest = (0..mesh.count()).min_by(|&i, &j| distance(i).total_cmp(&distance(j))).unwrap();
            mesh.bisect(nearest, &mut Vec::new());
        }
        check(&mesh);
        let smallest = (0..mesh.count()).map(|t| mesh.size(t)).fold(f64::INFINITY, f64::min);
        assert!(smallest < 1e-6 && mesh.count() < 1000, "{smallest} {}", mesh.count());
    }

    #[test]
    fn stars_hold_every_triangle_of_a_node() {
        let mut mesh = TriangleMesh::square([0.0; 2], 1.0, 4);
        for t in [3, 7, 3, 12] {
            mesh.bisect(t, &mut Vec::new());
        }
        for t in 0..mesh.count() {
            for node in mesh.corners(t) {
                let mut star = mesh.star(t, node);
                star.sort_unstable();
                let all: Vec<usize> =
                    (0..mesh.count()).filter(|&i| mesh.corners(i).contains(&node)).collect();
                assert_eq!(star, all);
            }
        }
    }

    #[test]
    fn a_circle_is_one_closed_contour_whatever_the_refinement() {
        let mut mesh = TriangleMesh::square([0.0; 2], 1.0, 8);
        for _ in 0..3 {
            let right: Vec<usize> =
                (0..mesh.count()).filter(|&t| mesh.nodes[mesh.corners(t)[2]][0] > 0.1).collect();
            right.into_iter().for_each(|t| mesh.bisect(t, &mut Vec::new()));
        }
        check(&mesh);
        let inside: Vec<bool> = mesh.nodes.iter().map(|p| p[0].hypot(p[1]) < 0.6).collect();
        let contours = mesh.contours(&inside);
        assert_eq!(contours.len(), 1);
        assert!(contours[0].closed);
        // The inside is positive and lies on the left: counter-clockwise.
        let at: Vec<[f64; 2]> = contours[0].crossings.iter().map(|e| mesh.nodes[e[0]]).collect();
        let twice: f64 = (0..at.len())
            .map(|i| at[i][0] * at[(i + 1) % at.len()][1] - at[i][1] * at[(i + 1) % at.len()][0])
            .sum();
        assert!(twice > 2.0, "{twice}");
    }
}
