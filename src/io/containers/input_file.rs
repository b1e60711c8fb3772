//! The one door for input: ordinary files only, no more bytes than memory allows, gzip opened on the way.

use std::fs::File;
use std::io::{Error as IoError, ErrorKind, Read};
use std::path::Path;

use flate2::read::MultiGzDecoder;

use crate::error::{Error, FileFault, Result};

/// The first bytes of a gzip file.
const GZIP: [u8; 2] = [0x1f, 0x8b];
/// Deflate makes no file smaller than by this factor, so that none can hold more than this times its bytes.
const DEFLATE_RATIO: u64 = 1032;
/// Memory that a table takes for every byte of its text: what is packed may be mostly text of nothing.
const MEMORY_PER_UNPACKED_BYTE: u64 = 8;
/// Memory that one input may take where the system does not say what there is.
const DEFAULT_LIMIT_BYTES: u64 = 4 << 30;

/// An ordinary file, opened to be read in parts.
///
/// # Errors
/// [`Error::Read`] for what is no ordinary file or cannot be opened.
pub(super) fn open(path: &Path) -> Result<File> {
    let read_error = Error::read(path);
    let found = std::fs::metadata(path).map_err(read_error)?;
    if found.is_dir() {
        // With the system's own words.
        return Err(std::fs::read(path).err().map_or_else(|| not_ordinary(path, "a folder"), read_error));
    }
    match found.is_file() {
        true => File::open(path).map_err(read_error),
        false => Err(not_ordinary(path, "a pipe or a device")),
    }
}

fn not_ordinary(path: &Path, what: &str) -> Error {
    let problem = format!("it is {what}, but must be an ordinary file");
    Error::read(path)(IoError::new(ErrorKind::InvalidInput, problem))
}

/// The bytes of an ordinary file, unpacked if they are gzip's.
///
/// # Errors
/// [`Error::Read`] for what is no ordinary file or cannot be read; [`Error::File`] for more than memory holds.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    let read_error = Error::read(path);
    let file = open(path)?;
    let found = file.metadata().map_err(read_error)?;
    check_memory(path, found.len())?;
    let mut bytes = Vec::with_capacity(found.len() as usize);
    let mut file = file.take(memory_limit_bytes());
    file.read_to_end(&mut bytes).map_err(read_error)?;
    if !bytes.starts_with(&GZIP) {
        return Ok(bytes);
    }
    let limit = memory_limit_bytes() / MEMORY_PER_UNPACKED_BYTE;
    let mut unpacked = Vec::new();
    let mut packed = MultiGzDecoder::new(bytes.as_slice()).take(limit + 1);
    packed.read_to_end(&mut unpacked).map_err(|error| {
        Error::file(FileFault::Damaged, path, format!("is damaged or cut short as a gzip file: {error}"))
    })?;
    check_memory(path, unpacked.len() as u64 * MEMORY_PER_UNPACKED_BYTE)?;
    Ok(unpacked)
}

/// The text of an ordinary file, which must be UTF-8.
///
/// # Errors
/// As [`Error::Read`] and [`Error::File`] say: no ordinary file, too large, or not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read(path)?)
        .map_err(|_| Error::read(path)(IoError::new(ErrorKind::InvalidData, "it is not UTF-8 text")))
}

/// Bytes that the content of a file of so many bytes may claim to have: what deflate packs into it, and memory holds.
pub(super) fn largest_content_bytes(file_bytes: usize) -> usize {
    (file_bytes as u64).saturating_mul(DEFLATE_RATIO).min(memory_limit_bytes()) as usize
}

fn check_memory(path: &Path, bytes: u64) -> Result<()> {
    let limit = memory_limit_bytes();
    if bytes < limit {
        return Ok(());
    }
    let problem =
        format!("takes {bytes} bytes or more, but half of the free memory is {limit}; cut it into parts");
    Err(Error::file(FileFault::TooLarge, path, problem))
}

/// Half of the memory that is free, or that the process is allowed.
pub(in crate::io) fn memory_limit_bytes() -> u64 {
    let field = |file: &str, name: &str, unit: u64| {
        let text = std::fs::read_to_string(file).ok()?;
        let value = text.lines().find_map(|line| line.strip_prefix(name))?;
        value.split_whitespace().next()?.parse::<u64>().ok().map(|number| number.saturating_mul(unit))
    };
    let free = field("/proc/meminfo", "MemAvailable:", 1024);
    let allowed = field("/proc/self/limits", "Max address space", 1);
    [free, allowed].into_iter().flatten().min().map_or(DEFAULT_LIMIT_BYTES, |bytes| bytes / 2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn gzip_is_unpacked_and_a_damaged_one_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.csv.gz");
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
        packed.write_all(b"z\n0.5\n").unwrap();
        let packed = packed.finish().unwrap();
        std::fs::write(&path, &packed).unwrap();
        assert_eq!(read_text(&path).unwrap(), "z\n0.5\n");
        std::fs::write(&path, &packed[..packed.len() - 9]).unwrap();
        let error = read(&path).unwrap_err();
        assert!(error.is_bad_input() && error.to_string().contains("cut short as a gzip file"), "{error}");
    }

    #[test]
    fn folders_and_devices_are_no_input() {
        for (path, reason) in [("/", "directory"), ("/dev/zero", "a pipe or a device")] {
            let error = read(Path::new(path)).unwrap_err().to_string();
            assert!(error.contains(reason), "{error}");
        }
    }

    #[test]
    fn a_file_may_claim_what_deflate_can_pack_into_it() {
        assert_eq!(largest_content_bytes(10), 10_320);
        assert!((largest_content_bytes(usize::MAX) as u64) < u64::MAX / 2);
    }
}
