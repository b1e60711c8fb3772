//! Linear theory of structure: σ(M, z), its slopes, peak height and growth, in Msun and Mpc.

use std::f64::consts::PI;

use super::background::Background;
use super::eisenstein98::Eisenstein98;
use super::growth::Growth;
use super::structure_parameters::StructureParameters;
use super::variance::{VarianceInput, tabulate_ln_sigma};
use crate::error::{Domain, Result};
use crate::numerics::spline::UniformSpline;

/// Linear overdensity at collapse of a top-hat sphere in Einstein–de Sitter, (3/20)(12π)^(2/3).
pub const COLLAPSE_OVERDENSITY: f64 = 1.686_470_199_841_145_4;

/// Smallest mass σ is tabulated for, Msun.
pub const MASS_MIN_MSUN: f64 = 1e2;
/// Largest mass σ is tabulated for, Msun.
pub const MASS_MAX_MSUN: f64 = 1e18;

/// Linear theory for one set of parameters: σ(M) is tabulated once, growth is computed.
///
/// P(k) ∝ k^ns T²(k) with T of Eisenstein & Hu 1998; σ²(M) = ∫ Δ² W² dlnk with the top-hat of
/// M = (4π/3) ρ̄ R³, scaled to σ8; D(z) of matter and Λ. Masses in Msun (never h-units), lengths in
/// comoving Mpc. σ agrees to 2e-6 with colossus 1.4.0 when the latter's tables are refined; its
/// default tables are off by up to 5e-4 (`tests/reference/halo_relations.rs`).
/// Outside [`MASS_MIN_MSUN`]–[`MASS_MAX_MSUN`] every function of mass returns NaN.
///
/// ```
/// use haloray::cosmology::{LinearTheory, StructureParameters};
/// let linear = LinearTheory::new(StructureParameters::planck18()).unwrap();
/// let mass8_msun = linear.lagrangian_mass_msun(8.0 / 0.6766);
/// assert!((linear.sigma(mass8_msun, 0.0) - 0.8102).abs() < 1e-7);
/// ```
#[derive(Debug, Clone)]
pub struct LinearTheory {
    parameters: StructureParameters,
    background: Background,
    growth: Growth,
    shape: Eisenstein98,
    ln_sigma: UniformSpline,
    /// H₀ by which h-units are turned into Msun and Mpc; see [`Self::in_hubble_units_of`].
    unit_h0_km_s_mpc: f64,
    /// ln of the table's mass in Msun over the caller's.
    ln_mass_shift: f64,
}

impl LinearTheory {
    /// Builds the σ(M) table.
    ///
    /// Errors: a parameter is outside the range its field states, or h0 is not positive.
    pub fn new(parameters: StructureParameters) -> Result<Self> {
        let background = Background::new(parameters.h0_km_s_mpc, parameters.omega_m)?;
        parameters.validate()?;
        let shape = Eisenstein98::new(&parameters);
        let input = VarianceInput {
            power: |k: f64| k.powf(3.0 + parameters.n_s) * shape.transfer(k).powi(2),
            mean_density_msun_mpc3: background.mean_matter_density_msun_mpc3(),
            sigma8: parameters.sigma8,
            radius8_mpc: 800.0 / parameters.h0_km_s_mpc,
        };
        let ln_sigma = tabulate_ln_sigma(&input, MASS_MIN_MSUN, MASS_MAX_MSUN)?;
        Ok(Self {
            parameters,
            background,
            growth: Growth::new(background),
            shape,
            ln_sigma,
            unit_h0_km_s_mpc: parameters.h0_km_s_mpc,
            ln_mass_shift: 0.0,
        })
    }

    /// The same theory in h-units, converted to Msun and Mpc with another H₀.
    ///
    /// A code that works in Msun/h and Mpc/h is often run for one cosmology and its output converted
    /// with the h of another. Hogg et al. 2023 did so: relations for H₀ = 67.66, distances for 67.4,
    /// and n = 5.597 Mpc⁻³ is 5.662 Mpc⁻³ × (67.4/67.66)³. Masses then count as M·h′/h in the table
    /// and the mean density scales as (h′/h)². Redshift dependences do not change.
    pub fn in_hubble_units_of(mut self, h0_km_s_mpc: f64) -> Result<Self> {
        Domain::POSITIVE.check("h0_km_s_mpc", h0_km_s_mpc)?;
        self.unit_h0_km_s_mpc = h0_km_s_mpc;
        self.ln_mass_shift = (h0_km_s_mpc / self.parameters.h0_km_s_mpc).ln();
        Ok(self)
    }

    /// The parameters given to [`Self::new`].
    pub fn parameters(&self) -> &StructureParameters {
        &self.parameters
    }

    /// Background of the same H₀ and Ωm.
    pub fn background(&self) -> Background {
        self.background
    }

    /// h = H₀/100 by which a published relation in Msun/h is turned into Msun.
    pub fn unit_h(&self) -> f64 {
        self.unit_h0_km_s_mpc / 100.0
    }

    /// Mean matter density, comoving Msun/Mpc³.
    pub fn mean_matter_density_msun_mpc3(&self) -> f64 {
        let unit_ratio = self.unit_h0_km_s_mpc / self.parameters.h0_km_s_mpc;
        self.background.mean_matter_density_msun_mpc3() * unit_ratio * unit_ratio
    }

    /// Radius of the sphere of mean density that holds `mass_msun`, comoving Mpc.
    pub fn lagrangian_radius_mpc(&self, mass_msun: f64) -> f64 {
        (3.0 * mass_msun / (4.0 * PI * self.mean_matter_density_msun_mpc3())).cbrt()
    }

    /// Mass in a sphere of mean density of radius `radius_mpc` (comoving), Msun.
    pub fn lagrangian_mass_msun(&self, radius_mpc: f64) -> f64 {
        4.0 / 3.0 * PI * self.mean_matter_density_msun_mpc3() * radius_mpc.powi(3)
    }

    /// Root-mean-square linear overdensity σ(M, z) = D(z) σ(M, 0).
    pub fn sigma(&self, mass_msun: f64, z: f64) -> f64 {
        self.growth(z) * self.sigma_today(mass_msun)
    }

    /// σ(M) at z = 0: one spline evaluation.
    pub fn sigma_today(&self, mass_msun: f64) -> f64 {
        self.ln_sigma.value(self.table_ln_mass(mass_msun)).exp()
    }

    /// dlnσ/dlnM (negative), at any redshift.
    pub fn dlnsigma_dlnm(&self, mass_msun: f64) -> f64 {
        self.ln_sigma.derivative(self.table_ln_mass(mass_msun))
    }

    /// dlnσ/dlnR = 3 dlnσ/dlnM at the Lagrangian radius R of `mass_msun`.
    pub fn dlnsigma_dlnr(&self, mass_msun: f64) -> f64 {
        3.0 * self.dlnsigma_dlnm(mass_msun)
    }

    /// Peak height ν = δ_c/σ(M, z) with the constant δ_c = 1.68647.
    pub fn peak_height(&self, mass_msun: f64, z: f64) -> f64 {
        COLLAPSE_OVERDENSITY / self.sigma(mass_msun, z)
    }

    /// Linear growth factor D(z)/D(0).
    pub fn growth(&self, z: f64) -> f64 {
        self.growth.growth(z)
    }

    /// dlnD/dlna = −dlnD/dln(1+z), positive; 1 while matter dominates.
    pub fn growth_slope(&self, z: f64) -> f64 {
        self.growth.growth_slope(z)
    }

    /// dlnP/dlnk of the spectrum without acoustic oscillations at k = 2π `kappa`/R(M).
    pub fn smooth_power_slope(&self, mass_msun: f64, kappa: f64) -> f64 {
        let table_mass_msun = mass_msun * self.ln_mass_shift.exp();
        let density = self.background.mean_matter_density_msun_mpc3();
        let radius_mpc = (3.0 * table_mass_msun / (4.0 * PI * density)).cbrt();
        let k_per_mpc = 2.0 * PI * kappa / radius_mpc;
        self.parameters.n_s + 2.0 * self.shape.smooth_transfer_slope(k_per_mpc)
    }

    fn table_ln_mass(&self, mass_msun: f64) -> f64 {
        let ln_mass = mass_msun.ln() + self.ln_mass_shift;
        if ln_mass >= self.ln_sigma.start() && ln_mass <= self.ln_sigma.end() { ln_mass } else { f64::NAN }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planck18() -> LinearTheory {
        LinearTheory::new(StructureParameters::planck18()).unwrap()
    }

    #[test]
    fn the_collapse_overdensity_is_its_closed_form() {
        let exact = 0.15 * (12.0 * PI).powf(2.0 / 3.0);
        assert!((COLLAPSE_OVERDENSITY / exact - 1.0).abs() < 1e-15, "{exact:.17}");
    }

    #[test]
    fn the_slope_of_sigma_is_its_derivative() {
        let linear = planck18();
        for i in 0..=140 {
            let mass = 1e4 * 10f64.powf(0.1 * f64::from(i) * 13.0 / 14.0);
            let step = 1e-4_f64;
            let difference = (linear.sigma_today(mass * step.exp()).ln()
                - linear.sigma_today(mass * (-step).exp()).ln())
                / (2.0 * step);
            let slope = linear.dlnsigma_dlnm(mass);
            assert!((slope / difference - 1.0).abs() < 1e-6, "{mass:e}: {slope} {difference}");
            assert!(slope < 0.0);
        }
    }

    #[test]
    fn sigma_is_the_direct_integral() {
        // Gauss–Legendre panels in k instead of the table's trapezium in ln k.
        use crate::cosmology::variance::top_hat_window;
        use crate::numerics::quadrature::integrate;
        let linear = planck18();
        let direct = |radius_mpc: f64| {
            integrate((1e-6f64).ln(), (300.0 / radius_mpc).ln(), 400, |ln_k| {
                let k = ln_k.exp();
                let amplitude = linear.shape.transfer(k) * top_hat_window(k * radius_mpc);
                amplitude * amplitude * k.powf(3.0 + linear.parameters.n_s)
            })
        };
        let direct8 = direct(800.0 / 67.66);
        for mass in [1e4, 1e8, 1e12, 1e15, 1e17] {
            let sigma = 0.8102 * (direct(linear.lagrangian_radius_mpc(mass)) / direct8).sqrt();
            let ratio = linear.sigma_today(mass) / sigma;
            assert!((ratio - 1.0).abs() < 1e-8, "{mass:e}: {:e}", ratio - 1.0);
        }
    }

    #[test]
    fn redshift_scales_sigma_by_the_growth_factor() {
        let linear = planck18();
        let ratio = linear.sigma(1e12, 1.0) / linear.sigma(1e12, 0.0);
        assert!((ratio - linear.growth(1.0)).abs() < 1e-15);
        assert!((linear.peak_height(1e12, 1.0) * linear.sigma(1e12, 1.0) - 1.686_47).abs() < 1e-6);
    }

    #[test]
    fn masses_outside_the_table_give_nan_not_a_guess() {
        let linear = planck18();
        for mass in [10.0, 1e20, -1.0, f64::NAN] {
            assert!(linear.sigma(mass, 0.0).is_nan(), "{mass}");
        }
        assert!(linear.sigma(MASS_MIN_MSUN * 1.01, 0.0) > linear.sigma(MASS_MAX_MSUN * 0.99, 0.0));
    }

    #[test]
    fn other_hubble_units_keep_the_relation_in_h_units() {
        let native = planck18();
        let mixed = planck18().in_hubble_units_of(67.4).unwrap();
        let mass_in_h_units = 3e12;
        let (m, m_mixed) = (mass_in_h_units / 0.6766, mass_in_h_units / 0.674);
        assert!((mixed.sigma_today(m_mixed) / native.sigma_today(m) - 1.0).abs() < 1e-13);
        let radius_ratio = mixed.lagrangian_radius_mpc(m_mixed) / native.lagrangian_radius_mpc(m);
        assert!((radius_ratio * 0.674 / 0.6766 - 1.0).abs() < 1e-13);
        let slope = mixed.smooth_power_slope(m_mixed, 1.0) / native.smooth_power_slope(m, 1.0);
        assert!((slope - 1.0).abs() < 1e-12);
    }

    #[test]
    fn unphysical_parameters_are_refused_by_name() {
        let good = StructureParameters::planck18();
        for (bad, name) in [
            (StructureParameters { omega_b: 0.0, ..good }, "omega_b"),
            (StructureParameters { omega_b: 0.4, ..good }, "omega_b"),
            (StructureParameters { sigma8: -0.8, ..good }, "sigma8"),
            (StructureParameters { n_s: f64::NAN, ..good }, "n_s"),
            (StructureParameters { t_cmb_k: 0.0, ..good }, "t_cmb_k"),
            (StructureParameters { omega_m: 2.0, ..good }, "omega_m"),
        ] {
            let message = LinearTheory::new(bad).unwrap_err().to_string();
            assert!(message.contains(name), "{message}");
        }
    }
}
