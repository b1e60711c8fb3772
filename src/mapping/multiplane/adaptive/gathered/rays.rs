//! Rays through the stops of a gathered segment, many in SIMD lanes.

use super::stops::{Gathered, Stop, What};
use crate::mapping::RayBundle;
use crate::mapping::multiplane::adaptive::chebyshev::{Basis, Jet, LANES};
use crate::mapping::multiplane::kick::{Distortion, Kick, Kicked};
use crate::mapping::multiplane::recursion::{Derivatives, RaysTogether};
use crate::numerics::dispatch::kernel;

/// Rays as they differ from the one through the middle of the field.
type Rays = RaysTogether<LANES>;

/// Traces at most [`LANES`] rays; says which left the square or came too close to the middle of the main lens.
#[inline(always)]
fn trace<const ORDER: usize>(gathered: &Gathered, theta: &[[f64; 2]]) -> (RayBundle, Vec<bool>) {
    let used = theta.len();
    let Gathered { span, field, stops, carry_to_end, reference_end, .. } = gathered;
    let mut rays = Rays::start(span.chi_start_cmpc, [0.0; 2], field.centre_arcsec.map(|c| -c), theta);
    let mut distortion = Distortion::none();
    let (mut basis, mut jet) = (Basis::zero(), Jet::<2>::zero());
    // How far rays have come from the middle, in half sides of the square.
    let mut reach = [0.0_f64; LANES];
    for Stop { chi_cmpc, carry, what } in stops {
        rays.carry::<ORDER>(carry, *chi_cmpc);
        let inv_chi = 1.0 / chi_cmpc;
        match what {
            What::Halo(plane, kick_of_middle) => {
                let Rays { x, s, by_theta, .. } = &mut rays;
                let slopes = Differences::<ORDER> { s, by_theta, inv_chi, kick_of_middle };
                plane.kick::<ORDER, LANES>(x, inv_chi, &mut distortion, slopes);
            }
            What::Gathered(series, square) => {
                for c in 0..2 {
                    let per_x = inv_chi / square.half_arcsec[c];
                    for (reach, x) in reach.iter_mut().zip(&rays.x[c]) {
                        *reach = reach.max((per_x * x).abs());
                    }
                }
                basis.set::<ORDER>(square, |c, i| inv_chi * rays.x[c][i]);
                series.at::<ORDER>(&basis, &mut jet);
                turn::<ORDER>(&mut rays, &jet, &mut distortion, inv_chi);
            }
            What::Lens { lens, kick_of_middle, core_arcsec } => {
                let [mx, my] = lens.centre_arcsec().unwrap_or([f64::INFINITY; 2]);
                for (i, reach) in reach.iter_mut().enumerate() {
                    let [x, y] = rays.position(i).map(|x| x * inv_chi);
                    if (x - mx).hypot(y - my) < *core_arcsec {
                        *reach = f64::INFINITY;
                    }
                }
                rays.through_lens::<ORDER>(lens, used);
                for (s, kick) in rays.s.iter_mut().zip(kick_of_middle) {
                    s.iter_mut().for_each(|s| *s += kick);
                }
            }
        }
    }
    rays.carry::<ORDER>(carry_to_end, span.chi_end_cmpc);
    let origin = [0, 1].map(|c| span.x_axis_end[c] - reference_end[c]);
    let bundle = rays.bundle::<ORDER>(used, origin, span.length_cmpc());
    let is_inside = |(reach, beta): (&f64, &[f64; 2])| *reach <= 1.0 && beta.iter().all(|b| b.is_finite());
    let is_refused = reach.iter().zip(&bundle.beta_arcsec).map(|both| !is_inside(both)).collect();
    (bundle, is_refused)
}

/// Rays turn by a kick given with its derivatives.
#[inline(always)]
fn turn<const ORDER: usize>(
    rays: &mut Rays,
    kick: &Jet<2>,
    distortion: &mut Distortion<LANES>,
    inv_chi: f64,
) {
    if ORDER >= 1 {
        let [[xx, _], [xy, yy]] = &kick.first;
        distortion.h = [*xx, *xy, *yy];
    }
    if ORDER >= 2 {
        let [[xxx, _], [xxy, _], [xyy, yyy]] = &kick.second;
        distortion.t = [*xxx, *xxy, *xyy, *yyy];
    }
    if ORDER >= 1 {
        rays.by_theta.kick::<ORDER>(distortion, inv_chi);
    }
    for c in 0..2 {
        for i in 0..LANES {
            rays.s[c][i] -= kick.value[c][i];
        }
    }
}

/// What a rough halo changes of rays, less what it changes of the one through the middle of the field.
struct Differences<'a, const ORDER: usize> {
    s: &'a mut [[f64; LANES]; 2],
    by_theta: &'a mut Derivatives<LANES>,
    inv_chi: f64,
    kick_of_middle: &'a [f64; 2],
}

impl<const ORDER: usize> Kicked<LANES> for Differences<'_, ORDER> {
    #[inline(always)]
    fn distort(&mut self, distortion: &Distortion<LANES>) {
        self.by_theta.kick::<ORDER>(distortion, self.inv_chi);
    }

    #[inline(always)]
    fn turn(&mut self, i: usize, kick: Kick) {
        for c in 0..2 {
            self.s[c][i] -= kick.f_alpha_arcsec[c] - self.kick_of_middle[c];
        }
    }
}

kernel! {
    pub(super) fn trace_positions(gathered: &Gathered, theta: &[[f64; 2]]) -> (RayBundle, Vec<bool>) {
        trace::<0>(gathered, theta)
    }
}

kernel! {
    pub(super) fn trace_jacobians(gathered: &Gathered, theta: &[[f64; 2]]) -> (RayBundle, Vec<bool>) {
        trace::<1>(gathered, theta)
    }
}

kernel! {
    pub(super) fn trace_second_derivatives(gathered: &Gathered, theta: &[[f64; 2]]) -> (RayBundle, Vec<bool>) {
        trace::<2>(gathered, theta)
    }
}
