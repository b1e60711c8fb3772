//! Sheets of the expected mass: what the population would add to each plane on average.

use super::catalogue::HaloCatalogue;
use super::population::{Population, SLABS};
use crate::constants::GM_SUN_OVER_C2_MPC;
use crate::error::Result;
use crate::numerics::spline::UniformSpline;

/// Expected convergence of the population for the plane of each halo, in catalogue order, reduced to the source.
///
/// The line of sight is shared out between the planes at the midpoints of their distances; the share of a plane is
/// κ = ∫dχ 4πG/c²·ρ_h(χ)(1+z)χ(χ_s−χ)/χ_s with ρ_h = ∫M n d ln M, the comoving mass density in haloes.
/// All shares add up to the convergence of the whole population.
///
/// # Errors
/// Never for a population that was built; the integral is smooth.
pub fn mean_density_sheets(population: &Population, haloes: &HaloCatalogue) -> Result<Vec<f64>> {
    let cumulative = cumulative_convergence(population)?;
    let mut order: Vec<(f64, usize)> = haloes.chi_cmpc.iter().enumerate().map(|(i, &chi)| (chi, i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut sheets = vec![0.0; order.len()];
    let mut below = 0.0;
    for (k, &(chi, i)) in order.iter().enumerate() {
        let upper = order.get(k + 1).map_or(cumulative.end(), |next| 0.5 * (chi + next.0));
        let up_to = cumulative.value(upper);
        sheets[i] = up_to - below;
        below = up_to;
    }
    Ok(sheets)
}

/// κ of all haloes nearer than χ, by Simpson's rule in each slab.
fn cumulative_convergence(population: &Population) -> Result<UniformSpline> {
    let step = population.slab_cmpc();
    let chi_source = step * SLABS as f64;
    let density = |slab: usize, chi: f64| {
        4.0 * std::f64::consts::PI
            * GM_SUN_OVER_C2_MPC
            * population.table(slab).mass_msun_per_cmpc3()
            * (1.0 + population.redshift(chi))
            * chi
            * (chi_source - chi)
            / chi_source
    };
    let mut at = vec![0.0];
    let mut sum = 0.0;
    for slab in 0..SLABS {
        let low = step * slab as f64;
        sum += step / 6.0
            * (density(slab, low) + 4.0 * density(slab, low + 0.5 * step) + density(slab, low + step));
        at.push(sum);
    }
    UniformSpline::new(0.0, step, &at)
}
