//! From masses of any spherical overdensity to M200c: the same NFW halo, cut elsewhere.

use super::mass_definition::MassDefinition;
use crate::cosmology::Background;
use crate::error::{Error, Result};
use crate::numerics::roots::bracketed_root;

/// M200c and c200c of NFW haloes whose mass, and perhaps concentration, follow other definitions.
///
/// The mean density within c·r_s of an NFW halo is 3ρ_s μ(c)/c³ with μ(c) = ln(1+c) − c/(1+c), so that the concentrations c_a,
/// c_b of two definitions obey (μ(c_a)/c_a³)/ρ_a = (μ(c_b)/c_b³)/ρ_b, and their masses M_a/M_b = μ(c_a)/μ(c_b)
/// (Hu & Kravtsov 2003, appendix C).
#[derive(Debug, Clone, Copy)]
pub struct MassConverter {
    background: Background,
    mass: MassDefinition,
    concentration: MassDefinition,
}

/// Mass and concentration within 200 times the critical density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Halo200c {
    /// Mass.
    pub m200c_msun: f64,
    /// Concentration.
    pub c200c: f64,
}

const M200C: MassDefinition = MassDefinition::Critical(200.0);

impl MassConverter {
    /// A converter from masses and concentrations of these definitions.
    ///
    /// # Errors
    /// Friends of friends, which have no density.
    pub fn new(background: Background, mass: MassDefinition, concentration: MassDefinition) -> Result<Self> {
        for (what, definition) in [("mass definition", mass), ("concentration's definition", concentration)] {
            if definition == MassDefinition::FriendsOfFriends {
                let allowed = "one of a density: 200c, 200m, vir; friends of friends have none. Say 200c to take the masses for M200c";
                return Err(Error::out_of_range(what, definition, allowed));
            }
        }
        Ok(Self { background, mass, concentration })
    }

    /// The halo of a mass and a concentration of the converter's definitions; none where no NFW halo has them.
    pub fn from_concentration(&self, mass_msun: f64, concentration: f64, z: f64) -> Option<Halo200c> {
        let c200c = self.other(self.concentration, concentration, M200C, z)?;
        Some(Halo200c { m200c_msun: self.m200c(mass_msun, c200c, z)?, c200c })
    }

    /// The halo of a mass whose concentration follows a relation c200c(M200c).
    pub fn from_relation(
        &self,
        mass_msun: f64,
        z: f64,
        c200c_of_m200c: impl Fn(f64) -> f64,
    ) -> Option<Halo200c> {
        /// Concentrations change by a tenth of what masses do at most: each step gains a digit.
        const STEPS: usize = 40;
        const TOLERANCE: f64 = 1e-12;
        let mut m200c_msun = mass_msun;
        for _ in 0..STEPS {
            let c200c = c200c_of_m200c(m200c_msun);
            let next = self.m200c(mass_msun, c200c, z)?;
            let change = (next / m200c_msun - 1.0).abs();
            m200c_msun = next;
            if change <= TOLERANCE {
                return Some(Halo200c { m200c_msun, c200c });
            }
        }
        None
    }

    fn m200c(&self, mass_msun: f64, c200c: f64, z: f64) -> Option<f64> {
        if self.mass == M200C {
            return (c200c > 0.0).then_some(mass_msun);
        }
        let own = self.other(M200C, c200c, self.mass, z)?;
        Some(mass_msun * enclosed(c200c) / enclosed(own))
    }

    /// The concentration in the definition `to` of a halo with concentration `c` in the definition `from`.
    fn other(&self, from: MassDefinition, c: f64, to: MassDefinition, z: f64) -> Option<f64> {
        /// ln c of haloes that are all centre and of points.
        const LN_C: [f64; 2] = [-7.0, 12.0];
        if !(c > 0.0 && c.is_finite()) {
            return None;
        }
        if from == to {
            return Some(c);
        }
        let density =
            |definition: MassDefinition| definition.density_threshold_msun_mpc3(&self.background, z);
        let wanted = (ln_mean_density(c.ln()) + (density(to)? / density(from)?).ln()).min(f64::MAX);
        bracketed_root(|ln_c| ln_mean_density(ln_c) - wanted, LN_C[0], LN_C[1], 1e-14).map(f64::exp)
    }
}

/// μ(c) = ln(1+c) − c/(1+c), the mass within c·r_s over 4πρ_s r_s³.
fn enclosed(c: f64) -> f64 {
    c.ln_1p() - c / (1.0 + c)
}

/// ln of μ(c)/c³, the mean density within c·r_s over 3ρ_s.
fn ln_mean_density(ln_c: f64) -> f64 {
    enclosed(ln_c.exp()).ln() - 3.0 * ln_c
}

#[cfg(test)]
mod tests {
    use super::*;

    /// colossus 1.4.0 `mass_defs.changeMassDefinition(M, c, z, from, '200c')`, masses and answers times h = 0.674, of a flat
    /// cosmology with H0 67.4, Ωm 0.315 and no relics: definition, M, c, z, M200c, c200c.
    const COLOSSUS: [(&str, f64, f64, f64, f64, f64); 12] = [
        ("200m", 1e12, 9.0, 0.0, 7.3330874e11, 5.522151),
        ("200m", 3e14, 4.5, 0.5, 2.5119405e14, 3.593457),
        ("200m", 1e10, 12.0, 1.2, 9.6124443e09, 11.13157),
        ("vir", 1e12, 9.0, 0.0, 8.4486396e11, 6.823874),
        ("vir", 3e14, 4.5, 0.5, 2.6438154e14, 3.826469),
        ("vir", 1e10, 12.0, 1.2, 9.5687286e09, 11.03701),
        ("500c", 1e12, 9.0, 0.0, 1.2223757e12, 13.06043),
        ("500c", 3e14, 4.5, 0.5, 3.9633669e14, 6.701523),
        ("500c", 1e10, 12.0, 1.2, 1.1940131e10, 17.27817),
        ("200c", 1e12, 9.0, 0.0, 9.9999989e11, 9.0),
        ("200c", 3e14, 4.5, 0.5, 3.0000000e14, 4.5),
        ("200c", 1e10, 12.0, 1.2, 9.9999991e09, 12.0),
    ];

    #[test]
    fn conversions_are_those_of_colossus() {
        /// What colossus loses by going from 200c to 200c and back.
        const TOLERANCE: f64 = 1e-6;
        for (definition, mass, c, z, m200c, c200c) in COLOSSUS {
            let definition: MassDefinition = definition.parse().unwrap();
            let converter = MassConverter::new(Background::paper(), definition, definition).unwrap();
            let found = converter.from_concentration(mass, c, z).unwrap();
            assert!((found.m200c_msun / m200c - 1.0).abs() < TOLERANCE, "{definition} {z}: {found:?}");
            assert!((found.c200c / c200c - 1.0).abs() < TOLERANCE, "{definition} {z}: {found:?}");
        }
    }

    #[test]
    fn a_relation_and_the_concentration_it_gives_are_the_same_halo() {
        let relation = |m: f64| 9.0 * (m / 1e12).powf(-0.1);
        for definition in ["200c", "200m", "vir", "500c"] {
            let definition: MassDefinition = definition.parse().unwrap();
            let converter = MassConverter::new(Background::paper(), definition, M200C).unwrap();
            let halo = converter.from_relation(3e12, 0.4, relation).unwrap();
            assert!((halo.c200c / relation(halo.m200c_msun) - 1.0).abs() < 1e-11);
            let again = converter.from_concentration(3e12, halo.c200c, 0.4).unwrap();
            assert!((again.m200c_msun / halo.m200c_msun - 1.0).abs() < 1e-11, "{definition}");
        }
    }

    #[test]
    fn what_is_no_halo_is_none() {
        let own = MassConverter::new(Background::paper(), M200C, M200C).unwrap();
        assert_eq!(own.from_concentration(1e12, 8.0, 0.3), Some(Halo200c { m200c_msun: 1e12, c200c: 8.0 }));
        for c in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(own.from_concentration(1e12, c, 0.3), None);
        }
        assert_eq!(own.from_relation(1e12, 0.3, |_| f64::NAN), None);
        let fof = MassConverter::new(Background::paper(), MassDefinition::FriendsOfFriends, M200C);
        assert!(fof.unwrap_err().to_string().contains("Say 200c"));
    }
}
