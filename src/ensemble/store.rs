//! The sightlines of an unfinished ensemble, kept as they end.

use std::ops::Range;
use std::path::Path;
use std::sync::{Mutex, MutexGuard};

use serde::{Deserialize, Serialize};

use super::sightline::SightlineRow;
use crate::error::Result;
use crate::io::RecordLog;

/// The record that says which sightlines are wanted; no sightline has this number.
const WANTED: u64 = u64::MAX;

/// How a sightline ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// Computed.
    Done(SightlineRow),
    /// It could not be, and why.
    Failed(String),
}

/// Sightlines that have ended, on the disk; everything may be called from any thread.
#[derive(Debug)]
pub struct SightlineStore(Mutex<RecordLog>);

impl SightlineStore {
    /// Opens the store of the ensemble of that identity at `path`, of which the sightlines `wanted` are to be computed; the
    /// second value says why a former one could not be continued.
    ///
    /// # Errors
    /// As [`RecordLog::open`].
    pub fn open(path: &Path, identity: &str, wanted: Range<u64>) -> Result<(Self, Option<&'static str>)> {
        let (mut log, replaced) = RecordLog::open(path, identity)?;
        log.append(WANTED, &(wanted.start, wanted.end))?;
        Ok((Self(Mutex::new(log)), replaced))
    }

    /// Of the store at `path`: how many sightlines have ended, how many are wanted, and whether a process is at it. None
    /// where there is no store.
    ///
    /// # Errors
    /// [`crate::Error::Read`].
    pub fn progress(path: &Path) -> Result<Option<(u64, u64, bool)>> {
        let Some((log, is_at_work)) = RecordLog::look(path)? else { return Ok(None) };
        let wanted = if log.has(WANTED) { log.read::<(u64, u64)>(WANTED)? } else { (0, 0) };
        let ended = log.numbers().filter(|number| (wanted.0..wanted.1).contains(number)).count();
        Ok(Some((ended as u64, wanted.1 - wanted.0, is_at_work)))
    }

    fn lock(&self) -> MutexGuard<'_, RecordLog> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Whether that sightline has ended.
    pub fn has(&self, number: u64) -> bool {
        self.lock().has(number)
    }

    /// Keeps how a sightline ended.
    ///
    /// # Errors
    /// [`crate::Error::Write`].
    pub fn keep(&self, number: u64, outcome: &Outcome) -> Result<()> {
        self.lock().append(number, outcome)
    }

    /// How a sightline ended.
    ///
    /// # Errors
    /// [`crate::Error::Read`] for one that is not there.
    pub fn read(&self, number: u64) -> Result<Outcome> {
        self.lock().read(number)
    }

    /// Removes the store: the results are safe.
    pub fn remove(self) {
        self.0.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()).remove();
    }
}
