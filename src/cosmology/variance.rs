//! Variance σ²(R) of the linear density field in top-hat spheres, tabulated in ln M.

use std::f64::consts::PI;

use crate::error::Result;
use crate::numerics::spline::UniformSpline;

/// Step of the ln k grid; halving it changes ln σ by less than 1e-8 (see the tests).
const DLN_K: f64 = 0.01;
/// Wavenumber steps between neighbouring radii, so that the nodes lie 0.06 apart in ln M.
const STEPS_PER_NODE: usize = 2;
/// Smallest wavenumber, comoving Mpc⁻¹: Δ² ∝ k⁴ there, 1e-14 of its value at any halo's scale.
const K_MIN_PER_MPC: f64 = 1e-6;
/// Beyond this k·R the integrand, falling as (kR)⁻⁴, holds under 1e-9 of the variance.
const X_MAX: f64 = 300.0;

/// What the variance is computed from.
pub struct VarianceInput<F: Fn(f64) -> f64> {
    /// Δ²(k) ∝ k³P(k) up to a constant factor, k in comoving Mpc⁻¹.
    pub power: F,
    /// Mean matter density, comoving Msun/Mpc³; M = (4π/3) ρ̄ R³.
    pub mean_density_msun_mpc3: f64,
    /// σ at `radius8_mpc` and z = 0, which fixes the factor.
    pub sigma8: f64,
    /// 8 h⁻¹ Mpc, in Mpc.
    pub radius8_mpc: f64,
}

/// Fourier transform of the top-hat sphere, W(x) = 3 (sin x − x cos x)/x³.
pub fn top_hat_window(x: f64) -> f64 {
    if x.abs() < 0.05 {
        let x2 = x * x;
        return 1.0 - x2 / 10.0 * (1.0 - x2 / 28.0 * (1.0 - x2 / 54.0));
    }
    3.0 * (x.sin() - x * x.cos()) / (x * x * x)
}

/// ln σ at z = 0 as a spline over ln(M/Msun), from `mass_min_msun` to at least `mass_max_msun`.
///
/// σ²(R) = ∫ Δ²(k) W²(kR) dlnk by the trapezium rule on an equally spaced ln k grid, which converges
/// exponentially for an integrand that vanishes smoothly at both ends. The radii lie on the same
/// grid, so W² is needed only at the sums of two grid points: once for the whole table.
pub fn tabulate_ln_sigma<F: Fn(f64) -> f64>(
    input: &VarianceInput<F>,
    mass_min_msun: f64,
    mass_max_msun: f64,
) -> Result<UniformSpline> {
    tabulate_with_step(input, mass_min_msun, mass_max_msun, DLN_K)
}

fn tabulate_with_step<F: Fn(f64) -> f64>(
    input: &VarianceInput<F>,
    mass_min_msun: f64,
    mass_max_msun: f64,
    dln_k: f64,
) -> Result<UniformSpline> {
    let radius_min_mpc = (3.0 * mass_min_msun / (4.0 * PI * input.mean_density_msun_mpc3)).cbrt();
    let dln_mass = 3.0 * dln_k * STEPS_PER_NODE as f64;
    let nodes = ((mass_max_msun / mass_min_msun).ln() / dln_mass).ceil() as usize + 1;

    let x_min = K_MIN_PER_MPC * radius_min_mpc;
    let count = ((X_MAX / x_min).ln() / dln_k).ceil() as usize;
    let factors: Vec<f64> = (0..count).map(|i| (dln_k * i as f64).exp()).collect();
    let wavenumbers: Vec<f64> = factors.iter().map(|factor| K_MIN_PER_MPC * factor).collect();
    let power: Vec<f64> = wavenumbers.iter().map(|&k| (input.power)(k)).collect();
    let window: Vec<f64> = factors.iter().map(|factor| top_hat_window(x_min * factor).powi(2)).collect();

    let variance8: f64 = wavenumbers
        .iter()
        .zip(&power)
        .map(|(k, p)| (k * input.radius8_mpc, p))
        .take_while(|&(x, _)| x < X_MAX)
        .map(|(x, p)| p * top_hat_window(x).powi(2))
        .sum();
    let ln_factor = 2.0 * input.sigma8.ln() - variance8.ln();

    let ln_sigma: Vec<f64> = (0..nodes)
        .map(|node| {
            // At node j the window of wavenumber i is number i + STEPS_PER_NODE·j.
            let shifted = &window[(STEPS_PER_NODE * node).min(count)..];
            let variance: f64 = power.iter().zip(shifted).map(|(p, w)| p * w).sum();
            0.5 * (variance.ln() + ln_factor)
        })
        .collect();
    UniformSpline::new(mass_min_msun.ln(), dln_mass, &ln_sigma)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::eisenstein98::Eisenstein98;
    use crate::cosmology::{Background, StructureParameters};

    fn power_law(slope: f64) -> VarianceInput<impl Fn(f64) -> f64> {
        VarianceInput {
            power: move |k: f64| k.powf(slope + 3.0),
            mean_density_msun_mpc3: 4e10,
            sigma8: 0.8,
            radius8_mpc: 12.0,
        }
    }

    #[test]
    fn the_window_is_continuous_at_the_seam_and_one_at_zero() {
        assert_eq!(top_hat_window(0.0), 1.0);
        let (below, above) = (top_hat_window(0.05 - 1e-12), top_hat_window(0.05 + 1e-12));
        assert!((below - above).abs() < 1e-12);
        // W vanishes where tan x = x.
        assert!(top_hat_window(4.493_409_457_909_064).abs() < 1e-15);
    }

    #[test]
    fn a_power_law_spectrum_gives_a_power_law_variance() {
        // P ∝ kⁿ: σ ∝ R^−(n+3)/2 ∝ M^−(n+3)/6, and σ8 as asked.
        let table = tabulate_ln_sigma(&power_law(-1.5), 1e8, 1e16).unwrap();
        for ln_mass in [20.0, 25.0, 30.0, 35.0] {
            assert!((table.derivative(ln_mass) + 0.25).abs() < 1e-6, "{ln_mass}");
        }
        let mass8: f64 = 4.0 / 3.0 * PI * 4e10 * 12f64.powi(3);
        assert!((table.value(mass8.ln()).exp() / 0.8 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_grid_is_converged() {
        let parameters = StructureParameters::planck18();
        let shape = Eisenstein98::new(&parameters);
        let input = VarianceInput {
            power: |k: f64| k.powf(3.0 + parameters.n_s) * shape.transfer(k).powi(2),
            mean_density_msun_mpc3: Background::planck18().mean_matter_density_msun_mpc3(),
            sigma8: parameters.sigma8,
            radius8_mpc: 8.0 / 0.6766,
        };
        let coarse = tabulate_with_step(&input, 1e2, 1e18, DLN_K).unwrap();
        let fine = tabulate_with_step(&input, 1e2, 1e18, 0.25 * DLN_K).unwrap();
        for i in 0..=1000 {
            let ln_mass = coarse.start() + (coarse.end() - coarse.start()) * f64::from(i) / 1001.0;
            let value = coarse.value(ln_mass) - fine.value(ln_mass);
            let slope = coarse.derivative(ln_mass) / fine.derivative(ln_mass) - 1.0;
            assert!(value.abs() < 1e-8, "ln M = {ln_mass}: {value:e}");
            assert!(slope.abs() < 1e-5, "ln M = {ln_mass}: {slope:e}");
        }
    }
}
