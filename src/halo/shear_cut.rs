//! The point-lens shear cut on a catalogue that came from elsewhere.

use super::catalogue::HaloCatalogue;
use super::nfw_parameters::NfwScaling;
use crate::constants::ARCSEC_RAD;
use crate::error::{Error, Result};

/// True for each halo whose mass as a point lens would shear the axis by at least `min_point_shear`.
///
/// γ = r_E²/r², r_E² = 4GM/c²·(1+z)χ(χ_s−χ)/χ_s, r = χ|θ|; a halo on the axis itself passes.
///
/// # Errors
/// When the catalogue has no masses.
pub fn passes_shear_cut(haloes: &HaloCatalogue, min_point_shear: f64) -> Result<Vec<bool>> {
    let masses = haloes.m200c_msun.as_ref().ok_or_else(|| {
        Error::out_of_range(
            "columns of the catalogue",
            "without m200c_msun",
            "with m200c_msun when the shear cut is asked for",
        )
    })?;
    let scaling = NfwScaling::new(haloes.background(), haloes.z_source());
    Ok((0..haloes.len())
        .map(|i| {
            let chi = haloes.chi_cmpc[i];
            let r = chi * haloes.theta_x_arcsec[i].hypot(haloes.theta_y_arcsec[i]) * ARCSEC_RAD;
            let r_e2 = masses[i] * scaling.einstein_radius_squared_per_msun(chi, haloes.z[i]);
            r_e2 >= min_point_shear * r * r
        })
        .collect())
}
