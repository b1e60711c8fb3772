//! Where a command that makes a folder, or on request one file of it, puts its results.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use haloray::error::FileFault;
use haloray::io::{Replace, Staging, check_writable, plain_name};
use haloray::report::{PAGE_FILE, RunRecord, stage_page, stage_text};
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
    pub fn begin(
        path: &Path,
        file_extensions: &[&str],
        inputs: &[Option<&Path>],
        names: &[&str],
        bars: &Bars,
    ) -> Result<Self> {
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
        Ok(Self::Folder(begin(path, names, bars)?))
    }
}

/// A staged folder for results of those names; a user's own files there are safe unless `--overwrite` is given.
pub fn begin(folder: &Path, names: &[&str], bars: &Bars) -> Result<Staging> {
    let names: Vec<&str> = names.iter().copied().chain([PAGE_FILE, "report.json"]).collect();
    let replace = if bars.overwrites() { Replace::Any } else { Replace::Own };
    Staging::begin(folder, &names, replace)
}

/// Puts the results in their place, and warns of those that could not be made.
pub fn commit(staging: Staging) -> Result<Vec<PathBuf>> {
    staging.complaints().into_iter().for_each(crate::terminal::warn);
    staging.commit()
}

/// Stages the result of a study beside its other files, commits its folder and prints what there is.
pub fn finish_study(staging: Staging, result: &str, record: &RunRecord, bars: &Bars) -> Result<()> {
    stage_text(&staging, "result.md", result)?;
    stage_page(&staging, "", record)?;
    let files = commit(staging)?;
    if !bars.is_quiet() {
        crate::terminal::print(result);
    }
    print_files(&files, bars);
    Ok(())
}

/// Refuses two of one name, or of names that become one in the name of a file.
pub fn one_of_a_name<'a>(what: &str, names: impl Iterator<Item = &'a str>) -> Result<()> {
    let mut seen: BTreeMap<String, &str> = BTreeMap::new();
    for name in names {
        if let Some(other) = seen.insert(plain_name(name), name) {
            let allowed = format!(
                "unlike \"{other}\" in more than signs that no file name has: both would be one file"
            );
            return Err(Error::out_of_range(&format!("name of the {what}"), name, &allowed));
        }
    }
    Ok(())
}

/// Lists the files written, one a line.
pub fn print_files(files: &[PathBuf], bars: &Bars) {
    if !bars.is_quiet() {
        crate::terminal::print(&files.iter().map(|f| format!("{}\n", f.display())).collect::<String>());
    }
}
