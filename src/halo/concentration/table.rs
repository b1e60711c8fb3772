//! Spline table of ln c(ln M) at one redshift, for drawing many haloes quickly.

use super::ConcentrationRelation;
use crate::cosmology::LinearTheory;
use crate::error::{Domain, Result};
use crate::numerics::elementary::{exp, ln};
use crate::numerics::spline::UniformSpline;

/// Knot spacing in ln M, that of the σ(M) table.
const DLN_MASS: f64 = 0.06;

/// c(M) of one relation at one redshift: built once, then one spline evaluation per halo.
///
/// Within 1e-5 of the relation itself (test below).
#[derive(Debug, Clone)]
pub struct ConcentrationTable {
    ln_concentration: UniformSpline,
}

impl ConcentrationTable {
    /// Tabulates `relation` at redshift `z` from `mass_min_msun` to `mass_max_msun`.
    ///
    /// Errors: the masses are not positive and ascending, or the relation has no value at one of them.
    ///
    /// ```
    /// use haloray::cosmology::{LinearTheory, StructureParameters};
    /// use haloray::halo::MassDefinition;
    /// use haloray::halo::concentration::{ConcentrationRelation, ConcentrationTable, Diemer19};
    /// let linear = LinearTheory::new(StructureParameters::planck18()).unwrap();
    /// let relation = Diemer19::median(MassDefinition::Critical(200.0)).unwrap();
    /// let table = ConcentrationTable::new(&relation, &linear, 0.5, 1e8, 1e15).unwrap();
    /// let exact = relation.concentration(&linear, 1e10, 0.5);
    /// assert!((table.concentration(1e10) / exact - 1.0).abs() < 1e-5);
    /// ```
    pub fn new(
        relation: &dyn ConcentrationRelation,
        linear: &LinearTheory,
        z: f64,
        mass_min_msun: f64,
        mass_max_msun: f64,
    ) -> Result<Self> {
        Domain::POSITIVE.check("mass_min_msun", mass_min_msun)?;
        Domain::above(mass_min_msun).check_in_words("mass_max_msun", mass_max_msun, "above mass_min_msun")?;
        let range = (mass_max_msun / mass_min_msun).ln();
        let intervals = (range / DLN_MASS).ceil().max(4.0);
        let step = range / intervals;
        let ln_mass_min = mass_min_msun.ln();
        let values: Vec<f64> = (0..=intervals as usize)
            .map(|i| relation.concentration(linear, (ln_mass_min + step * i as f64).exp(), z).ln())
            .collect();
        Ok(Self { ln_concentration: UniformSpline::new(ln_mass_min, step, &values)? })
    }

    /// c at `mass_msun`; outside the tabulated range the end cubics continue.
    #[inline]
    pub fn concentration(&self, mass_msun: f64) -> f64 {
        exp(self.ln_concentration.value(ln(mass_msun)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cosmology::StructureParameters;
    use crate::halo::MassDefinition;
    use crate::halo::concentration::ConcentrationModel;

    /// Promised in the documentation.
    const TABLE_TOLERANCE: f64 = 1e-5;

    #[test]
    fn the_table_agrees_with_the_relation_everywhere() {
        let linear = LinearTheory::new(StructureParameters::planck18()).unwrap();
        for model in
            [ConcentrationModel::Diemer19, ConcentrationModel::Diemer19Mean, ConcentrationModel::Diemer15]
        {
            let relation = model.build(MassDefinition::Critical(200.0)).unwrap();
            for z in [0.0, 0.5, 2.0] {
                let table = ConcentrationTable::new(relation.as_ref(), &linear, z, 1e7, 1e16).unwrap();
                for i in 0..=3000 {
                    let mass = 1e7 * 10f64.powf(0.003 * f64::from(i));
                    let ratio = table.concentration(mass) / relation.concentration(&linear, mass, z);
                    assert!((ratio - 1.0).abs() < TABLE_TOLERANCE, "{model:?} {mass:e}: {ratio}");
                }
            }
        }
    }

    #[test]
    fn masses_without_a_concentration_are_refused() {
        let linear = LinearTheory::new(StructureParameters::planck18()).unwrap();
        let relation = ConcentrationModel::Diemer19.build(MassDefinition::Critical(200.0)).unwrap();
        for (low, high) in [(1.0, 1e15), (1e15, 1e8), (0.0, 1e15), (1e8, f64::NAN)] {
            let table = ConcentrationTable::new(relation.as_ref(), &linear, 0.5, low, high);
            assert!(table.is_err(), "{low:e} {high:e}");
        }
    }
}
