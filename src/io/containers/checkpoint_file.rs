//! The state of a long computation, saved between two steps so that the same command continues it.

use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::atomic_file::write_text;
use crate::error::{Error, Result};

/// A state with the command it belongs to.
#[derive(Serialize, Deserialize)]
struct Checkpoint<State> {
    command: String,
    haloray_version: String,
    git_revision: String,
    state: State,
}

/// Saves a state; `command` is everything that must be the same for it to be continued: configuration, seed,
/// data.
///
/// # Errors
/// [`Error::Write`] or [`Error::OutputPlace`].
pub fn write_checkpoint<State: Serialize>(path: &Path, command: &str, state: &State) -> Result<()> {
    let checkpoint = Checkpoint {
        command: command.into(),
        haloray_version: env!("CARGO_PKG_VERSION").into(),
        git_revision: env!("HALORAY_GIT_REVISION").into(),
        state,
    };
    let text = serde_json::to_string(&checkpoint).map_err(|error| Error::write(path, error))?;
    write_text(path, &text)
}

/// The state saved by the same command of the same build; `None` if there is none, or one of another command.
///
/// # Errors
/// [`Error::Read`]; a damaged file counts as none, since it can only be computed anew.
pub fn read_checkpoint<State: DeserializeOwned>(path: &Path, command: &str) -> Result<Option<State>> {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(source) => return Err(Error::Read { path: path.into(), source }),
    };
    let is_same = |checkpoint: &Checkpoint<State>| {
        checkpoint.command == command
            && checkpoint.haloray_version == env!("CARGO_PKG_VERSION")
            && checkpoint.git_revision == env!("HALORAY_GIT_REVISION")
    };
    Ok(serde_json::from_str(&text).ok().filter(is_same).map(|checkpoint: Checkpoint<State>| checkpoint.state))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_same_command_continues() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint.json");
        assert_eq!(read_checkpoint::<Vec<u64>>(&path, "fit a").unwrap(), None);
        write_checkpoint(&path, "fit a", &vec![1_u64, u64::MAX]).unwrap();
        assert_eq!(read_checkpoint::<Vec<u64>>(&path, "fit a").unwrap(), Some(vec![1, u64::MAX]));
        assert_eq!(read_checkpoint::<Vec<u64>>(&path, "fit b").unwrap(), None);
        std::fs::write(&path, "{\"command\":").unwrap();
        assert_eq!(read_checkpoint::<Vec<u64>>(&path, "fit a").unwrap(), None);
        assert!(matches!(read_checkpoint::<Vec<u64>>(folder.path(), "fit a"), Err(Error::Read { .. })));
    }
}
