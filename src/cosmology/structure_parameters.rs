//! Parameters of the linear power spectrum.

use serde::{Deserialize, Serialize};

use super::background::Background;
use crate::error::{Domain, Result};

/// Everything the linear power spectrum of flat ΛCDM depends on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StructureParameters {
    /// Hubble constant, km/s/Mpc.
    pub h0_km_s_mpc: f64,
    /// Matter density today over the critical density, in (0, 1].
    pub omega_m: f64,
    /// Baryon density today over the critical density, above 0 and below `omega_m`.
    pub omega_b: f64,
    /// Root-mean-square linear overdensity in spheres of 8 h⁻¹ Mpc today, at most 5.
    pub sigma8: f64,
    /// Slope of the primordial power spectrum.
    pub n_s: f64,
    /// Temperature of the cosmic microwave background today, K.
    pub t_cmb_k: f64,
}

impl StructureParameters {
    /// Planck 2018 (A&A 641, A6), Table 2 with lensing and BAO, rounded as colossus `planck18` does.
    pub const fn planck18() -> Self {
        Self {
            h0_km_s_mpc: 67.66,
            omega_m: 0.3111,
            omega_b: 0.0490,
            sigma8: 0.8102,
            n_s: 0.9665,
            t_cmb_k: 2.7255,
        }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// The first parameter outside the range its field states.
    pub fn validate(&self) -> Result<()> {
        Background::new(self.h0_km_s_mpc, self.omega_m)?;
        let allowed = "above 0 and below omega_m (the Eisenstein-Hu fit needs baryons)";
        Domain::inside(0.0, self.omega_m).check_in_words("omega_b", self.omega_b, allowed)?;
        Domain::above_to(0.0, 5.0).check_in_words("sigma8", self.sigma8, "positive and at most 5")?;
        Domain::from_to(0.5, 1.5).check("n_s", self.n_s)?;
        Domain::from_to(1.0, 5.0).check_in_words("t_cmb_k", self.t_cmb_k, "from 1 to 5 K").map(drop)
    }
}
