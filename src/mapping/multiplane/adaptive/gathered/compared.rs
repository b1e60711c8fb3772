//! Rays traced exactly before anything is gathered: one through the middle of the field, and those that others are compared with.

use rayon::prelude::*;

use crate::mapping::multiplane::adaptive::field::Field;
use crate::mapping::multiplane::adaptive::sample::spread_over;
use crate::mapping::multiplane::axis::State;
use crate::mapping::multiplane::plane::LensPlane;
use crate::mapping::multiplane::recursion::BLOCK;
use crate::mapping::multiplane::segment::Segment;
use crate::mapping::multiplane::span::Span;

/// Rays that are compared with the exact recursion, those about the main lens among them.
const COMPARED: usize = BLOCK;
const ABOUT_LENS: usize = 16;
/// Rays that pass the middle of the main lens within this part of the field's half side are traced exactly: its Hessian, by
/// which errors grow, has no bound there.
const CORE: f64 = 1.0 / 24.0;
/// How much wider than the rays compared the squares are in which kicks are interpolated.
const MARGIN: f64 = 1.1;
/// Part of the rays for which squares at the end need not be wide enough: close to its middle a steep lens turns rays far away.
const LEFT_OUT: f64 = 0.05;

/// The ray through the middle of the field on its way through all haloes.
pub(super) struct Reference {
    /// Where it meets each plane.
    pub met: Vec<State>,
    /// Before the main lens, by which it is kicked unless it passes the middle of that closely.
    pub at_lens: State,
    pub kick_by_lens: [f64; 2],
    pub end: [f64; 2],
}

impl Reference {
    pub fn of(segment: &Segment, field: &Field) -> Self {
        let Span { chi_start_cmpc, chi_end_cmpc, x_start, s_start, .. } = segment.span;
        let s = [0, 1].map(|c| s_start[c] + field.centre_arcsec[c]);
        let mut ray = State { chi_cmpc: chi_start_cmpc, x: x_start, s };
        let (nearer, farther) = segment.nearer_and_farther();
        let mut met = ray.through(nearer);
        let (mut at_lens, mut kick_by_lens) = (ray, [0.0; 2]);
        if let Some((_, lens)) = &segment.lens {
            at_lens = ray.advanced(lens.chi_cmpc);
            let is_close = middle_of_lens(lens, &at_lens, field).is_none_or(|middle| field.contains(middle));
            if !is_close {
                kick_by_lens = lens.kick(at_lens.direction_arcsec());
            }
            ray = State { s: [0, 1].map(|c| at_lens.s[c] - kick_by_lens[c]), ..at_lens };
        }
        met.extend(ray.through(farther));
        Self { met, at_lens, kick_by_lens, end: ray.advanced(chi_end_cmpc).x }
    }
}

/// About the direction in which the middle of the main lens is seen.
fn middle_of_lens(lens: &LensPlane, at_lens: &State, field: &Field) -> Option<[f64; 2]> {
    let (centre, reference) = (lens.centre_arcsec()?, at_lens.direction_arcsec());
    Some([0, 1].map(|c| field.centre_arcsec[c] + centre[c] - reference[c]))
}

/// Rays traced exactly, and how wide they spread about the one through the middle of the field.
pub(super) struct Compared {
    pub theta_arcsec: Vec<[f64; 2]>,
    pub beta_arcsec: Vec<[f64; 2]>,
    pub half_at_lens_arcsec: f64,
    pub half_at_end_arcsec: f64,
    pub core_arcsec: f64,
}

impl Compared {
    pub fn with(segment: &Segment, reference: &Reference, field: &Field) -> Self {
        let field_half = field.half_arcsec[0].max(field.half_arcsec[1]);
        let core_arcsec = CORE * field_half;
        let middle = field.centre_arcsec;
        let corner = |k: usize| {
            [0, 1].map(|c| middle[c] + if k >> c & 1 == 1 { 1.0 } else { -1.0 } * field.half_arcsec[c])
        };
        let mut theta_arcsec: Vec<[f64; 2]> = (0..4).map(corner).collect();
        theta_arcsec.extend(spread_over(field).take(COMPARED - ABOUT_LENS - 4));
        let spread = theta_arcsec.len();
        let of_lens = |(_, lens): &(usize, LensPlane)| middle_of_lens(lens, &reference.at_lens, field);
        if let Some(middle) = segment.lens.as_ref().and_then(of_lens) {
            let about = (0..ABOUT_LENS).map(|k| {
                let (sin, cos) = (2.4 * k as f64).sin_cos();
                let radius = core_arcsec * (1.1 + 0.4 * k as f64);
                [0, 1].map(|c| middle[c] + radius * [cos, sin][c])
            });
            theta_arcsec.extend(about.filter(|at| field.contains(*at)));
        }
        let met: Vec<[[f64; 2]; 2]> =
            theta_arcsec.par_chunks(BLOCK).flat_map_iter(|theta| at_lens_and_end(segment, theta)).collect();
        let Span { chi_end_cmpc, x_axis_end, .. } = segment.span;
        let half = |place: usize, reference: [f64; 2], chi: f64| -> Vec<f64> {
            let far = |x: &[[f64; 2]; 2], c: usize| (x[place][c] - reference[c]).abs() / chi;
            let mut halves: Vec<f64> = met[..spread].iter().map(|x| far(x, 0).max(far(x, 1))).collect();
            halves.sort_by(f64::total_cmp);
            halves
        };
        let at_lens = half(0, reference.at_lens.x, reference.at_lens.chi_cmpc);
        let at_end = half(1, reference.end, chi_end_cmpc);
        let widest = at_lens.last().copied().unwrap_or(0.0).max(field_half);
        let most = at_end[((1.0 - LEFT_OUT) * spread as f64) as usize - 1];
        let length_cmpc = segment.span.length_cmpc();
        let beta = |[_, end]: &[[f64; 2]; 2]| [0, 1].map(|c| (end[c] - x_axis_end[c]) / length_cmpc);
        Self {
            half_at_lens_arcsec: MARGIN * widest,
            half_at_end_arcsec: MARGIN * most,
            beta_arcsec: met.iter().map(beta).collect(),
            theta_arcsec,
            core_arcsec,
        }
    }
}

/// Where rays are at the main lens and at the end, Mpc·arcsec.
fn at_lens_and_end(segment: &Segment, theta: &[[f64; 2]]) -> Vec<[[f64; 2]; 2]> {
    let (nearer, farther) = segment.nearer_and_farther();
    let mut rays = segment.start(theta);
    rays.through::<0>(nearer);
    if let Some((_, lens)) = &segment.lens {
        rays.advance::<0>(lens.chi_cmpc);
    }
    let at_lens = rays.x;
    if let Some((_, lens)) = &segment.lens {
        rays.through_lens::<0>(lens, theta.len());
    }
    rays.through::<0>(farther);
    rays.advance::<0>(segment.span.chi_end_cmpc);
    (0..theta.len()).map(|i| [[at_lens[0][i], at_lens[1][i]], rays.position(i)]).collect()
}
