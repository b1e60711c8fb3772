//! `haloray report`: the page of a run made again.

use std::path::{Path, PathBuf};

use haloray::Result;
use haloray::io::{Replace, Staging, files_of_run, is_of_a_run};
use haloray::report::{PAGE_FILE, page, stage_text};

use crate::bars::Bars;
use crate::output::print_files;

/// Make the page of a run again: report.html, from the files of its folder alone.
///
/// Every run writes its page: one file without network, with warnings, numbers, figures, maps and images to explore, tables,
/// configuration, and what repeats and cites it. Make it again with another version of haloray, or after figures were changed.
/// Pages of its fits are made again too.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  haloray report run")]
pub struct Args {
    /// Folder of a run.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub fn run(args: &Args, bars: &Bars) -> Result<()> {
    let ends_in = |file: &String| file.strip_suffix("/report.json").map(|part| format!("{part}/"));
    let mut parts: Vec<String> = files_of_run(&args.folder)?.iter().filter_map(ends_in).collect();
    parts.push(String::new());
    let pages = parts.iter().map(|part| page(&args.folder.join(part))).collect::<Result<Vec<_>>>()?;
    let is_whole = args.folder.join("manifest.json").is_file();
    let replace = match (bars.overwrites(), is_whole) {
        (true, true) => Replace::RenewAny,
        (false, true) => Replace::Renew,
        // A part of a run: the manifest of the whole lists it.
        (false, false) if !is_of_a_run(&args.folder.join(PAGE_FILE)) => Replace::Own,
        (_, false) => Replace::Beside,
    };
    let staging = Staging::begin(&args.folder, &[PAGE_FILE], replace)?;
    for (part, html) in parts.iter().zip(&pages) {
        stage_text(&staging, &format!("{part}{PAGE_FILE}"), html)?;
    }
    let files = staging.commit()?;
    print_files(&files.iter().map(|file| Path::new(file).into()).collect::<Vec<_>>(), bars)
}
