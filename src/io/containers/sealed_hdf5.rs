//! An HDF5 file that stands alone ends with a hash of itself, behind what HDF5 reads: what was changed since is its owner's.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::Path;

use super::atomic_file::write_atomically;
use super::checkpoint_file::hash;
use crate::error::{Error, Result};

/// What stands before the sixteen digits of the hash; any program that changes the file through HDF5 cuts the line off.
const LABEL: &str = "\nwritten by haloray, hash ";

/// Writes one HDF5 file as [`write_atomically`] does, and seals it.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_hdf5_atomically(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    write_atomically(path, |temporary| {
        write(temporary)?;
        seal(temporary).map_err(|error| Error::write(temporary, error))
    })
}

fn seal(path: &Path) -> std::io::Result<()> {
    let line = line(&fs::read(path)?);
    OpenOptions::new().append(true).open(path)?.write_all(line.as_bytes())
}

/// Whether haloray wrote the file, and nobody changed it.
pub(super) fn is_own(path: &Path) -> bool {
    fs::read(path).is_ok_and(|bytes| {
        let length = bytes.len().saturating_sub(line(&[]).len());
        let (content, end) = bytes.split_at(length);
        end == line(content).as_bytes()
    })
}

fn line(content: &[u8]) -> String {
    format!("{LABEL}{:016x}\n", hash(content))
}
