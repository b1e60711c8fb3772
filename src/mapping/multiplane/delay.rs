//! Arrival time of a ray through many planes (Schneider, Ehlers & Falco 1992, section 9.2; flat space).

use super::plane::Plane;
use super::segment::Segment;
use crate::constants::{ARCSEC_RAD, MPC_OVER_C_DAYS};
use crate::profile::mass::{MassModel, MassProfile, nfw_radial, truncated_potential};

impl Segment<'_> {
    /// c·τ = ½ΣΔχ|s|² − |x_end − x_start|²/2(χ_end − χ_start) − Σ f χ ψ, in comoving coordinates.
    ///
    /// Conformal time equals observed delay for a = 1 today; ψ is zero at each halo's centre.
    pub(super) fn ray_delay_days(&self, theta: [f64; 2]) -> f64 {
        let slope = [self.s_start[0] + theta[0], self.s_start[1] + theta[1]];
        let mut ray = Ray::start(self.chi_start, self.x_start, slope);
        let mut planes = self.planes;
        if let Some(lens) = self.lens {
            let (nearer, farther) = planes.split_at(lens.after);
            ray.through(nearer);
            let f = self.chi_source_cmpc / (self.chi_source_cmpc - lens.chi_cmpc);
            ray.through_lens(lens.chi_cmpc, lens.profile, f);
            planes = farther;
        }
        ray.through(planes);
        ray.delay_days_at(self.chi_end)
    }
}

/// One ray on its way; `path` is the geometric minus the potential part so far (Mpc·arcsec²).
pub(super) struct Ray {
    chi_start: f64,
    x_start: [f64; 2],
    chi: f64,
    x: [f64; 2],
    s: [f64; 2],
    path: f64,
}

fn square(v: [f64; 2]) -> f64 {
    v[0] * v[0] + v[1] * v[1]
}

impl Ray {
    /// A ray that leaves the point `x` at comoving distance `chi` with slope `s`.
    pub(super) fn start(chi: f64, x: [f64; 2], s: [f64; 2]) -> Self {
        Self { chi_start: chi, x_start: x, chi, x, s, path: 0.0 }
    }

    /// On to a general lens plane at `chi`, and through it.
    pub(super) fn through_lens(&mut self, chi: f64, profile: &MassModel, f: f64) {
        self.advance(chi);
        let t = self.x.map(|x| x / chi);
        let alpha = profile.deflection(t[0], t[1]);
        self.kick(alpha.map(|a| f * a), f * profile.potential(t[0], t[1]));
    }

    /// On to `chi_end`: the delay against the straight path from start to there.
    pub(super) fn delay_days_at(mut self, chi_end: f64) -> f64 {
        self.advance(chi_end);
        let straight = square([self.x[0] - self.x_start[0], self.x[1] - self.x_start[1]])
            / (2.0 * (chi_end - self.chi_start));
        (self.path - straight) * ARCSEC_RAD * ARCSEC_RAD * MPC_OVER_C_DAYS
    }

    fn advance(&mut self, chi: f64) {
        let step = chi - self.chi;
        self.chi = chi;
        self.path += 0.5 * step * square(self.s);
        self.x = [self.x[0] + step * self.s[0], self.x[1] + step * self.s[1]];
    }

    fn kick(&mut self, f_alpha: [f64; 2], f_psi: f64) {
        self.s = [self.s[0] - f_alpha[0], self.s[1] - f_alpha[1]];
        self.path -= self.chi * f_psi;
    }

    fn through(&mut self, planes: &[Plane]) {
        for plane in planes {
            self.advance(plane.chi_cmpc);
            let theta = self.x.map(|x| x * plane.inv_chi);
            let t = [theta[0] - plane.centre_arcsec[0], theta[1] - plane.centre_arcsec[1]];
            let u = plane.u(t[0], t[1]);
            let km = plane.fk * plane.radial(u)[0];
            let integral = if plane.tau.is_finite() {
                truncated_potential(u, plane.tau)
            } else {
                nfw_radial::potential(u)
            };
            let f_psi = 0.5 * (plane.fk / plane.inv_r_s2 * integral - plane.f_sheet * square(theta));
            self.kick([km * t[0] - plane.f_sheet * theta[0], km * t[1] - plane.f_sheet * theta[1]], f_psi);
        }
    }
}
