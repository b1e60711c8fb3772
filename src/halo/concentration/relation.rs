//! What a concentration–mass relation is.

use crate::cosmology::LinearTheory;
use crate::error::{Error, Result};
use crate::halo::MassDefinition;

/// A published concentration–mass relation, bound to a mass definition.
pub trait ConcentrationRelation: Send + Sync {
    /// c = R/r_s of haloes of `mass_msun` at `z`, R in the definition the relation was built with.
    ///
    /// No h-factor is applied to c. NaN outside the mass range of [`LinearTheory`].
    fn concentration(&self, linear: &LinearTheory, mass_msun: f64, z: f64) -> f64;
}

/// Refuses every definition but 200c.
pub(super) fn require_200c(relation: &'static str, definition: MassDefinition) -> Result<()> {
    if definition == MassDefinition::Critical(200.0) {
        return Ok(());
    }
    Err(Error::MassDefinition { relation, given: definition.to_string(), allowed: "200c" })
}
