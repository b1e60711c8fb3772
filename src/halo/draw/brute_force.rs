//! Brute force: every halo of the cylinder is drawn, then the shear cut is applied, slab by slab.

use rand::RngExt;
use rayon::prelude::*;

use super::{DrawnHaloes, poisson};
use crate::error::Result;
use crate::halo::nfw_parameters::NfwScaling;
use crate::halo::population::{Population, SLABS};
use crate::monitor::Monitor;
use crate::numerics::random::{Stage, stream};

/// Draws all haloes of the cylinder (ten million in the paper's) and keeps those that pass the cut.
///
/// Slabs are independent streams and only kept haloes are stored, so memory stays at a few MB and the result
/// does not depend on the number of threads. `monitor` is told of every halo drawn.
///
/// # Errors
/// When `monitor` cancels.
pub fn draw_brute_force(
    population: &Population,
    seed: u64,
    realisation: u64,
    monitor: &dyn Monitor,
) -> Result<DrawnHaloes> {
    let scaling = NfwScaling::new(population.background(), population.z_source());
    let radius_squared = population.limits().radius_cmpc.powi(2);
    let volume = std::f64::consts::PI * radius_squared * population.slab_cmpc();
    let slabs: Result<Vec<DrawnHaloes>> = (0..SLABS)
        .into_par_iter()
        .map(|i| {
            monitor.check()?;
            let mut rng = stream(seed, realisation, Stage::BruteForceDraw, i as u64);
            let table = population.table(i);
            let number = poisson(&mut rng, table.number_per_cmpc3() * volume);
            let mut slab = DrawnHaloes { number_drawn: number, ..DrawnHaloes::default() };
            for _ in 0..number {
                let chi = population.slab_cmpc() * (i as f64 + rng.random::<f64>());
                let r2 = radius_squared * rng.random::<f64>();
                let u = rng.random();
                // γ = r_E²/r² ≥ ε, and r_E²/ε is infinite without a cut.
                let kept_per_msun = population.kept_radius_squared_per_msun(&scaling, chi);
                if r2 > table.at_most_msun(u) * kept_per_msun {
                    continue;
                }
                let mass = table.sample_msun(u);
                if r2 <= mass * kept_per_msun {
                    slab.push(chi, r2, rng.random(), mass);
                }
            }
            monitor.advance(number);
            Ok(slab)
        })
        .collect();
    Ok(DrawnHaloes::concatenate(slabs?))
}
