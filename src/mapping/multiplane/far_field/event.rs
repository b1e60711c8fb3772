//! What a bundle of rays meets on its way: kicks of single haloes, of many merged, of the main lens.

use super::polynomial::Polynomial;
use crate::mapping::multiplane::plane::Plane;
use crate::profile::mass::{MassModel, MassProfile};

/// Two rows over z = (a, b): an angle ϑ = Q z, ϑ the direction at which a plane is met, relative to the central ray.
pub(super) type Rows = [[f64; 4]; 2];
/// The symplectic matrix M of z = z_ref + M z′.
pub(super) type Basis = [[f64; 4]; 4];

/// The unit matrix.
pub(super) const IDENTITY: Basis =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

/// A stretch of the line of sight; its length is the unit of b.
#[derive(Clone, Copy)]
pub(super) struct Way<'a> {
    pub chi_start: f64,
    pub chi_end: f64,
    pub x_start: [f64; 2],
    pub s_start: [f64; 2],
    pub x_axis_end: [f64; 2],
    /// The main lens: its distance, its factor f = χ_s/(χ_s − χ), its profile.
    pub lens: Option<(f64, f64, &'a MassModel)>,
}

impl Way<'_> {
    pub fn length(&self) -> f64 {
        self.chi_end - self.chi_start
    }

    /// What the end of a ray moves by for a kick at `chi`, in units of the kick.
    pub fn lever(&self, chi: f64) -> f64 {
        (self.chi_end - chi) / self.length()
    }

    /// Direction at which the unkicked ray of direction `theta` meets distance `chi`.
    fn straight(&self, chi: f64, theta: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|c| (self.x_start[c] + (chi - self.chi_start) * (self.s_start[c] + theta[c])) / chi)
    }

    /// β of the unkicked ray of direction `theta`.
    pub fn straight_beta(&self, theta: [f64; 2]) -> [f64; 2] {
        let end = |c: usize| self.x_start[c] + self.length() * (self.s_start[c] + theta[c]);
        [0, 1].map(|c| (end(c) - self.x_axis_end[c]) / self.length())
    }

    /// Rows of ϑ for rays that nothing has kicked: a is the angle at the start, b the displacement over the length.
    fn free_rows(&self, chi: f64) -> Rows {
        let (a, b) = ((chi - self.chi_start) / chi, self.length() / chi);
        [[a, 0.0, b, 0.0], [0.0, a, 0.0, b]]
    }

    /// A halo plane as met by rays about the unkicked ray of direction `theta`.
    pub fn plane(&self, plane: &Plane, theta: [f64; 2]) -> Event {
        let at = self.straight(plane.chi_cmpc, theta);
        let halo = Halo {
            t_arcsec: [at[0] - plane.centre_arcsec[0], at[1] - plane.centre_arcsec[1]],
            inv_r_s2: plane.inv_r_s2,
            fk: plane.fk,
            tau: plane.tau,
        };
        Event {
            rows: self.free_rows(plane.chi_cmpc),
            sheet: Some((plane.f_sheet, at)),
            ..Event::new(plane.chi_cmpc, Kick::Halo(halo))
        }
    }

    /// The main lens as met by rays about the unkicked ray of direction `theta`.
    pub fn lens_event(&self, theta: [f64; 2]) -> Option<Event> {
        let (chi, ..) = self.lens?;
        let lens = Kick::Lens { theta_arcsec: self.straight(chi, theta), spread_arcsec: f64::INFINITY };
        Some(Event { rows: self.free_rows(chi), ..Event::new(chi, lens) })
    }

    /// f·α of the main lens.
    pub fn lens_kick(&self, theta: [f64; 2]) -> [f64; 2] {
        self.lens.map_or([0.0; 2], |(_, f, profile)| profile.deflection(theta[0], theta[1]).map(|a| f * a))
    }
}

/// A kick K of the slope; of a kept one K(ϑ) − K(0) − Hϑ counts, since central ray and rows hold the rest.
#[derive(Clone)]
pub(super) struct Event {
    pub chi: f64,
    pub rows: Rows,
    pub kick_ref: [f64; 2],
    /// Part (xx, xy, yy) of the Hessian that the rows already hold.
    pub linear: [f64; 3],
    /// Lipschitz constant of what acts here, without unit.
    pub lipschitz: f64,
    /// Bound on the error of the kick, arcsec.
    pub error: f64,
    /// f·κ of a sheet that acts here too, and where the central ray meets it.
    pub sheet: Option<(f64, [f64; 2])>,
    pub kick: Kick,
}

/// One NFW halo, seen from the central ray.
#[derive(Clone, Copy)]
pub(super) struct Halo {
    /// Offset of the central ray from the centre.
    pub t_arcsec: [f64; 2],
    pub inv_r_s2: f64,
    pub fk: f64,
    pub tau: f64,
}

#[derive(Clone)]
pub(super) enum Kick {
    Halo(Halo),
    /// Merged haloes, from degree 2.
    Polynomial(Box<Polynomial>),
    /// The main lens: direction of the central ray there; no ray is kicked by more than `spread_arcsec` from it.
    Lens {
        theta_arcsec: [f64; 2],
        spread_arcsec: f64,
    },
}

impl Event {
    pub fn new(chi: f64, kick: Kick) -> Self {
        Self {
            chi,
            rows: [[0.0; 4]; 2],
            kick_ref: [0.0; 2],
            linear: [0.0; 3],
            lipschitz: 0.0,
            error: 0.0,
            sheet: None,
            kick,
        }
    }
}

impl Halo {
    /// (u, m, u·m′) at the offset `t`.
    #[inline(always)]
    pub fn radial(&self, t: [f64; 2]) -> (f64, f64, f64) {
        let u = ((t[0] * t[0] + t[1] * t[1]) * self.inv_r_s2).max(crate::profile::mass::nfw_radial::U_FLOOR);
        let basis = crate::profile::mass::nfw_radial::basis(u);
        let [m, p1, _] = if self.tau.is_finite() {
            crate::profile::mass::truncated(u, &basis, self.tau)
        } else {
            basis.nfw()
        };
        (u, m, p1)
    }
}

/// Q z.
#[inline(always)]
pub(super) fn apply(rows: &Rows, z: &[f64; 4]) -> [f64; 2] {
    rows.map(|r| r[0] * z[0] + r[1] * z[1] + r[2] * z[2] + r[3] * z[3])
}

/// z ← z + w Ω Qᵀ K with Ω = (0 −1; 1 0) and w = χ/length: what a kick does to a ray.
#[inline(always)]
pub(super) fn kick(rows: &Rows, w: f64, k: [f64; 2], z: &mut [f64; 4]) {
    let q = |i: usize| w * (rows[0][i] * k[0] + rows[1][i] * k[1]);
    z[0] -= q(2);
    z[1] -= q(3);
    z[2] += q(0);
    z[3] += q(1);
}

/// Q M.
#[inline(always)]
pub(super) fn product(rows: &Rows, basis: &Basis) -> Rows {
    rows.map(|r| {
        std::array::from_fn(|j| {
            r[0] * basis[0][j] + r[1] * basis[1][j] + r[2] * basis[2][j] + r[3] * basis[3][j]
        })
    })
}
