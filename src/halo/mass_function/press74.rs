//! Press & Schechter 1974 mass function.

use super::MassFunction;
use crate::cosmology::linear::COLLAPSE_OVERDENSITY;
use crate::error::Result;
use crate::halo::MassDefinition;

/// f(σ) = √(2/π) ν exp(−ν²/2), ν = δ_c/σ (Press & Schechter 1974, ApJ 187, 425).
///
/// Includes the factor 2 that makes all mass end in haloes; δ_c is the constant 1.68647, as in the
/// paper. Friends of friends only. Known to overpredict small haloes and to miss the most massive ones.
#[derive(Debug, Clone, Copy)]
pub struct Press74;

impl Press74 {
    /// Errors unless `definition` is friends of friends.
    pub fn new(definition: MassDefinition) -> Result<Self> {
        definition.must_be("fof", "press74")?;
        Ok(Self)
    }
}

impl MassFunction for Press74 {
    fn name(&self) -> &'static str {
        "press74"
    }

    fn multiplicity(&self, sigma: f64, _z: f64) -> f64 {
        let nu = COLLAPSE_OVERDENSITY / sigma;
        (2.0 / std::f64::consts::PI).sqrt() * nu * (-0.5 * nu * nu).exp()
    }
}
