//! Direct: the haloes that pass the cut are themselves a Poisson process, and only they are drawn.

use rand::RngExt;
use rayon::prelude::*;

use super::{DrawnHaloes, draw_brute_force, poisson};
use crate::error::Result;
use crate::halo::nfw_parameters::NfwScaling;
use crate::halo::population::{Population, SLABS};
use crate::monitor::Monitor;
use crate::numerics::random::{Stage, stream};

/// Draws only haloes that pass the cut, density n(M)·π·min(R², r_E²(M, χ)/ε) in (χ, ln M).
///
/// In a slab the process is drawn with the largest r_E² of the slab and thinned by the true one, which is exact.
/// Without a cut every halo passes, and the draw is that of [`draw_brute_force`]. `monitor` is told of every halo.
///
/// # Errors
/// When `monitor` cancels.
pub fn draw_direct(
    population: &Population,
    seed: u64,
    realisation: u64,
    monitor: &dyn Monitor,
) -> Result<DrawnHaloes> {
    if population.limits().min_point_shear == 0.0 {
        return draw_brute_force(population, seed, realisation, monitor);
    }
    let scaling = NfwScaling::new(population.background(), population.z_source());
    let radius_squared = population.limits().radius_cmpc.powi(2);
    let slabs: Result<Vec<DrawnHaloes>> = (0..SLABS)
        .into_par_iter()
        .map(|i| {
            monitor.check()?;
            let mut rng = stream(seed, realisation, Stage::DirectDraw, i as u64);
            let table = population.table(i);
            let envelope = envelope_squared_per_msun(population, &scaling, i);
            let star = radius_squared / envelope;
            let masses = table.limited(star);
            let area = std::f64::consts::PI * radius_squared * masses.number_per_cmpc3();
            let mut slab = DrawnHaloes::default();
            for _ in 0..poisson(&mut rng, area * population.slab_cmpc()) {
                let chi = population.slab_cmpc() * (i as f64 + rng.random::<f64>());
                let mass = masses.sample_msun(rng.random());
                let drawn_within = radius_squared.min(mass * envelope);
                let r2 = drawn_within * rng.random::<f64>();
                if r2 <= mass * population.kept_radius_squared_per_msun(&scaling, chi) {
                    slab.push(chi, r2, rng.random(), mass);
                    slab.number_drawn += 1;
                }
            }
            monitor.advance(slab.number_drawn);
            Ok(slab)
        })
        .collect();
    Ok(DrawnHaloes::concatenate(slabs?))
}

/// An upper bound of r_E²/(ε M) over slab `i`: the function of χ is smooth and concave up to one maximum.
///
/// Its largest value on nine points, raised by 1%: between two of them a concave function rises above both
/// by less than an eighth of their spacing squared times its curvature, 2e-6 of the maximum.
fn envelope_squared_per_msun(population: &Population, scaling: &NfwScaling, slab: usize) -> f64 {
    let largest = (0..=8)
        .map(|k| {
            let chi = population.slab_cmpc() * (slab as f64 + f64::from(k) / 8.0);
            population.kept_radius_squared_per_msun(scaling, chi)
        })
        .fold(0.0, f64::max);
    1.01 * largest
}
