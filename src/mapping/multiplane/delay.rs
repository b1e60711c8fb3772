//! Arrival time of a ray through many planes (Schneider, Ehlers & Falco 1992, section 9.2; flat space).
//!
//! c·τ = ½ΣΔχ|s|² − |x_end − x_start|²/2(χ_end − χ_start) − Σ f χ ψ, in comoving coordinates. Conformal time equals
//! observed delay for a = 1 today; ψ is zero at each halo's centre.

use super::kick::{Distortion, Kick};
use super::plane::{LensPlane, Plane};
use crate::constants::{ARCSEC_RAD, MPC_OVER_C_DAYS};

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
    pub fn start(chi: f64, x: [f64; 2], s: [f64; 2]) -> Self {
        Self { chi_start: chi, x_start: x, chi, x, s, path: 0.0 }
    }

    /// On through halo planes.
    pub fn through(&mut self, planes: &[Plane]) {
        for plane in planes {
            self.advance(plane.chi_cmpc);
            let theta = self.x.map(|x| x * plane.inv_chi);
            let mut kick = [0.0; 2];
            plane.kick::<0, 1>(&theta.map(|t| [t]), 1.0, &mut Distortion::none(), |_, k: Kick| {
                kick = k.f_alpha_arcsec
            });
            self.kick(kick, plane.potential(theta));
        }
    }

    /// On to the plane of a lens and through it.
    pub fn through_lens(&mut self, lens: &LensPlane) {
        self.advance(lens.chi_cmpc);
        let theta = self.x.map(|x| x / lens.chi_cmpc);
        self.kick(lens.kick(theta), lens.potential(theta));
    }

    /// On to `chi_end`: the delay against the straight path from start to there.
    pub fn delay_days_at(mut self, chi_end: f64) -> f64 {
        self.advance(chi_end);
        let straight = square([self.x[0] - self.x_start[0], self.x[1] - self.x_start[1]])
            / (2.0 * (chi_end - self.chi_start));
        (self.path - straight) * ARCSEC_RAD * ARCSEC_RAD * MPC_OVER_C_DAYS
    }

    /// On to where `axis` ends: the delay where positions, slopes and deflections are measured from that ray.
    ///
    /// With x + X, s + S for a ray, X and S the axis ray's, Σ Δχ s·S = x_end·S_end + Σ x·f·α_axis by parts: the last term
    /// belongs to the potentials of the subtracted deflections, the first does not to the delay.
    pub fn delay_days_from(mut self, axis: &Self) -> f64 {
        self.advance(axis.chi);
        let x = [self.x[0] - axis.x[0], self.x[1] - axis.x[1]];
        let straight = square(x) / (2.0 * (axis.chi - self.chi_start));
        let linear = x[0] * axis.s[0] + x[1] * axis.s[1];
        (self.path - axis.path - linear - straight) * ARCSEC_RAD * ARCSEC_RAD * MPC_OVER_C_DAYS
    }

    /// On without a plane.
    pub fn advance(&mut self, chi: f64) {
        let step = chi - self.chi;
        self.chi = chi;
        self.path += 0.5 * step * square(self.s);
        self.x = [self.x[0] + step * self.s[0], self.x[1] + step * self.s[1]];
    }

    fn kick(&mut self, f_alpha: [f64; 2], f_psi: f64) {
        self.s = [self.s[0] - f_alpha[0], self.s[1] - f_alpha[1]];
        self.path -= self.chi * f_psi;
    }
}
