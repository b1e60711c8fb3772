//! Concentrations of haloes that come from elsewhere without one: the configured relation, with its scatter.

use rand_distr::{Distribution, StandardNormal};

use super::haloes::linear_theory;
use crate::config::{Config, HALO_MASS_DEFINITION};
use crate::cosmology::LinearTheory;
use crate::error::Result;
use crate::halo::Epoch;
use crate::halo::concentration::ConcentrationRelation;
use crate::numerics::random::{Stage, stream};

/// c200c of haloes of a light cone: each has its own deviate, whichever sightline meets it.
pub struct MissingConcentrations {
    relation: Box<dyn ConcentrationRelation>,
    linear: LinearTheory,
    epoch: Epoch,
    scatter_dex: f64,
    seed: u64,
}

impl MissingConcentrations {
    /// Those of a configuration.
    ///
    /// # Errors
    /// A relation that does not cover M200c.
    pub fn of(config: &Config) -> Result<Self> {
        let settings = &config.haloes;
        Ok(Self {
            relation: settings.concentration.build(HALO_MASS_DEFINITION)?,
            linear: linear_theory(config)?,
            epoch: settings.epoch,
            scatter_dex: settings.concentration_scatter_dex,
            seed: config.seed,
        })
    }

    /// Median c200c; not a number for masses that the relation does not know.
    pub fn median(&self, m200c_msun: f64, z: f64) -> f64 {
        let z = match self.epoch {
            Epoch::Evolving => z,
            Epoch::FrozenZ(frozen) => frozen,
        };
        self.relation.concentration(&self.linear, m200c_msun, z)
    }

    /// What the halo in that row of the light cone has over the median.
    pub fn over_median(&self, row: u64) -> f64 {
        if self.scatter_dex == 0.0 {
            return 1.0;
        }
        let mut rng = stream(self.seed, row, Stage::LightconeConcentration, 0);
        let deviate: f64 = StandardNormal.sample(&mut rng);
        10f64.powf(self.scatter_dex * deviate)
    }
}
