//! Which likelihood a model is fitted with.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which likelihood.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LikelihoodKind {
    /// One variance, that of the model, with its determinant; amplitudes marginalised.
    #[default]
    Gaussian,
    /// lenstronomy's: no determinant, amplitudes solved with the variance of the data.
    Lenstronomy,
}
