//! What a concentration–mass relation is.

use crate::cosmology::LinearTheory;

/// A published concentration–mass relation, bound to a mass definition.
pub trait ConcentrationRelation: Send + Sync {
    /// c = R/r_s of haloes of `mass_msun` at `z`, R in the definition the relation was built with.
    ///
    /// No h-factor is applied to c. NaN outside the mass range of [`LinearTheory`].
    fn concentration(&self, linear: &LinearTheory, mass_msun: f64, z: f64) -> f64;
}
