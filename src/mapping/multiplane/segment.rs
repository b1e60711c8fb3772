//! A stretch of the line of sight as a [`Mapping`]: observer or lens plane to lens plane or source.

use rayon::prelude::*;

use super::line_of_sight::LineOfSight;
use super::plane::Plane;
use super::recursion::{TILE, Tile, trace_jacobians, trace_positions, trace_second_derivatives};
use crate::mapping::{Mapping, Order, RayBundle};
use crate::profile::mass::MassModel;

/// The mapping between two distances along the line of sight, with or without the main lens.
///
/// Seen from the observer, β = x_end/χ_end. Seen from a plane d, rays start on the ray that the observer
/// sees on the axis and β = (x_end − x_axis)/(χ_end − χ_d): θ and β are measured from that ray.
#[derive(Debug, Clone, Copy)]
pub struct Segment<'a> {
    pub(super) planes: &'a [Plane],
    pub(super) chi_source_cmpc: f64,
    pub(super) chi_start: f64,
    pub(super) chi_end: f64,
    /// Position and slope of the axis ray at the start, and its position at the end.
    pub(super) x_start: [f64; 2],
    pub(super) s_start: [f64; 2],
    pub(super) x_axis_end: [f64; 2],
    pub(super) lens: Option<LensPlane<'a>>,
}

/// The main lens inside a segment: how many halo planes come before it, and where it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct LensPlane<'a> {
    pub after: usize,
    pub chi_cmpc: f64,
    pub profile: &'a MassModel,
}

impl<'a> Segment<'a> {
    pub(super) fn from_observer(line_of_sight: &'a LineOfSight, chi_end: f64) -> Self {
        let planes = &line_of_sight.planes;
        Self {
            planes: &planes[..planes.partition_point(|p| p.chi_cmpc < chi_end)],
            chi_source_cmpc: line_of_sight.chi_source_cmpc,
            chi_start: 0.0,
            chi_end,
            x_start: [0.0; 2],
            s_start: [0.0; 2],
            x_axis_end: [0.0; 2],
            lens: None,
        }
    }

    pub(super) fn between(line_of_sight: &'a LineOfSight, chi_start: f64, chi_end: f64) -> Self {
        let nearer = Self::from_observer(line_of_sight, chi_start);
        let (x_start, s_start) = nearer.axis_ray();
        let all = Self::from_observer(line_of_sight, chi_end);
        let mut segment =
            Self { planes: &all.planes[nearer.planes.len()..], chi_start, x_start, s_start, ..all };
        segment.x_axis_end = segment.axis_ray().0;
        segment
    }

    pub(super) fn with_lens(mut self, chi_cmpc: f64, profile: &'a MassModel) -> Self {
        let after = self.planes.partition_point(|p| p.chi_cmpc < chi_cmpc);
        self.lens = Some(LensPlane { after, chi_cmpc, profile });
        self
    }

    /// Mixed second derivatives ∂²β/∂θ_j∂σ_k of the axis ray, symmetrised in j and k, where σ is a change of its slope
    /// at `chi_kick`: what a deflection there does to the distortion behind it. Same order as b_ijk, per arcsec.
    ///
    /// With rays θ = p, σ = p the second derivative is b_θθ + 2b_θσ + b_σσ; the other two are known.
    pub(super) fn mixed_second_derivatives(&self, chi_kick: f64) -> [f64; 6] {
        let axis = [[0.0, 0.0]];
        let (nearer, farther) = self.planes.split_at(self.planes.partition_point(|p| p.chi_cmpc < chi_kick));
        let trace = |kicked_before: bool, kick: bool| -> [f64; 6] {
            let mut tile = Tile::start(self.chi_start, self.x_start, self.s_start, &axis);
            trace_planes::<2>(&mut tile, nearer);
            tile.advance::<2>(chi_kick);
            if !kicked_before {
                tile.forget_derivatives();
            }
            if kick {
                tile.ds[0][0] += 1.0;
                tile.ds[3][0] += 1.0;
            }
            trace_planes::<2>(&mut tile, farther);
            tile.advance::<2>(self.chi_end);
            std::array::from_fn(|c| tile.d2x[c][0] / (self.chi_end - self.chi_start))
        };
        let (both, theta, sigma) = (trace(true, true), trace(true, false), trace(false, true));
        std::array::from_fn(|c| 0.5 * (both[c] - theta[c] - sigma[c]))
    }

    /// Position and slope at the end of the ray of direction 0.
    fn axis_ray(&self) -> ([f64; 2], [f64; 2]) {
        let tile = self.trace_tile::<0>(&[[0.0, 0.0]]);
        ([tile.x[0][0], tile.x[1][0]], [tile.s[0][0], tile.s[1][0]])
    }

    fn trace_tile<const ORDER: usize>(&self, theta: &[[f64; 2]]) -> Tile {
        let mut tile = Tile::start(self.chi_start, self.x_start, self.s_start, theta);
        let mut planes = self.planes;
        if let Some(lens) = self.lens {
            let (nearer, farther) = planes.split_at(lens.after);
            trace_planes::<ORDER>(&mut tile, nearer);
            tile.advance::<ORDER>(lens.chi_cmpc);
            let f = self.chi_source_cmpc / (self.chi_source_cmpc - lens.chi_cmpc);
            tile.kick_lens::<ORDER>(lens.profile, f, theta.len());
            planes = farther;
        }
        trace_planes::<ORDER>(&mut tile, planes);
        tile.advance::<ORDER>(self.chi_end);
        tile
    }

    fn map_order<const ORDER: usize>(&self, theta: &[[f64; 2]]) -> RayBundle {
        let scale = 1.0 / (self.chi_end - self.chi_start);
        let parts: Vec<RayBundle> = theta
            .par_chunks(TILE)
            .map(|theta| self.trace_tile::<ORDER>(theta).bundle::<ORDER>(theta.len(), self.x_axis_end, scale))
            .collect();
        RayBundle::concatenate(parts)
    }
}

fn trace_planes<const ORDER: usize>(tile: &mut Tile, planes: &[Plane]) {
    match ORDER {
        0 => trace_positions(tile, planes),
        1 => trace_jacobians(tile, planes),
        _ => trace_second_derivatives(tile, planes),
    }
}

impl Mapping for Segment<'_> {
    fn map(&self, theta_arcsec: &[[f64; 2]], order: Order) -> RayBundle {
        match order {
            Order::Position => self.map_order::<0>(theta_arcsec),
            Order::Jacobian => self.map_order::<1>(theta_arcsec),
            Order::SecondDerivatives => self.map_order::<2>(theta_arcsec),
        }
    }

    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        theta_arcsec.par_iter().map(|&theta| self.ray_delay_days(theta)).collect()
    }
}
