//! The lock of a living run's staging folder, and what dead runs left.

use std::fs::{self, File};
use std::path::Path;

use super::manifest::Commit;
use super::temporaries::{host_name, maker_is_dead, prefix_for};

/// Locked as long as the run that owns the staging folder lives.
pub(super) const LOCK_NAME: &str = ".haloray-lock";

/// Creates the lock file. It gets its name only once locked, so nobody sees it unlocked.
pub(super) fn lock(folder: &Path) -> Option<File> {
    let unnamed = folder.join(".locking");
    let file = File::create(&unnamed).ok()?;
    let locked = file.try_lock().is_ok();
    if locked {
        fs::rename(&unnamed, folder.join(LOCK_NAME)).ok()?;
    } else {
        fs::remove_file(&unnamed).ok()?; // no locks on this file system: never seen as stale
    }
    locked.then_some(file)
}

/// Whether a folder has a lock that nobody holds.
fn is_unlocked(folder: &Path) -> bool {
    File::open(folder.join(LOCK_NAME)).is_ok_and(|file| file.try_lock().is_ok())
}

/// Removes the lock of a run that was killed right after its folder took the place of `final_dir`.
pub(super) fn remove_free_lock(final_dir: &Path) {
    if is_unlocked(final_dir) {
        let _ = fs::remove_file(final_dir.join(LOCK_NAME));
    }
}

/// Sweeps staging folders that dead runs of this host left in `final_dir`: their lock is free, or they have none, killed
/// before they got it or while they were removed, and no process of that number lives. One that had begun its renames is
/// finished, so that no part of a set of files stays.
///
/// The host is part of the name because some network file systems keep locks to one host.
pub(super) fn remove_stale(final_dir: &Path) {
    let (Some(host), Ok(entries)) = (host_name(), fs::read_dir(final_dir)) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let has_lock = entry.path().join(LOCK_NAME).exists();
        let is_dead = if has_lock { is_unlocked(&entry.path()) } else { maker_is_dead(&name, &host) };
        if is_dead && name.starts_with(&prefix_for(&host)) && entry.path().is_dir() {
            let finished =
                Commit::begun(&entry.path()).is_none_or(|c| c.run(&entry.path(), final_dir).is_ok());
            let _ = if finished { fs::remove_dir_all(entry.path()) } else { Ok(()) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dead_run_is_swept_even_without_its_lock() {
        let Some(host) = host_name() else { return };
        let out = tempfile::tempdir().unwrap();
        let of = |process: u32| out.path().join(format!("{}{process}+abc", prefix_for(&host)));
        for process in [std::process::id(), u32::MAX] {
            fs::create_dir_all(of(process).join(".former")).unwrap();
        }
        remove_stale(out.path());
        assert!(of(std::process::id()).exists() && !of(u32::MAX).exists());
    }
}
