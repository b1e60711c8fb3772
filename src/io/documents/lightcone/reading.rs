//! Rows of a light cone, file by file and part by part, checked and in degrees and solar masses.

use std::collections::HashSet;
use std::path::PathBuf;

use rayon::prelude::*;

use super::columns::{ConeColumns, identify};
use crate::config::LightconeConfig;
use crate::error::{Domain, Error, Result, shortest};
use crate::halo::MassDefinition;
use crate::halo::lightcone::{Direction, Footprint, FootprintOfHaloes};
use crate::io::containers::TableStream;
use crate::monitor::Monitor;

/// Name of the HDF5 group or FITS extension with haloes.
const GROUP: &str = "haloes";

/// Rows that one thread works on at once.
const PART_ROWS: usize = 1 << 13;

/// A halo of a light cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ConeRow {
    /// Its row, from 0, counted through all files.
    pub(super) row: u64,
    pub(super) direction: Direction,
    pub(super) z: f64,
    /// Mass in the file's definition.
    pub(super) mass_msun: f64,
    /// Concentration in the file's definition; not a number where there is none.
    pub(super) concentration: f64,
}

/// How many rows were read, and how many of them were left out.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct RowCounts {
    pub(super) read: u64,
    pub(super) bad: u64,
}

/// Definitions of mass and concentration.
pub(super) type Definitions = (MassDefinition, MassDefinition);

/// Why a row cannot be used: the place of its column among right ascension, declination, redshift, mass, concentration, the
/// value, and what is allowed.
pub(super) struct BadValue {
    pub(super) column: usize,
    pub(super) value: f64,
    pub(super) allowed: String,
}

/// What a part of the rows came to, and the rows that turned out not to be usable.
pub(super) type OfPart<T> = std::result::Result<T, (ConeRow, BadValue)>;

/// The files of a light cone, each with what its columns are.
pub(super) struct ConeFiles {
    files: Vec<(PathBuf, ConeColumns)>,
    row_count: Option<u64>,
    skip_bad_rows: bool,
}

impl ConeFiles {
    /// Looks at every file; what its columns were taken for is logged once.
    ///
    /// # Errors
    /// Files that cannot be read; columns or units that are not clear.
    pub(super) fn open(cone: &LightconeConfig) -> Result<Self> {
        let mut found = Self { files: Vec::new(), row_count: Some(0), skip_bad_rows: cone.skip_bad_rows };
        let mut told = String::new();
        let mut places = HashSet::new();
        for path in &cone.files {
            if std::fs::canonicalize(path).is_ok_and(|place| !places.insert(place)) {
                return Err(Error::table(path, "light cone", "is given twice; its haloes would count twice"));
            }
            let stream = TableStream::open(path, GROUP)?;
            let (columns, in_words) = identify(path, stream.titles(), cone)?;
            if in_words != told {
                log::info!("{}: {in_words}", path.display());
                told = in_words;
            }
            found.row_count = found.row_count.zip(stream.row_count()).map(|(all, more)| all + more);
            found.files.push((path.clone(), columns));
        }
        Ok(found)
    }

    /// What is wrong with the light cone as a whole.
    fn fault(&self, place: &str, problem: &str) -> Error {
        let path = self.files.first().map_or_else(PathBuf::new, |(path, _)| path.clone());
        Error::table(&path, place, problem)
    }

    /// Goes through all rows: `of_part` sees some of them, on any thread, `take` what it made of them, in the order of the
    /// files.
    ///
    /// Rows with values that no halo has, as this or `of_part` finds them, stop it, or are left out and counted.
    ///
    /// # Errors
    /// The first such row, with its place; errors of `take`; when cancelled.
    pub(super) fn go_through<T: Send>(
        &self,
        task_name: &str,
        monitor: &dyn Monitor,
        of_part: impl Fn(Definitions, &[ConeRow]) -> Vec<OfPart<T>> + Sync,
        mut take: impl FnMut(T) -> Result<()>,
    ) -> Result<RowCounts> {
        let mut counts = RowCounts::default();
        let task = monitor.task(task_name, self.row_count);
        for (path, columns) in &self.files {
            let mut stream = TableStream::open(path, GROUP)?;
            let definitions = (columns.mass_definition, columns.concentration_definition);
            let rows_before = counts.read;
            while let Some(batch) = stream.next_batch(&columns.places)? {
                task.check()?;
                let length = batch.columns.first().map_or(0, Vec::len);
                let part = |start: usize| {
                    let (mut rows, mut bad) = (Vec::with_capacity(PART_ROWS), Vec::new());
                    for i in start..(start + PART_ROWS).min(length) {
                        let row = row_of(columns, &batch.columns, rows_before + batch.first_row, i);
                        match check(&row) {
                            None => rows.push(row),
                            Some(fault) => bad.push((row, fault)),
                        }
                    }
                    (bad, of_part(definitions, &rows))
                };
                let starts: Vec<usize> = (0..length).step_by(PART_ROWS).collect();
                let parts: Vec<_> = starts.into_par_iter().map(part).collect();
                for (mut bad, made) in parts {
                    for one in made {
                        match one {
                            Ok(made) => take(made)?,
                            Err(other) => bad.push(other),
                        }
                    }
                    if let (Some((row, value)), false) =
                        (bad.iter().min_by_key(|(row, _)| row.row), self.skip_bad_rows)
                    {
                        let name = &columns.names[value.column];
                        return Err(stream.fault_in_row(row.row - rows_before, name, value.in_words()));
                    }
                    counts.bad += bad.len() as u64;
                }
                counts.read += length as u64;
                task.advance(length as u64);
            }
        }
        match counts.read == counts.bad {
            true => Err(self.fault("table", "has no row of a halo")),
            false => Ok(counts),
        }
    }

    /// The box around all haloes, which is told.
    ///
    /// # Errors
    /// As [`Self::go_through`]; haloes that span no box.
    pub(super) fn footprint(&self, monitor: &dyn Monitor) -> Result<Footprint> {
        let mut found = FootprintOfHaloes::default();
        let of_part =
            |_, rows: &[ConeRow]| vec![Ok(rows.iter().map(|row| row.direction).collect::<Vec<_>>())];
        let add = |part: Vec<Direction>| {
            part.into_iter().for_each(|direction| found.add(direction));
            Ok(())
        };
        self.go_through("footprint of the light cone", monitor, of_part, add)?;
        let footprint = found.footprint().ok_or_else(|| {
            let problem = "the haloes span no box in right ascension and declination; say --footprint \
                           (haloes.lightcone.footprint_deg)";
            self.fault("columns", problem)
        })?;
        log::info!(
            "footprint from the haloes: {footprint}; cylinders near its edge are cut by it: say a smaller one with \
             --footprint (haloes.lightcone.footprint_deg)"
        );
        Ok(footprint)
    }
}

impl BadValue {
    fn in_words(&self) -> String {
        let value = if self.value.is_nan() { "no number".into() } else { shortest(self.value) };
        format!("is {value}, but must be {}", self.allowed)
    }
}

fn row_of(columns: &ConeColumns, values: &[Vec<f64>], first: u64, i: usize) -> ConeRow {
    let value = |place: usize| columns.factors[place] * values[place][i];
    ConeRow {
        row: first + i as u64,
        direction: Direction { ra_deg: value(0), dec_deg: value(1) },
        z: value(2),
        mass_msun: value(3),
        concentration: values.get(4).map_or(f64::NAN, |column| column[i]),
    }
}

/// The first value of a row that no halo has.
fn check(row: &ConeRow) -> Option<BadValue> {
    /// π/2 in single precision is above 90°.
    const ROUNDING_DEG: f64 = 1e-4;
    const RA: Domain = Domain::from_to(-360.0 - ROUNDING_DEG, 360.0 + ROUNDING_DEG);
    const DEC: Domain = Domain::from_to(-90.0 - ROUNDING_DEG, 90.0 + ROUNDING_DEG);
    let bad = |column, value, allowed: &str| Some(BadValue { column, value, allowed: allowed.into() });
    let (direction, c) = (row.direction, row.concentration);
    match () {
        () if !RA.contains(direction.ra_deg) => bad(0, direction.ra_deg, "from -360 to 360 degrees"),
        () if !DEC.contains(direction.dec_deg) => bad(1, direction.dec_deg, "from -90 to 90 degrees"),
        () if !Domain::POSITIVE.contains(row.z) => bad(2, row.z, "finite and positive"),
        () if !Domain::POSITIVE.contains(row.mass_msun) => bad(3, row.mass_msun, "finite and positive"),
        () if !(c.is_nan() || Domain::POSITIVE.contains(c)) => {
            bad(4, c, "positive, or no number (empty) where it is not known")
        }
        () => None,
    }
}
