//! Linear growth of structure in flat ΛCDM, from Heath's integral.

use super::Background;
use crate::numerics::quadrature::unit_rule;

/// Linear growth factor D(z), normalised to 1 today, and its logarithmic slope.
///
/// D(a) = (5/2) Ωm E(a) ∫₀ᵃ da′ / (a′E)³ (Heath 1977, MNRAS 179, 351), for matter and a
/// cosmological constant. With a′ = a s² the integrand is analytic on [0, 1] and the 32-node rule
/// gives machine precision for Ωm ≥ 0.1. Radiation is left out: it is smooth below the horizon and,
/// as colossus treats it, does not enter D at z < 10; the two agree to 1e-9
/// (`tests/reference/halo_relations.rs`).
#[derive(Debug, Clone, Copy)]
pub struct Growth {
    background: Background,
    growth_today: f64,
}

impl Growth {
    /// Growth in the given background.
    pub fn new(background: Background) -> Self {
        let mut growth = Self { background, growth_today: 1.0 };
        growth.growth_today = growth.suppression(0.0);
        growth
    }

    /// D(z)/D(0) for z > −1.
    pub fn growth(&self, z: f64) -> f64 {
        self.suppression(z) / ((1.0 + z) * self.growth_today)
    }

    /// dlnD/dlna = −dlnD/dln(1+z) = Ωm(z) [5/(2g) − 3/2], g = D/a; 1 while matter dominates.
    pub fn growth_slope(&self, z: f64) -> f64 {
        self.background.omega_m_at(z) * (2.5 / self.suppression(z) - 1.5)
    }

    /// g = D/a, normalised to D → a at early times.
    ///
    /// (a′E)⁻³ = a′^{3/2} (Ωm + ΩΛ a′³)^{−3/2}; with λ = ΩΛ a³/Ωm and a′ = a s² this gives
    /// g = 5 √(1+λ) ∫₀¹ s⁴ (1 + λ s⁶)^{−3/2} ds.
    fn suppression(&self, z: f64) -> f64 {
        let omega_m = self.background.omega_m();
        let lambda = (1.0 - omega_m) / (omega_m * (1.0 + z).powi(3));
        let integral = unit_rule().integrate_unit(|s| {
            let s2 = s * s;
            let base = 1.0 + lambda * s2 * s2 * s2;
            s2 * s2 / (base * base.sqrt())
        });
        5.0 * (1.0 + lambda).sqrt() * integral
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_is_the_scale_factor_in_einstein_de_sitter() {
        let growth = Growth::new(Background::new(70.0, 1.0).unwrap());
        for z in [0.0, 0.3, 1.0, 9.0, 1000.0] {
            assert!((growth.growth(z) * (1.0 + z) - 1.0).abs() < 1e-15, "z = {z}");
            assert!((growth.growth_slope(z) - 1.0).abs() < 1e-14, "z = {z}");
        }
    }

    #[test]
    fn growth_is_the_scale_factor_times_a_constant_while_matter_dominates() {
        let growth = Growth::new(Background::paper());
        let ratio = growth.growth(200.0) / growth.growth(100.0) * 201.0 / 101.0;
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
        assert!((growth.growth_slope(100.0) - 1.0).abs() < 2e-6);
    }

    #[test]
    fn the_slope_is_the_derivative_of_the_growth() {
        let growth = Growth::new(Background::planck18());
        for z in [0.0, 0.5, 1.5, 5.0] {
            let step = 1e-4;
            let at = |x: f64| growth.growth(x.exp() - 1.0).ln();
            let ln1pz = f64::ln_1p(z);
            let difference = -(at(ln1pz + step) - at(ln1pz - step)) / (2.0 * step);
            assert!((growth.growth_slope(z) - difference).abs() < 1e-8, "z = {z}");
        }
    }

    #[test]
    fn growth_rate_today_is_near_omega_m_to_the_power_055() {
        // Linder 2005 (PRD 72, 043529): f ≈ Ωm^0.55 to 0.2% in ΛCDM.
        let growth = Growth::new(Background::paper());
        let ratio = growth.growth_slope(0.0) / 0.315f64.powf(0.55);
        assert!((ratio - 1.0).abs() < 5e-3, "{ratio}");
    }
}
