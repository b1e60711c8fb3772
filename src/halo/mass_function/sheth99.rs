//! Sheth & Tormen 1999 mass function.

use super::{MassDefinition, MassFunction, collapse_overdensity, require_friends_of_friends};
use crate::cosmology::Background;
use crate::error::Result;

/// Normalisation A, eq. 10: all mass is in haloes.
const A_NORM: f64 = 0.3222;
/// Threshold rescaling a, eq. 10.
const A_THRESHOLD: f64 = 0.707;
/// Low-mass exponent p, eq. 10.
const P: f64 = 0.3;

/// f(σ) = A √(2x/π) (1 + x^−p) e^(−x/2), x = a δ_c(z)²/σ² (Sheth & Tormen 1999, MNRAS 308, 119, eq. 10).
///
/// Doubled with respect to their f(ν), which counts per unit lnν² . δ_c depends on cosmology as in
/// Navarro, Frenk & White 1997. Calibrated on friends-of-friends haloes only.
#[derive(Debug, Clone, Copy)]
pub struct Sheth99 {
    background: Background,
}

impl Sheth99 {
    /// Errors unless `definition` is friends of friends.
    pub fn new(definition: MassDefinition, background: Background) -> Result<Self> {
        require_friends_of_friends("sheth99", definition)?;
        Ok(Self { background })
    }
}

impl MassFunction for Sheth99 {
    fn name(&self) -> &'static str {
        "sheth99"
    }

    fn multiplicity(&self, sigma: f64, z: f64) -> f64 {
        let nu = collapse_overdensity(&self.background, z) / sigma;
        let x = A_THRESHOLD * nu * nu;
        A_NORM * (2.0 * x / std::f64::consts::PI).sqrt() * (1.0 + x.powf(-P)) * (-0.5 * x).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::quadrature::integrate;

    #[test]
    fn all_mass_is_in_haloes() {
        let relation = Sheth99::new(MassDefinition::FriendsOfFriends, Background::paper()).unwrap();
        let fraction = integrate(-4.0, 60.0, 100, |ln_sigma| relation.multiplicity(ln_sigma.exp(), 0.5));
        // A is published with four digits.
        assert!((fraction - 1.0).abs() < 2e-4, "{fraction}");
    }
}
