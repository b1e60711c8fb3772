//! Ctrl-C and SIGTERM: the work is told to stop; what it does not clean up in time is cleaned up here.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use haloray::io::{folders_written_to, remove_temporaries};
use haloray::{Error, Result};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use crate::bars::Bars;

/// How long the work has for an orderly end.
const PATIENCE: Duration = Duration::from_millis(700);
/// How often a second signal, which ends the patience, is looked for.
const LOOK: Duration = Duration::from_millis(10);

/// The signal that came, and the folders into which outputs were being written then.
static CAUGHT: Mutex<Option<(i32, Vec<PathBuf>)>> = Mutex::new(None);

/// Starts the thread that waits for a signal.
///
/// # Errors
/// A system that has no signals to give.
pub fn watch(bars: &'static Bars) -> Result<()> {
    let signals = Signals::new([SIGINT, SIGTERM]);
    let mut signals = signals.map_err(|error| Error::write(Path::new("signal handlers"), error))?;
    let listener = move || {
        let Some(signal) = signals.forever().next() else { return };
        *CAUGHT.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) =
            Some((signal, folders_written_to()));
        bars.cancel();
        let start = Instant::now();
        while start.elapsed() < PATIENCE && signals.pending().next().is_none() {
            std::thread::sleep(LOOK);
        }
        end(bars);
    };
    let spawned = std::thread::Builder::new().spawn(listener);
    spawned.map(drop).map_err(|error| Error::write(Path::new("signal handlers"), error))
}

/// Ends the process if a signal came: sweeps, says what is kept and how to go on, and never returns.
pub fn end(bars: &Bars) {
    // Held until the end, so that only one thread ends the process.
    let caught = CAUGHT.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let Some((signal, folders)) = caught.as_ref() else { return };
    remove_temporaries();
    // Nothing can be done about a closed stderr.
    let _ = std::io::stderr().lock().write_all(message(bars, *signal, folders).as_bytes());
    // Threads that still compute or write must not run into what the usual end of a process takes down.
    signal_hook::low_level::exit(128 + signal)
}

fn message(bars: &Bars, signal: i32, folders: &[PathBuf]) -> String {
    let mut text = format!("stopped by {}\n", if signal == SIGINT { "Ctrl-C" } else { "SIGTERM" });
    let kept = bars.kept();
    if !bars.is_quiet() {
        text += &match &kept {
            Some((what, path)) => format!("kept: {what} in {}\n", short(path)),
            None => "kept: nothing; files of earlier commands are as they were\n".into(),
        };
        for folder in folders {
            text += &format!("removed: what was half-written in {}\n", short(folder));
        }
    }
    let hint = if kept.is_some() { "to continue" } else { "to begin again" };
    text + &format!("{hint}: {}\n", command_line())
}

/// A path below the working folder relative to it.
fn short(path: &Path) -> String {
    let here = std::env::current_dir().unwrap_or_default();
    let path = path.strip_prefix(&here).unwrap_or(path);
    if path.as_os_str().is_empty() { ".".into() } else { path.display().to_string() }
}

/// The command as it was given, quoted for a shell where need be.
fn command_line() -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%".contains(c);
    let quote = |word: String| match word.chars().all(plain) && !word.is_empty() {
        true => word,
        false => format!("'{}'", word.replace('\'', "'\\''")),
    };
    let words = std::env::args_os().map(|word| quote(word.to_string_lossy().into_owned()));
    words.collect::<Vec<_>>().join(" ")
}
