//! Which files of a folder belong to the run that wrote them last, and the journal that finishes a run killed between renames.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::checkpoint_file::hash;
use crate::error::{Error, Result};

/// Name of the manifest in the folder of a run.
pub(super) const MANIFEST: &str = "manifest.json";
/// The journal in a staging folder: there once every file is staged and on the disk.
const JOURNAL: &str = ".commit";
/// Former files, in a staging folder, until the new ones are in place.
const FORMER: &str = ".former";

/// How long a run took: the file of all that differs between equal runs.
pub const TIMINGS: &str = "timings.json";

/// The files of a run with a hash of their bytes; that of [`TIMINGS`] is empty, so that equal runs have equal manifests.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Manifest {
    files: BTreeMap<String, String>,
}

fn fingerprint(folder: &Path, name: &str) -> io::Result<String> {
    match Path::new(name).ends_with(TIMINGS) {
        true => Ok(String::new()),
        false => Ok(format!("{:016x}", hash(&fs::read(folder.join(name))?))),
    }
}

impl Manifest {
    /// That of a folder; empty where there is none.
    pub fn of_folder(folder: &Path) -> Self {
        Self::read(folder).unwrap_or_default()
    }

    /// That of a folder; `None` where no run can have written it: other files bear that name too, and a name that leaves the
    /// folder would be removed.
    fn read(folder: &Path) -> Option<Self> {
        let text = fs::read_to_string(folder.join(MANIFEST)).ok()?;
        let manifest: Self = serde_json::from_str(&text).ok()?;
        let stay = manifest.names().all(|name| checked_name(Path::new(name)).is_ok());
        stay.then_some(manifest)
    }

    /// The names listed.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// Whether the run wrote the file of that name in `folder`, as it is now: what was changed since is its owner's.
    pub fn owns(&self, folder: &Path, name: &str) -> bool {
        if name == MANIFEST {
            return Self::read(folder).is_some();
        }
        self.files.get(name).is_some_and(|own| fingerprint(folder, name).is_ok_and(|now| now == *own))
    }

    /// With the entries of a former one that this one lacks.
    pub fn beside(mut self, former: Self) -> Self {
        for (name, fingerprint) in former.files {
            self.files.entry(name).or_insert(fingerprint);
        }
        self
    }

    /// Of the staged files of those names.
    pub fn of_files(staging: &Path, names: &[String]) -> io::Result<Self> {
        let listed = names.iter().map(|name| Ok((name.clone(), fingerprint(staging, name)?)));
        Ok(Self { files: listed.collect::<io::Result<_>>()? })
    }
}

/// Names of the files of the run in `folder`, in order: those of its manifest that are there, without one all that are
/// not hidden.
///
/// # Errors
/// [`Error::Read`] when the folder cannot be read.
pub fn files_of_run(folder: &Path) -> Result<Vec<String>> {
    let listed: Vec<String> = Manifest::of_folder(folder).names().map(String::from).collect();
    if !listed.is_empty() {
        return Ok(listed.into_iter().filter(|name| folder.join(name).is_file()).collect());
    }
    let mut names = Vec::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(inner) = folders.pop() {
        let path = folder.join(&inner);
        for entry in fs::read_dir(&path).map_err(Error::read(&path))? {
            let entry = entry.map_err(Error::read(&path))?;
            let name = inner.join(entry.file_name());
            match name.to_str() {
                _ if entry.file_name().to_string_lossy().starts_with('.') => {}
                _ if entry.path().is_dir() => folders.push(name),
                Some(name) if name != MANIFEST => names.push(name.to_owned()),
                _ => {}
            }
        }
    }
    names.sort();
    Ok(names)
}

/// Whether a run lists the file, in the manifest of its folder or of one that holds it.
pub fn is_of_a_run(file: &Path) -> bool {
    let Ok(file) = std::path::absolute(file) else { return false };
    let name = |folder: &Path| Some(file.strip_prefix(folder).ok()?.to_str()?.to_owned());
    file.ancestors()
        .skip(1)
        .any(|folder| name(folder).is_some_and(|name| Manifest::of_folder(folder).files.contains_key(&name)))
}

/// A name of an output: a path that stays in its folder.
pub(super) fn checked_name(name: &Path) -> Result<&str> {
    let stays =
        name.components().all(|part| matches!(part, Component::Normal(_))) && name.file_name().is_some();
    let is_free = !name.starts_with(MANIFEST) && !name.starts_with(JOURNAL) && !name.starts_with(FORMER);
    match name.to_str().filter(|name| stays && is_free && !name.contains('\0')) {
        Some(name) => Ok(name),
        None => {
            let allowed = "a name in UTF-8 that stays in the folder of the results";
            Err(Error::out_of_range("name of an output", name.display(), allowed))
        }
    }
}

/// What a commit does; kept as a journal so that a later run can finish it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Commit {
    /// Staged names to be put into the folder.
    pub place: Vec<String>,
    /// Files of the former run that the new one does not have.
    pub remove: Vec<String>,
}

impl Commit {
    /// The commit that a killed run had begun from that staging folder.
    pub fn begun(staging: &Path) -> Option<Self> {
        let commit: Self = serde_json::from_slice(&fs::read(staging.join(JOURNAL)).ok()?).ok()?;
        let mut names = commit.place.iter().chain(&commit.remove);
        let stay = names.all(|name| name == MANIFEST || checked_name(Path::new(name)).is_ok());
        stay.then_some(commit)
    }

    /// Says which files of an earlier run are gone with it.
    pub fn tell_of_removed(&self, folder: &Path) {
        /// A list longer than this is cut.
        const TOLD: usize = 6;
        let told = self.remove.iter().take(TOLD).map(String::as_str).collect::<Vec<_>>().join(", ");
        match self.remove.len() {
            0 => {}
            count if count <= TOLD => {
                log::info!("{}: an earlier run's {told} went with it", folder.display())
            }
            count => log::info!(
                "{}: an earlier run's {told} and {} more files went with it",
                folder.display(),
                count - TOLD
            ),
        }
    }

    /// Makes all renames; when one fails, those made before are taken back.
    pub fn run(&self, staging: &Path, folder: &Path) -> io::Result<()> {
        for name in &self.place {
            fs::create_dir_all(parent(&folder.join(name)))?;
            fs::create_dir_all(parent(&staging.join(FORMER).join(name)))?;
        }
        let journal = staging.join(JOURNAL);
        if !journal.exists() {
            let unfinished = staging.join(".committing");
            fs::write(&unfinished, serde_json::to_vec(self)?)?;
            fs::File::open(&unfinished)?.sync_all()?;
            fs::rename(&unfinished, &journal)?;
        }
        let mut placed: Vec<(&str, bool)> = Vec::new();
        for name in &self.place {
            let (new, target, former) =
                (staging.join(name), folder.join(name), staging.join(FORMER).join(name));
            if !new.exists() {
                continue; // in place since before the kill
            }
            let had_former = target.exists() && !former.exists();
            let moved = if had_former { fs::rename(&target, &former) } else { Ok(()) };
            if let Err(error) = moved.and_then(|()| fs::rename(&new, &target)) {
                if had_former && former.exists() {
                    let _ = fs::rename(&former, &target);
                }
                for (name, had_former) in placed.into_iter().rev() {
                    let _ = fs::rename(folder.join(name), staging.join(name));
                    if had_former {
                        let _ = fs::rename(staging.join(FORMER).join(name), folder.join(name));
                    }
                }
                let _ = fs::remove_file(&journal);
                return Err(error);
            }
            placed.push((name, had_former));
        }
        for name in &self.remove {
            let path = folder.join(name);
            let _ = fs::remove_file(&path);
            let folders = path.ancestors().skip(1).take_while(|ancestor| *ancestor != folder);
            folders.for_each(|folder| drop(fs::remove_dir(folder))); // goes when empty
        }
        Ok(())
    }
}

fn parent(path: &Path) -> PathBuf {
    path.parent().map(Path::to_path_buf).unwrap_or_default()
}

/// Which files in its folder a run may replace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Replace {
    /// Those that an earlier run wrote, by its manifest, and that are as it left them.
    Own,
    /// Whatever bears their names.
    Any,
    /// Those that an earlier run wrote; its other files stay, and the manifest goes on to list them.
    Renew,
    /// Whatever bears their names, the manifest as with [`Renew`](Self::Renew).
    RenewAny,
    /// Whatever bears their names, and no manifest is kept: single files that stand beside a user's own.
    Beside,
}

/// Where an output of that name ends, without a needless `./`.
pub(super) fn target_in(folder: &Path, name: &Path) -> PathBuf {
    if folder == Path::new(".") { name.into() } else { folder.join(name) }
}

/// Refuses a name under which there is a file, or a folder of files, that is not the former run's.
pub(super) fn check_replaceable(
    final_dir: &Path,
    name: &str,
    former: &Manifest,
    replace: Replace,
) -> Result<()> {
    let path = target_in(final_dir, Path::new(name));
    if !matches!(replace, Replace::Own | Replace::Renew) || !path.is_file() || former.owns(final_dir, name) {
        return Ok(());
    }
    let text = "it is there already, and no unchanged file of an earlier run; give another folder, or allow it to be replaced (--overwrite, in Python overwrite=True)";
    Err(Error::OutputPlace { path, source: io::Error::new(ErrorKind::AlreadyExists, text) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_their_folder() {
        for good in ["run.h5", "figures/map.svg", "a b.csv", "..x"] {
            assert_eq!(checked_name(Path::new(good)).unwrap(), good);
        }
        for bad in ["", "..", "../x", "a/../../x", "/etc/x", "manifest.json", ".commit", ".former/x"] {
            assert!(checked_name(Path::new(bad)).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_manifest_that_no_run_wrote_owns_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let own = "mine";
        fs::write(folder.path().join("own"), own).unwrap();
        let hash = format!("{:016x}", hash(own.as_bytes()));
        let with = |text: String| {
            fs::write(folder.path().join(MANIFEST), text).unwrap();
            let manifest = Manifest::of_folder(folder.path());
            [MANIFEST, "own"].map(|name| manifest.owns(folder.path(), name))
        };
        assert_eq!(with(format!(r#"{{"files": {{"own": "{hash}"}}}}"#)), [true, true]);
        assert!(is_of_a_run(&folder.path().join("own")) && !is_of_a_run(&folder.path().join("other")));
        for text in [
            r#"{"name": "an app"}"#.into(),
            "no JSON".into(),
            format!(r#"{{"files": {{"own": "{hash}"}}, "name": "an app"}}"#),
            format!(r#"{{"files": {{"own": "{hash}", "../mine": "{hash}"}}}}"#),
            format!(r#"{{"files": {{"own": "{hash}", "/mine": "{hash}"}}}}"#),
        ] {
            assert_eq!(with(text.clone()), [false, false], "{text}");
        }
        let staging = folder.path().join(".staging");
        fs::create_dir(&staging).unwrap();
        for (remove, is_sound) in [("old/d", true), ("../d", false), ("/d", false)] {
            let commit = Commit { place: vec![MANIFEST.into()], remove: vec![remove.into()] };
            fs::write(staging.join(JOURNAL), serde_json::to_vec(&commit).unwrap()).unwrap();
            assert_eq!(Commit::begun(&staging).is_some(), is_sound, "{remove}");
        }
    }

    #[test]
    fn a_commit_that_was_killed_is_finished_and_one_that_fails_taken_back() {
        let folder = tempfile::tempdir().unwrap();
        let staging = folder.path().join(".staging");
        let commit = Commit { place: vec!["a".into(), "b/c".into()], remove: vec!["old/d".into()] };
        let prepare = || {
            fs::create_dir_all(staging.join("b")).unwrap();
            fs::create_dir_all(folder.path().join("old")).unwrap();
            fs::write(staging.join("a"), "new a").unwrap();
            fs::write(staging.join("b/c"), "new c").unwrap();
            fs::write(folder.path().join("a"), "former a").unwrap();
            fs::write(folder.path().join("old/d"), "former d").unwrap();
        };
        prepare();
        // A folder in the way of the second file: the first gets its former content back.
        fs::create_dir_all(folder.path().join("b/c/x")).unwrap();
        fs::create_dir_all(staging.join(FORMER).join("b/c")).unwrap();
        assert!(commit.run(&staging, folder.path()).is_err());
        assert_eq!(fs::read_to_string(folder.path().join("a")).unwrap(), "former a");
        assert!(folder.path().join("old/d").exists() && staging.join("a").exists());
        fs::remove_dir_all(folder.path().join("b")).unwrap();
        fs::remove_dir_all(&staging).unwrap();
        // Killed after the first rename.
        prepare();
        fs::write(staging.join(JOURNAL), serde_json::to_vec(&commit).unwrap()).unwrap();
        fs::rename(staging.join("a"), folder.path().join("a")).unwrap();
        Commit::begun(&staging).unwrap().run(&staging, folder.path()).unwrap();
        assert_eq!(fs::read_to_string(folder.path().join("a")).unwrap(), "new a");
        assert_eq!(fs::read_to_string(folder.path().join("b/c")).unwrap(), "new c");
        assert!(!folder.path().join("old").exists());
    }
}
