//! Tinker et al. 2008 mass function of spherical-overdensity haloes.

use super::MassFunction;
use crate::cosmology::Background;
use crate::error::{Domain, Error, Result};
use crate::halo::MassDefinition;

/// Table 2: Δ_m, A, a, b, c at z = 0.
const TABLE_2: [[f64; 5]; 9] = [
    [200.0, 0.186, 1.47, 2.57, 1.19],
    [300.0, 0.200, 1.52, 2.25, 1.27],
    [400.0, 0.212, 1.56, 2.05, 1.34],
    [600.0, 0.218, 1.61, 1.87, 1.45],
    [800.0, 0.248, 1.87, 1.59, 1.58],
    [1200.0, 0.255, 2.13, 1.51, 1.80],
    [1600.0, 0.260, 2.30, 1.46, 1.97],
    [2400.0, 0.260, 2.53, 1.44, 2.24],
    [3200.0, 0.260, 2.66, 1.41, 2.44],
];

/// Slack at the ends of the table: 200c is 200m to rounding error while matter dominates.
const ROUNDING: f64 = 1e-9;

const ALLOWED: &str = "spherical overdensities from 200m to 3200m at every redshift used";

/// f(σ, z) = A [(σ/b)^−a + 1] e^(−c/σ²) (Tinker et al. 2008, ApJ 688, 709, eqs. 3–8).
///
/// A = A₀(1+z)^−0.14, a = a₀(1+z)^−0.06, b = b₀(1+z)^−α, log₁₀α = −[0.75/log₁₀(Δ_m/75)]^1.2.
/// Any definition is turned into Δ_m(z), its overdensity over the mean density, and A₀, a₀, b₀, c are
/// interpolated linearly in Δ_m. Linear and not in log Δ: measured on n(1e8–1e15 Msun/h, z = 0.5,
/// 200c), colossus gives 5.6620 Mpc⁻³ (5.5970 with h = 0.674 for the units), linear 5.6624, log-linear
/// 5.6640, natural spline in log Δ 5.673, not-a-knot spline 5.681; between the tabulated Δ the splines
/// overshoot at the step from 600 to 800. Δ_m is not rounded to an integer as colossus does; that is
/// the largest remaining difference, 2e-4 in the median (`tests/reference/halo_relations.rs`).
///
/// Calibrated for 1e11–1e15 Msun/h, 0 ≤ z ≲ 2, to 5% at z = 0.
#[derive(Debug, Clone, Copy)]
pub struct Tinker08 {
    definition: MassDefinition,
    background: Background,
}

impl Tinker08 {
    /// Errors unless Δ_m lies in 200–3200 at every redshift from 0 to `z_max`.
    ///
    /// Δ_m never rises with redshift for any definition, so both ends decide.
    pub fn new(definition: MassDefinition, background: Background, z_max: f64) -> Result<Self> {
        Domain::NON_NEGATIVE.check_in_words("z_max", z_max, "at least 0")?;
        for z in [0.0, z_max] {
            let given = match definition.mean_overdensity(&background, z) {
                Some(overdensity) if overdensity > 200.0 - ROUNDING && overdensity < 3200.0 + ROUNDING => {
                    continue;
                }
                Some(overdensity) => format!("{definition}, which is {overdensity:.1}m at z = {z}"),
                None => definition.to_string(),
            };
            return Err(Error::MassDefinition { relation: "tinker08", given, allowed: ALLOWED });
        }
        Ok(Self { definition, background })
    }

    /// A₀, a₀, b₀, c and Δ_m at redshift `z`; beyond `z_max` Δ_m is held inside the table.
    fn parameters_today(&self, z: f64) -> ([f64; 4], f64) {
        let overdensity =
            self.definition.mean_overdensity(&self.background, z).unwrap_or(f64::NAN).clamp(200.0, 3200.0);
        let above = TABLE_2.iter().position(|row| row[0] > overdensity).unwrap_or(TABLE_2.len() - 1);
        let (low, high) = (&TABLE_2[above.max(1) - 1], &TABLE_2[above.max(1)]);
        let fraction = (overdensity - low[0]) / (high[0] - low[0]);
        let at = |column: usize| low[column] + fraction * (high[column] - low[column]);
        ([at(1), at(2), at(3), at(4)], overdensity)
    }
}

impl MassFunction for Tinker08 {
    fn name(&self) -> &'static str {
        "tinker08"
    }

    fn multiplicity(&self, sigma: f64, z: f64) -> f64 {
        let ([a0_norm, a0, b0, c], overdensity) = self.parameters_today(z);
        let alpha = 10f64.powf(-(0.75 / (overdensity / 75.0).log10()).powf(1.2));
        let ln_1pz = z.ln_1p();
        let norm = a0_norm * (-0.14 * ln_1pz).exp();
        let a = a0 * (-0.06 * ln_1pz).exp();
        let b = b0 * (-alpha * ln_1pz).exp();
        norm * ((sigma / b).powf(-a) + 1.0) * (-c / (sigma * sigma)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn relation(definition: &str) -> Result<Tinker08> {
        Tinker08::new(definition.parse()?, Background::planck18(), 2.0)
    }

    #[test]
    fn tabulated_overdensities_return_the_table() {
        for row in TABLE_2 {
            let relation = Tinker08::new(MassDefinition::Mean(row[0]), Background::paper(), 2.0).unwrap();
            let (parameters, overdensity) = relation.parameters_today(0.0);
            assert_eq!(overdensity, row[0]);
            assert_eq!(parameters, [row[1], row[2], row[3], row[4]]);
        }
    }

    #[test]
    fn halfway_between_two_rows_is_their_mean() {
        let (parameters, _) = relation("700m").unwrap().parameters_today(0.0);
        for (value, mean) in parameters.iter().zip([0.233, 1.74, 1.73, 1.515]) {
            assert!((value - mean).abs() < 1e-14, "{value} {mean}");
        }
    }

    #[test]
    fn the_published_value_at_sigma_one() {
        // Δ = 200, z = 0: 0.186 (2.57^1.47 + 1) e^−1.19.
        let f = relation("200m").unwrap().multiplicity(1.0, 0.0);
        assert!((f - 0.186 * (2.57f64.powf(1.47) + 1.0) * (-1.19f64).exp()).abs() < 1e-15);
    }

    #[test]
    fn definitions_outside_the_table_are_refused_and_say_where() {
        for (text, reason) in [
            ("fof", "fof"),
            ("100m", "100.0m"),
            ("2500c", "8036.0m at z = 0"),
            ("vir", "at z = 2"),
            ("3201m", "3201.0m"),
        ] {
            let message = relation(text).unwrap_err().to_string();
            assert!(message.contains(reason) && message.contains("200m to 3200m"), "{message}");
        }
        for text in ["200c", "500c", "200m", "3200m"] {
            assert!(relation(text).is_ok(), "{text}");
        }
        let eds = Background::new(70.0, 1.0).unwrap();
        assert!(Tinker08::new(MassDefinition::Critical(200.0), eds, 1000.0).is_ok());
        assert!(Tinker08::new(MassDefinition::Virial, Background::planck18(), 0.5).is_ok());
        assert!(Tinker08::new(MassDefinition::Mean(200.0), Background::planck18(), -1.0).is_err());
    }
}
