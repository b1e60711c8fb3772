//! One output file at a time: written under a temporary name, then renamed.

use std::fs::{self, File};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use super::temporaries::{Temporary, own_prefix, sweep_files, undivided};
use crate::error::{Error, Result};

/// Writes one file so that its name only ever shows a complete one.
///
/// `write` gets a temporary path in the same folder and with the same extension; when it
/// succeeds the file is flushed to the disk and renamed to `path`, replacing a former one. When
/// anything fails, nothing is left and a former file keeps its content.
///
/// # Errors
/// [`Error::OutputPlace`] when `path` cannot be written to at all (see [`check_writable`]),
/// [`Error::Write`] with the final name when writing fails half-way, else what `write` returned.
pub fn write_atomically(path: &Path, write: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let (temporary, _known) = reserve(path)?;
    write(&temporary).map_err(|error| error.at_path(path))?;
    sync(&temporary).map_err(|error| Error::write(path, error))?;
    let target = resolve(path);
    undivided(|| temporary.persist(&target).map_err(|error| Error::write(path, error.error)))?;
    sync_folder(folder_of(&target));
    Ok(())
}

/// Checks, before long work, that a file can be created at `path` or replaced there.
///
/// # Errors
/// [`Error::OutputPlace`] when the folder is missing or read-only, or when `path` is a folder, a
/// device or a write-protected file.
pub fn check_writable(path: &Path) -> Result<()> {
    reserve(path).map(drop)
}

/// Writes a text so that its name only ever shows a complete one.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    write_atomically(path, |place| fs::write(place, text).map_err(|error| Error::write(place, error)))
}

/// An empty temporary file beside `path`, removed when dropped; those that killed runs left there go first.
fn reserve(path: &Path) -> Result<(tempfile::TempPath, Temporary)> {
    check_target(path)?;
    let target = resolve(path);
    sweep_files(folder_of(&target));
    let suffix = target.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
    let mut builder = tempfile::Builder::new();
    let prefix = own_prefix();
    builder.prefix(&prefix).suffix(&suffix);
    #[cfg(unix)] // a private mode is the default of temporary files; outputs follow the umask
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let make = || builder.tempfile_in(folder_of(&target)).map(tempfile::NamedTempFile::into_temp_path);
    Temporary::make(make)?.map_err(|error| place_error(path, error))
}

/// Refuses a target that a rename must not replace: a folder, a device, a protected file.
pub(super) fn check_target(path: &Path) -> Result<()> {
    let refuse = |kind, reason: &str| {
        Err(Error::OutputPlace { path: path.into(), source: io::Error::new(kind, reason) })
    };
    match fs::metadata(path) {
        Ok(found) if found.is_dir() => {
            refuse(ErrorKind::IsADirectory, "it is a folder; a file name is wanted")
        }
        Ok(found) if !found.is_file() => {
            refuse(ErrorKind::InvalidInput, "it exists and is not an ordinary file")
        }
        Ok(found) if found.permissions().readonly() => {
            refuse(ErrorKind::PermissionDenied, "the existing file is write-protected")
        }
        Err(_) if path.is_symlink() => {
            refuse(ErrorKind::NotFound, "it is a link to a file that is not there")
        }
        _ if path.file_name().is_none() => refuse(ErrorKind::InvalidInput, "it does not name a file"),
        _ => Ok(()),
    }
}

/// The file itself where `path` is a symbolic link to one, so that the link survives.
fn resolve(path: &Path) -> PathBuf {
    if path.is_symlink() { path.canonicalize().unwrap_or_else(|_| path.into()) } else { path.into() }
}

/// The folder that holds `path`; `.` for a bare name.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A full disk means that the run failed; anything else at this point is a bad place.
///
/// `tempfile` adds the temporary path to the system's words; that is taken off.
pub(super) fn place_error(path: &Path, error: io::Error) -> Error {
    let text = error.to_string();
    let source = match text.split_once(" at path ") {
        Some((reason, _)) => io::Error::new(error.kind(), reason),
        None => error,
    };
    match source.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Error::write(path, source),
        _ => Error::OutputPlace { path: path.into(), source },
    }
}

/// Forces the file's content to the disk; a full disk may show up only here.
pub(super) fn sync(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()
}

/// Makes renames in `folder` last through a power cut; some file systems cannot, which is no error.
pub(super) fn sync_folder(folder: &Path) {
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names_in(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failing_writer_leaves_nothing_and_keeps_the_former_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("haloes.csv");
        fs::write(&path, "former").unwrap();
        let error = write_atomically(&path, |temporary| {
            fs::write(temporary, "half of the").unwrap();
            Err(Error::write(temporary, "No space left on device"))
        })
        .unwrap_err();
        assert_eq!(
            error.to_string(),
            format!(
                "writing {} failed: No space left on device; nothing was left under that name",
                path.display()
            )
        );
        assert!(!error.is_bad_input());
        let refuse = |temporary: &Path| Err(Error::table(temporary, "column γ", "not ASCII"));
        let error = write_atomically(&path, refuse).unwrap_err().to_string();
        assert_eq!(error, format!("{}: column γ: not ASCII", path.display()));
        assert_eq!(names_in(folder.path()), ["haloes.csv"]);
        assert_eq!(fs::read_to_string(&path).unwrap(), "former");
    }

    #[test]
    fn a_complete_file_replaces_the_former_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.h5");
        for text in ["first", "second"] {
            write_atomically(&path, |temporary| {
                assert_eq!(temporary.extension(), path.extension());
                assert_eq!(temporary.parent(), path.parent());
                fs::write(temporary, text).map_err(|e| Error::write(temporary, e))
            })
            .unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), text);
        }
        assert_eq!(names_in(folder.path()), ["run.h5"]);
    }

    #[test]
    fn bad_places_are_told_before_any_work() {
        let folder = tempfile::tempdir().unwrap();
        let protected = folder.path().join("protected.csv");
        fs::write(&protected, "").unwrap();
        let mut permissions = fs::metadata(&protected).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&protected, permissions).unwrap();
        for (path, reason) in [
            (folder.path().to_path_buf(), "it is a folder; a file name is wanted"),
            (folder.path().join("missing/out.csv"), "No such file or directory"),
            (protected.join("out.csv"), "Not a directory"),
            (protected.clone(), "the existing file is write-protected"),
            (PathBuf::from("/dev/null"), "it exists and is not an ordinary file"),
            (PathBuf::new(), "it does not name a file"),
        ] {
            let error = check_writable(&path).unwrap_err();
            assert!(matches!(error, Error::OutputPlace { .. }), "{error:?}");
            assert!(error.is_bad_input() && error.to_string().contains(reason), "{error}");
            assert!(!error.to_string().contains(".haloray-"), "{error}");
        }
        check_writable(&folder.path().join("out.csv")).unwrap();
        assert_eq!(names_in(folder.path()), ["protected.csv"]);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn what_a_killed_run_left_is_swept_and_what_a_living_one_writes_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let (living, known) = reserve(&folder.path().join("a.csv")).unwrap();
        let name = living
            .file_name()
            .unwrap()
            .to_string_lossy()
            .replace(&format!("{}+", std::process::id()), "4194305+");
        fs::write(folder.path().join(&name), "half").unwrap(); // no process has a number beyond 2²²
        fs::write(folder.path().join(".haloray-other-host-7+x.csv"), "half").unwrap();
        write_text(&folder.path().join("b.csv"), "b").unwrap();
        assert!(living.exists() && !folder.path().join(name).exists());
        assert_eq!(names_in(folder.path()).len(), 3);
        drop((living, known));
    }

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_stays_and_its_file_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file.csv"), folder.path().join("link.csv"));
        fs::write(&file, "former").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_atomically(&link, |t| fs::write(t, "new").map_err(|e| Error::write(t, e))).unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        fs::remove_file(&file).unwrap(); // a disk that is not mounted
        let refused = write_text(&link, "newer").unwrap_err();
        assert!(refused.to_string().contains("it is a link to a file that is not there"), "{refused}");
        assert!(link.is_symlink());
    }
}
