//! Diemer & Kravtsov 2015 concentration–mass relation, with the parameters updated in 2019.

use super::ConcentrationRelation;
use crate::cosmology::LinearTheory;
use crate::error::Result;
use crate::halo::MassDefinition;

/// Scale at which the slope of the power spectrum counts: k = 2πκ/R.
const KAPPA: f64 = 1.00;
/// c_min = φ₀ + φ₁ n.
const PHI: [f64; 2] = [6.58, 1.27];
/// ν_min = η₀ + η₁ n.
const ETA: [f64; 2] = [7.28, 1.56];
/// Slope below ν_min.
const ALPHA: f64 = 1.08;
/// Slope above ν_min.
const BETA: f64 = 1.77;

/// c = c_min/2 · [(ν/ν_min)^−α + (ν/ν_min)^β] (Diemer & Kravtsov 2015, ApJ 799, 108).
///
/// n = dlnP/dlnk at k = 2πκ/R of the spectrum without acoustic oscillations, ν = δ_c/σ(M, z).
/// The parameters are those of the median as updated in Diemer & Joyce 2019 (ApJ 871, 168), who
/// mend a numerical fault of the original fit; colossus does the same by default. 200c only.
#[derive(Debug, Clone, Copy)]
pub struct Diemer15;

impl Diemer15 {
    /// Errors unless `definition` is 200c.
    pub fn new(definition: MassDefinition) -> Result<Self> {
        definition.must_be("200c", "diemer15")?;
        Ok(Self)
    }
}

impl ConcentrationRelation for Diemer15 {
    fn concentration(&self, linear: &LinearTheory, mass_msun: f64, z: f64) -> f64 {
        let n = linear.smooth_power_slope(mass_msun, KAPPA);
        let c_min = PHI[0] + PHI[1] * n;
        let nu_ratio = linear.peak_height(mass_msun, z) / (ETA[0] + ETA[1] * n);
        0.5 * c_min * (nu_ratio.powf(-ALPHA) + nu_ratio.powf(BETA))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::StructureParameters;

    #[test]
    fn concentration_rises_again_for_the_highest_peaks() {
        // The upturn that sets this relation apart: a minimum between ν = 1 and ν = 5 at z = 2.
        let linear = LinearTheory::new(StructureParameters::planck18()).unwrap();
        let relation = Diemer15::new(MassDefinition::Critical(200.0)).unwrap();
        let c = |mass| relation.concentration(&linear, mass, 2.0);
        assert!(c(1e15) > c(1e14) && c(1e8) > c(1e12), "{} {} {}", c(1e8), c(1e12), c(1e15));
    }
}
