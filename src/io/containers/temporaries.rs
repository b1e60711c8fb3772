//! The temporary files and staging folders of this process, so that a process that is told to end can remove them.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::{fs, io};

use crate::error::{Error, Result};

/// Temporary files and staging folders start with this.
const PREFIX: &str = ".haloray-";

/// The host's name on Linux; elsewhere nothing, and what killed runs left is let alone.
pub(super) fn host_name() -> Option<String> {
    let name = fs::read_to_string("/proc/sys/kernel/hostname").ok()?;
    let plain: String =
        name.trim().chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    (!plain.is_empty()).then_some(plain)
}

/// How the names of temporaries of a host begin.
pub(super) fn prefix_for(host: &str) -> String {
    format!("{PREFIX}{host}-")
}

/// How the names of this process's temporary files and staging folders begin.
pub(super) fn own_prefix() -> String {
    format!("{}{}+", prefix_for(host_name().as_deref().unwrap_or("host")), std::process::id())
}

/// Whether the process of this host that a temporary is named after lives no longer.
pub(super) fn maker_is_dead(name: &str, host: &str) -> bool {
    let process = name.strip_prefix(&prefix_for(host)).and_then(|rest| rest.split_once('+'));
    let process = process.and_then(|(process, _)| process.parse::<u32>().ok());
    process.is_some_and(|process| !Path::new(&format!("/proc/{process}")).exists())
}

/// Removes the temporary files in `folder` of processes of this host that live no longer.
pub(super) fn sweep_files(folder: &Path) {
    let (Some(host), Ok(entries)) = (host_name(), fs::read_dir(folder)) else { return };
    for entry in entries.flatten() {
        if maker_is_dead(&entry.file_name().to_string_lossy(), &host) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// What lives now; closed for good once it has been swept.
static LIVE: Mutex<Live> = Mutex::new(Live { is_closed: false, temporaries: Vec::new() });

struct Live {
    is_closed: bool,
    /// Paths, and whether they go with all that they hold or, as an output folder made here, only when empty.
    temporaries: Vec<(PathBuf, bool)>,
}

/// A temporary file or folder, known as such until dropped.
#[derive(Debug)]
pub(super) struct Temporary(PathBuf);

impl Temporary {
    /// Makes a temporary file or folder, which goes with all that it holds.
    pub(super) fn make<T: AsRef<Path>>(
        make: impl FnOnce() -> io::Result<T>,
    ) -> Result<io::Result<(T, Self)>> {
        let mut live = open()?;
        Ok(make().map(|made| {
            let path = made.as_ref().to_path_buf();
            live.temporaries.push((path.clone(), true));
            (made, Self(path))
        }))
    }

    /// Makes an output folder, which goes again if it is empty when the process is told to end.
    pub(super) fn make_output_folder(path: &Path) -> Result<io::Result<Self>> {
        let mut live = open()?;
        Ok(fs::create_dir(path).map(|()| {
            live.temporaries.push((path.into(), false));
            Self(path.into())
        }))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        lock().temporaries.retain(|(path, _)| *path != self.0);
    }
}

fn lock() -> MutexGuard<'static, Live> {
    LIVE.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// The registry, as long as it is not closed.
fn open() -> Result<MutexGuard<'static, Live>> {
    let live = lock();
    if live.is_closed { Err(Error::Cancelled) } else { Ok(live) }
}

/// Runs `change`, which [`remove_temporaries`] never cuts in two. It must neither make nor drop a [`Temporary`].
pub(super) fn undivided<T>(change: impl FnOnce() -> Result<T>) -> Result<T> {
    let _open = open()?;
    change()
}

/// The folders into which outputs are being written at this moment.
pub fn folders_written_to() -> Vec<PathBuf> {
    let live = lock();
    let temporaries = live.temporaries.iter().filter(|(_, with_content)| *with_content);
    temporaries.filter_map(|(path, _)| path.parent().map(Path::to_path_buf)).collect()
}

/// Removes every temporary file and staging folder of this process and refuses new ones for good. To be called right
/// before the process ends: other threads may still be writing.
pub fn remove_temporaries() {
    let mut live = lock();
    live.is_closed = true;
    for (path, with_content) in std::mem::take(&mut live.temporaries).into_iter().rev() {
        let _ = if with_content { remove(&path) } else { fs::remove_dir(&path) }; // an output folder goes when empty
    }
}

/// A thread that is still writing may add a file while a folder is emptied.
fn remove(path: &Path) -> io::Result<()> {
    if !path.is_dir() {
        return fs::remove_file(path);
    }
    let _ = (0..20).any(|_| fs::remove_dir_all(path).is_ok());
    Ok(())
}
