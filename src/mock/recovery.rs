//! What one fit says of γ_LOS, in a form that is saved and read back.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::inference::{Fit, Profile};

/// One component of γ_LOS as a fit recovered it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RecoveredShear {
    /// Median of the draws: the output value.
    pub median: f64,
    /// Mean of the draws.
    pub mean: f64,
    /// Standard deviation of the draws.
    pub standard_deviation: f64,
    /// Value at the highest posterior density.
    pub best_fit: f64,
    /// Lower end of the 68% highest-density interval.
    pub low: f64,
    /// Upper end of that interval.
    pub high: f64,
    /// False if the interval touches an edge of the prior.
    pub bounded: bool,
    /// What the Fisher matrix at the maximum gives for the standard deviation.
    pub fisher: f64,
    /// Its profile likelihood, where one was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<ProfiledShear>,
}

/// What the profile likelihood says of one component; see [`crate::inference::Profile`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ProfiledShear {
    /// Where ln L is highest.
    pub best_fit: f64,
    /// Ends of the values with −2Δln L < 1; none at an edge of the prior.
    pub interval68: [Option<f64>; 2],
}

impl ProfiledShear {
    /// Whether the 68% interval holds a value.
    pub fn holds(&self, value: f64) -> bool {
        let [low, high] = self.interval68;
        low.is_none_or(|low| low <= value) && high.is_none_or(|high| value <= high)
    }

    /// (best fit − value)/σ, σ the distance to the interval's end on the side of `value`; 0 where that is an edge of the prior.
    pub fn residual_in_sigma(&self, value: f64) -> f64 {
        let [low, high] = self.interval68;
        let end = if value < self.best_fit { low } else { high };
        end.map_or(0.0, |end| (self.best_fit - value) / (self.best_fit - end).abs())
    }
}

impl RecoveredShear {
    /// (σ⁻, σ⁺), the ends of the interval seen from the median.
    pub fn sigmas(&self) -> [f64; 2] {
        [self.median - self.low, self.high - self.median]
    }
}

/// One fit of a catalogue.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShearRecovery {
    /// Name of the image's file.
    pub image: String,
    /// Name of the model.
    pub model: String,
    /// γ1 and γ2.
    pub shear: [RecoveredShear; 2],
    /// Evenly spaced draws of (γ1, γ2), at most [`Self::KEPT_DRAWS`].
    pub draws: Vec<[f64; 2]>,
    /// R-hat and effective sizes of every parameter in order.
    pub converged: bool,
    /// Largest R-hat.
    pub worst_r_hat: f64,
    /// Smallest effective number of draws.
    pub worst_ess: f64,
    /// Divergent trajectories.
    pub divergences: usize,
    /// χ² per degree of freedom of the best fit.
    pub chi2_reduced: f64,
    /// Evaluations of the likelihood.
    pub evaluations: u64,
    /// Names of the parameters whose intervals touch an edge of their prior.
    pub unbounded: Vec<String>,
}

impl ShearRecovery {
    /// Names of the components.
    pub const PARAMETERS: [&str; 2] = ["gamma1_los", "gamma2_los"];
    /// Draws kept for contours.
    pub const KEPT_DRAWS: usize = 1000;

    /// Reads γ_LOS off a fit; `profiles` of its parameters may be among those known.
    ///
    /// # Errors
    /// A model without `gamma1_los` and `gamma2_los`.
    pub fn of(fit: &Fit, profiles: &[Profile], image: &str, model: &str) -> Result<Self> {
        let names = Self::PARAMETERS;
        let missing = |name: &str| Error::out_of_range(name, "missing", "a parameter of the model");
        let mut shear = Vec::new();
        let mut columns = Vec::new();
        for name in names {
            let p = fit.parameters.iter().find(|p| p.name == name).ok_or_else(|| missing(name))?;
            shear.push(RecoveredShear {
                median: p.median,
                mean: p.mean,
                standard_deviation: p.standard_deviation,
                best_fit: p.best_fit,
                low: p.hpd68_low,
                high: p.hpd68_high,
                bounded: p.bounded,
                fisher: fisher(fit, name),
                profile: profiles
                    .iter()
                    .find(|profile| profile.name == name)
                    .map(|of| ProfiledShear { best_fit: of.best_fit, interval68: of.interval68 }),
            });
            columns.push(fit.draws_of(name).unwrap_or_default().concat());
        }
        let kept = columns[0].len().min(Self::KEPT_DRAWS);
        let at = |i: usize| (2 * i + 1) * columns[0].len() / (2 * kept.max(1));
        let worst = fit.status.worst;
        Ok(Self {
            image: image.into(),
            model: model.into(),
            shear: [shear[0], shear[1]],
            draws: (0..kept).map(|i| [columns[0][at(i)], columns[1][at(i)]]).collect(),
            converged: fit.status.is_converged,
            worst_r_hat: worst.r_hat,
            worst_ess: worst.ess_bulk.min(worst.ess_tail),
            divergences: fit.status.divergences,
            chi2_reduced: fit.chi2_reduced(),
            evaluations: fit.evaluations,
            unbounded: fit.parameters.iter().filter(|p| !p.bounded).map(|p| p.name.clone()).collect(),
        })
    }

    /// True if both components have bounds on both sides.
    pub fn is_productive(&self) -> bool {
        self.shear.iter().all(|shear| shear.bounded)
    }
}

/// Standard deviation of a free parameter from the metric at the maximum, whose latent prior is a unit matrix.
fn fisher(fit: &Fit, name: &str) -> f64 {
    let model = fit.likelihood.model();
    let Some(i) = model.free.iter().position(|p| p.name == name) else { return f64::NAN };
    let slope = model.at_latent(&fit.maximum.latent).1[i];
    fit.maximum.metric.clone().cholesky().map_or(f64::NAN, |c| c.inverse()[(i, i)].sqrt() * slope)
}
