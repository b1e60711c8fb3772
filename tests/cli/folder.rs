//! Runs the binary in a temporary folder and looks at what it said and left there.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;

/// A temporary folder in which commands run; paths in their arguments are relative to it.
pub struct Folder(tempfile::TempDir);

impl Folder {
    /// A folder with these files.
    pub fn with(files: &[(&str, &str)]) -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        files.iter().for_each(|(name, text)| fs::write(folder.path(name), text).unwrap());
        folder
    }

    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.path().join(name)
    }

    /// `haloray` with arguments separated by spaces.
    pub fn haloray(&self, arguments: &str) -> Output {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("haloray"));
        // A child of another test may hold, for a moment, the lock of a file that this test has just closed.
        command.env("HDF5_USE_FILE_LOCKING", "FALSE");
        command.current_dir(self.0.path()).args(arguments.split_whitespace()).output().unwrap()
    }

    /// Every file below the folder with its bytes; empty folders are listed too.
    pub fn files(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut found = BTreeMap::new();
        let mut folders = vec![PathBuf::new()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(self.path(&folder)).unwrap() {
                let entry = entry.unwrap();
                let name = folder.join(entry.file_name());
                if entry.file_type().unwrap().is_dir() {
                    folders.push(name.clone());
                    found.insert(name, Vec::new());
                } else {
                    found.insert(name, fs::read(entry.path()).unwrap());
                }
            }
        }
        found
    }

    /// Checks what a failed command said: one `error:` line, one `hint:`, every text wanted, nothing on stdout.
    pub fn check_failure(&self, code: i32, output: &Output, arguments: &str, wanted: &[&str]) {
        let stderr = String::from_utf8_lossy(&output.stderr);
        let said = format!("haloray {arguments}\n{stderr}");
        assert_eq!(output.status.code(), Some(code), "{said}");
        assert!(output.stdout.is_empty(), "{said}");
        assert!(stderr.starts_with("error: "), "{said}");
        for start in ["error:", "hint:"] {
            assert_eq!(stderr.lines().filter(|line| line.starts_with(start)).count(), 1, "{said}");
        }
        for text in wanted {
            assert!(stderr.contains(text), "without {text:?}: {said}");
        }
        for private in [".haloray-", "panicked", "/tmp", "expected f64"] {
            assert!(!stderr.contains(private), "{private}: {said}");
        }
    }
}
