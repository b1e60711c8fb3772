//! A segment whose smooth haloes are gathered onto a few planes, each with a polynomial for a kick; rays meet these planes, the
//! rough haloes one by one, and the main lens, however far that turns them.
//!
//! All is measured from the ray through the middle of the field, traced through every halo, and through the main lens unless the
//! field holds the middle of that. A ray at the offset δ from it gets from a halo K(0) + Hδ + K₂(δ), more than that ray by
//! Hδ + K₂. The linear parts of all smooth haloes are linear maps of offset and slope between two stops, and exact. What K₂ does to
//! the end, (χ_end − χ)·K₂(δ(χ)), is small and smooth in δ and χ: it is interpolated over the square that the rays fill at
//! Chebyshev nodes, and moved to the four nearest of a hundred distances by the weights of a cubic. docs/ADAPTIVE_TRACING.md has
//! more.

mod compared;
mod rays;
mod side;
mod stops;

use rayon::prelude::*;

use super::chebyshev::LANES;
use super::field::Field;
use super::tree::{FEW_RAYS, Part, Traced};
use crate::error::Result;
use crate::mapping::multiplane::axis::State;
use crate::mapping::multiplane::plane::Plane;
use crate::mapping::multiplane::segment::Segment;
use crate::mapping::{Order, RayBundle};
use crate::monitor::Monitor;
use compared::{Compared, Reference};
use rays::{trace_jacobians, trace_positions, trace_second_derivatives};
use side::{Bounds, Bundle, gather};
pub(super) use stops::Gathered;
use stops::{What, carried};

/// Planes onto which haloes between the start and the end are gathered, and the largest kick beyond its linear part of a halo that
/// is moved to them, over the root of the accuracy in arcsec: moved past a halo that turns rays by a, it is off by the product of
/// both over the number of planes. More planes leave fewer haloes to be met one by one, which pays below 1e-6″.
const FEW_PLANES: (usize, f64) = (96, 0.1);
const MANY_PLANES: (usize, f64) = (256, 0.5);
const MANY_PLANES_BELOW_ARCSEC: f64 = 1e-6;
/// What is too coarse is tried again, finer.
const FINER_PLANES: (usize, f64) = (256, 0.03);
/// More stops than this part of all planes are not worth it.
const STOPS_SHARE: f64 = 0.5;
/// Rays that are worth the gathering for each quarter of their field.
pub(super) const MANY_RAYS: usize = 30_000;
/// Quarters of quarters, for rays that coincide.
const DEEPEST: usize = 24;
/// By how much the largest error may exceed that of the rays compared.
const SAFETY: f64 = 4.0;

impl Gathered {
    /// Gathers the smooth haloes of a segment onto so few planes that β stays within the accuracy; nothing where that fails.
    pub fn new(segment: &Segment, field: &Field, accuracy_arcsec: f64) -> Option<Self> {
        let reference = Reference::of(segment, field);
        let compared = Compared::with(segment, &reference, field);
        let first = if accuracy_arcsec < MANY_PLANES_BELOW_ARCSEC { MANY_PLANES } else { FEW_PLANES };
        for (planes, largest) in [first, FINER_PLANES] {
            let largest_arcsec = largest * accuracy_arcsec.sqrt();
            let bounds = Bounds { accuracy_arcsec, largest_arcsec };
            let mut gathered = Self::onto(planes, segment, &reference, (&compared, field), &bounds);
            if gathered.stops.len() as f64 > STOPS_SHARE * segment.planes().len() as f64 {
                return None;
            }
            gathered.bound_arcsec = SAFETY * gathered.largest_error(&compared);
            if gathered.bound_arcsec <= accuracy_arcsec {
                return Some(gathered);
            }
        }
        None
    }

    fn onto(
        planes: usize,
        segment: &Segment,
        reference: &Reference,
        (compared, field): (&Compared, &Field),
        bounds: &Bounds,
    ) -> Self {
        let (nearer, farther) = segment.nearer_and_farther();
        let chi_lens = segment.lens.as_ref().map_or(segment.span.chi_end_cmpc, |(_, lens)| lens.chi_cmpc);
        let step = segment.span.length_cmpc() / planes as f64;
        let (before, behind) = reference.met.split_at(nearer.len());
        let near = Bundle { chi_cmpc: [chi_lens; 2], half_arcsec: [compared.half_at_lens_arcsec; 2] };
        let far = Bundle {
            chi_cmpc: [chi_lens, segment.span.chi_end_cmpc],
            half_arcsec: [compared.half_at_lens_arcsec, compared.half_at_end_arcsec],
        };
        let side =
            |planes: &[Plane], met: &[State], bundle: &Bundle| gather(planes, met, bundle, step, bounds);
        let (mut near, far) = rayon::join(|| side(nearer, before, &near), || side(farther, behind, &far));
        if let Some((_, lens)) = &segment.lens {
            let lens = lens.seen_from(reference.at_lens.direction_arcsec());
            let what = What::Lens {
                lens,
                kick_of_middle: reference.kick_by_lens,
                core_arcsec: compared.core_arcsec,
            };
            near.stops.push((reference.at_lens.chi_cmpc, what));
        }
        let mut stops = near.stops;
        stops.extend(far.stops);
        let mut linear = near.linear;
        linear.extend(far.linear);
        let (stops, carry_to_end) = carried(segment, stops, &linear);
        Self {
            span: segment.span,
            field: *field,
            stops,
            carry_to_end,
            reference_end: reference.end,
            bound_arcsec: 0.0,
        }
    }

    /// The largest error of rays that are not refused.
    fn largest_error(&self, compared: &Compared) -> f64 {
        let mut worst = 0.0_f64;
        let blocks = compared.theta_arcsec.chunks(LANES).zip(compared.beta_arcsec.chunks(LANES));
        for (theta, exact) in blocks {
            let (bundle, is_refused) = self.block(theta, Order::Position);
            let gaps =
                bundle.beta_arcsec.iter().zip(exact).zip(&is_refused).filter(|(_, refused)| !**refused);
            for ((ours, exact), _) in gaps {
                worst = worst.max((ours[0] - exact[0]).hypot(ours[1] - exact[1]));
            }
        }
        worst
    }

    /// Traces at most [`LANES`] rays, and says which are to be traced exactly.
    fn block(&self, theta: &[[f64; 2]], order: Order) -> (RayBundle, Vec<bool>) {
        match order {
            Order::Position => trace_positions(self, theta),
            Order::Jacobian => trace_jacobians(self, theta),
            Order::SecondDerivatives => trace_second_derivatives(self, theta),
        }
    }

    /// Traces rays by their indices; refuses those that leave the squares or pass the middle of the main lens.
    fn trace(&self, call: &Call, rays: Vec<u32>) -> Result<Traced> {
        let blocks: Result<Vec<(Part, Vec<u32>)>> = rays
            .par_chunks(LANES)
            .map(|rays| {
                call.monitor.check()?;
                let theta = call.directions(rays);
                let (bundle, is_refused) = self.block(&theta, call.order);
                let all = rays.iter().zip(is_refused.into_iter().zip(theta));
                let refused =
                    all.filter(|(_, (is_refused, theta))| *is_refused || !self.field.contains(*theta));
                let refused: Vec<u32> = refused.map(|(ray, _)| *ray).collect();
                call.monitor.advance((rays.len() - refused.len()) as u64);
                Ok((Part { rays: rays.into(), bundle }, refused))
            })
            .collect();
        let (parts, refused): (Vec<Part>, Vec<Vec<u32>>) = blocks?.into_iter().unzip();
        let refused = refused.concat();
        let met = (rays.len() - refused.len()) * self.stops.len();
        Ok(Traced { parts, refused, bound_arcsec: self.bound_arcsec, met })
    }
}

/// What all fields of one call have in common.
pub(super) struct Call<'a> {
    pub segment: &'a Segment,
    pub accuracy_arcsec: f64,
    pub theta_arcsec: &'a [[f64; 2]],
    pub order: Order,
    pub monitor: &'a dyn Monitor,
}

impl Call<'_> {
    fn directions(&self, rays: &[u32]) -> Vec<[f64; 2]> {
        rays.iter().map(|&ray| self.theta_arcsec[ray as usize]).collect()
    }

    /// Traces rays of a field, its quarters each on its own where they are many, refused ones again about themselves.
    pub fn trace(&self, whole: Option<&Gathered>, rays: Vec<u32>, depth: usize) -> Result<Traced> {
        let directions = self.directions(&rays);
        let is_worth_it = whole.is_some() || rays.len() >= FEW_RAYS;
        let Some(field) = Field::around(&directions).filter(|_| is_worth_it) else {
            return Ok(Traced { refused: rays, ..Traced::default() });
        };
        self.monitor.check()?;
        if rays.len() > MANY_RAYS && depth < DEEPEST {
            let mut quarters: [Vec<u32>; 4] = Default::default();
            for (ray, theta) in rays.into_iter().zip(directions) {
                quarters[field.quarter_of(theta)].push(ray);
            }
            let parts = quarters.into_par_iter().map(|rays| self.trace(None, rays, depth + 1));
            let parts: Result<Vec<Traced>> = parts.collect();
            return Ok(parts?.into_iter().fold(Traced::default(), Traced::and));
        }
        let own = match whole {
            Some(_) => None,
            None => Gathered::new(self.segment, &field, self.accuracy_arcsec),
        };
        let Some(gathered) = whole.or(own.as_ref()) else {
            return Ok(Traced { refused: rays, ..Traced::default() });
        };
        let number = rays.len();
        let mut traced = gathered.trace(self, rays)?;
        if 2 * traced.refused.len() > number || depth == DEEPEST {
            return Ok(traced);
        }
        let refused = std::mem::take(&mut traced.refused);
        Ok(traced.and(self.trace(None, refused, depth + 1)?))
    }
}
