//! Which γ_LOS does an image measure? Fits of many sightlines against every definition.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

use super::fitted_shear::FittedShear;
use super::haloes::line_of_sight;
use super::los_shears::DEFINITIONS;
use super::one_core_each::one_core_each;
use super::rows::RowStore;
use super::shapes::LensAndSource;
use super::sightlines::populate;
use super::view::View;
use crate::config::Config;
use crate::error::Result;
use crate::imaging::Psf;
use crate::monitor::{Monitor, Uncounted};
use crate::numerics::random::Stage;

/// One sightline: γ_LOS by every definition and as its image has it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WhichShear {
    /// Number of the sightline (realisation of the seed).
    pub sightline: u64,
    /// (γ1, γ2) by the definitions of [`DEFINITIONS`]; not a number where there is none.
    pub by_definition: [[f64; 2]; 5],
    /// Posterior means.
    pub fitted: [f64; 2],
    /// Posterior covariance (11, 12, 22).
    pub covariance: [f64; 3],
    /// Weighted rms that the nearest tidal and flexion models leave of β, arcsec.
    pub residual_arcsec: [f64; 2],
    /// χ² per degree of freedom.
    pub chi2_reduced: f64,
    /// Whether the posterior converged.
    pub converged: bool,
    /// By how much a climb from the truth ends higher in ln p, where it does.
    pub missed_by: Option<f64>,
}

impl WhichShear {
    /// √(dᵀC⁻¹d/2) of the fit's distance d from a definition: 1 for a deviation of one σ in each component.
    pub fn deviation(&self, definition: usize) -> f64 {
        let [c11, c12, c22] = self.covariance;
        let d = [0, 1].map(|i| self.fitted[i] - self.by_definition[definition][i]);
        let d = Vector2::from(d);
        Matrix2::new(c11, c12, c12, c22).try_inverse().map_or(f64::NAN, |c| (0.5 * d.dot(&(c * d))).sqrt())
    }
}

/// Images and fits `n` sightlines of the configuration through all haloes with the built-in `model`; those that `rows` has
/// are not computed again.
///
/// # Errors
/// As [`populate`], and a model without γ_LOS; rows that cannot be kept; when cancelled.
pub fn which_shear(
    config: &Config,
    psf: &Psf,
    model: &str,
    n: u64,
    rows: &dyn RowStore<WhichShear>,
    monitor: &dyn Monitor,
) -> Result<Vec<WhichShear>> {
    let task = monitor.task("fits of sightlines", Some(n));
    one_core_each(n, |sightline| {
        let row = rows.row(sightline, || one(config, psf, model, sightline, &Uncounted(monitor)));
        task.advance(1);
        row
    })
}

fn one(config: &Config, psf: &Psf, model: &str, sightline: u64, monitor: &dyn Monitor) -> Result<WhichShear> {
    let haloes = populate(config, None, sightline, monitor)?;
    let sight = line_of_sight(config, &haloes, &haloes.catalogue)?;
    let shapes = LensAndSource::resolve(config, sightline);
    let view = View::through(config, &sight, &shapes, psf, (sightline, Stage::NoiseAllHaloes), monitor)?;
    let fitted = FittedShear::of(config, &shapes, &view, psf, model, monitor)?;
    let tensors = view.los_shears.all(&view.effective);
    let residual = [view.los_shears.best_tidal, view.los_shears.best_flexion];
    Ok(WhichShear {
        sightline,
        by_definition: std::array::from_fn(|i| {
            tensors[i].map_or([f64::NAN; 2], |(_, los)| [los.gamma.re, los.gamma.im])
        }),
        fitted: fitted.mean,
        covariance: fitted.covariance,
        residual_arcsec: residual.map(|best| best.map_or(f64::NAN, |best| best.residual_arcsec)),
        chi2_reduced: fitted.chi2_reduced,
        converged: fitted.converged,
        missed_by: fitted.missed_by,
    })
}

/// Median deviation of the fits from each definition, in the order of [`DEFINITIONS`].
pub fn median_deviations(rows: &[WhichShear]) -> [f64; DEFINITIONS.len()] {
    std::array::from_fn(|definition| {
        let mut all: Vec<f64> = rows.iter().map(|row| row.deviation(definition)).collect();
        all.retain(|v| v.is_finite());
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(f64::NAN)
    })
}
