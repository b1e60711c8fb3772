//! Sheets of the expected mass: what the haloes that are traced would add to each plane on average.

use super::catalogue::HaloCatalogue;
use super::population::{Population, SLABS};
use crate::constants::GM_SUN_OVER_C2_MPC;
use crate::error::Result;
use crate::numerics::spline::UniformSpline;

/// The share of an expected convergence for the plane of each halo, in catalogue order, reduced to the source.
///
/// The line of sight is shared out between the planes at the midpoints of their distances; `expected` is the
/// convergence of everything nearer than χ. All shares add up to the whole.
pub fn mean_density_sheets(expected: &UniformSpline, haloes: &HaloCatalogue) -> Vec<f64> {
    let mut order: Vec<(f64, usize)> = haloes.chi_cmpc.iter().enumerate().map(|(i, &chi)| (chi, i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut sheets = vec![0.0; order.len()];
    let mut below = 0.0;
    for (k, &(chi, i)) in order.iter().enumerate() {
        let upper = order.get(k + 1).map_or(expected.end(), |next| 0.5 * (chi + next.0));
        let up_to = expected.value(upper);
        sheets[i] = up_to - below;
        below = up_to;
    }
    sheets
}

/// Convergence of a smooth comoving density ρ(χ, slab) between observer and source:
/// κ = ∫dχ 4πG/c²·ρ(1+z)χ(χ_s−χ)/χ_s, by Simpson's rule in each slab.
fn convergence(population: &Population, density_msun_per_cmpc3: impl Fn(usize) -> f64) -> f64 {
    let step = population.slab_cmpc();
    let chi_source = step * SLABS as f64;
    let kernel = |chi: f64| (1.0 + population.redshift(chi)) * chi * (chi_source - chi) / chi_source;
    let slab = |i: usize| {
        let low = step * i as f64;
        let simpson = kernel(low) + 4.0 * kernel(low + 0.5 * step) + kernel(low + step);
        4.0 * std::f64::consts::PI * GM_SUN_OVER_C2_MPC * density_msun_per_cmpc3(i) * simpson * step / 6.0
    };
    (0..SLABS).map(slab).sum()
}

/// Convergence to the source of all matter at its mean density, and of the population's M200c alone.
pub fn smooth_convergences(population: &Population) -> [f64; 2] {
    let mean = population.background().mean_matter_density_msun_mpc3();
    [
        convergence(population, |_| mean),
        convergence(population, |i| population.table(i).mass_msun_per_cmpc3()),
    ]
}

/// Expected convergence on the axis of haloes that are kept within `theta_max` of it: π θ²·κ̄(< θ), arcsec².
///
/// # Errors
/// Never; the type is that of [`super::expected_sum`].
pub fn convergence_over_disc(lens: &crate::profile::mass::MassModel, theta_max: f64) -> Result<f64> {
    use crate::profile::mass::MassProfile;
    Ok(std::f64::consts::PI * theta_max * lens.deflection(theta_max, 0.0)[0])
}
