//! How to fit an image.

use serde::{Deserialize, Serialize};

use super::diagnose::ESS_LIMIT;
use super::model::LikelihoodKind;
use super::sample::SamplerSettings;
use crate::imaging::PixelSampling;

/// How to fit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FitSettings {
    /// Which likelihood.
    pub likelihood: LikelihoodKind,
    /// How pixels are integrated.
    pub pixel_sampling: PixelSampling,
    /// The sampler and its settings.
    pub sampler: SamplerSettings,
    /// Effective draws of every quantity before which sampling goes on, [`ESS_LIMIT`] or more.
    pub min_ess: f64,
    /// Seed of everything random.
    pub seed: u64,
}

impl Default for FitSettings {
    /// What `haloray fit` does with a model that says nothing of it.
    fn default() -> Self {
        Self {
            likelihood: LikelihoodKind::default(),
            pixel_sampling: PixelSampling::Adaptive,
            sampler: SamplerSettings::default(),
            min_ess: ESS_LIMIT,
            seed: 1,
        }
    }
}
