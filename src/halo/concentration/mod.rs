//! Concentration–mass relations c(M, z), each for the mass definitions it was calibrated with.

mod diemer15;
mod diemer19;
mod duffy08;
mod relation;
mod table;

use serde::{Deserialize, Serialize};

use super::MassDefinition;
use crate::error::Result;

pub use diemer15::Diemer15;
pub use diemer19::Diemer19;
pub use duffy08::Duffy08;
pub use relation::ConcentrationRelation;
pub use table::ConcentrationTable;

/// The concentration relations a configuration can name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ConcentrationModel {
    /// Diemer & Joyce 2019, median; 200c.
    Diemer19,
    /// Diemer & Joyce 2019, mean; 200c.
    Diemer19Mean,
    /// Diemer & Kravtsov 2015, median, with the parameters updated in 2019; 200c.
    Diemer15,
    /// Duffy et al. 2008, full sample; 200c, 200m or vir.
    Duffy08,
}

impl ConcentrationModel {
    /// Builds the relation, or says which mass definitions it covers.
    ///
    /// ```
    /// use haloray::halo::{MassDefinition, concentration::ConcentrationModel};
    /// assert!(ConcentrationModel::Diemer19.build(MassDefinition::Critical(200.0)).is_ok());
    /// assert!(ConcentrationModel::Diemer19.build(MassDefinition::Virial).is_err());
    /// ```
    pub fn build(self, definition: MassDefinition) -> Result<Box<dyn ConcentrationRelation>> {
        Ok(match self {
            Self::Diemer19 => Box::new(Diemer19::median(definition)?),
            Self::Diemer19Mean => Box::new(Diemer19::mean(definition)?),
            Self::Diemer15 => Box::new(Diemer15::new(definition)?),
            Self::Duffy08 => Box::new(Duffy08::new(definition)?),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::{LinearTheory, StructureParameters};
    use crate::error::Error;

    const MODELS: [ConcentrationModel; 4] = [
        ConcentrationModel::Diemer19,
        ConcentrationModel::Diemer19Mean,
        ConcentrationModel::Diemer15,
        ConcentrationModel::Duffy08,
    ];

    #[test]
    fn wrong_mass_definitions_are_refused() {
        for model in MODELS {
            for definition in [MassDefinition::Critical(500.0), MassDefinition::FriendsOfFriends] {
                let error = model.build(definition).err();
                assert!(matches!(error, Some(Error::MassDefinition { .. })), "{model:?} {definition}");
            }
        }
    }

    #[test]
    fn small_haloes_are_more_concentrated_and_all_were_less_so_before() {
        let linear = LinearTheory::new(StructureParameters::planck18()).unwrap();
        for model in MODELS {
            let relation = model.build(MassDefinition::Critical(200.0)).unwrap();
            let c = |mass, z| relation.concentration(&linear, mass, z);
            assert!(c(1e8, 0.0) > c(1e11, 0.0) && c(1e11, 0.0) > c(1e13, 0.0), "{model:?}");
            assert!(c(1e10, 0.0) > c(1e10, 1.5), "{model:?}");
        }
    }
}
