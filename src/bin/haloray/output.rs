//! Where a command that makes a folder, or on request one file of it, puts its results.

use std::path::{Path, PathBuf};

use haloray::error::FileFault;
use haloray::io::{Staging, check_writable};
use haloray::report::stage_text;
use haloray::{Error, Result};

use crate::bars::Bars;
use crate::settings::check_not_an_input;

/// A folder of results, or the one file that stands for it.
pub enum Output {
    /// One file, written atomically.
    File(PathBuf),
    /// A staged folder.
    Folder(Staging),
}

/// Extensions of files; a folder is not meant by them.
const FILES: [&str; 9] = ["csv", "h5", "hdf5", "fits", "fit", "png", "svg", "json", "toml"];

impl Output {
    /// Decides by the extension of `path`, and checks that it can be written before any work is done.
    pub fn begin(path: &Path, file_extensions: &[&str], inputs: &[Option<&Path>]) -> Result<Self> {
        let extension =
            path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        if file_extensions.contains(&extension.as_str()) {
            check_writable(path)?;
            check_not_an_input(path, inputs)?;
            return Ok(Self::File(path.into()));
        }
        if FILES.contains(&extension.as_str()) && !path.is_dir() {
            let problem = format!("-o takes a folder or a file ending in .{}", file_extensions.join(" or ."));
            return Err(Error::file(FileFault::UnknownFormat, path, problem));
        }
        Ok(Self::Folder(Staging::begin(path)?))
    }
}

/// Stages the result of a study beside its other files, commits its folder and prints what there is.
pub fn finish_study(staging: Staging, result: &str, bars: &Bars) -> Result<()> {
    stage_text(&staging, "result.md", result)?;
    let files = staging.commit()?;
    if !bars.is_quiet() {
        crate::terminal::print(result);
    }
    print_files(&files, bars);
    Ok(())
}

/// Lists the files written, one a line.
pub fn print_files(files: &[PathBuf], bars: &Bars) {
    if !bars.is_quiet() {
        crate::terminal::print(&files.iter().map(|f| format!("{}\n", f.display())).collect::<String>());
    }
}
