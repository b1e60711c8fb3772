//! The samplers there are, each with its settings.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ensemble::{EnsembleSliceSettings, StretchSettings};
use super::nested::NestedSettings;
use super::nuts::NutsSettings;
use super::valley::ValleySettings;

/// The samplers, each with its settings.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum SamplerSettings {
    /// No-U-Turn sampler: needs gradients alone, profits from a metric.
    Nuts(NutsSettings),
    /// Moves along the curved valleys of posteriors, across which it integrates; needs curvatures; the fastest for images.
    Valley(ValleySettings),
    /// Ensemble slice sampling, the method of the paper's zeus: no gradients; for what is not smooth.
    EnsembleSlice(EnsembleSliceSettings),
    /// The affine-invariant stretch move, the method of emcee: to compare with others.
    Stretch(StretchSettings),
    /// Nested sampling: the evidence, and posteriors with several peaks; many evaluations.
    Nested(NestedSettings),
}

impl SamplerSettings {
    /// The name it is chosen by.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Nuts(_) => "nuts",
            Self::Valley(_) => "valley",
            Self::EnsembleSlice(_) => "ensemble-slice",
            Self::Stretch(_) => "stretch",
            Self::Nested(_) => "nested",
        }
    }
}

impl Default for SamplerSettings {
    fn default() -> Self {
        Self::Valley(ValleySettings::default())
    }
}
