//! What a tile is made from: a hundred rays through what surrounds it, which haloes are rough for it, what the others do.

use super::chebyshev::{ROW_SIDE, SIDE, fine_number, nodes};
use super::field::Field;
use super::phase_space::Rows;
use crate::mapping::multiplane::plane::Plane;

/// Nodes of paths, and those of them that are nodes of rows.
pub(super) const FINE_NODES: usize = SIDE * SIDE;
pub(super) const ROW_NODES: usize = ROW_SIDE * ROW_SIDE;
/// Fine nodes on the edge: corners and middles of the sides.
pub(super) const EDGE_NODES: [usize; 8] = {
    const LAST: usize = SIDE - 1;
    const UP: [usize; 3] = [0, SIDE * (LAST / 2), SIDE * LAST];
    [0, LAST / 2, LAST, UP[1], UP[1] + LAST, UP[2], UP[2] + LAST / 2, UP[2] + LAST]
};
/// Rays of a sample: nodes, then rays that only compare; two tiles of the exact recursion.
pub(super) const RAYS: usize = 96;

/// Directions and kicks of all rays at one plane.
pub(super) struct Met {
    pub theta_arcsec: Vec<[f64; 2]>,
    pub kick_arcsec: Vec<[f64; 2]>,
}

impl Met {
    pub fn with_room(rays: usize) -> Self {
        Self { theta_arcsec: Vec::with_capacity(rays), kick_arcsec: Vec::with_capacity(rays) }
    }

    /// What blocks of rays met at every event, as one block after the other.
    pub fn joined(blocks: impl IntoIterator<Item = Vec<Self>>) -> Vec<Self> {
        let mut blocks = blocks.into_iter();
        let mut all = blocks.next().unwrap_or_default();
        for block in blocks {
            for (met, more) in all.iter_mut().zip(block) {
                met.theta_arcsec.extend(more.theta_arcsec);
                met.kick_arcsec.extend(more.kick_arcsec);
            }
        }
        all
    }
}

/// A rough plane as the rays of a sample meet it.
pub(super) struct SampledPlane {
    pub plane: Plane,
    pub met: Met,
    /// Rows at the coarse nodes, with the Hessians of smooth haloes and nothing of the rough ones.
    pub rows: [Rows; ROW_NODES],
}

/// A square seen through its surroundings.
pub(super) struct Sample {
    pub square: Field,
    pub theta_arcsec: Vec<[f64; 2]>,
    pub rough: Vec<SampledPlane>,
    /// β of every ray, and rows at the end at the coarse nodes.
    pub beta_arcsec: Vec<[f64; 2]>,
    pub end_rows: [Rows; ROW_NODES],
}

/// Rays of a sample; `images` are directions in which rough haloes are seen, strongest first.
///
/// Half of the checks pass close to haloes, where errors are largest (at the centre itself kicks are zero, and their
/// errors nearly so): at a twentieth to a quarter of the half side, in all directions. The others are spread evenly
/// (Roberts' R₂ sequence).
pub(super) fn rays(square: &Field, images_arcsec: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let at = |centre: [f64; 2], place: [f64; 2]| {
        [0, 1].map(|c| {
            let far = square.half_arcsec[c];
            (centre[c] + far * place[c]).clamp(square.centre_arcsec[c] - far, square.centre_arcsec[c] + far)
        })
    };
    let mut rays = nodes(square);
    let inside: Vec<[f64; 2]> = images_arcsec.iter().filter(|at| square.contains(**at)).copied().collect();
    for (k, image) in inside.iter().cycle().take((RAYS - FINE_NODES) / 2).enumerate() {
        let (sin, cos) = (2.4 * k as f64).sin_cos();
        let radius = 0.05 * (1 + k % 5) as f64;
        rays.push(at(*image, [radius * cos, radius * sin]));
    }
    rays.extend(spread_over(square).take(RAYS - rays.len()));
    rays
}

/// Rays spread evenly over a square without end (Roberts' R₂ sequence).
pub(super) fn spread_over(square: &Field) -> impl Iterator<Item = [f64; 2]> {
    /// 1/φ and 1/φ² for φ³ = φ + 1.
    const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    let at = |c: usize, k: usize| {
        let place = 2.0 * (0.5 + STEPS[c] * k as f64).fract() - 1.0;
        square.centre_arcsec[c] + square.half_arcsec[c] * place
    };
    (1..).map(move |k| [at(0, k), at(1, k)])
}

/// The rays of a sample that are coarse nodes.
pub(super) fn row_nodes(theta_arcsec: &[[f64; 2]]) -> [[f64; 2]; ROW_NODES] {
    std::array::from_fn(|k| theta_arcsec[fine_number(k)])
}

/// Where the rays of a tile meet a plane: their mean and the largest distance from it.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    pub mean_arcsec: [f64; 2],
    pub radius_arcsec: f64,
}

impl Spot {
    pub fn of(theta: impl Iterator<Item = [f64; 2]> + Clone) -> Self {
        let (mut sum, mut n) = ([0.0; 2], 0.0_f64);
        for t in theta.clone() {
            sum = [sum[0] + t[0], sum[1] + t[1]];
            n += 1.0;
        }
        let mean_arcsec = sum.map(|s| s / n);
        let square = |t: [f64; 2]| (t[0] - mean_arcsec[0]).powi(2) + (t[1] - mean_arcsec[1]).powi(2);
        Self { mean_arcsec, radius_arcsec: theta.map(square).fold(0.0, f64::max).sqrt() }
    }

    /// Whether interpolation of degree 4 is good to `tolerance` for a halo that is many spots away; `alpha` is its kick in the middle.
    #[inline(always)]
    pub fn is_far(&self, plane: &Plane, alpha: f64, tolerance: f64) -> bool {
        let [x, y] = [0, 1].map(|c| self.mean_arcsec[c] - plane.centre_arcsec[c]);
        let b = 2.0 * std::f64::consts::SQRT_2 * (x * x + y * y).sqrt() / (1.05 * self.radius_arcsec) - 1.3;
        // Over the spot the kick grows by less than half.
        b > 9.0 && 3.0 * alpha <= tolerance * (b * b) * (b * b) * b
    }

    /// False when interpolating the kick of a halo over the spot is good to `tolerance`; `alpha` is its largest kick
    /// at the edge.
    ///
    /// The kick is analytic but for the halo's centre, so interpolation of degree 8 is off by about 2α·B⁻⁹, where B is
    /// the sum of the half axes of the largest Bernstein ellipse that leaves the centre outside. For a halo at
    /// distance D from the middle of a square of half diagonal ϱ, B ≥ 2√2·D/ϱ − 1.3 beyond D = 1.5ϱ.
    #[inline(always)]
    pub fn is_rough(&self, plane: &Plane, alpha: f64, tolerance: f64) -> bool {
        let [x, y] = [0, 1].map(|c| self.mean_arcsec[c] - plane.centre_arcsec[c]);
        let (distance, radius) = ((x * x + y * y).sqrt(), 1.05 * self.radius_arcsec);
        if distance > 1.5 * radius {
            let b = 2.0 * std::f64::consts::SQRT_2 * distance / radius - 1.3;
            let b4 = (b * b) * (b * b);
            2.0 * alpha > tolerance * b4 * b4 * b
        } else {
            // The deflection of any truncation is at most that of the plain halo, which is largest near 1.3 r_s.
            let [m, ..] = plane.radial(1.0);
            1.1 * plane.fk.abs() * m > tolerance * plane.inv_r_s2.sqrt()
        }
    }
}
