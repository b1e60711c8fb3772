//! `haloray status`: how far an ensemble or its shards are.

use std::path::{Path, PathBuf};

use haloray::ensemble::SightlineStore;
use haloray::io::SightlineTable;
use haloray::report::SIGHTLINES_FILE;
use haloray::{Error, Result};

use crate::ensemble::store_beside;
use crate::merge::folders_in;
use crate::slurm::{SUBMIT_SCRIPT, in_queue};
use crate::terminal::print_result;

/// How far an ensemble is: its sightlines that have ended, shard by shard where DIR holds shards.
#[derive(clap::Args)]
#[command(
    after_help = "Examples:\n  haloray status ensemble\n  haloray status parts        # parts/1, parts/2, …"
)]
pub struct Args {
    /// Folder of `haloray ensemble`, or one that holds such folders.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// What is known of one folder.
struct Status {
    done: u64,
    wanted: u64,
    text: String,
}

pub fn run(args: &Args) -> Result<()> {
    let of = |folder: &Path| status(folder).map(|status| status.map(|status| (folder.to_path_buf(), status)));
    let folders: Vec<PathBuf> = [vec![args.folder.clone()], shards_in(&args.folder)].concat();
    let known: Vec<(PathBuf, Status)> =
        folders.iter().filter_map(|folder| of(folder).transpose()).collect::<Result<_>>()?;
    let queue = in_queue(&args.folder);
    let is_submitted = args.folder.join(SUBMIT_SCRIPT).is_file();
    if known.is_empty() && queue.is_none() && !is_submitted {
        let allowed = "a folder of `haloray ensemble`, or one that holds such folders";
        return Err(Error::argument("DIR", args.folder.display().to_string(), allowed));
    }
    let mut text = String::new();
    if known.is_empty() {
        text += &format!("{}: no shard has begun\n", args.folder.display());
    }
    for (folder, status) in &known {
        text += &format!("{}: {}\n", folder.display(), status.text);
    }
    if known.len() > 1 {
        let (done, wanted) =
            known.iter().fold((0, 0), |(a, b), (_, status)| (a + status.done, b + status.wanted));
        text += &format!("{} parts: {done} of {wanted} sightlines\n", known.len());
    }
    if let Some(told) = queue {
        text += &format!("queue: {told}\n");
    }
    print_result(&text)
}

/// Folders of shards: those that are there, and those that unfinished work will make.
fn shards_in(folder: &Path) -> Vec<PathBuf> {
    let mut folders = folders_in(folder);
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let unfinished = name.strip_prefix('.').and_then(|name| name.strip_suffix(".haloray-ensemble"));
        folders.extend(unfinished.map(|name| folder.join(name)));
    }
    folders.sort();
    folders.dedup();
    folders
}

fn status(folder: &Path) -> Result<Option<Status>> {
    if let Some((ended, wanted, is_at_work)) = SightlineStore::progress(&store_beside(folder))? {
        let state = if is_at_work { "at work" } else { "stopped; the same command goes on" };
        let text = format!("{ended} of {wanted} sightlines, {state}");
        return Ok(Some(Status { done: ended, wanted, text }));
    }
    let path = folder.join(SIGHTLINES_FILE);
    if !path.is_file() {
        return Ok(None);
    }
    let table = SightlineTable::read(&path)?;
    let number = table.numbers.len() as u64;
    let range = match (table.numbers.first(), table.numbers.last()) {
        (Some(first), Some(last)) => {
            format!("{first}–{last} of {}–{}", table.whole.start, table.whole.end - 1)
        }
        _ => "none".into(),
    };
    let text = format!("complete, {number} sightlines ({range}), {} failed", table.failures.len());
    Ok(Some(Status { done: number, wanted: number, text }))
}
