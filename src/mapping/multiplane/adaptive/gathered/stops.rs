//! What rays meet on their way through a gathered segment, and the linear maps between.

use crate::mapping::multiplane::adaptive::chebyshev::Series;
use crate::mapping::multiplane::adaptive::field::Field;
use crate::mapping::multiplane::plane::{LensPlane, Plane};
use crate::mapping::multiplane::recursion::Carry;
use crate::mapping::multiplane::segment::Segment;
use crate::mapping::multiplane::span::Span;

/// What rays meet at one distance, its place as seen from the ray through the middle of the field.
pub(super) struct Stop {
    pub chi_cmpc: f64,
    /// From the stop before: offset x (Mpc·arcsec) and slope s of a ray are Σ_k carry\[i\]\[k\]·(x, s)_k.
    pub carry: Carry,
    pub what: What,
}

pub(super) enum What {
    /// A rough halo, and its kick of that ray.
    Halo(Plane, [f64; 2]),
    /// What is gathered here, over a square of offsets.
    Gathered(Series<2>, Field),
    /// The main lens, its kick of that ray, and how close to its middle rays are left to the exact recursion, arcsec.
    Lens { lens: LensPlane, kick_of_middle: [f64; 2], core_arcsec: f64 },
}

/// A segment with few stops.
pub struct Gathered {
    pub(super) span: Span,
    pub(super) field: Field,
    pub(super) stops: Vec<Stop>,
    /// From the last stop to the end.
    pub(super) carry_to_end: Carry,
    /// Where the ray through the middle of the field ends, Mpc·arcsec.
    pub(super) reference_end: [f64; 2],
    /// Bound of |β − β_exact|, arcsec.
    pub(super) bound_arcsec: f64,
}

/// The stops with the linear maps between them.
pub(super) fn carried(
    segment: &Segment,
    stops: Vec<(f64, What)>,
    linear: &[Option<[f64; 3]>],
) -> (Vec<Stop>, Carry) {
    let mut chi = segment.span.chi_start_cmpc;
    let mut carry = Carry::identity();
    let mut planes = segment.planes().iter().zip(linear).peekable();
    let mut to = |end: f64, is_end: bool| {
        while let Some((plane, linear)) = planes.next_if(|(plane, _)| is_end || plane.chi_cmpc < end) {
            if let Some(h) = linear {
                carry.drift(plane.chi_cmpc - chi);
                carry.kick(h.map(|h| plane.inv_chi * h));
                chi = plane.chi_cmpc;
            }
        }
        carry.drift(end - chi);
        chi = end;
        std::mem::replace(&mut carry, Carry::identity())
    };
    let stops = stops.into_iter().map(|(chi_cmpc, what)| Stop { chi_cmpc, carry: to(chi_cmpc, false), what });
    let stops: Vec<Stop> = stops.collect();
    (stops, to(segment.span.chi_end_cmpc, true))
}
