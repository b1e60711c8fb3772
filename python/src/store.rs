//! The state of an unfinished fit in a file that the caller names.

use std::fmt::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use haloray::error::FileFault;
use haloray::inference::{FitState, FitStore, Observation};
use haloray::io::{Saved, hash, read_checkpoint, write_checkpoint};
use haloray::mapping::HaloSight;
use haloray::monitor::Monitor;
use haloray::{Error, Result};

/// Keeps the state in a file, or nowhere.
pub struct StateFile<'a> {
    path: Option<PathBuf>,
    /// What must be the same for the state to be gone on with.
    fit: String,
    monitor: &'a dyn Monitor,
    next_save: Instant,
    /// Seconds of earlier attempts.
    before_s: f64,
    start: Instant,
}

impl<'a> StateFile<'a> {
    pub fn at(path: Option<PathBuf>, fit: String, monitor: &'a dyn Monitor) -> Self {
        let now = Instant::now();
        Self { path, fit, monitor, next_save: now, before_s: 0.0, start: now }
    }

    /// Seconds of all attempts.
    pub fn seconds(&self) -> f64 {
        self.before_s + self.start.elapsed().as_secs_f64()
    }

    /// The results are safe.
    pub fn remove(&self) {
        if let Some(path) = &self.path {
            // Should it stay, only the same fit goes on with it.
            let _ = std::fs::remove_file(path);
        }
    }
}

impl FitStore for StateFile<'_> {
    /// A file that is something else is not written over.
    fn load(&mut self) -> Result<Option<FitState>> {
        let Some(path) = &self.path else { return Ok(None) };
        match read_checkpoint::<(FitState, f64)>(path, &self.fit)? {
            Saved::Nothing => Ok(None),
            Saved::State((state, seconds)) => {
                self.before_s = seconds;
                Ok(Some(state))
            }
            Saved::Unusable(why) => {
                let why = if why == "of another command" { "of another fit" } else { why };
                let problem = format!("the state kept here is {why}; remove it, or name another file");
                Err(Error::file(FileFault::Content, path, problem))
            }
        }
    }

    fn save(&mut self, state: &FitState) -> Result<()> {
        /// Time of computing for one of saving the state, which grows with the work.
        const COMPUTED_PER_SAVED: u32 = 20;
        const AT_LEAST: Duration = Duration::from_millis(100);
        let (Some(path), now) = (&self.path, Instant::now()) else { return Ok(()) };
        if now >= self.next_save || self.monitor.is_cancelled() {
            write_checkpoint(path, &self.fit, &(state, self.seconds()))?;
            self.next_save = Instant::now() + (now.elapsed() * COMPUTED_PER_SAVED).max(AT_LEAST);
        }
        Ok(())
    }
}

/// An image, and the haloes before and behind its lens, in short: every number counts.
pub fn fingerprint(observation: &Observation, haloes: Option<&HaloSight>) -> String {
    let mut text = format!("{observation:?}");
    if let Some(haloes) = haloes {
        // Writing to a string cannot fail.
        let _ = write!(text, "{haloes:?}");
    }
    format!("{} bytes, {:016x}", text.len(), hash(text.as_bytes()))
}
