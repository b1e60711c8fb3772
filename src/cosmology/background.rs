//! Distances and densities of flat ΛCDM without radiation, to machine precision.

use serde::{Deserialize, Serialize};

use crate::constants::{CRITICAL_DENSITY_MSUN_MPC3_PER_H0_SQUARED, SPEED_OF_LIGHT_KM_S};
use crate::error::{Domain, Error, Result};
use crate::numerics::dispatch::kernel;
use crate::numerics::quadrature::{SHORT_NODES, UnitRule, short_rule, unit_rule};
use crate::numerics::real::sum_of_halves;

/// The two numbers that fix a [`Background`], as a configuration file holds them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BackgroundParameters {
    /// Hubble constant, km/s/Mpc.
    pub h0_km_s_mpc: f64,
    /// Matter density today over the critical density, in (0, 1].
    pub omega_m: f64,
}

/// Flat ΛCDM expansion history without radiation: E²(z) = Ωm (1+z)³ + 1 − Ωm.
///
/// With u = (1+z)^(−1/2) the comoving distance becomes
/// χ(z₁, z₂) = 2 c/H₀ ∫ du / √(Ωm + (1−Ωm) u⁶) from u₂ to u₁,
/// an integrand analytic on all of [0, 1]: one Gauss–Legendre rule, of 16 nodes for widths up to 0.4 (z ≤ 1.77 from us) and
/// of 32 for others, gives every distance to about 1e-15 relative for Ωm ≥ 0.1 and any z ≥ 0 (1e-11 at Ωm = 0.01). The width
/// u₁ − u₂ is formed without cancellation, so this also holds for tiny redshifts and differences.
/// Shown by `tests/reference/cosmology.rs` against astropy.
///
/// ```
/// use haloray::cosmology::Background;
/// let background = Background::paper();
/// assert!((background.comoving_distance_mpc(1.5) - 4482.096985550197).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(try_from = "BackgroundParameters", into = "BackgroundParameters")]
#[schemars(with = "BackgroundParameters")]
pub struct Background {
    h0_km_s_mpc: f64,
    omega_m: f64,
}

impl Background {
    /// Background with 10 ≤ `h0_km_s_mpc` ≤ 1000, which h = H0/100 is not, and 0 < `omega_m` ≤ 1 (1 is Einstein–de Sitter).
    pub fn new(h0_km_s_mpc: f64, omega_m: f64) -> Result<Self> {
        Domain::from_to(10.0, 1000.0).check("h0_km_s_mpc", h0_km_s_mpc)?;
        Domain::above_to(0.0, 1.0).check("omega_m", omega_m)?;
        Ok(Self { h0_km_s_mpc, omega_m })
    }

    /// H₀ = 67.4 km/s/Mpc, Ωm = 0.315: the distances of Hogg, Fleury, Larena & Martinelli 2023.
    pub const fn paper() -> Self {
        Self { h0_km_s_mpc: 67.4, omega_m: 0.315 }
    }

    /// H₀ = 67.66 km/s/Mpc, Ωm = 0.3111: Planck 2018 (A&A 641, A6), Table 2, with lensing and BAO.
    pub const fn planck18() -> Self {
        Self { h0_km_s_mpc: 67.66, omega_m: 0.3111 }
    }

    /// Hubble constant, km/s/Mpc.
    pub fn h0_km_s_mpc(&self) -> f64 {
        self.h0_km_s_mpc
    }

    /// Matter density today over the critical density.
    pub fn omega_m(&self) -> f64 {
        self.omega_m
    }

    /// Hubble distance c/H₀, Mpc.
    pub fn hubble_distance_mpc(&self) -> f64 {
        SPEED_OF_LIGHT_KM_S / self.h0_km_s_mpc
    }

    /// E(z) = H(z)/H₀ for z > −1.
    pub fn hubble_ratio(&self, z: f64) -> f64 {
        (self.omega_m * (1.0 + z).powi(3) + 1.0 - self.omega_m).sqrt()
    }

    /// Matter density over the critical density at redshift z, Ωm (1+z)³ / E².
    pub fn omega_m_at(&self, z: f64) -> f64 {
        let matter = self.omega_m * (1.0 + z).powi(3);
        matter / (matter + 1.0 - self.omega_m)
    }

    /// Critical density 3H²/(8πG) at redshift z, physical Msun/Mpc³.
    pub fn critical_density_msun_mpc3(&self, z: f64) -> f64 {
        let today = CRITICAL_DENSITY_MSUN_MPC3_PER_H0_SQUARED * self.h0_km_s_mpc * self.h0_km_s_mpc;
        today * (self.omega_m * (1.0 + z).powi(3) + 1.0 - self.omega_m)
    }

    /// Mean matter density, comoving Msun/Mpc³ (the physical one is (1+z)³ times this).
    pub fn mean_matter_density_msun_mpc3(&self) -> f64 {
        self.omega_m * self.critical_density_msun_mpc3(0.0)
    }

    /// Comoving distance from us to redshift `z` ≥ 0, Mpc.
    pub fn comoving_distance_mpc(&self, z: f64) -> f64 {
        self.comoving_distance_between_mpc(0.0, z)
    }

    /// Comoving distances from us to many redshifts ≥ 0, Mpc, each with the bits of [`Self::comoving_distance_mpc`].
    pub fn comoving_distances_mpc(&self, z: &[f64]) -> Vec<f64> {
        let widths: Vec<f64> = z.iter().map(|&z| width_to(z)).collect();
        let mut means = widths.clone();
        means_over_short_ranges(self.omega_m, &mut means);
        let distance = |(&width, &mean): (&f64, &f64)| {
            let integral =
                if width <= SHORT_WIDTH { 2.0 * width * mean } else { self.distance_integral(1.0, width) };
            self.hubble_distance_mpc() * integral
        };
        widths.iter().zip(&means).map(distance).collect()
    }

    /// Comoving distance from `z1` to `z2`, Mpc; negative when `z2` < `z1`.
    pub fn comoving_distance_between_mpc(&self, z1: f64, z2: f64) -> f64 {
        let u1 = (1.0 + z1).sqrt().recip();
        self.hubble_distance_mpc() * self.distance_integral(u1, u1 * width_to((z2 - z1) / (1.0 + z1)))
    }

    /// Angular diameter distance from us to redshift `z` ≥ 0, Mpc.
    pub fn angular_diameter_distance_mpc(&self, z: f64) -> f64 {
        self.comoving_distance_mpc(z) / (1.0 + z)
    }

    /// Angular diameter distance of an object at `z2` seen from `z1` (flat space), Mpc.
    pub fn angular_diameter_distance_between_mpc(&self, z1: f64, z2: f64) -> f64 {
        self.comoving_distance_between_mpc(z1, z2) / (1.0 + z2)
    }

    /// Redshift at comoving distance `chi_mpc`, the inverse of [`Self::comoving_distance_mpc`].
    ///
    /// Halley's iteration in w = 1 − (1+z)^(−1/2), where χ(w) is nearly linear; machine precision
    /// after two or three steps.
    ///
    /// Errors: `chi_mpc` negative, not a number, or at or beyond χ(z → ∞).
    pub fn redshift_at_comoving_distance(&self, chi_mpc: f64) -> Result<f64> {
        // The integrand is 1 at least, and the horizon twice the Hubble distance.
        let is_near = (0.0..2.0 * self.hubble_distance_mpc()).contains(&chi_mpc);
        let horizon_mpc = || self.hubble_distance_mpc() * self.distance_integral(1.0, 1.0);
        if !is_near && !(0.0..horizon_mpc()).contains(&chi_mpc) {
            let horizon_mpc = horizon_mpc();
            let allowed = format!("at least 0 and below the horizon, {horizon_mpc:.1}");
            return Err(Error::out_of_range("comoving distance in Mpc", chi_mpc, &allowed));
        }
        let target = chi_mpc / self.hubble_distance_mpc();
        let mut width = (0.5 * target).min(1.0 - f64::EPSILON);
        for _ in 0..ITERATIONS_MAX {
            let excess = self.distance_integral(1.0, width) - target;
            let u = 1.0 - width;
            let energy = self.omega_m + (1.0 - self.omega_m) * u.powi(6);
            let newton = 0.5 * excess * energy.sqrt();
            // χ″/χ′ = 3 (1−Ωm) u⁵ / (Ωm + (1−Ωm) u⁶)
            let curvature = 3.0 * (1.0 - self.omega_m) * u.powi(5) / energy;
            let step = newton / (1.0 - 0.5 * newton * curvature).max(0.5);
            width = (width - step).clamp(0.0, 1.0 - f64::EPSILON);
            // The error falls with its third power.
            if step.abs() <= STEP_BEFORE_ROUNDING * width {
                break;
            }
        }
        // (1−w)⁻² − 1.
        let u = 1.0 - width;
        Ok(width * (2.0 - width) / (u * u))
    }

    /// 2 ∫ du / √(Ωm + (1−Ωm) u⁶) over [`u_high` − `width`, `u_high`].
    fn distance_integral(&self, u_high: f64, width: f64) -> f64 {
        // Its next singularities are (Ωm/(1−Ωm))^⅙ from 0 at 30° to the real axis: ρ is large for a narrow range.
        let mean = match width.abs() <= SHORT_WIDTH {
            true => mean_over_short_range(self.omega_m, u_high, width),
            false => mean_over_range(self.omega_m, u_high, width),
        };
        2.0 * width * mean
    }
}

/// 1 − (1+z)^(−1/2), without cancellation.
fn width_to(z: f64) -> f64 {
    let root = (1.0 + z).sqrt();
    z / (root * (1.0 + root))
}

/// Steps allowed to Halley's iteration, which needs two or three.
const ITERATIONS_MAX: usize = 12;
/// A relative step after which the error is one of rounding.
const STEP_BEFORE_ROUNDING: f64 = 4e-6;
/// Distances that are computed side by side.
const SIDE_BY_SIDE: usize = 16;
/// Widths up to this take 16 nodes.
const SHORT_WIDTH: f64 = 0.4;

kernel! {
    fn mean_over_short_range(omega_m: f64, u_high: f64, width: f64) -> f64 {
        mean_inverse_energy(short_rule(), omega_m, u_high, width)
    }
}

kernel! {
    /// Replaces widths below 1 by the means over them, with the bits of `mean_over_short_range`, several side by side.
    fn means_over_short_ranges(omega_m: f64, widths: &mut [f64]) {
        let rule = short_rule();
        for widths in widths.chunks_mut(SIDE_BY_SIDE) {
            let mut width = [0.0; SIDE_BY_SIDE];
            width[..widths.len()].copy_from_slice(widths);
            let mut terms = [[0.0; SIDE_BY_SIDE]; SHORT_NODES];
            for ((terms, node), weight) in terms.iter_mut().zip(&rule.nodes).zip(&rule.weights) {
                for (term, width) in terms.iter_mut().zip(&width) {
                    *term = weight * inverse_energy(omega_m, 1.0 - width * node);
                }
            }
            // As `sum_of_halves` adds.
            let mut n = SHORT_NODES;
            while n > 1 {
                n /= 2;
                let (sums, others) = terms.split_at_mut(n);
                for (sums, others) in sums.iter_mut().zip(others) {
                    sums.iter_mut().zip(others).for_each(|(sum, other)| *sum += *other);
                }
            }
            widths.copy_from_slice(&terms[0][..widths.len()]);
        }
    }
}

kernel! {
    fn mean_over_range(omega_m: f64, u_high: f64, width: f64) -> f64 {
        mean_inverse_energy(unit_rule(), omega_m, u_high, width)
    }
}

/// Mean of 1/√(Ωm + (1−Ωm) u⁶) over [`u_high` − `width`, `u_high`].
#[inline(always)]
fn mean_inverse_energy<const N: usize>(rule: &UnitRule<N>, omega_m: f64, u_high: f64, width: f64) -> f64 {
    let mut terms = rule.weights;
    for (term, node) in terms.iter_mut().zip(&rule.nodes) {
        *term *= inverse_energy(omega_m, u_high - width * node);
    }
    sum_of_halves(terms)
}

/// 1/√(Ωm + (1−Ωm) u⁶).
#[inline(always)]
fn inverse_energy(omega_m: f64, u: f64) -> f64 {
    let u3 = u * u * u;
    1.0 / (omega_m + (1.0 - omega_m) * (u3 * u3)).sqrt()
}

impl TryFrom<BackgroundParameters> for Background {
    type Error = Error;

    fn try_from(parameters: BackgroundParameters) -> Result<Self> {
        Self::new(parameters.h0_km_s_mpc, parameters.omega_m)
    }
}

impl From<Background> for BackgroundParameters {
    fn from(background: Background) -> Self {
        Self { h0_km_s_mpc: background.h0_km_s_mpc, omega_m: background.omega_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn einstein_de_sitter_has_its_closed_form() {
        let background = Background::new(70.0, 1.0).unwrap();
        for z in [1e-9, 1e-3, 0.5, 2.0, 20.0, 1000.0] {
            let exact = 2.0 * background.hubble_distance_mpc() * -(-0.5 * f64::ln_1p(z)).exp_m1();
            let ratio = background.comoving_distance_mpc(z) / exact;
            assert!((ratio - 1.0).abs() < 2e-15, "z = {z}: {ratio}");
        }
    }

    #[test]
    fn tiny_redshifts_follow_the_hubble_law() {
        // χ = c/H₀ (z − ¾ Ωm z² + …)
        let background = Background::paper();
        for z in [1e-12, 1e-9, 1e-7] {
            let series = background.hubble_distance_mpc() * z * (1.0 - 0.75 * 0.315 * z);
            assert!((background.comoving_distance_mpc(z) / series - 1.0).abs() < 1e-13, "z = {z}");
        }
    }

    #[test]
    fn distances_add_along_the_line_of_sight() {
        let background = Background::paper();
        let parts =
            background.comoving_distance_mpc(0.5) + background.comoving_distance_between_mpc(0.5, 1.5);
        assert!((parts / background.comoving_distance_mpc(1.5) - 1.0).abs() < 1e-15);
        let back = background.comoving_distance_between_mpc(1.5, 0.5);
        assert!((back + background.comoving_distance_between_mpc(0.5, 1.5)).abs() < 1e-11);
    }

    #[test]
    fn many_distances_have_the_bits_of_single_ones() {
        for background in [Background::paper(), Background::new(80.0, 0.05).unwrap()] {
            let z: Vec<f64> = (0..1003).map(|i| 1e-9 * 10f64.powf(0.011 * f64::from(i))).collect();
            let single: Vec<f64> = z.iter().map(|&z| background.comoving_distance_mpc(z)).collect();
            assert_eq!(background.comoving_distances_mpc(&z), single);
        }
        assert!(Background::paper().comoving_distances_mpc(&[]).is_empty());
    }

    #[test]
    fn the_rule_is_converged_for_every_matter_density() {
        // One panel of 32 nodes against twenty panels.
        for (omega_m, tolerance) in [(0.01, 1e-10), (0.1, 1e-15), (0.315, 1e-15), (0.9, 1e-15)] {
            let background = Background::new(70.0, omega_m).unwrap();
            let one = background.distance_integral(1.0, 1.0);
            let many: f64 =
                (0..20).map(|i| background.distance_integral(1.0 - f64::from(i) / 20.0, 0.05)).sum();
            assert!((one / many - 1.0).abs() < 2.0 * tolerance, "{omega_m}: {}", one / many - 1.0);
            // The widest of 16 nodes against halves of it.
            let short = |u: f64, width: f64| background.distance_integral(u, width);
            let [whole, halves] = [short(1.0, 0.4), short(1.0, 0.2) + short(0.8, 0.2)];
            assert!((whole / halves - 1.0).abs() < 2.0 * tolerance, "{omega_m}: {}", whole / halves - 1.0);
        }
    }

    #[test]
    fn redshift_at_comoving_distance_inverts_the_distance() {
        for background in [
            Background::paper(),
            Background::planck18(),
            Background::new(50.0, 1.0).unwrap(),
            Background::new(80.0, 0.05).unwrap(),
        ] {
            for i in 0..=400 {
                let z = 1e-10 * 10f64.powf(0.03 * f64::from(i));
                let chi_mpc = background.comoving_distance_mpc(z);
                let back = background.redshift_at_comoving_distance(chi_mpc).unwrap();
                // dln(1+z)/dlnχ grows with (1+z)^½: what one rounding error of χ costs.
                let tolerance = 1e-15 * (4.0 + 10.0 * (1.0 + z).sqrt());
                assert!((back / z - 1.0).abs() < tolerance, "z = {z:e}: {:e}", back / z - 1.0);
            }
            assert_eq!(background.redshift_at_comoving_distance(0.0).unwrap(), 0.0);
        }
    }

    #[test]
    fn distances_outside_the_horizon_and_unphysical_parameters_are_refused() {
        let background = Background::paper();
        for chi_mpc in [-1.0, 15_000.0, f64::NAN, f64::INFINITY] {
            assert!(background.redshift_at_comoving_distance(chi_mpc).is_err(), "{chi_mpc}");
        }
        for (h0, omega_m) in [(0.0, 0.3), (f64::NAN, 0.3), (70.0, 0.0), (70.0, 1.2)] {
            assert!(Background::new(h0, omega_m).is_err(), "{h0} {omega_m}");
        }
    }

    #[test]
    fn densities_are_consistent() {
        let background = Background::planck18();
        for z in [0.0_f64, 0.7, 3.0] {
            let mean = background.mean_matter_density_msun_mpc3() * (1.0 + z).powi(3);
            let ratio = mean / background.critical_density_msun_mpc3(z) / background.omega_m_at(z);
            assert!((ratio - 1.0).abs() < 1e-14, "z = {z}");
        }
    }

    #[test]
    fn parameters_are_checked_when_read() {
        let good: Background = toml::from_str("h0_km_s_mpc = 67.4\nomega_m = 0.315").unwrap();
        assert_eq!(good, Background::paper());
        assert!(toml::from_str::<Background>("h0_km_s_mpc = 67.4\nomega_m = -1.0").is_err());
        let misspelt = "h0_km_s_mpc = 67.4\nomega_m = 0.3\nomega_k = 0.1";
        assert!(toml::from_str::<Background>(misspelt).is_err());
    }
}
