//! The matter on the line of sight: what the haloes that are traced hold on average, and what sheets take away.

use serde::Serialize;

use crate::config::{Config, HALO_MASS_DEFINITION};
use crate::cosmology::LinearTheory;
use crate::diagnostics::shear_variation;
use crate::error::Result;
use crate::halo::{Epoch, HaloShapes, Population, convergence_over_disc, expected_sum, smooth_convergences};
use crate::numerics::spline::UniformSpline;
use crate::profile::mass::{MassModel, MassProfile};

/// Which of the haloes are traced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Selection {
    /// All that pass the cut and `haloes.max_kappa`.
    All,
    /// Of these, the ones in the tidal regime: Δ_h below the threshold.
    TidalRegime,
}

/// Mass between observer and source as the convergence that it causes on the axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MatterBudget {
    /// All matter at its mean density.
    pub kappa_of_mean_density: f64,
    /// M200c of the whole population.
    pub kappa_of_population_m200c: f64,
    /// The haloes that are traced, on average over realisations; none for an imported catalogue.
    pub kappa_of_traced_haloes: Option<f64>,
    /// The sheets of this realisation.
    pub kappa_of_sheets: f64,
}

impl MatterBudget {
    /// Counts the matter of a population beside the sheets of one line of sight.
    ///
    /// # Errors
    /// As [`expectation`].
    pub fn of(config: &Config, linear: &LinearTheory, population: &Population, sheets: f64) -> Result<Self> {
        let [kappa_of_mean_density, kappa_of_population_m200c] = smooth_convergences(population);
        let kappa_of_traced_haloes = match config.haloes.is_imported() {
            false => Some(end(&mean_convergence(config, linear, population, Selection::All)?)),
            true => None,
        };
        Ok(Self {
            kappa_of_mean_density,
            kappa_of_population_m200c,
            kappa_of_traced_haloes,
            kappa_of_sheets: sheets,
        })
    }
}

/// The value of a cumulative sum at the source.
pub fn end(sum: &UniformSpline) -> f64 {
    sum.value(sum.end())
}

/// Steps in distance of an integral over masses, and where every disc of it takes long.
const CHI_STEPS: [usize; 2] = [128, 32];

/// Expected sum over the drawn haloes of a quantity given by its integral over the disc in which a halo is kept; see
/// [`expected_sum`].
///
/// # Errors
/// When a relation does not cover what is asked of it.
pub fn expectation(
    config: &Config,
    linear: &LinearTheory,
    population: &Population,
    over_disc: impl Fn(&MassModel, f64) -> Result<f64> + Sync,
) -> Result<UniformSpline> {
    expectation_in(CHI_STEPS[0], config, linear, population, over_disc)
}

fn expectation_in(
    chi_steps: usize,
    config: &Config,
    linear: &LinearTheory,
    population: &Population,
    over_disc: impl Fn(&MassModel, f64) -> Result<f64> + Sync,
) -> Result<UniformSpline> {
    let settings = &config.haloes;
    let relation = settings.concentration.build(HALO_MASS_DEFINITION)?;
    let concentration = |mass: f64, z: f64| {
        let z = match settings.epoch {
            Epoch::Evolving => z,
            Epoch::FrozenZ(frozen) => frozen,
        };
        relation.concentration(linear, mass, z)
    };
    let is_cut = !settings.is_imported() || settings.cut_imported;
    let shapes = HaloShapes {
        concentration: &concentration,
        scatter_dex: settings.concentration_scatter_dex,
        truncation: settings.truncation()?,
        min_point_shear: if is_cut { settings.min_point_shear } else { 0.0 },
        chi_steps,
    };
    expected_sum(population, &shapes, over_disc)
}

/// Expected convergence on a straight axis of exactly the haloes that are traced: cut, cylinder, truncation, selection.
///
/// # Errors
/// As [`expectation`].
pub fn mean_convergence(
    config: &Config,
    linear: &LinearTheory,
    population: &Population,
    selection: Selection,
) -> Result<UniformSpline> {
    let threshold = (selection == Selection::TidalRegime).then_some(config.diagnostics.delta_threshold);
    let max_kappa = config.haloes.max_kappa;
    if threshold.is_none() && max_kappa.is_none() {
        return expectation(config, linear, population, convergence_over_disc);
    }
    let theta_e = config.diagnostics.theta_e_arcsec;
    let is_kept = |lens: &MassModel, at: [f64; 2]| {
        let kappa = || {
            let [xx, _, yy] = lens.hessian(at[0], at[1]);
            0.5 * (xx + yy)
        };
        let delta = || shear_variation(lens, at, theta_e).delta;
        max_kappa.is_none_or(|most| kappa() <= most) && threshold.is_none_or(|limit| delta() < limit)
    };
    let over_disc = |lens: &MassModel, theta_max: f64| kept_over_disc(lens, theta_max, is_kept);
    expectation_in(CHI_STEPS[1], config, linear, population, over_disc)
}

/// ∫d²θ κ over the places within `theta_max` where a halo is kept, along spokes.
fn kept_over_disc(
    lens: &MassModel,
    theta_max: f64,
    is_kept: impl Fn(&MassModel, [f64; 2]) -> bool,
) -> Result<f64> {
    const SPOKES: usize = 8;
    const RINGS: usize = 16;
    /// Halvings of ln θ between two rings where the selection changes.
    const HALVINGS: usize = 10;
    /// The innermost ring, arcsec.
    const FIRST_ARCSEC: f64 = 0.05;
    let within = |theta: f64| convergence_over_disc(lens, theta);
    let first = FIRST_ARCSEC.min(0.5 * theta_max);
    let ratio = (theta_max / first).ln() / RINGS as f64;
    let mut sum = 0.0;
    for spoke in 0..SPOKES {
        let (sin, cos) = (std::f64::consts::TAU * (spoke as f64 + 0.5) / SPOKES as f64).sin_cos();
        // The ray sees the halo at θ where the halo sees the ray at −θ.
        let kept_at = |theta: f64| is_kept(lens, [-theta * cos, -theta * sin]);
        let mut low = first;
        let mut low_is_kept = kept_at(low);
        if low_is_kept {
            sum += within(low)?;
        }
        for ring in 1..=RINGS {
            let high = first * (ratio * ring as f64).exp();
            let high_is_kept = kept_at(high);
            if low_is_kept == high_is_kept {
                sum += if high_is_kept { within(high)? - within(low)? } else { 0.0 };
            } else {
                let (mut a, mut b) = (low, high);
                for _ in 0..HALVINGS {
                    let middle = (a * b).sqrt();
                    *(if kept_at(middle) == low_is_kept { &mut a } else { &mut b }) = middle;
                }
                sum += if low_is_kept { within(a)? - within(low)? } else { within(high)? - within(b)? };
            }
            (low, low_is_kept) = (high, high_is_kept);
        }
    }
    Ok(sum / SPOKES as f64)
}
