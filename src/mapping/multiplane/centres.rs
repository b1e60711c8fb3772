//! Where on the sky the centres of lenses in several planes are seen.

use rayon::prelude::*;

use super::general::GeneralMultiPlane;
use super::recursion::{BLOCK, FewRays, RayBlock};
use crate::mapping::centre::{REACHED_ARCSEC, direction_of};
use crate::mapping::{Mapping, Order};
use crate::numerics::triangle_mesh::TriangleMesh;

/// Cells of the mesh of rays, arcsec, and the most of them a side.
const CELL_ARCSEC: f64 = 0.05;
const CELLS_MAX: usize = 256;
/// The mesh is widened by this factor until rays at its edge miss all centres, and at most so often.
const WIDENING: f64 = 1.25;
const WIDENINGS: usize = 30;
/// Points on each side of the edge where the deflection is measured.
const POINTS_PER_SIDE: usize = 48;
/// A centre as near to the image of a triangle, in units of its sides, counts as inside.
const ASIDE: f64 = 0.1;
const NEWTON_STEPS: usize = 30;
/// Directions as near as this are one, arcsec.
const SAME_ARCSEC: f64 = 1e-9;

impl GeneralMultiPlane {
    /// Directions in which rays meet the centre of a lens.
    ///
    /// A lens behind a strong one is seen in several. They are looked for on a mesh of rays (cells of 0.05″, larger where more
    /// than 256 a side were needed), each refined by Newton's method; images closer together than its cells, or closer to the
    /// centre of a strong lens, may be missed.
    pub fn lens_centres_arcsec(&self) -> Vec<[f64; 2]> {
        let with_centre = |i: usize| self.planes[i].profile.centre_arcsec().map(|centre| (i, centre));
        let centres: Vec<(usize, [f64; 2])> = (0..self.planes.len()).filter_map(with_centre).collect();
        let direct =
            |&(i, centre): &(usize, [f64; 2])| direction_of(centre, |theta| self.at_plane(i, theta).0);
        let mut seen: Vec<[f64; 2]> = centres.iter().filter_map(direct).collect();
        if centres.iter().any(|&(i, _)| self.planes[i].chi_cmpc > self.planes[0].chi_cmpc) {
            for direction in self.directions_on_a_mesh(&centres) {
                if seen.iter().all(|other| distance(direction, *other) > SAME_ARCSEC) {
                    seen.push(direction);
                }
            }
        }
        seen
    }

    fn directions_on_a_mesh(&self, centres: &[(usize, [f64; 2])]) -> Vec<[f64; 2]> {
        let furthest = centres.iter().flat_map(|(_, c)| c).fold(0.0_f64, |most, c| most.max(c.abs()));
        let half_width = self.beyond(furthest);
        let cells = ((2.0 * half_width / CELL_ARCSEC).ceil() as usize).clamp(1, CELLS_MAX);
        let mesh = TriangleMesh::square([0.0; 2], half_width, cells);
        let mut blocks: Vec<RayBlock> =
            mesh.nodes.chunks(BLOCK).map(|theta| RayBlock::start(0.0, [0.0; 2], [0.0; 2], theta)).collect();
        let mut found = Vec::new();
        for (i, plane) in self.planes.iter().enumerate() {
            blocks.par_iter_mut().for_each(|rays| rays.advance::<0>(plane.chi_cmpc));
            for (_, centre) in centres.iter().filter(|(of, _)| *of == i) {
                let at =
                    |node: usize| blocks[node / BLOCK].position(node % BLOCK).map(|x| x / plane.chi_cmpc);
                let starts = (0..mesh.count()).into_par_iter().filter_map(|t| {
                    let corners = mesh.corners(t);
                    let weights = weights(*centre, corners.map(at))?;
                    let theta = [0, 1].map(|c| (0..3).map(|k| weights[k] * mesh.nodes[corners[k]][c]).sum());
                    self.polished(i, *centre, theta, mesh.size(t))
                });
                found.extend(starts.collect::<Vec<_>>());
            }
            blocks.par_iter_mut().for_each(|rays| rays.through_lens::<0>(plane, BLOCK));
        }
        found
    }

    /// Half the width of a square, at least `furthest`, from whose edge no ray is deflected to a point as near as that.
    fn beyond(&self, furthest: f64) -> f64 {
        let mut half_width = 1.05 * furthest + CELL_ARCSEC;
        for _ in 0..WIDENINGS {
            let edge: Vec<[f64; 2]> = (0..POINTS_PER_SIDE)
                .map(|i| half_width * (2.0 * i as f64 / POINTS_PER_SIDE as f64 - 1.0))
                .flat_map(|at| [[at, -half_width], [half_width, at], [-at, half_width], [-half_width, -at]])
                .collect();
            let beta = self.map(&edge, Order::Position).beta_arcsec;
            let most = edge.iter().zip(&beta).map(|(t, b)| distance(*t, *b)).fold(0.0, f64::max);
            if furthest + most < half_width {
                break;
            }
            half_width *= WIDENING;
        }
        half_width
    }

    /// The direction near `theta` whose ray meets plane `plane` at `centre`; `None` where no step of at most `step` leads there.
    fn polished(&self, plane: usize, centre: [f64; 2], mut theta: [f64; 2], step: f64) -> Option<[f64; 2]> {
        for _ in 0..NEWTON_STEPS {
            let (at, [xx, xy, yx, yy]) = self.at_plane(plane, theta);
            let left = [centre[0] - at[0], centre[1] - at[1]];
            let det = xx * yy - xy * yx;
            let newton = [(yy * left[0] - xy * left[1]) / det, (xx * left[1] - yx * left[0]) / det];
            let length = newton[0].hypot(newton[1]);
            if length <= REACHED_ARCSEC {
                return Some(theta);
            }
            let damping = (step / length).min(1.0);
            theta = [theta[0] + damping * newton[0], theta[1] + damping * newton[1]];
        }
        None
    }

    /// Where a ray meets plane number `plane`, arcsec from the axis, and what moves it there.
    fn at_plane(&self, plane: usize, theta: [f64; 2]) -> ([f64; 2], [f64; 4]) {
        let mut rays = FewRays::start(0.0, [0.0; 2], [0.0; 2], &[theta]);
        let chi_end = self.planes[plane].chi_cmpc;
        for in_front in self.planes[..plane].iter().filter(|p| p.chi_cmpc < chi_end) {
            rays.through_lens::<1>(in_front, 1);
        }
        rays.advance::<1>(chi_end);
        let bundle = rays.bundle::<1>(1, [0.0; 2], chi_end);
        (bundle.beta_arcsec[0], bundle.jacobian[0])
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The weights of three points whose mean a point is, where it lies among them or a little aside.
fn weights(point: [f64; 2], [a, b, c]: [[f64; 2]; 3]) -> Option<[f64; 3]> {
    let from = |p: [f64; 2]| [p[0] - point[0], p[1] - point[1]];
    let cross = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
    let [a, b, c] = [from(a), from(b), from(c)];
    let parts = [cross(b, c), cross(c, a), cross(a, b)];
    let all: f64 = parts.iter().sum();
    let weights = parts.map(|part| part / all);
    weights.iter().all(|w| *w >= -ASIDE).then_some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::Background;
    use crate::profile::mass::{External, MassModel, PointMass};

    #[test]
    fn a_sheared_foreground_moves_the_centre() {
        let lens = MassModel::PointMass(PointMass::new(1.0, [0.5, 0.0]).unwrap());
        let sheet = MassModel::External(External::new(0.1, [0.0; 2], [0.0; 4], [0.0; 2]).unwrap());
        let through =
            GeneralMultiPlane::new(&Background::paper(), 1.5, &[(0.5, lens.clone()), (0.2, sheet)]).unwrap();
        let [x, y] = through.lens_centres_arcsec()[0];
        assert!(x > 0.5 && x < 0.5 / 0.9 && y == 0.0, "{x}");
        let alone = GeneralMultiPlane::new(&Background::paper(), 1.5, &[(0.5, lens)]).unwrap();
        assert_eq!(alone.lens_centres_arcsec(), [[0.5, 0.0]]);
    }

    #[test]
    fn a_centre_behind_a_point_mass_is_seen_twice() {
        let mass = |theta_e, centre| MassModel::PointMass(PointMass::new(theta_e, centre).unwrap());
        let background = Background::paper();
        let (z_lens, z_behind, z_source) = (0.5, 0.9, 1.5);
        let lens = [(z_lens, mass(1.0, [0.0; 2])), (z_behind, mass(0.1, [0.3, 0.4]))];
        let through = GeneralMultiPlane::new(&background, z_source, &lens).unwrap();
        // θ_E² is the deflection's share that has worked by the plane behind: (χ_b − χ_l)χ_s/(χ_b(χ_s − χ_l)).
        let [l, b, s] = [z_lens, z_behind, z_source].map(|z| background.comoving_distance_mpc(z));
        let theta_e2 = (b - l) * s / (b * (s - l));
        let root = (0.25_f64 + 4.0 * theta_e2).sqrt();
        let mut want = vec![[0.0, 0.0]];
        want.extend([0.5 * (0.5 + root), 0.5 * (0.5 - root)].map(|r| [0.6 * r, 0.8 * r]));
        let seen = through.lens_centres_arcsec();
        assert_eq!(seen.len(), want.len(), "{seen:?}");
        for want in want {
            assert!(seen.iter().any(|seen| distance(*seen, want) < 1e-10), "{want:?} of {seen:?}");
        }
    }
}
