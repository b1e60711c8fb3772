//! Lens planes as the ray loop reads them: one cache line a plane, sorted by distance.

use std::sync::Arc;

use rayon::prelude::*;

use crate::halo::HaloCatalogue;
use crate::profile::mass::{MassModel, Nfw, Truncation, nfw_radial, resolved_scale_radius};

/// The sheet of negative convergence that compensates the mass added as haloes.
#[derive(Debug, Clone, PartialEq)]
pub enum Sheets {
    /// In each halo's plane −κ_h(0), the halo's own convergence on the axis: the paper's choice.
    OnAxis,
    /// In each halo's plane minus the halo's own convergence where the axis ray, which nearer planes bend, passes it.
    OnRay,
    /// No compensation.
    None,
    /// In each halo's plane the convergence given (reduced to the source), in catalogue order: the share of what the
    /// haloes that are traced hold on average, see [`crate::halo::mean_density_sheets`].
    Expected(Vec<f64>),
}

/// One halo plane with its sheet; eight numbers, one cache line.
///
/// A ray at comoving x meets the halo at t = x/χ − c and its slope changes by −f[k·m(u)·t − κ_sheet·x/χ],
/// f = χ_s/(χ_s − χ), u = |t|²/r_s².
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Plane {
    /// Comoving distance in Mpc.
    pub chi_cmpc: f64,
    /// 1/χ.
    pub inv_chi: f64,
    /// Halo centre in arcsec.
    pub centre_arcsec: [f64; 2],
    /// 1/r_s² in arcsec⁻².
    pub inv_r_s2: f64,
    /// f·k.
    pub fk: f64,
    /// f·κ of the sheet.
    pub f_sheet: f64,
    /// Truncation τ = r_t/r_s; infinite for a plain NFW halo.
    pub tau: f64,
}

/// A plane with a mass profile of any kind, its deflection reduced to the source.
#[derive(Debug, Clone)]
pub(super) struct LensPlane {
    /// Comoving distance in Mpc.
    pub chi_cmpc: f64,
    /// f = χ_s/(χ_s − χ).
    pub f: f64,
    /// From where the profile measures positions, arcsec.
    pub origin_arcsec: [f64; 2],
    /// The profile.
    pub profile: Arc<MassModel>,
}

impl LensPlane {
    /// A profile at comoving distance `chi_cmpc`.
    pub fn new(chi_cmpc: f64, chi_source_cmpc: f64, profile: MassModel) -> Self {
        let f = chi_source_cmpc / (chi_source_cmpc - chi_cmpc);
        Self { chi_cmpc, f, origin_arcsec: [0.0; 2], profile: Arc::new(profile) }
    }

    /// The plane with directions measured from another one.
    pub fn seen_from(&self, theta: [f64; 2]) -> Self {
        Self { origin_arcsec: [0, 1].map(|c| self.origin_arcsec[c] - theta[c]), ..self.clone() }
    }
}

/// Planes in order of distance (equal distances in catalogue order); sheets on the ray are still missing.
pub(super) fn sorted_planes(haloes: &HaloCatalogue, chi_source_cmpc: f64, sheets: &Sheets) -> Vec<Plane> {
    // Distances, which are positive, are ordered as their bits; whole numbers are sorted several times as fast as pairs.
    let mut order: Vec<u128> =
        haloes.chi_cmpc.iter().zip(0..).map(|(chi, i)| u128::from(chi.to_bits()) << 64 | i).collect();
    order.sort_unstable();
    let mut planes: Vec<Plane> = order
        .into_par_iter()
        .map(|place| {
            let (chi, i) = (f64::from_bits((place >> 64) as u64), place as u64 as usize);
            let f = chi_source_cmpc / (chi_source_cmpc - chi);
            let r_s = resolved_scale_radius(haloes.r_s_arcsec[i]);
            let mut plane = Plane {
                chi_cmpc: chi,
                inv_chi: 1.0 / chi,
                centre_arcsec: [haloes.theta_x_arcsec[i], haloes.theta_y_arcsec[i]],
                inv_r_s2: 1.0 / (r_s * r_s),
                fk: f * Nfw::strength(r_s, haloes.alpha_rs_arcsec[i]),
                f_sheet: 0.0,
                tau: haloes.truncation(i),
            };
            if let Sheets::Expected(kappa) = sheets {
                plane.f_sheet = f * kappa[i];
            }
            plane
        })
        .collect();
    if *sheets == Sheets::OnAxis {
        balance_on_axis(&mut planes);
    }
    planes
}

/// Gives every plane the sheet −κ_h(0), with the bits of [`Plane::convergence_at`].
fn balance_on_axis(planes: &mut [Plane]) {
    let mut factors: Vec<f64> = planes.iter().map(|plane| plane.u_at([0.0; 2])).collect();
    nfw_radial::convergences(&mut factors);
    for (plane, factor) in planes.iter_mut().zip(factors) {
        let is_truncated = plane.tau.is_finite();
        plane.f_sheet = if is_truncated { plane.convergence_at([0.0; 2]) } else { plane.fk * factor };
    }
}

impl Plane {
    /// The plane with directions measured from another one; its kick differs by a constant, that of the sheet there.
    pub fn seen_from(&self, theta: [f64; 2]) -> Self {
        Self { centre_arcsec: [0, 1].map(|c| self.centre_arcsec[c] - theta[c]), ..*self }
    }

    /// u of an offset t.
    #[inline(always)]
    pub fn u(&self, tx: f64, ty: f64) -> f64 {
        ((tx * tx + ty * ty) * self.inv_r_s2).max(nfw_radial::U_FLOOR)
    }

    /// (m, u·m′, u²·m″) at any u.
    #[inline(always)]
    pub fn radial(&self, u: f64) -> [f64; 3] {
        let basis = nfw_radial::basis(u);
        if self.tau.is_finite() { Truncation::at(self.tau).radial(u, &basis) } else { basis.nfw() }
    }

    /// f·κ_h = f·k(m + u·m′) in one direction.
    pub fn convergence_at(&self, theta: [f64; 2]) -> f64 {
        let [m, p1, _] = self.radial(self.u_at(theta));
        self.fk * (m + p1)
    }

    /// u of a direction.
    fn u_at(&self, theta: [f64; 2]) -> f64 {
        self.u(self.centre_arcsec[0] - theta[0], self.centre_arcsec[1] - theta[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::Background;
    use crate::halo::HaloMasses;
    use crate::profile::mass::MassProfile;

    #[test]
    fn haloes_of_no_size_deflect_nothing_and_stay_finite() {
        for r_s in [1e-40, 1e-78, 1e-150, 1e-300] {
            let masses = HaloMasses::Angles { r_s_arcsec: vec![r_s], alpha_rs_arcsec: vec![1e-3] };
            let place = [vec![1.0], vec![0.5]];
            let haloes = HaloCatalogue::new(1.5, &Background::paper(), vec![0.3], place, masses).unwrap();
            let plane = sorted_planes(&haloes, 4000.0, &Sheets::OnAxis)[0];
            for theta in [[0.3, 0.4], [1.0, 0.5], [1e9, 0.0]] {
                let (kick, hessian) = plane.linear(theta);
                assert!(kick.iter().all(|v| v.abs() < 1e-20), "{r_s:e} {theta:?} {kick:?}");
                assert!(hessian.iter().all(|v| v.is_finite()), "{r_s:e} {theta:?} {hessian:?}");
                let third = haloes.profile(0).unwrap().third_derivatives(theta[0], theta[1]);
                assert!(third.iter().all(|v| v.is_finite()), "{r_s:e} {theta:?} {third:?}");
            }
        }
    }
}
