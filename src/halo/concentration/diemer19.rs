//! Diemer & Joyce 2019 concentration–mass relation.

use super::ConcentrationRelation;
use crate::cosmology::LinearTheory;
use crate::error::Result;
use crate::halo::MassDefinition;
use crate::numerics::roots::bracketed_root;

/// Published best fit of the median: κ, a₀, a₁, b₀, b₁, c_α.
const MEDIAN: [f64; 6] = [0.41, 2.45, 1.82, 3.20, 2.30, 0.21];
/// The same of the mean.
const MEAN: [f64; 6] = [0.42, 2.37, 1.74, 3.39, 1.82, 0.20];

/// Bracket of the root before the factor C(α).
const C_BRACKET: [f64; 2] = [0.5, 1e5];
/// Accuracy of ln c.
const LN_C_TOLERANCE: f64 = 1e-12;

/// c = C(α) · G⁻¹(A(n)/ν · [1 + ν²/B(n)]) (Diemer & Joyce 2019, ApJ 871, 168).
///
/// G(x) = x/μ(x)^((5+n)/6), μ(x) = ln(1+x) − x/(1+x); A = a₀[1 + a₁(n+3)], B = b₀[1 + b₁(n+3)],
/// C = 1 − c_α(1−α); n = −2 dlnσ/dlnR − 3 at κR, α = −dlnD/dln(1+z), ν = δ_c/σ(M, z).
/// 200c and NFW fits; the authors give it for any cosmology, mass and redshift.
///
/// G⁻¹ is solved to 1e-12, where colossus interpolates a table: the two agree to 1.1e-3 at the worst
/// (`tests/reference/halo_relations.rs`). For −3 ≤ n ≤ 0 the right-hand side is at least 2A/√B, which exceeds
/// the minimum of G, so that the root on the rising branch always exists.
#[derive(Debug, Clone, Copy)]
pub struct Diemer19 {
    parameters: [f64; 6],
}

impl Diemer19 {
    /// The median relation; errors unless `definition` is 200c.
    pub fn median(definition: MassDefinition) -> Result<Self> {
        definition.must_be("200c", "diemer19")?;
        Ok(Self { parameters: MEDIAN })
    }

    /// The mean relation; errors unless `definition` is 200c.
    pub fn mean(definition: MassDefinition) -> Result<Self> {
        definition.must_be("200c", "diemer19-mean")?;
        Ok(Self { parameters: MEAN })
    }
}

impl ConcentrationRelation for Diemer19 {
    fn concentration(&self, linear: &LinearTheory, mass_msun: f64, z: f64) -> f64 {
        let [kappa, a0, a1, b0, b1, c_alpha] = self.parameters;
        let n = -2.0 * linear.dlnsigma_dlnr(mass_msun * kappa.powi(3)) - 3.0;
        let nu = linear.peak_height(mass_msun, z);
        let a = a0 * (1.0 + a1 * (n + 3.0));
        let b = b0 * (1.0 + b1 * (n + 3.0));
        let c = 1.0 - c_alpha * (1.0 - linear.growth_slope(z));
        let right_hand_side = a / nu * (1.0 + nu * nu / b);
        c * inverse_g(right_hand_side, n)
    }
}

/// x on the rising branch of G(x) = x/μ(x)^((5+n)/6) = `value`; NaN if there is none.
fn inverse_g(value: f64, n: f64) -> f64 {
    let ln_value = value.ln();
    let exponent = (5.0 + n) / 6.0;
    bracketed_root(
        |ln_x| {
            let x = ln_x.exp();
            let mu = x.ln_1p() - x / (1.0 + x);
            ln_x - exponent * mu.ln() - ln_value
        },
        C_BRACKET[0].ln(),
        C_BRACKET[1].ln(),
        LN_C_TOLERANCE,
    )
    .map_or(f64::NAN, f64::exp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::StructureParameters;

    #[test]
    fn the_inverse_inverts() {
        for n in [-3.0, -2.5, -2.0, -1.5] {
            for c in [2.0, 5.0, 30.0, 300.0] {
                let mu = f64::ln_1p(c) - c / (1.0 + c);
                let inverted = inverse_g(c / mu.powf((5.0 + n) / 6.0), n);
                assert!((inverted / c - 1.0).abs() < 1e-10, "n = {n}: {c} {inverted}");
            }
        }
    }

    #[test]
    fn a_root_exists_for_every_slope_at_the_smallest_right_hand_side() {
        for [_, a0, a1, b0, b1, _] in [MEDIAN, MEAN] {
            for i in 0..=300 {
                let x = 0.01 * f64::from(i);
                let smallest = 2.0 * a0 * (1.0 + a1 * x) / (b0 * (1.0 + b1 * x)).sqrt();
                assert!(inverse_g(smallest, x - 3.0) > 1.0, "n = {}", x - 3.0);
            }
        }
        assert!(inverse_g(0.1, -2.5).is_nan());
    }

    #[test]
    fn cosmic_acceleration_lowers_concentration_only_through_c_alpha() {
        // In Einstein–de Sitter α = 1, hence c depends on ν and n alone: same σ, same c.
        let parameters = StructureParameters { omega_m: 1.0, ..StructureParameters::planck18() };
        let once = LinearTheory::new(parameters).unwrap();
        let half = StructureParameters { sigma8: 0.5 * parameters.sigma8, ..parameters };
        let half = LinearTheory::new(half).unwrap();
        let relation = Diemer19::median(MassDefinition::Critical(200.0)).unwrap();
        let ratio = relation.concentration(&once, 1e12, 1.0) / relation.concentration(&half, 1e12, 0.0);
        assert!((ratio - 1.0).abs() < 1e-12, "{ratio}");
    }

    #[test]
    fn masses_outside_the_table_give_nan() {
        let linear = LinearTheory::new(StructureParameters::planck18()).unwrap();
        let relation = Diemer19::mean(MassDefinition::Critical(200.0)).unwrap();
        assert!(relation.concentration(&linear, 10.0, 0.0).is_nan());
        assert!(relation.concentration(&linear, 1e4, 0.0) > 10.0);
    }
}
