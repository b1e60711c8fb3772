//! Halo mass functions: dn/dlnM from a published multiplicity function f(σ).

mod press74;
mod relation;
mod sheth99;
mod tinker08;

use serde::{Deserialize, Serialize};

use super::MassDefinition;
use crate::cosmology::Background;
use crate::error::Result;

pub use press74::Press74;
pub use relation::MassFunction;
pub use sheth99::Sheth99;
pub use tinker08::Tinker08;

/// The mass functions a configuration can name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MassFunctionModel {
    /// Tinker et al. 2008: spherical overdensity, 200 to 3200 times the mean density.
    Tinker08,
    /// Sheth & Tormen 1999: friends of friends.
    Sheth99,
    /// Press & Schechter 1974: friends of friends.
    Press74,
}

impl MassFunctionModel {
    /// Builds the relation for haloes of the given definition at 0 ≤ z ≤ `z_max`.
    ///
    /// `background` turns critical into mean overdensities; pass that of the [`crate::cosmology::LinearTheory`] in use.
    /// Errors: the relation is not calibrated for that definition in that redshift range.
    ///
    /// ```
    /// use haloray::cosmology::{LinearTheory, StructureParameters};
    /// use haloray::halo::{MassDefinition, mass_function::MassFunctionModel};
    /// let linear = LinearTheory::new(StructureParameters::planck18()).unwrap();
    /// let relation = MassFunctionModel::Tinker08
    ///     .build(MassDefinition::Critical(200.0), linear.background(), 2.0)
    ///     .unwrap();
    /// let dn_dlnm = relation.dn_dlnm_per_cmpc3(&linear, 1e12, 0.5);
    /// let colossus = 1.66563e-3; // massFunction(1e12 h, 0.5, mdef='200c', model='tinker08') h³
    /// assert!((dn_dlnm / colossus - 1.0).abs() < 1e-3);
    /// ```
    pub fn build(
        self,
        definition: MassDefinition,
        background: Background,
        z_max: f64,
    ) -> Result<Box<dyn MassFunction>> {
        Ok(match self {
            Self::Tinker08 => Box::new(Tinker08::new(definition, background, z_max)?),
            Self::Sheth99 => Box::new(Sheth99::new(definition)?),
            Self::Press74 => Box::new(Press74::new(definition)?),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::numerics::quadrature::integrate;

    #[test]
    fn all_mass_is_in_haloes() {
        let fraction = |relation: &dyn MassFunction, ln_sigma_max, panels| {
            integrate(-4.0, ln_sigma_max, panels, |ln_sigma| relation.multiplicity(ln_sigma.exp(), 0.5))
        };
        assert!((fraction(&Press74, 20.0, 40) - 1.0).abs() < 1e-8);
        // The normalisation is published with four digits.
        assert!((fraction(&Sheth99, 60.0, 100) - 1.0).abs() < 2e-4);
    }

    #[test]
    fn every_model_has_one_name_in_files_and_in_code() {
        let background = Background::planck18();
        for (model, definition) in [
            (MassFunctionModel::Tinker08, MassDefinition::Critical(200.0)),
            (MassFunctionModel::Sheth99, MassDefinition::FriendsOfFriends),
            (MassFunctionModel::Press74, MassDefinition::FriendsOfFriends),
        ] {
            let relation = model.build(definition, background, 2.0).unwrap();
            let written = serde_json::to_string(&model).unwrap();
            assert_eq!(written, format!("\"{}\"", relation.name()));
        }
    }

    #[test]
    fn wrong_mass_definitions_are_refused() {
        let background = Background::planck18();
        for (model, definition) in [
            (MassFunctionModel::Tinker08, MassDefinition::FriendsOfFriends),
            (MassFunctionModel::Sheth99, MassDefinition::Critical(200.0)),
            (MassFunctionModel::Press74, MassDefinition::Virial),
        ] {
            let error = model.build(definition, background, 2.0).err();
            assert!(matches!(error, Some(Error::MassDefinition { .. })), "{model:?}");
        }
    }
}
