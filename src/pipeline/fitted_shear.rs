//! The γ_LOS that a fit of one image finds.

use super::shapes::LensAndSource;
use super::summary::Quantities;
use super::view::View;
use super::view_fits::FittedView;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::imaging::Psf;
use crate::inference::Fit;
use crate::monitor::Monitor;

/// Mean and covariance of γ_LOS of a posterior, and how far it can be trusted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedShear {
    /// Posterior means of (γ1, γ2).
    pub mean: [f64; 2],
    /// Posterior covariance (11, 12, 22).
    pub covariance: [f64; 3],
    /// χ² per degree of freedom.
    pub chi2_reduced: f64,
    /// Whether the posterior converged.
    pub converged: bool,
    /// By how much a climb from the truth ends higher in ln p, where it does.
    pub missed_by: Option<f64>,
}

impl FittedShear {
    /// What stands for a fit where only the names of its numbers count.
    pub fn nothing() -> Self {
        Self { mean: [0.0; 2], covariance: [0.0; 3], chi2_reduced: 0.0, converged: false, missed_by: None }
    }

    /// Fits the image of `view`, through all haloes, with the built-in `model`.
    ///
    /// # Errors
    /// A model without γ_LOS; when cancelled.
    pub fn of(
        config: &Config,
        shapes: &LensAndSource,
        view: &View,
        psf: &Psf,
        model: &str,
        monitor: &dyn Monitor,
    ) -> Result<Self> {
        let seen = FittedView::of("all_haloes", config, shapes, view, psf);
        let refused =
            || Error::out_of_range("model", model, "one with gamma1_los and gamma2_los among its parameters");
        let fitted = seen.fit(model, || Err(refused()), monitor)?;
        let (mean, covariance) = moments(&fitted.fit, ["gamma1_los", "gamma2_los"]).ok_or_else(refused)?;
        Ok(Self {
            mean,
            covariance,
            chi2_reduced: fitted.fit.chi2_reduced(),
            converged: fitted.fit.status.is_converged,
            missed_by: fitted.missed_by,
        })
    }

    /// By name, as in `which_shear.csv`.
    pub fn quantities(&self) -> Quantities {
        let list = [
            ("gamma1_los_fit", self.mean[0]),
            ("gamma2_los_fit", self.mean[1]),
            ("covariance_11", self.covariance[0]),
            ("covariance_12", self.covariance[1]),
            ("covariance_22", self.covariance[2]),
            ("chi2_reduced", self.chi2_reduced),
            ("converged", f64::from(u8::from(self.converged))),
            ("missed_by", self.missed_by.unwrap_or(0.0)),
        ];
        Quantities(list.map(|(name, value)| (name.to_string(), "", value)).into())
    }
}

/// Means and covariance (11, 12, 22) of the draws of two quantities; none where the fit has no such quantity.
pub(super) fn moments(fit: &Fit, names: [&str; 2]) -> Option<([f64; 2], [f64; 3])> {
    let draws = |name: &str| fit.draws_of(name).map(<[_]>::concat);
    let (x, y) = (draws(names[0])?, draws(names[1])?);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let [mx, my] = [mean(&x), mean(&y)];
    let covariance = |a: &[f64], b: &[f64], [ma, mb]: [f64; 2]| {
        a.iter().zip(b).map(|(a, b)| (a - ma) * (b - mb)).sum::<f64>() / (a.len() - 1) as f64
    };
    let covariances =
        [covariance(&x, &x, [mx, mx]), covariance(&x, &y, [mx, my]), covariance(&y, &y, [my, my])];
    Some(([mx, my], covariances))
}
