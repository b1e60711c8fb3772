//! A whole folder of outputs: staged in a hidden folder inside it, renamed only when all are complete, and the former
//! run's files, which the manifest names, replaced by exactly those.

use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use tempfile::TempDir;

use super::atomic_file::{check_target, folder_of, place_error, sync, sync_folder};
use super::figure_files::FigureFiles;
use super::manifest::{Commit, MANIFEST, Manifest, Replace, check_replaceable, checked_name, target_in};
use super::stale::{LOCK_NAME, lock, remove_free_lock, remove_stale};
use super::temporaries::{Temporary, own_prefix, sweep_files, undivided};
use crate::error::{Error, Result};

/// Outputs on their way into a folder: complete ones are moved there together, or none.
///
/// Dropping it without [`commit`](Self::commit) removes what was staged, and the final folder
/// too when it was made here.
#[derive(Debug)]
pub struct Staging {
    final_dir: PathBuf,
    replace: Replace,
    /// What could not be made, in words.
    complaints: Mutex<Vec<String>>,
    figures: FigureFiles,
    folder: Option<TempDir>,
    /// Holds the lock; the system lets go of it however the run ends.
    _lock: Option<File>,
    /// There when the final folder was made here.
    made_final_dir: Option<Temporary>,
    _known: Temporary,
}

impl Staging {
    /// Opens a staging folder inside `final_dir`, which is created where missing (its parent must
    /// exist), and sweeps staging folders that killed runs on this host left there: a run killed among its renames is
    /// finished, others vanish. `names` are files and folders that it is about to write, as far as they are known.
    ///
    /// # Errors
    /// [`Error::OutputPlace`] when `final_dir` cannot be created or written to, or one of `names` is a file there that is
    /// not to be replaced.
    pub fn begin(final_dir: &Path, names: &[&str], replace: Replace) -> Result<Self> {
        if final_dir.is_file() {
            let source = io::Error::new(ErrorKind::NotADirectory, "it is a file; a folder is wanted");
            return Err(Error::OutputPlace { path: final_dir.into(), source });
        }
        if final_dir.is_symlink() && !final_dir.exists() {
            let source = io::Error::new(ErrorKind::NotFound, "it is a link to a folder that is not there");
            return Err(Error::OutputPlace { path: final_dir.into(), source });
        }
        let made_final_dir = match final_dir.is_dir() {
            true => None,
            false => Some(Temporary::make_output_folder(final_dir)?.map_err(|e| place_error(final_dir, e))?),
        };
        remove_stale(final_dir);
        remove_stale(folder_of(final_dir));
        remove_free_lock(final_dir);
        sweep_files(final_dir);
        let former = Manifest::of_folder(final_dir);
        let manifest = Some(&MANIFEST).filter(|_| replace != Replace::Beside);
        names.iter().chain(manifest).try_for_each(|name| {
            check_target(&target_in(final_dir, Path::new(name)))?;
            check_replaceable(final_dir, name, &former, replace)
        })?;
        match Temporary::make(|| tempfile::Builder::new().prefix(&own_prefix()).tempdir_in(final_dir))? {
            Ok((folder, _known)) => {
                let _lock = lock(folder.path());
                let (final_dir, complaints) = (final_dir.into(), Mutex::default());
                Ok(Self {
                    final_dir,
                    replace,
                    complaints,
                    figures: FigureFiles::default(),
                    folder: Some(folder),
                    _lock,
                    made_final_dir,
                    _known,
                })
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
        target_in(&self.final_dir, name.as_ref())
    }

    /// The same with figures as they are wanted.
    pub fn with_figures(mut self, figures: &FigureFiles) -> Self {
        self.figures = figures.clone();
        self
    }

    /// As what and how figures are wanted.
    pub fn figures(&self) -> &FigureFiles {
        &self.figures
    }

    /// Remembers what could not be made though the rest could.
    pub fn complain(&self, what: String) {
        self.complaints.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(what);
    }

    /// What could not be made.
    pub fn complaints(&self) -> Vec<String> {
        self.complaints.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).clone()
    }

    /// Writes one staged output; a folder in `name` is created, errors carry the final name.
    ///
    /// # Errors
    /// Those of `write`, and [`Error::OutOfRange`] for a name that leaves the folder.
    pub fn write(&self, name: impl AsRef<Path>, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        checked_name(name.as_ref())?;
        let (path, target) = (self.path(&name), self.target(&name));
        undivided(|| fs::create_dir_all(folder_of(&path)).map_err(|error| Error::write(&target, error)))?;
        write(&path).map_err(|error| error.at_path(&target))
    }

    /// Flushes every staged file to the disk, then renames them all into the final folder, removes what the former run
    /// had and this one has not, and returns their final paths in alphabetical order.
    ///
    /// # Errors
    /// [`Error::OutputPlace`] when a final name is taken by a folder, a protected file or one that is not to be replaced;
    /// the results are then kept in a folder that the error names. [`Error::Write`] when the disk is full. Nothing has
    /// been renamed then.
    pub fn commit(mut self) -> Result<Vec<PathBuf>> {
        let paths = files_below(self.folder(), Path::new(""))?;
        let mut names =
            paths.iter().map(|p| checked_name(p).map(String::from)).collect::<Result<Vec<_>>>()?;
        let former = Manifest::of_folder(&self.final_dir);
        let targets: Vec<PathBuf> = names.iter().map(|name| self.target(name)).collect();
        for (name, target) in names.iter().zip(&targets) {
            if let Err(error) = check_target(target)
                .and_then(|()| check_replaceable(&self.final_dir, name, &former, self.replace))
            {
                return Err(self.kept_aside(error));
            }
            sync(&self.path(name)).map_err(|error| Error::write(target, error))?;
        }
        let mut remove = Vec::new();
        if self.replace != Replace::Beside {
            let is_over = |name: &&str| !names.iter().any(|own| own == name);
            let owned = |name: &&str| former.owns(&self.final_dir, name);
            let mut manifest = Manifest::of_files(self.folder(), &names);
            if matches!(self.replace, Replace::Renew | Replace::RenewAny) {
                manifest = manifest.map(|manifest| manifest.beside(former));
            } else {
                remove = former.names().filter(is_over).filter(owned).map(String::from).collect();
            }
            let json = manifest.and_then(|manifest| Ok(serde_json::to_string_pretty(&manifest)? + "\n"));
            let path = self.target(MANIFEST);
            json.and_then(|json| fs::write(self.path(MANIFEST), json)).map_err(|e| Error::write(&path, e))?;
            sync(&self.path(MANIFEST)).map_err(|error| Error::write(&path, error))?;
            names.push(MANIFEST.into());
        }
        let commit = Commit { place: names, remove };
        undivided(|| {
            if take_place(self.folder(), &self.final_dir) {
                return Ok(());
            }
            let done = commit.run(self.folder(), &self.final_dir);
            done.map_err(|error| Error::write(&self.final_dir, error))
        })?;
        targets.iter().for_each(|target| sync_folder(folder_of(target)));
        commit.tell_of_removed(&self.final_dir);
        Ok(targets)
    }

    /// Moves what is staged to where a person finds it, and says so.
    fn kept_aside(&mut self, error: Error) -> Error {
        let Some(folder) = self.folder.take() else { return error };
        let free =
            (1..).map(|k| self.final_dir.join(format!("results-kept-aside-{k}"))).find(|p| !p.exists());
        let (staged, aside) = (folder.keep(), free.unwrap_or_default());
        let _ = fs::remove_file(staged.join(LOCK_NAME));
        match (fs::rename(&staged, &aside), error) {
            (Ok(()), Error::OutputPlace { path, source }) => {
                let text = format!("{source}; the results are kept in {}", aside.display());
                Error::OutputPlace { path, source: io::Error::new(source.kind(), text) }
            }
            (_, error) => error,
        }
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

/// Puts a staging folder in the place of the folder that holds it, if it holds nothing else: in one step, all files are
/// there. False where that cannot be.
fn take_place(staging: &Path, final_dir: &Path) -> bool {
    let is_alone = fs::read_dir(final_dir).is_ok_and(|entries| entries.count() == 1);
    let (Some(name), Some(_), false) = (staging.file_name(), final_dir.file_name(), final_dir.is_symlink())
    else {
        return false;
    };
    let beside = folder_of(final_dir).join(name);
    if !is_alone || fs::rename(staging, &beside).is_err() {
        return false;
    }
    // Staging folders are private; and an empty folder is replaced by a rename.
    let permissions = fs::metadata(final_dir).map(|found| found.permissions());
    let _ = permissions.and_then(|own| fs::set_permissions(&beside, own));
    let is_done = fs::rename(&beside, final_dir).is_ok();
    let _ = if is_done { fs::remove_file(final_dir.join(LOCK_NAME)) } else { fs::rename(&beside, staging) };
    is_done
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
        } else if name != Path::new(LOCK_NAME) && name != Path::new(MANIFEST) {
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
        let staging = Staging::begin(&out, &[], Replace::Own).unwrap();
        fs::write(staging.path("summary.json"), "{}").unwrap();
        staging.write("figures/map.svg", |p| fs::write(p, "<svg/>").map_err(|e| Error::write(p, e))).unwrap();
        assert!(!out.join("summary.json").exists());
        let committed = staging.commit().unwrap();
        assert_eq!(committed, [out.join("figures/map.svg"), out.join("summary.json")]);
        assert!(committed.iter().all(|path| path.is_file()));
        assert_eq!(count(&out), 3);
    }

    #[test]
    fn a_second_run_replaces_exactly_what_the_first_wrote() {
        let parent = tempfile::tempdir().unwrap();
        let out = parent.path().join("out");
        let run = |names: &[&str], text: &str, replace: Replace| {
            let staging = Staging::begin(&out, &["config.toml"], replace)?;
            for name in names {
                staging.write(name, |p| fs::write(p, text).map_err(|e| Error::write(p, e)))?;
            }
            staging.commit()
        };
        run(&["config.toml", "fits/a.csv", "b.csv"], "1", Replace::Own).unwrap();
        fs::write(out.join("notes.txt"), "mine").unwrap();
        run(&["config.toml", "c.csv"], "2", Replace::Own).unwrap();
        let is_there = |name: &str| out.join(name).exists();
        assert!(!is_there("fits") && !is_there("b.csv") && is_there("notes.txt") && is_there("c.csv"));
        // What its owner has changed is the owner's: it stays, and is not replaced unless told.
        fs::write(out.join("config.toml"), "edited").unwrap();
        let refused = run(&["config.toml"], "3", Replace::Own).unwrap_err();
        assert!(refused.is_bad_input() && refused.to_string().contains("--overwrite"), "{refused}");
        fs::write(out.join("c.csv"), "edited").unwrap();
        let refused = run(&["notes.txt", "d.csv"], "3", Replace::Own).unwrap_err().to_string();
        assert!(refused.contains("config.toml"), "{refused}");
        run(&["config.toml"], "4", Replace::Any).unwrap();
        assert_eq!(fs::read_to_string(out.join("config.toml")).unwrap(), "4");
        assert!(is_there("c.csv") && is_there("notes.txt"));
        // A name that nobody told of before the work: the work is kept.
        let refused = run(&["notes.txt", "d.csv"], "5", Replace::Own).unwrap_err().to_string();
        assert!(refused.contains("results-kept-aside-1"), "{refused}");
        assert_eq!(fs::read_to_string(out.join("results-kept-aside-1/d.csv")).unwrap(), "5");
        assert_eq!(fs::read_to_string(out.join("notes.txt")).unwrap(), "mine");
    }

    #[test]
    fn times_do_not_make_manifests_differ() {
        let out = tempfile::tempdir().unwrap();
        let run = |seconds: &str| {
            let staging = Staging::begin(out.path(), &["fits/a/timings.json"], Replace::Own).unwrap();
            staging
                .write("fits/a/timings.json", |p| fs::write(p, seconds).map_err(|e| Error::write(p, e)))
                .unwrap();
            staging.commit().unwrap();
            fs::read_to_string(out.path().join(MANIFEST)).unwrap()
        };
        assert_eq!(run("1.5"), run("2.5"));
        assert_eq!(fs::read_to_string(out.path().join("fits/a/timings.json")).unwrap(), "2.5");
    }

    #[test]
    fn names_that_leave_the_folder_are_refused() {
        let out = tempfile::tempdir().unwrap();
        let staging = Staging::begin(out.path(), &[], Replace::Own).unwrap();
        for name in ["../x", "/tmp/x", "a/../../x", "manifest.json"] {
            let error =
                staging.write(name, |p| fs::write(p, "").map_err(|e| Error::write(p, e))).unwrap_err();
            assert!(error.is_bad_input(), "{error}");
        }
    }

    #[test]
    fn dropping_removes_the_folder_it_made_but_not_one_that_was_there() {
        let parent = tempfile::tempdir().unwrap();
        let (new, old) = (parent.path().join("new"), parent.path().join("old"));
        fs::create_dir(&old).unwrap();
        for out in [&new, &old] {
            let staging = Staging::begin(out, &[], Replace::Own).unwrap();
            fs::write(staging.path("run.h5"), "half").unwrap();
        }
        assert!(!new.exists());
        assert!(old.exists() && count(&old) == 0);
    }

    #[test]
    fn a_living_run_is_left_alone_and_a_dead_one_is_swept() {
        let out = tempfile::tempdir().unwrap();
        let living = Staging::begin(out.path(), &[], Replace::Own).unwrap();
        let mut dead = Staging::begin(out.path(), &[], Replace::Own).unwrap();
        let kept = dead.folder.take().unwrap().keep(); // as after SIGKILL: folder there, lock free
        drop(dead);
        let next = Staging::begin(out.path(), &[], Replace::Own).unwrap();
        assert!(living.path("").is_dir() && next.path("").is_dir());
        assert_eq!(kept.exists(), crate::io::containers::temporaries::host_name().is_none());
    }

    #[test]
    fn staging_inside_a_staged_folder_leaves_its_lock() {
        let out = tempfile::tempdir().unwrap();
        let outer = Staging::begin(out.path(), &[], Replace::Own).unwrap();
        let _inner = Staging::begin(&outer.path("."), &[], Replace::Own).unwrap();
        assert!(outer.path(LOCK_NAME).exists());
    }

    #[test]
    fn a_final_name_taken_by_a_folder_fails_before_anything_moves() {
        let out = tempfile::tempdir().unwrap();
        fs::create_dir(out.path().join("b.csv")).unwrap();
        let staging = Staging::begin(out.path(), &[], Replace::Own).unwrap();
        for name in ["a.csv", "b.csv"] {
            fs::write(staging.path(name), "z\n").unwrap();
        }
        assert!(matches!(staging.commit().unwrap_err(), Error::OutputPlace { .. }));
        assert_eq!(count(out.path()), 2);
        assert_eq!(count(&out.path().join("results-kept-aside-1")), 2);
    }

    #[test]
    fn bad_places_are_told_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        for bad in [folder.path().join("missing/out"), file.clone(), file.join("out")] {
            let error = Staging::begin(&bad, &[], Replace::Own).unwrap_err();
            assert!(matches!(error, Error::OutputPlace { .. }) && error.is_bad_input(), "{error}");
        }
    }

    #[test]
    fn a_failing_writer_names_the_final_file() {
        let out = tempfile::tempdir().unwrap();
        let staging = Staging::begin(out.path(), &[], Replace::Own).unwrap();
        let error = staging.write("run.h5", |p| Err(Error::write(p, "disk full"))).unwrap_err();
        let expected = out.path().join("run.h5");
        assert!(error.to_string().starts_with(&format!("writing {} failed", expected.display())), "{error}");
        drop(staging);
        assert_eq!(count(out.path()), 0);
    }
}
