//! `haloray merge`: the parts of an ensemble into one.

use std::path::{Path, PathBuf};

use haloray::Result;
use haloray::ensemble::merge;
use haloray::report::{SIGHTLINES_FILE, write_ensemble};

use crate::bars::Bars;
use crate::ensemble::tell;
use crate::output::{begin, check_not_an_input, commit};
use crate::terminal::warn;

/// Put the shards of an ensemble together: the bytes of one process that had computed all of it.
///
/// Also joins ensembles that continue one another (`--first`). Parts of another configuration, seed, version or level are
/// refused, and so are missing sightlines and ensembles that overlap.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  haloray merge parts -o ensemble            # parts/1, parts/2, …\n  \
                  haloray merge a b -o both")]
pub struct Args {
    /// Folders of `haloray ensemble`, or folders that hold such folders.
    #[arg(value_name = "DIR", required = true)]
    parts: Vec<PathBuf>,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let paths: Vec<PathBuf> = args.parts.iter().flat_map(|part| tables_in(part)).collect();
    let target = args.output.join(SIGHTLINES_FILE);
    check_not_an_input(&target, &paths.iter().map(|path| Some(path.as_path())).collect::<Vec<_>>())?;
    let staging = begin(&args.output, &[SIGHTLINES_FILE, "summary.json", "config.toml"], bars)?;
    let merged = bars.stage("reading the parts", || merge(&paths))?;
    for path in &merged.duplicates {
        warn(format_args!("{}: a duplicate of other parts", path.display()));
    }
    let statistics =
        bars.stage("files and figures", || write_ensemble(&merged.table, merged.specs(), &merged, &staging))?;
    let files = commit(staging)?;
    tell(&statistics, &files, bars)
}

/// The table of a folder, or those of the folders in it, by name.
fn tables_in(part: &Path) -> Vec<PathBuf> {
    let own = part.join(SIGHTLINES_FILE);
    if own.is_file() {
        return vec![own];
    }
    let inner: Vec<PathBuf> = folders_in(part)
        .into_iter()
        .map(|folder| folder.join(SIGHTLINES_FILE))
        .filter(|path| path.is_file())
        .collect();
    // What is not there is named by who reads it.
    if inner.is_empty() { vec![own] } else { inner }
}

/// The folders in a folder, by name.
pub fn folders_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
    folders.sort();
    folders
}
