//! One self-contained page of HTML a run, made from the files of its folder alone.

mod citations;
mod figures;
mod folder;
mod glossary;
mod grids;
mod model;
mod numbers;
mod posterior;
mod record;
mod render;
mod tables;
mod words;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

pub use record::{PAGE_FILE, RunRecord};

use super::staged::{stage_json, stage_text};
use crate::error::{Error, Result};
use crate::io::Staging;

/// The page of the run whose files lie in `folder`: the same files give the same bytes.
///
/// # Errors
/// [`Error::File`] when there is nothing of a run in the folder.
pub fn page(folder: &Path) -> Result<String> {
    render::html(&folder::read(folder)?)
}

/// Stages `report.json`, what was run, and `report.html`, the page, beside what is staged under `prefix` (empty, or a
/// folder ending in `/`). A page that cannot be made is left out, and the staging folder remembers why.
///
/// # Errors
/// [`Error::Write`] when the disk is full.
pub fn stage_page(staging: &Staging, prefix: &str, record: &RunRecord) -> Result<()> {
    stage_json(staging, &format!("{prefix}{}", record::RECORD_FILE), record)?;
    let made = catch_unwind(AssertUnwindSafe(|| page(&staging.path(prefix))));
    match made {
        Ok(Ok(html)) => stage_text(staging, &format!("{prefix}{PAGE_FILE}"), &html),
        Ok(Err(Error::Cancelled)) => Err(Error::Cancelled),
        Ok(Err(error)) => {
            staging.complain(format!("there is no page {prefix}{PAGE_FILE}: {error}"));
            Ok(())
        }
        Err(_) => {
            staging.complain(format!("there is no page {prefix}{PAGE_FILE}: making it failed"));
            Ok(())
        }
    }
}
