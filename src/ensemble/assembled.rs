//! From the store of an ensemble to its table.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::PathBuf;

use super::columns::{EnsembleColumn, scalar_columns, tidal_columns};
use super::plan::{Level, Plan};
use super::store::{Outcome, SightlineStore};
use crate::error::{Error, Result};
use crate::io::{CONE_INDEX_FILE, Provenance, SightlineColumn, SightlineTable, StackRows, StackSpec, hash};

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
        inputs: plan.inputs()?,
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

impl Plan {
    /// What is in the PSF and the light cone that a configuration names: of every file its size and a hash of its ends, as a light
    /// cone may be a hundred gigabytes; of a folder of sightlines that of its index.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn inputs(&self) -> Result<String> {
        const END: u64 = 1 << 20;
        let of_file = |path: &PathBuf| -> Result<String> {
            let path = if path.is_dir() { path.join(CONE_INDEX_FILE) } else { path.clone() };
            let read = || -> std::io::Result<String> {
                let mut file = File::open(&path)?;
                let length = file.metadata()?.len();
                let mut ends = Vec::new();
                file.by_ref().take(END).read_to_end(&mut ends)?;
                file.seek(SeekFrom::Start(length.saturating_sub(END)))?;
                file.take(END).read_to_end(&mut ends)?;
                Ok(format!("{length}:{:016x}", hash(&ends)))
            };
            read().map_err(Error::read(&path))
        };
        let cone = self.config.haloes.lightcone.iter().flat_map(|cone| &cone.files);
        let files: Vec<String> =
            self.config.instrument.psf_file.iter().chain(cone).map(of_file).collect::<Result<_>>()?;
        Ok(files.join(" "))
    }
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
