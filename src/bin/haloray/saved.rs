//! The state of long work, hidden beside its folder: saved now and then, so that the same command goes on with it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::Instant;

use haloray::io::{Saved, read_checkpoint, write_checkpoint};
use haloray::pipeline::RowStore;
use haloray::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::bars::Bars;
use crate::terminal::warn;

/// A state on disk: where, of which command, and when it is to be saved next.
pub struct StateFile {
    pub path: PathBuf,
    command: String,
    next_save: Instant,
    /// Whether the work has gone on since it was saved.
    is_behind: bool,
    /// Whether a failed write has been told of.
    has_failed: bool,
}

/// `.NAME.haloray-KIND` beside `output`.
pub fn hidden_beside(output: &Path, kind: &str) -> PathBuf {
    let name = output.canonicalize().ok().and_then(|full| full.file_name().map(ToOwned::to_owned));
    let name = name.or_else(|| output.file_name().map(ToOwned::to_owned));
    let mut hidden = std::ffi::OsString::from(".");
    hidden.push(name.unwrap_or_else(|| kind.into()));
    hidden.push(format!(".haloray-{kind}"));
    output.with_file_name(hidden)
}

impl StateFile {
    /// `.NAME.haloray-KIND` beside `output`; only the same `command` goes on with it.
    pub fn beside(output: &Path, kind: &str, command: String) -> Self {
        let path = hidden_beside(output, kind);
        Self { path, command, next_save: Instant::now(), is_behind: false, has_failed: false }
    }

    /// What an earlier attempt left; damaged or other states are told of and left out.
    pub fn load<State: DeserializeOwned>(&self) -> Result<Option<State>> {
        match read_checkpoint(&self.path, &self.command)? {
            Saved::Nothing => Ok(None),
            Saved::Unusable(why) => {
                self.begin_anew(why);
                Ok(None)
            }
            Saved::State(state) => Ok(Some(state)),
        }
    }

    pub fn begin_anew(&self, why: &str) {
        warn(format_args!("{}: the saved state is {why}; the work begins anew", self.path.display()));
    }

    /// Saves the state when it is due, or when `at_once` and behind. A state that cannot be saved costs what it would have
    /// kept, not the work that goes on.
    pub fn save(&mut self, state: &impl Serialize, at_once: bool) -> Result<()> {
        /// Seconds of computing for one of saving the state, which grows with the work.
        const COMPUTED_PER_SAVED: u32 = 20;
        let now = Instant::now();
        let is_due = if at_once { self.is_behind } else { now >= self.next_save };
        if !is_due {
            self.is_behind |= !at_once;
            return Ok(());
        }
        match write_checkpoint(&self.path, &self.command, state) {
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            Err(error) if !self.has_failed => {
                self.has_failed = true;
                warn(format_args!("{error}; the work goes on, but cannot be continued if it is stopped"));
            }
            _ => {}
        }
        self.is_behind = false;
        self.next_save = Instant::now() + now.elapsed() * COMPUTED_PER_SAVED;
        Ok(())
    }

    /// The results are safe; a state that stays behind is only ever continued by the same command.
    pub fn remove(&mut self) {
        self.is_behind = false;
        let _ = std::fs::remove_file(&self.path);
    }
}

/// The rows of a study that have ended, by number.
pub struct SavedRows<Row: Serialize>(Mutex<(StateFile, BTreeMap<u64, Row>)>);

impl<Row: Serialize + DeserializeOwned + Clone> SavedRows<Row> {
    pub fn beside(output: &Path, command: String, bars: &Bars) -> Result<Self> {
        let file = StateFile::beside(output, "study", command);
        bars.keeps("what has been done", &file.path);
        let rows = file.load()?.unwrap_or_default();
        Ok(Self(Mutex::new((file, rows))))
    }
}

impl<Row: Serialize> SavedRows<Row> {
    fn lock(&self) -> MutexGuard<'_, (StateFile, BTreeMap<u64, Row>)> {
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    pub fn remove(&self) {
        self.lock().0.remove();
    }
}

impl<Row: Serialize + Clone + Send> RowStore<Row> for SavedRows<Row> {
    fn ended(&self, number: u64) -> Option<Row> {
        self.lock().1.get(&number).cloned()
    }

    fn keep(&self, number: u64, row: &Row) -> Result<()> {
        let (file, rows) = &mut *self.lock();
        rows.insert(number, row.clone());
        file.save(rows, false)
    }
}

impl<Row: Serialize> Drop for SavedRows<Row> {
    /// Work that ends early keeps what it has done.
    fn drop(&mut self) {
        let (file, rows) = &mut *self.lock();
        let _ = file.save(rows, true);
    }
}
