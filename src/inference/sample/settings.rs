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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_named_as_documented_and_refuse_what_they_do_not_know() {
        let parsed = |text: &str| toml::from_str::<SamplerSettings>(text);
        let SamplerSettings::Nuts(nuts) = parsed("kind = \"nuts\"\nchains = 6\n").unwrap() else {
            panic!("not nuts")
        };
        assert_eq!((nuts.chains, nuts.block_draws), (6, NutsSettings::default().block_draws));
        for kind in ["nuts", "valley", "ensemble-slice", "stretch", "nested"] {
            let settings = parsed(&format!("kind = \"{kind}\"")).unwrap();
            let text = toml::to_string(&settings).unwrap();
            assert_eq!(parsed(&text).unwrap(), settings);
            let error = parsed(&format!("kind = \"{kind}\"\nwalkes = 3")).unwrap_err().to_string();
            assert!(error.contains("unknown field `walkes`"), "{error}");
        }
        assert!(parsed("kind = \"emcee\"").unwrap_err().to_string().contains("ensemble-slice"));
        assert_eq!(SamplerSettings::default(), parsed("kind = \"valley\"").unwrap());
    }
}
