//! How many haloes of a line of sight are beyond the tidal regime or nearly critical.

use super::haloes::Haloes;
use super::summary::Quantities;
use crate::config::Config;
use crate::diagnostics::JudgedHaloes;
use crate::mapping::multiplane::LineOfSight;

/// Counts of one sightline, under the names of [`Summary`](super::Summary).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HaloCounts {
    /// Haloes left out because of `haloes.max_kappa`.
    pub number_excluded_by_kappa: usize,
    /// Haloes with Δ_h of at least the threshold.
    pub number_beyond_tidal: usize,
    /// Largest convergence of a single halo.
    pub largest_kappa_h: f64,
    /// Haloes with κ_h above `diagnostics.kappa_warning`.
    pub number_above_kappa_warning: usize,
    /// Convergence that the sheets take away, reduced to the source.
    pub kappa_of_sheets: f64,
}

impl HaloCounts {
    /// Counts; `judged` is what single haloes do where they are judged.
    pub fn of(config: &Config, haloes: &Haloes, judged: &JudgedHaloes, sight: &LineOfSight) -> Self {
        let limits = &config.diagnostics;
        Self {
            number_excluded_by_kappa: haloes.number_excluded,
            number_beyond_tidal: judged.is_tidal.iter().filter(|is| !**is).count(),
            largest_kappa_h: judged.kappa.iter().copied().fold(0.0, f64::max),
            number_above_kappa_warning: judged.kappa.iter().filter(|k| **k > limits.kappa_warning).count(),
            kappa_of_sheets: sight.sheet_convergence(),
        }
    }

    /// By name.
    pub fn quantities(&self) -> Quantities {
        let list = [
            ("number_excluded_by_kappa", self.number_excluded_by_kappa as f64),
            ("number_beyond_tidal", self.number_beyond_tidal as f64),
            ("largest_kappa_h", self.largest_kappa_h),
            ("number_above_kappa_warning", self.number_above_kappa_warning as f64),
            ("kappa_of_sheets", self.kappa_of_sheets),
        ];
        Quantities(list.map(|(name, value)| (name.to_string(), "", value)).into())
    }
}
