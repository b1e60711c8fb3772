//! From mass and concentration to the angles of an NFW lens.

use crate::constants::{ARCSEC_RAD, GM_SUN_OVER_C2_MPC};
use crate::cosmology::Background;
use crate::numerics::elementary::ln_1p;

/// Turns (M200c, c200c, z) into (r_s, α_Rs) for one source.
#[derive(Debug, Clone, Copy)]
pub struct NfwScaling {
    background: Background,
    chi_source_cmpc: f64,
}

impl NfwScaling {
    /// Scaling for a source at `z_source`.
    pub fn new(background: &Background, z_source: f64) -> Self {
        Self { background: *background, chi_source_cmpc: background.comoving_distance_mpc(z_source) }
    }

    /// (r_s, α_Rs) in arcsec of a halo of M200c, c200c at redshift z and comoving distance χ(z) (Navarro, Frenk & White 1997).
    ///
    /// r_200c = (3M/800πρ_c(z))^{1/3}, r_s = r_200c/c, ρ_0 = M/(4πr_s³[ln(1+c) − c/(1+c)]),
    /// α_Rs = 4ρ_0 r_s²(1 − ln 2)·(4πG/c²)·D_ds/D_s. G·Msun is the IAU's; lenstronomy's is 2.8e-4 larger.
    pub fn angles_arcsec(&self, m200c_msun: f64, c200c: f64, z: f64, chi_cmpc: f64) -> (f64, f64) {
        let rho_c = self.background.critical_density_msun_mpc3(z);
        let r200 = (3.0 * m200c_msun / (800.0 * std::f64::consts::PI * rho_c)).cbrt();
        let r_s = r200 / c200c;
        let mu = ln_1p(c200c) - c200c / (1.0 + c200c);
        // 4ρ_0 r_s²·4πG/c² = 4·(GM/c²)/(r_s μ).
        let alpha_rad = 4.0 * GM_SUN_OVER_C2_MPC * m200c_msun / (r_s * mu)
            * (1.0 - std::f64::consts::LN_2)
            * (self.chi_source_cmpc - chi_cmpc)
            / self.chi_source_cmpc;
        (r_s * (1.0 + z) / chi_cmpc / ARCSEC_RAD, alpha_rad / ARCSEC_RAD)
    }

    /// Squared comoving Einstein radius of a point lens per solar mass, r_E²/M = 4G/c²·(1+z)χ(χ_s−χ)/χ_s in Mpc².
    ///
    /// The shear of a point lens at comoving distance r from the axis is γ = r_E²/r².
    pub fn einstein_radius_squared_per_msun(&self, chi_cmpc: f64, z: f64) -> f64 {
        4.0 * GM_SUN_OVER_C2_MPC * (1.0 + z) * chi_cmpc * (self.chi_source_cmpc - chi_cmpc)
            / self.chi_source_cmpc
    }
}
