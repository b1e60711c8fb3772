//! Which γ_LOS does an image measure? Fits of many sightlines against every definition.

use nalgebra::{Matrix2, Vector2};

use super::haloes::{line_of_sight, populate};
use super::los_shears::DEFINITIONS;
use super::one_core_each::one_core_each;
use super::shapes::LensAndSource;
use super::view::View;
use super::view_fits::FittedView;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::imaging::Psf;
use crate::monitor::{Monitor, Uncounted};
use crate::numerics::random::Stage;

/// One sightline: γ_LOS by every definition and as its image has it.
#[derive(Debug, Clone, PartialEq)]
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

/// Images and fits `n` sightlines of the configuration through all haloes with the built-in `model`.
///
/// # Errors
/// As [`populate`], and a model without γ_LOS; when cancelled.
pub fn which_shear(
    config: &Config,
    psf: &Psf,
    model: &str,
    n: u64,
    monitor: &dyn Monitor,
) -> Result<Vec<WhichShear>> {
    let task = monitor.task("fits of sightlines", Some(n));
    one_core_each(n, |sightline| {
        let row = one(config, psf, model, sightline, &Uncounted(monitor));
        task.advance(1);
        row
    })
}

fn one(config: &Config, psf: &Psf, model: &str, sightline: u64, monitor: &dyn Monitor) -> Result<WhichShear> {
    let haloes = populate(config, None, sightline, monitor)?;
    let sight = line_of_sight(config, &haloes, &haloes.catalogue)?;
    let shapes = LensAndSource::resolve(config, sightline);
    let view = View::through(config, &sight, &shapes, psf, (sightline, Stage::NoiseAllHaloes), monitor)?;
    let seen = FittedView { image: "all_haloes", config, shapes: &shapes, view: &view, psf };
    let refused =
        || Error::out_of_range("model", model, "one with gamma1_los and gamma2_los among its parameters");
    let fitted = seen.fit(model, || Err(refused()), monitor)?;
    let draws = |name: &str| fitted.fit.draws_of(name).map(<[_]>::concat).ok_or_else(refused);
    let (x, y) = (draws("gamma1_los")?, draws("gamma2_los")?);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let fitted_shear = [mean(&x), mean(&y)];
    let covariance = |a: &[f64], b: &[f64], [ma, mb]: [f64; 2]| {
        a.iter().zip(b).map(|(a, b)| (a - ma) * (b - mb)).sum::<f64>() / (a.len() - 1) as f64
    };
    let [mx, my] = fitted_shear;
    let tensors = view.los_shears.all(&view.effective);
    let residual = [view.los_shears.best_tidal, view.los_shears.best_flexion];
    Ok(WhichShear {
        sightline,
        by_definition: std::array::from_fn(|i| {
            tensors[i].map_or([f64::NAN; 2], |(_, los)| [los.gamma.re, los.gamma.im])
        }),
        fitted: fitted_shear,
        covariance: [
            covariance(&x, &x, [mx, mx]),
            covariance(&x, &y, [mx, my]),
            covariance(&y, &y, [my, my]),
        ],
        residual_arcsec: residual.map(|best| best.map_or(f64::NAN, |best| best.residual_arcsec)),
        chi2_reduced: fitted.fit.chi2_reduced(),
        converged: fitted.fit.status.is_converged,
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
