//! One of the samplers, as it is saved.

use serde::{Deserialize, Serialize};

use super::ensemble::{Ensembles, Move};
use super::nested::Nested;
use super::nuts::Nuts;
use super::problem::Problem;
use super::sampler::Sampler;
use super::settings::SamplerSettings;
use super::valley::Valley;
use crate::error::Result;

/// A sampler of any kind between two blocks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) enum AnySampler {
    Nuts(Nuts),
    Valley(Box<Valley>),
    Ensemble(Ensembles),
    Nested(Nested),
}

impl AnySampler {
    /// Before the first block.
    pub fn start(settings: &SamplerSettings, seed: u64, problem: &Problem) -> Result<Self> {
        Ok(match settings {
            SamplerSettings::Nuts(nuts) => Self::Nuts(Nuts::start(*nuts, seed, problem)?),
            SamplerSettings::Valley(valley) => Self::Valley(Box::new(Valley::start(*valley, seed, problem)?)),
            SamplerSettings::EnsembleSlice(slice) => {
                Self::Ensemble(Ensembles::start((*slice, Move::Slice), seed, problem)?)
            }
            SamplerSettings::Stretch(stretch) => {
                Self::Ensemble(Ensembles::start(stretch.parts(), seed, problem)?)
            }
            SamplerSettings::Nested(nested) => Self::Nested(Nested::start(*nested, seed, problem)?),
        })
    }

    /// Whether it was started with these settings.
    pub fn has_settings(&self, settings: &SamplerSettings) -> bool {
        match (self, settings) {
            (Self::Nuts(own), SamplerSettings::Nuts(nuts)) => own.settings == *nuts,
            (Self::Valley(own), SamplerSettings::Valley(valley)) => own.settings == *valley,
            (Self::Ensemble(own), SamplerSettings::EnsembleSlice(slice)) => {
                (own.settings, own.step) == (*slice, Move::Slice)
            }
            (Self::Ensemble(own), SamplerSettings::Stretch(stretch)) => {
                (own.settings, own.step) == stretch.parts()
            }
            (Self::Nested(own), SamplerSettings::Nested(nested)) => own.settings == *nested,
            _ => false,
        }
    }

    /// What all samplers have in common.
    pub fn sampler(&self) -> &dyn Sampler {
        match self {
            Self::Nuts(sampler) => sampler,
            Self::Valley(sampler) => sampler.as_ref(),
            Self::Ensemble(sampler) => sampler,
            Self::Nested(sampler) => sampler,
        }
    }

    /// The same, to be advanced.
    pub fn sampler_mut(&mut self) -> &mut dyn Sampler {
        match self {
            Self::Nuts(sampler) => sampler,
            Self::Valley(sampler) => sampler.as_mut(),
            Self::Ensemble(sampler) => sampler,
            Self::Nested(sampler) => sampler,
        }
    }
}
