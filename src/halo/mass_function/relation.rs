//! What a halo mass function is.

use crate::cosmology::LinearTheory;

/// A published multiplicity function, bound to a mass definition it was calibrated for.
pub trait MassFunction: Send + Sync {
    /// Name as in the literature and in the configuration, e.g. "tinker08".
    fn name(&self) -> &'static str;

    /// f(σ, z): fraction of the mass in haloes per unit lnσ⁻¹.
    fn multiplicity(&self, sigma: f64, z: f64) -> f64;

    /// dn/dlnM = f(σ) ρ̄_m/M · dlnσ⁻¹/dlnM, comoving Mpc⁻³ (no h).
    ///
    /// `mass_msun` in the definition the relation was built with; `z` ≥ 0.
    fn dn_dlnm_per_cmpc3(&self, linear: &LinearTheory, mass_msun: f64, z: f64) -> f64 {
        self.multiplicity(linear.sigma(mass_msun, z), z) * linear.mean_matter_density_msun_mpc3() / mass_msun
            * -linear.dlnsigma_dlnm(mass_msun)
    }
}
