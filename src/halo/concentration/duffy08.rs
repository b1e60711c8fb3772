//! Duffy et al. 2008 concentration–mass relation.

use super::ConcentrationRelation;
use crate::cosmology::LinearTheory;
use crate::error::{Error, Result};
use crate::halo::MassDefinition;

/// Pivot mass, Msun/h.
const PIVOT_MSUN_PER_H: f64 = 2e12;

/// c = A (M/M_pivot)^B (1+z)^C, M_pivot = 2e12 Msun/h (Duffy et al. 2008, MNRAS 390, L64, Table 1).
///
/// NFW fits to all haloes of the full sample, 0 ≤ z ≤ 2, 1e11–1e15 Msun/h, WMAP5 cosmology. It has
/// no flattening and goes far too high when extrapolated to small haloes.
#[derive(Debug, Clone, Copy)]
pub struct Duffy08 {
    amplitude: f64,
    mass_exponent: f64,
    redshift_exponent: f64,
}

impl Duffy08 {
    /// Errors unless `definition` is 200c, 200m or vir.
    pub fn new(definition: MassDefinition) -> Result<Self> {
        let (amplitude, mass_exponent, redshift_exponent) = match definition {
            MassDefinition::Critical(200.0) => (5.71, -0.084, -0.47),
            MassDefinition::Virial => (7.85, -0.081, -0.71),
            MassDefinition::Mean(200.0) => (10.14, -0.081, -1.01),
            other => {
                return Err(Error::MassDefinition {
                    relation: "duffy08",
                    given: other.to_string(),
                    allowed: "200c, 200m, vir",
                });
            }
        };
        Ok(Self { amplitude, mass_exponent, redshift_exponent })
    }
}

impl ConcentrationRelation for Duffy08 {
    fn concentration(&self, linear: &LinearTheory, mass_msun: f64, z: f64) -> f64 {
        let mass_ratio = mass_msun * linear.unit_h() / PIVOT_MSUN_PER_H;
        self.amplitude * mass_ratio.powf(self.mass_exponent) * (1.0 + z).powf(self.redshift_exponent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::StructureParameters;

    #[test]
    fn the_pivot_mass_has_the_published_amplitude() {
        let linear = LinearTheory::new(StructureParameters::planck18()).unwrap();
        let pivot_msun = 2e12 / 0.6766;
        for (text, amplitude, at_z1) in
            [("200c", 5.71, 0.721_965), ("vir", 7.85, 0.611_320), ("200m", 10.14, 0.496_546)]
        {
            let relation = Duffy08::new(text.parse().unwrap()).unwrap();
            assert!((relation.concentration(&linear, pivot_msun, 0.0) / amplitude - 1.0).abs() < 1e-14);
            let ratio = relation.concentration(&linear, pivot_msun, 1.0) / amplitude;
            assert!((ratio - at_z1).abs() < 1e-6, "{text}: {ratio}");
        }
    }
}
