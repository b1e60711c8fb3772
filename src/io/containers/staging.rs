//! A whole folder of outputs: staged in a hidden folder inside it, renamed only when all are complete.

use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::atomic_file::{check_target, folder_of, place_error, sync, sync_folder};
use super::temporaries::{PREFIX, Temporary, undivided};
use crate::error::{Error, Result};

/// Locked as long as the run that owns the staging folder lives.
const LOCK_NAME: &str = ".lock";

/// Outputs on their way into a folder: complete ones are moved there together, or none.
///
/// Dropping it without [`commit`](Self::commit) removes what was staged, and the final folder
/// too when it was made here.
#[derive(Debug)]
pub struct Staging {
    final_dir: PathBuf,
    folder: Option<TempDir>,
    /// Holds the lock; the system lets go of it however the run ends.
    _lock: Option<File>,
    /// There when the final folder was made here.
    made_final_dir: Option<Temporary>,
    _known: Temporary,
}

impl Staging {
    /// Opens a staging folder inside `final_dir`, which is created where missing (its parent must
    /// exist), and removes staging folders that killed runs on this host left there.
    ///
    /// # Errors
    /// [`Error::OutputPlace`] when `final_dir` cannot be created or written to.
    pub fn begin(final_dir: &Path) -> Result<Self> {
        if final_dir.is_file() {
            let source = io::Error::new(ErrorKind::NotADirectory, "it is a file; a folder is wanted");
            return Err(Error::OutputPlace { path: final_dir.into(), source });
        }
        let made_final_dir = match final_dir.is_dir() {
            true => None,
            false => Some(Temporary::make_output_folder(final_dir)?.map_err(|e| place_error(final_dir, e))?),
        };
        let host = host_name();
        if let Some(host) = &host {
            remove_stale(final_dir, &prefix_for(host));
        }
        let prefix = prefix_for(host.as_deref().unwrap_or("host"));
        match Temporary::make(|| tempfile::Builder::new().prefix(&prefix).tempdir_in(final_dir))? {
            Ok((folder, _known)) => {
                let _lock = lock(folder.path());
                Ok(Self { final_dir: final_dir.into(), folder: Some(folder), _lock, made_final_dir, _known })
            }
            Err(error) => {
                if made_final_dir.is_some() {
                    let _ = fs::remove_dir(final_dir);
                }
                Err(place_error(final_dir, error))
            }
        }
    }

    /// Where to write the output that will be called `name` (`"run.h5"`, `"figures/map.svg"`).
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder().join(name)
    }

    /// What a staged output will be called, without a needless `./`.
    fn target(&self, name: impl AsRef<Path>) -> PathBuf {
        if self.final_dir == Path::new(".") { name.as_ref().into() } else { self.final_dir.join(name) }
    }

    /// Writes one staged output; a folder in `name` is created, errors carry the final name.
    pub fn write(&self, name: impl AsRef<Path>, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let (path, target) = (self.path(&name), self.target(&name));
        undivided(|| fs::create_dir_all(folder_of(&path)).map_err(|error| Error::write(&target, error)))?;
        write(&path).map_err(|error| error.at_path(&target))
    }

    /// Flushes every staged file to the disk, then renames them all into the final folder, and
    /// returns their final paths in alphabetical order.
    ///
    /// # Errors
    /// [`Error::OutputPlace`] when a final name is taken by a folder or a protected file,
    /// [`Error::Write`] when the disk is full; both before the first rename.
    pub fn commit(self) -> Result<Vec<PathBuf>> {
        let names = files_below(self.folder(), Path::new(""))?;
        let targets: Vec<PathBuf> = names.iter().map(|name| self.target(name)).collect();
        for (name, target) in names.iter().zip(&targets) {
            check_target(target)?;
            sync(&self.path(name)).map_err(|error| Error::write(target, error))?;
        }
        undivided(|| {
            names.iter().zip(&targets).try_for_each(|(name, target)| {
                fs::create_dir_all(folder_of(target))
                    .and_then(|()| fs::rename(self.path(name), target))
                    .map_err(|error| Error::write(target, error))
            })
        })?;
        targets.iter().for_each(|target| sync_folder(folder_of(target)));
        Ok(targets)
    }

    fn folder(&self) -> &Path {
        self.folder.as_ref().map_or(&self.final_dir, TempDir::path)
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        self.folder.take();
        if self.made_final_dir.is_some() {
            let _ = fs::remove_dir(&self.final_dir); // only goes when empty
        }
    }
}

fn prefix_for(host: &str) -> String {
    format!("{PREFIX}{host}-")
}

/// The host's name on Linux; elsewhere nothing, and stale folders are left alone.
fn host_name() -> Option<String> {
    let name = fs::read_to_string("/proc/sys/kernel/hostname").ok()?;
    let plain: String =
        name.trim().chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    (!plain.is_empty()).then_some(plain)
}

/// Creates the lock file. It gets its name only once locked, so nobody sees it unlocked.
fn lock(folder: &Path) -> Option<File> {
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

/// Removes staging folders of this host whose lock is free: their runs are dead.
///
/// The host is part of the name because some network file systems keep locks to one host.
fn remove_stale(final_dir: &Path, prefix: &str) {
    let Ok(entries) = fs::read_dir(final_dir) else { return };
    for entry in entries.flatten().filter(|e| e.file_name().to_string_lossy().starts_with(prefix)) {
        let Ok(file) = File::open(entry.path().join(LOCK_NAME)) else { continue };
        if file.try_lock().is_ok() {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

/// Paths of all staged files relative to the staging folder, sorted.
fn files_below(root: &Path, inner: &Path) -> Result<Vec<PathBuf>> {
    let folder = root.join(inner);
    let failed = |error| Error::write(&folder, error);
    let mut names = Vec::new();
    for entry in fs::read_dir(&folder).map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let name = inner.join(entry.file_name());
        if entry.file_type().map_err(failed)?.is_dir() {
            names.extend(files_below(root, &name)?);
        } else if name != Path::new(LOCK_NAME) {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn commit_moves_all_files_and_nothing_else_stays() {
        let parent = tempfile::tempdir().unwrap();
        let out = parent.path().join("out");
        let staging = Staging::begin(&out).unwrap();
        fs::write(staging.path("summary.json"), "{}").unwrap();
        staging.write("figures/map.svg", |p| fs::write(p, "<svg/>").map_err(|e| Error::write(p, e))).unwrap();
        assert!(!out.join("summary.json").exists());
        let committed = staging.commit().unwrap();
        assert_eq!(committed, [out.join("figures/map.svg"), out.join("summary.json")]);
        assert!(committed.iter().all(|path| path.is_file()));
        assert_eq!(count(&out), 2);
    }

    #[test]
    fn dropping_removes_the_folder_it_made_but_not_one_that_was_there() {
        let parent = tempfile::tempdir().unwrap();
        let (new, old) = (parent.path().join("new"), parent.path().join("old"));
        fs::create_dir(&old).unwrap();
        for out in [&new, &old] {
            let staging = Staging::begin(out).unwrap();
            fs::write(staging.path("run.h5"), "half").unwrap();
        }
        assert!(!new.exists());
        assert!(old.exists() && count(&old) == 0);
    }

    #[test]
    fn a_living_run_is_left_alone_and_a_dead_one_is_swept() {
        let out = tempfile::tempdir().unwrap();
        let living = Staging::begin(out.path()).unwrap();
        let mut dead = Staging::begin(out.path()).unwrap();
        let kept = dead.folder.take().unwrap().keep(); // as after SIGKILL: folder there, lock free
        drop(dead);
        let next = Staging::begin(out.path()).unwrap();
        assert!(living.path("").is_dir() && next.path("").is_dir());
        assert_eq!(kept.exists(), host_name().is_none());
    }

    #[test]
    fn a_final_name_taken_by_a_folder_fails_before_anything_moves() {
        let out = tempfile::tempdir().unwrap();
        fs::create_dir(out.path().join("b.csv")).unwrap();
        let staging = Staging::begin(out.path()).unwrap();
        for name in ["a.csv", "b.csv"] {
            fs::write(staging.path(name), "z\n").unwrap();
        }
        assert!(matches!(staging.commit().unwrap_err(), Error::OutputPlace { .. }));
        assert_eq!(count(out.path()), 1);
    }

    #[test]
    fn bad_places_are_told_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        for bad in [folder.path().join("missing/out"), file.clone(), file.join("out")] {
            let error = Staging::begin(&bad).unwrap_err();
            assert!(matches!(error, Error::OutputPlace { .. }) && error.is_bad_input(), "{error}");
        }
    }

    #[test]
    fn a_failing_writer_names_the_final_file() {
        let out = tempfile::tempdir().unwrap();
        let staging = Staging::begin(out.path()).unwrap();
        let error = staging.write("run.h5", |p| Err(Error::write(p, "disk full"))).unwrap_err();
        let expected = out.path().join("run.h5");
        assert!(error.to_string().starts_with(&format!("writing {} failed", expected.display())), "{error}");
        drop(staging);
        assert_eq!(count(out.path()), 0);
    }
}
