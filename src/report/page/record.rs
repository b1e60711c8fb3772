//! `report.json`: what was run, which the other files of a folder do not say.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, FileFault, Result};
use crate::io::{Provenance, read_text, shell_word};

/// Name of the page in the folder of a run.
pub const PAGE_FILE: &str = "report.html";

/// Name of the file.
pub(super) const RECORD_FILE: &str = "report.json";

/// What was run and what repeats it; no paths, times or hosts, so that equal runs have equal records.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// The subcommand: `simulate`, `study tidal`.
    pub command: String,
    /// What it did, in one sentence.
    pub about: String,
    /// Command lines that repeat it inside its own folder; inputs by their name without folder.
    pub repeat: Vec<String>,
    /// Package version.
    pub version: String,
    /// Git revision of the build.
    pub git_revision: String,
    /// Seed, where there is one.
    pub seed: Option<u64>,
    /// The resolved configuration or model as TOML; empty where there is none.
    pub configuration: String,
    /// Warnings that no other file holds.
    pub warnings: Vec<String>,
    /// False if it made no image, so that nothing need be said of how images are made.
    #[serde(default = "always")]
    pub makes_images: bool,
}

/// Records of older versions do not say.
fn always() -> bool {
    true
}

impl RunRecord {
    /// A run of `haloray COMMAND ARGUMENTS`.
    pub fn new(command: &str, arguments: &[String], about: &str, provenance: &Provenance) -> Self {
        let words =
            ["haloray"].into_iter().chain(command.split(' ')).chain(arguments.iter().map(String::as_str));
        let line = words.map(shell_word).collect::<Vec<_>>().join(" ");
        Self {
            command: command.into(),
            about: about.into(),
            repeat: vec![line],
            version: provenance.version.clone(),
            git_revision: provenance.git_revision.clone(),
            seed: provenance.seed,
            configuration: provenance.config_toml.clone(),
            warnings: Vec::new(),
            makes_images: true,
        }
    }

    /// That of a folder.
    pub(super) fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(RECORD_FILE);
        let refuse = |problem: String| Err(Error::file(FileFault::Content, &path, problem));
        let text = read_text(&path)?;
        serde_json::from_str(&text).or_else(|e| refuse(format!("is no record of a run of this version: {e}")))
    }
}
