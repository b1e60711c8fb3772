//! A stretch of the line of sight as a [`Mapping`]: observer or lens plane to lens plane or source.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use super::axis::{Axis, Reference};
use super::delay::Ray;
use super::plane::{LensPlane, Plane};
use super::recursion::{BLOCK, RayBlock};
use super::span::Span;
use crate::error::Result;
use crate::mapping::{Mapping, Order, RayBundle};
use crate::monitor::Monitor;

/// The mapping between two distances along the line of sight, with or without the main lens.
///
/// Seen from the observer, β = x_end/χ_end, x_end measured from the [`Reference`]. Seen from a plane d, rays start on the ray that the observer
/// sees on the axis and β = (x_end − x_axis)/(χ_end − χ_d): θ and β are measured from that ray. A segment shares the
/// planes of its line of sight and outlives it.
#[derive(Debug, Clone)]
pub struct Segment {
    all_planes: Arc<Vec<Plane>>,
    range: Range<usize>,
    pub(super) span: Span,
    reference: Reference,
    /// The main lens, and how many of the segment's planes come before it.
    pub(super) lens: Option<(usize, LensPlane)>,
}

impl Segment {
    /// From the observer to `chi_end`; `x_end` is the place there that is called the axis.
    pub(super) fn from_observer(
        all_planes: &Arc<Vec<Plane>>,
        reference: Reference,
        chi_end: f64,
        x_end: [f64; 2],
    ) -> Self {
        Self {
            range: 0..all_planes.partition_point(|p| p.chi_cmpc < chi_end),
            all_planes: all_planes.clone(),
            span: Span { x_axis_end: x_end, ..Span::from_observer(chi_end) },
            reference,
            lens: None,
        }
    }

    /// What is left of a segment from the observer behind `chi_start`, about its axis ray.
    pub(super) fn behind(mut self, axis: &Axis, chi_start: f64) -> Self {
        let start = axis.at(chi_start);
        self.range.start = self.planes().partition_point(|p| p.chi_cmpc < chi_start);
        self.span = Span { chi_start_cmpc: chi_start, x_start: start.x, s_start: start.s, ..self.span };
        self.span.x_axis_end = self.to_end::<0>(&[[0.0; 2]]).position(0);
        self
    }

    pub(super) fn with_lens(mut self, lens: LensPlane) -> Self {
        self.lens = Some((self.planes().partition_point(|p| p.chi_cmpc < lens.chi_cmpc), lens));
        self
    }

    /// The halo planes of the segment.
    pub(super) fn planes(&self) -> &[Plane] {
        &self.all_planes[self.range.clone()]
    }

    /// The halo planes before and after the main lens; without one all are before.
    pub(super) fn nearer_and_farther(&self) -> (&[Plane], &[Plane]) {
        let planes = self.planes();
        planes.split_at(self.lens.as_ref().map_or(planes.len(), |(before, _)| *before))
    }

    pub(super) fn start(&self, theta: &[[f64; 2]]) -> RayBlock {
        RayBlock::start(self.span.chi_start_cmpc, self.span.x_start, self.span.s_start, theta)
    }

    /// A block of rays from start to end.
    pub(super) fn to_end<const ORDER: usize>(&self, theta: &[[f64; 2]]) -> RayBlock {
        let mut rays = self.start(theta);
        let (nearer, farther) = self.nearer_and_farther();
        rays.through::<ORDER>(nearer);
        if let Some((_, lens)) = &self.lens {
            rays.through_lens::<ORDER>(lens, theta.len());
        }
        rays.through::<ORDER>(farther);
        rays.advance::<ORDER>(self.span.chi_end_cmpc);
        rays
    }

    fn trace_order<const ORDER: usize>(
        &self,
        theta: &[[f64; 2]],
        monitor: &dyn Monitor,
    ) -> Result<RayBundle> {
        let length_cmpc = self.span.length_cmpc();
        RayBundle::in_blocks(theta, BLOCK, monitor, |theta| {
            self.to_end::<ORDER>(theta).bundle::<ORDER>(theta.len(), self.span.x_axis_end, length_cmpc)
        })
    }

    /// A ray behind the last plane.
    fn ray(&self, theta: [f64; 2], lens: Option<&LensPlane>) -> Ray {
        let Span { chi_start_cmpc, x_start, s_start, .. } = self.span;
        let mut ray = Ray::start(chi_start_cmpc, x_start, [s_start[0] + theta[0], s_start[1] + theta[1]]);
        let (nearer, farther) = self.nearer_and_farther();
        ray.through(nearer);
        if let Some(lens) = lens {
            ray.through_lens(lens);
        }
        ray.through(farther);
        ray
    }
}

impl Mapping for Segment {
    fn trace(&self, theta_arcsec: &[[f64; 2]], order: Order, monitor: &dyn Monitor) -> Result<RayBundle> {
        match order {
            Order::Position => self.trace_order::<0>(theta_arcsec, monitor),
            Order::Jacobian => self.trace_order::<1>(theta_arcsec, monitor),
            Order::SecondDerivatives => self.trace_order::<2>(theta_arcsec, monitor),
        }
    }

    fn delay_days(&self, theta_arcsec: &[[f64; 2]]) -> Vec<f64> {
        let (end, lens) = (self.span.chi_end_cmpc, self.lens.as_ref().map(|(_, lens)| lens));
        let rays = theta_arcsec.par_iter().map(|&theta| self.ray(theta, lens));
        match self.reference {
            Reference::Bent => rays.map(|ray| ray.delay_days_at(end)).collect(),
            Reference::Straight => {
                let mut axis = self.ray([0.0; 2], None);
                axis.advance(end);
                rays.map(|ray| ray.delay_days_from(&axis)).collect()
            }
        }
    }
}
