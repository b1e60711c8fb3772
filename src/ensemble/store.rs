//! The sightlines of an unfinished ensemble, kept as they end.

use std::path::Path;
use std::sync::{Mutex, MutexGuard};

use serde::{Deserialize, Serialize};

use super::sightline::SightlineRow;
use crate::error::Result;
use crate::io::RecordLog;

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
    /// Opens the store of the ensemble of that identity at `path`; the second value says why a former one could not be continued.
    ///
    /// # Errors
    /// As [`RecordLog::open`].
    pub fn open(path: &Path, identity: &str) -> Result<(Self, Option<&'static str>)> {
        let (log, replaced) = RecordLog::open(path, identity)?;
        Ok((Self(Mutex::new(log)), replaced))
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
