//! The state of a long computation, saved between two steps so that the same command continues it.
//!
//! Thirty-two bytes of header, then the state as postcard writes it: eight bytes that name the format, and hashes of the
//! build, of the command and of the state, each of eight bytes.

use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::atomic_file::write_atomically;
use crate::error::{Error, Result};

const FORMAT: [u8; 8] = *b"haloray1";
const HEADER: usize = 32;
/// Only the same build continues what another began.
pub(super) const BUILD: &str = concat!(env!("CARGO_PKG_VERSION"), " ", env!("HALORAY_GIT_REVISION"));

/// What is found under the name of a state.
#[derive(Debug, Clone, PartialEq)]
pub enum Saved<State> {
    /// Nothing.
    Nothing,
    /// What cannot be continued, and why: it can only be computed anew.
    Unusable(&'static str),
    /// The state of the same command of the same build.
    State(State),
}

/// Saves a state; `command` is everything that must be the same for it to be continued: configuration, seed,
/// data.
///
/// # Errors
/// [`Error::Write`] or [`Error::OutputPlace`].
pub fn write_checkpoint<State: Serialize>(path: &Path, command: &str, state: &State) -> Result<()> {
    let bytes = postcard::to_extend(state, vec![0; HEADER]).map_err(|error| Error::write(path, error))?;
    let bytes = with_header(bytes, command);
    write_atomically(path, |path| std::fs::write(path, &bytes).map_err(|error| Error::write(path, error)))
}

fn with_header(mut bytes: Vec<u8>, command: &str) -> Vec<u8> {
    let header = header(command, &bytes[HEADER..]);
    bytes[..HEADER].copy_from_slice(&header.concat());
    bytes
}

/// The state saved under that name.
///
/// # Errors
/// [`Error::Read`] where there is a file that cannot be read.
pub fn read_checkpoint<State: DeserializeOwned>(path: &Path, command: &str) -> Result<Saved<State>> {
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Saved::Nothing),
        Err(source) => return Err(Error::Read { path: path.into(), source }),
    };
    let Some((found, state)) = bytes.split_at_checked(HEADER) else { return Ok(Saved::Unusable("damaged")) };
    let wrong = ["of another format", "of another build of haloray", "of another command", "damaged"];
    let wanted = header(command, state);
    let differs = found.chunks_exact(8).zip(wanted).position(|(found, wanted)| found != wanted);
    Ok(match (differs, postcard::from_bytes(state)) {
        (Some(part), _) => Saved::Unusable(wrong[part]),
        (None, Ok(state)) => Saved::State(state),
        (None, Err(_)) => Saved::Unusable("damaged"),
    })
}

fn header(command: &str, state: &[u8]) -> [[u8; 8]; 4] {
    [
        FORMAT,
        hash(BUILD.as_bytes()).to_le_bytes(),
        hash(command.as_bytes()).to_le_bytes(),
        hash(state).to_le_bytes(),
    ]
}

/// FNV-1a, to notice other data under the same name.
pub fn hash(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    type Numbers = Vec<f64>;

    #[test]
    fn every_bit_survives_and_only_the_same_command_continues() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state");
        let read = |command: &str| read_checkpoint::<Numbers>(&path, command).unwrap();
        assert_eq!(read("fit a"), Saved::Nothing);
        let numbers = vec![0.1, -0.0, f64::NEG_INFINITY, 1e-310, 1.0 / 3.0];
        write_checkpoint(&path, "fit a", &numbers).unwrap();
        let Saved::State(back) = read("fit a") else { panic!("no state") };
        assert!(numbers.iter().zip(&back).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert_eq!(read("fit b"), Saved::Unusable("of another command"));
        assert!(matches!(read_checkpoint::<Numbers>(folder.path(), "fit a"), Err(Error::Read { .. })));
    }

    #[test]
    fn damage_is_noticed_wherever_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state");
        write_checkpoint(&path, "fit", &vec![1.5, 2.5]).unwrap();
        let good = std::fs::read(&path).unwrap();
        for (place, why) in [(3, "of another format"), (9, "of another build of haloray"), (40, "damaged")] {
            let mut bytes = good.clone();
            bytes[place] ^= 1;
            std::fs::write(&path, &bytes).unwrap();
            assert_eq!(read_checkpoint::<Numbers>(&path, "fit").unwrap(), Saved::Unusable(why));
        }
        for cut in [0, 20, 33] {
            std::fs::write(&path, &good[..cut]).unwrap();
            assert_eq!(read_checkpoint::<Numbers>(&path, "fit").unwrap(), Saved::Unusable("damaged"));
        }
        // Whole, but not of the type that is asked for.
        write_checkpoint(&path, "fit", &7_u8).unwrap();
        assert_eq!(read_checkpoint::<Numbers>(&path, "fit").unwrap(), Saved::Unusable("damaged"));
    }
}
