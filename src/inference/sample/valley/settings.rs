//! Settings of the valley sampler.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Domain, Result};

/// Settings of the valley sampler.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ValleySettings {
    /// Independent chains, at least 2.
    pub chains: usize,
    /// Proposals of a chain in each of the two rounds of warm-up, which teach the surrogate; at least 10.
    pub round_draws: usize,
    /// Draws of a chain between two looks at convergence, each of which makes the surrogate again.
    pub block_draws: usize,
    /// Draws of a chain after which sampling stops unconverged.
    pub max_draws: usize,
    /// Directions measured worse than this, in units of their priors' widths, are followed; the rest is integrated over.
    /// More are followed where they are few or the integral is poor.
    pub slow_width: f64,
}

impl Default for ValleySettings {
    fn default() -> Self {
        Self { chains: 4, round_draws: 30, block_draws: 50, max_draws: 8_000, slow_width: 0.03 }
    }
}

impl ValleySettings {
    pub(super) fn check(&self) -> Result<()> {
        for (what, value, domain) in [
            ("chains", self.chains as f64, Domain::at_least(2.0)),
            ("round_draws", self.round_draws as f64, Domain::at_least(10.0)),
            ("block_draws", self.block_draws as f64, Domain::at_least(1.0)),
            ("max_draws", self.max_draws as f64, Domain::at_least(4.0)),
            ("slow_width", self.slow_width, Domain::POSITIVE),
        ] {
            domain.check(&format!("{what} of valley"), value)?;
        }
        Ok(())
    }
}
