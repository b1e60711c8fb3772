//! The relations of a configuration as a table: what goes into the draw, to look at or to compare.

use super::haloes::linear_theory;
use crate::config::{Config, HALO_MASS_DEFINITION};
use crate::error::{Domain, Result};

/// σ(M), peak height, mass function and concentration at some masses and redshifts, column by column.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Relations {
    /// Redshift.
    pub z: Vec<f64>,
    /// M200c, Msun.
    pub m200c_msun: Vec<f64>,
    /// Rms of the linear density field in spheres of that mass.
    pub sigma: Vec<f64>,
    /// Peak height ν = δ_c/σ.
    pub peak_height: Vec<f64>,
    /// Comoving number density per ln M, Mpc⁻³.
    pub dn_dlnm_per_cmpc3: Vec<f64>,
    /// Concentration.
    pub c200c: Vec<f64>,
}

impl Relations {
    /// Evaluates the relations that `config` names at every redshift of `z` and every mass, mass running fastest.
    ///
    /// The redshifts are taken as given, whatever `haloes.epoch` says.
    ///
    /// # Errors
    /// When a redshift is negative or the mass function does not cover its mass definition there.
    pub fn of(config: &Config, z: &[f64], m200c_msun: &[f64]) -> Result<Self> {
        for &z in z {
            Domain::from_to(0.0, 20.0).check("z", z)?;
        }
        for &mass in m200c_msun {
            Domain::POSITIVE.check("m200c_msun", mass)?;
        }
        let linear = linear_theory(config)?;
        let z_max = z.iter().copied().fold(0.0, f64::max);
        let settings = &config.haloes;
        let mass_function =
            settings.mass_function.build(settings.mass_definition, linear.background(), z_max)?;
        let concentration = settings.concentration.build(HALO_MASS_DEFINITION)?;
        let mut table = Self::default();
        for &z in z {
            for &mass in m200c_msun {
                table.z.push(z);
                table.m200c_msun.push(mass);
                table.sigma.push(linear.sigma(mass, z));
                table.peak_height.push(linear.peak_height(mass, z));
                table.dn_dlnm_per_cmpc3.push(mass_function.dn_dlnm_per_cmpc3(&linear, mass, z));
                table.c200c.push(concentration.concentration(&linear, mass, z));
            }
        }
        Ok(table)
    }
}
