//! Records of long work, appended to one file as they end: whatever kills the work, it goes on after the last whole one.
//!
//! A header of twenty-four bytes (format, hashes of the build and of the command), then the records: number, length and
//! hash, eight bytes each, and the record as postcard writes it. A record that was cut short ends what is read.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::checkpoint_file::{BUILD, hash};
use super::temporaries::undivided;
use crate::error::{Error, Result};

const FORMAT: [u8; 8] = *b"haloraL1";
const HEADER: usize = 24;
/// Bytes in front of a record: number, length, hash.
const FRAME: usize = 24;
/// How long records may be known to the system alone and not to the disk.
const SYNC_EVERY: Duration = Duration::from_secs(60);

/// An open log; one process at a time has it.
#[derive(Debug)]
pub struct RecordLog {
    path: PathBuf,
    file: File,
    /// Where each record is and how long.
    index: BTreeMap<u64, (u64, usize)>,
    end: u64,
    synced: Instant,
}

impl RecordLog {
    /// Opens the log of `command` at `path`, made if missing. What cannot be continued is replaced; the second value says why.
    ///
    /// # Errors
    /// [`Error::OutputPlace`] where it cannot be made or another process has it; [`Error::Read`].
    pub fn open(path: &Path, command: &str) -> Result<(Self, Option<&'static str>)> {
        let place = |source| Error::OutputPlace { path: path.into(), source };
        let open = || OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        let mut file = undivided(|| open().map_err(place))?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => {
                let text = "another process is at this work";
                return Err(place(std::io::Error::new(ErrorKind::ResourceBusy, text)));
            }
            Ok(()) | Err(TryLockError::Error(_)) => {} // some file systems have no locks
        }
        let wanted = header(command);
        let mut found = Vec::with_capacity(HEADER);
        (&file).take(HEADER as u64).read_to_end(&mut found).map_err(Error::read(path))?;
        let wrong = ["of another format", "of another build of haloray", "of another command"];
        let mut replaced = None;
        if found != wanted {
            let mut parts = found.chunks_exact(8).zip(wanted.chunks_exact(8));
            let differs = parts.position(|(found, wanted)| found != wanted);
            replaced = (!found.is_empty()).then(|| differs.map_or("damaged", |part| wrong[part]));
            let begin = |file: &mut File| {
                file.set_len(0)?;
                file.seek(SeekFrom::Start(0))?;
                file.write_all(&wanted)
            };
            begin(&mut file).map_err(|error| Error::write(path, error))?;
        }
        let mut log = Self::at(path, file);
        log.scan()?;
        Ok((log, replaced))
    }

    /// A log of any command to read from, and whether a process is at it now; none where there is no log.
    ///
    /// # Errors
    /// [`Error::Read`].
    pub fn look(path: &Path) -> Result<Option<(Self, bool)>> {
        let file = match File::open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(Error::read(path)(error)),
        };
        let is_at_work = matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
        // Whoever begins now must find it free.
        let _ = file.unlock();
        let mut log = Self::at(path, file);
        log.scan()?;
        Ok(Some((log, is_at_work)))
    }

    fn at(path: &Path, file: File) -> Self {
        let (index, end, synced) = (BTreeMap::new(), HEADER as u64, Instant::now());
        Self { path: path.into(), file, index, end, synced }
    }

    /// Finds the whole records; the first that is not whole is where the next one will be written.
    fn scan(&mut self) -> Result<()> {
        let read_error = Error::read(&self.path);
        self.file.seek(SeekFrom::Start(HEADER as u64)).map_err(read_error)?;
        let length = self.file.metadata().map_err(Error::read(&self.path))?.len();
        let mut input = std::io::BufReader::new(&self.file);
        let mut record = Vec::new();
        let mut frame = [0_u8; FRAME];
        while input.read_exact(&mut frame).is_ok() {
            let number_at = |i: usize| u64::from_le_bytes(std::array::from_fn(|k| frame[8 * i + k]));
            let (number, bytes, wanted) = (number_at(0), number_at(1), number_at(2));
            if bytes > length.saturating_sub(self.end + FRAME as u64) {
                break;
            }
            record.resize(bytes as usize, 0);
            if input.read_exact(&mut record).is_err() || hash(&record) != wanted {
                break;
            }
            self.index.insert(number, (self.end + FRAME as u64, bytes as usize));
            self.end += FRAME as u64 + bytes;
        }
        Ok(())
    }

    /// Numbers of the records there are, ascending.
    pub fn numbers(&self) -> impl Iterator<Item = u64> {
        self.index.keys().copied()
    }

    /// Whether that record is there.
    pub fn has(&self, number: u64) -> bool {
        self.index.contains_key(&number)
    }

    /// Appends a record, about every minute down to the disk.
    ///
    /// # Errors
    /// [`Error::Write`]; the records before stay.
    pub fn append(&mut self, number: u64, record: &impl Serialize) -> Result<()> {
        let failed = |error: &dyn std::fmt::Display| Error::write(&self.path, error);
        let mut bytes = postcard::to_extend(record, vec![0; FRAME]).map_err(|error| failed(&error))?;
        let length = bytes.len() - FRAME;
        let frame = [number, length as u64, hash(&bytes[FRAME..])].map(u64::to_le_bytes).concat();
        bytes[..FRAME].copy_from_slice(&frame);
        let put = |mut file: &File| {
            file.seek(SeekFrom::Start(self.end))?;
            file.write_all(&bytes)
        };
        put(&self.file).map_err(|error| failed(&error))?;
        self.index.insert(number, (self.end + FRAME as u64, length));
        self.end += bytes.len() as u64;
        if self.synced.elapsed() > SYNC_EVERY {
            self.sync()?;
        }
        Ok(())
    }

    /// Everything down to the disk.
    ///
    /// # Errors
    /// [`Error::Write`].
    pub fn sync(&mut self) -> Result<()> {
        self.synced = Instant::now();
        self.file.sync_data().map_err(|error| Error::write(&self.path, error))
    }

    /// The record of that number.
    ///
    /// # Errors
    /// [`Error::Read`] for one that is missing or cannot be read.
    pub fn read<Record: DeserializeOwned>(&self, number: u64) -> Result<Record> {
        let fault = |text: String| Error::read(&self.path)(std::io::Error::new(ErrorKind::InvalidData, text));
        let &(place, length) =
            self.index.get(&number).ok_or_else(|| fault(format!("it has no record {number}")))?;
        let mut bytes = vec![0; length];
        let mut file = &self.file;
        file.seek(SeekFrom::Start(place)).map_err(Error::read(&self.path))?;
        file.read_exact(&mut bytes).map_err(Error::read(&self.path))?;
        postcard::from_bytes(&bytes).map_err(|error| fault(format!("record {number}: {error}")))
    }

    /// Removes the file: the results are safe.
    pub fn remove(self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

fn header(command: &str) -> Vec<u8> {
    [FORMAT, hash(BUILD.as_bytes()).to_le_bytes(), hash(command.as_bytes()).to_le_bytes()].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(path: &Path, command: &str) -> (Vec<u64>, Option<&'static str>) {
        let (log, why) = RecordLog::open(path, command).unwrap();
        (log.numbers().collect(), why)
    }

    #[test]
    fn whatever_end_a_log_is_cut_at_it_goes_on_after_the_last_whole_record() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        let records = [(7, vec![0.1, -0.0]), (3, vec![f64::MIN_POSITIVE; 5]), (4, vec![])];
        let mut ends = vec![HEADER];
        {
            let (mut log, why) = RecordLog::open(&path, "a").unwrap();
            assert_eq!(why, None);
            for (number, record) in &records {
                log.append(*number, record).unwrap();
                ends.push(log.end as usize);
            }
        }
        let whole = std::fs::read(&path).unwrap();
        for cut in 0..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let left = ends.iter().filter(|end| **end <= cut).count().saturating_sub(1);
            let (mut log, _) = RecordLog::open(&path, "a").unwrap();
            assert_eq!(log.numbers().count(), left, "{cut}");
            for (number, record) in &records[left..] {
                log.append(*number, record).unwrap();
            }
            for (number, record) in &records {
                assert_eq!(log.read::<Vec<f64>>(*number).unwrap(), *record);
            }
        }
        assert_eq!(std::fs::read(&path).unwrap(), whole);
    }

    #[test]
    fn damage_and_other_commands_are_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        assert!(RecordLog::look(&path).unwrap().is_none());
        {
            let (mut log, _) = RecordLog::open(&path, "a").unwrap();
            for number in 0..3 {
                log.append(number, &vec![number as f64; 4]).unwrap();
            }
            assert!(RecordLog::open(&path, "a").unwrap_err().to_string().contains("another process"));
            let (seen, is_at_work) = RecordLog::look(&path).unwrap().unwrap();
            assert!(is_at_work && seen.numbers().eq(0..3));
            assert!(log.read::<Vec<f64>>(9).is_err());
        }
        assert_eq!(numbers(&path, "a"), (vec![0, 1, 2], None));
        let mut bytes = std::fs::read(&path).unwrap();
        let middle = HEADER + FRAME + 33 + FRAME + 5; // in the second record
        bytes[middle] ^= 1;
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(numbers(&path, "a"), (vec![0], None));
        assert_eq!(numbers(&path, "b"), (vec![], Some("of another command")));
    }
}
