//! From the store of an ensemble to its table.

use std::ops::Range;

use super::columns::{EnsembleColumn, scalar_columns, tidal_columns};
use super::plan::{Level, Plan};
use super::store::{Outcome, SightlineStore};
use crate::error::Result;
use crate::io::{Provenance, SightlineColumn, SightlineTable, StackRows, StackSpec};

/// The table of the sightlines of `numbers`, all of which the store has.
///
/// # Errors
/// [`crate::Error::Read`].
pub fn assemble(
    plan: &Plan,
    numbers: Range<u64>,
    provenance: &Provenance,
    store: &SightlineStore,
) -> Result<SightlineTable> {
    let empty = |columns: Vec<EnsembleColumn>| -> Vec<SightlineColumn> {
        let column = |EnsembleColumn { name, unit, description }| SightlineColumn {
            name,
            unit: unit.into(),
            description,
            values: Vec::new(),
        };
        columns.into_iter().map(column).collect()
    };
    let mut table = SightlineTable {
        provenance: provenance.clone(),
        level: plan.level.to_string(),
        model: if plan.level == Level::Fits { plan.model.clone() } else { String::new() },
        whole: plan.numbers(),
        lenses: plan.lenses.clone(),
        numbers: numbers.clone().collect(),
        all_haloes: empty(scalar_columns(plan)),
        tidal_haloes: empty(tidal_columns(plan)),
        failures: Vec::new(),
    };
    for number in numbers {
        let (all, tidal) = match store.read(number)? {
            Outcome::Done(row) => (row.all_haloes, row.tidal_haloes),
            Outcome::Failed(reason) => {
                table.failures.push((number, reason));
                (Vec::new(), Vec::new())
            }
        };
        for (columns, values) in [(&mut table.all_haloes, all), (&mut table.tidal_haloes, tidal)] {
            for (i, column) in columns.iter_mut().enumerate() {
                let of_failed = if column.name == "failed" { 1.0 } else { f64::NAN };
                column.values.push(values.get(i).copied().unwrap_or(of_failed));
            }
        }
    }
    Ok(table)
}

/// The maps and images in a store.
pub struct StoredStacks<'a> {
    /// The store.
    pub store: &'a SightlineStore,
    /// What they are.
    pub specs: &'a [StackSpec],
}

impl StackRows for StoredStacks<'_> {
    fn pixels(&self, stack: usize, number: u64) -> Result<Vec<f32>> {
        let [ny, nx] = self.specs[stack].shape;
        Ok(match self.store.read(number)? {
            Outcome::Done(mut row) if stack < row.stacks.len() => row.stacks.swap_remove(stack),
            _ => vec![f32::NAN; ny * nx],
        })
    }
}
