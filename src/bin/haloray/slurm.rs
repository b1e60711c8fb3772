//! `haloray ensemble --submit slurm`: the shards of an ensemble as a job array, and their merge behind it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::ValueEnum;
use haloray::ensemble::{Plan, SlurmJob};
use haloray::report::stage_text;
use haloray::{Error, Result};

use crate::bars::Bars;
use crate::output::{begin, commit};
use crate::settings::{provenance, whole};
use crate::terminal::print_result;

/// Schedulers of clusters.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Scheduler {
    Slurm,
}

/// What submits the shards, in the folder of their parts.
pub const SUBMIT_SCRIPT: &str = "submit.sh";

/// How an ensemble is submitted.
#[derive(clap::Args)]
#[command(next_help_heading = "On a cluster")]
pub struct Args {
    /// Submit the shards as a job array, and their merge into DIR behind it; shards, scripts and logs lie in DIR.parts.
    #[arg(long, value_name = "slurm", conflicts_with_all = ["shard", "sightline"])]
    submit: Option<Scheduler>,
    /// Write the scripts into DIR.parts and submit nothing: `sh DIR.parts/submit.sh` does.
    #[arg(long, requires = "submit")]
    no_submit: bool,
    /// Number of shards.
    #[arg(long, value_name = "K", requires = "submit", default_value_t = 20, value_parser = whole::<u64>(1..=100_000))]
    shards: u64,
    /// Cores of each task.
    #[arg(long, value_name = "N", requires = "submit", default_value_t = 1, value_parser = whole::<u64>(1..=1024))]
    cpus: u64,
    /// Partition to submit to.
    #[arg(long, value_name = "NAME", requires = "submit")]
    partition: Option<String>,
    /// Account to charge.
    #[arg(long, value_name = "NAME", requires = "submit")]
    account: Option<String>,
    /// Time of a task, as `sbatch` takes it; a task whose time is over is queued again and goes on.
    #[arg(long, value_name = "D-HH:MM", requires = "submit", value_parser = time)]
    time: Option<String>,
    /// Memory of a task, as `sbatch` takes it; 1G holds any level.
    #[arg(long, value_name = "SIZE", requires = "submit", value_parser = memory)]
    memory: Option<String>,
    /// Any other option of `sbatch`, as --sbatch=--qos=high; may be given again.
    #[arg(long, value_name = "OPTION", requires = "submit", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// Image of a container that has haloray: tasks run `apptainer exec IMAGE haloray`.
    #[arg(long, value_name = "IMAGE", requires = "submit")]
    container: Option<PathBuf>,
}

/// A time limit as `sbatch` reads it: minutes, H:M:S, D-H, D-H:M or D-H:M:S. What it reads as M:S is refused: most mean H:M.
fn time(text: &str) -> std::result::Result<String, String> {
    let (days, clock) = text.split_once('-').map_or((None, text), |(days, clock)| (Some(days), clock));
    let numbers: Vec<&str> = days.into_iter().chain(clock.split(':')).collect();
    let is_number = |part: &&str| !part.is_empty() && part.chars().all(|c| c.is_ascii_digit());
    let is_clock = match clock.split(':').count() {
        2 => days.is_some(),
        parts => parts <= 3,
    };
    let is_time = is_clock && numbers.iter().all(is_number);
    let allowed = "must be minutes, or a time as 1:30:00 or 2-12:00 (days-hours:minutes)";
    is_time.then(|| text.into()).ok_or(allowed.into())
}

/// An amount of memory as `sbatch` reads it.
fn memory(text: &str) -> std::result::Result<String, String> {
    let digits = text.strip_suffix(['K', 'M', 'G', 'T', 'k', 'm', 'g', 't']).unwrap_or_default();
    let is_size = !digits.is_empty() && digits.chars().all(|c| c.is_ascii_digit());
    is_size.then(|| text.into()).ok_or("must be a whole number with K, M, G or T, as 4G".into())
}

impl Args {
    /// Whether the ensemble is to be submitted instead of computed.
    pub fn is_asked_for(&self) -> bool {
        self.submit.is_some()
    }

    /// Writes the scripts of `plan` beside `output` and submits them; `lenses` is its table of lenses.
    pub fn submit(&self, plan: &Plan, lenses: Option<&Path>, output: &Path, bars: &Bars) -> Result<()> {
        if self.shards > plan.number {
            let allowed = format!("at most as many shards as sightlines ({})", plan.number);
            return Err(Error::argument("--shards", self.shards, &allowed));
        }
        if !self.no_submit && !is_there("sbatch") {
            let allowed = "given on a machine that has Slurm's sbatch; with --no-submit beside it the scripts alone are written";
            return Err(Error::argument("--submit", "slurm", allowed));
        }
        let (given, parts, output) = (output, parts_beside(output)?, absolute(output)?);
        let mut arguments = vec!["-n".into(), (plan.number / plan.lenses.len().max(1) as u64).to_string()];
        arguments.extend([format!("--first={}", plan.first), format!("--level={}", plan.level)]);
        arguments.extend([format!("--model={}", plan.model)]);
        if let Some(path) = lenses {
            arguments.push(format!("--lenses={}", utf8(&absolute(path)?)?));
        }
        if !plan.smoothing_arcsec.is_empty() {
            let radii: Vec<String> = plan.smoothing_arcsec.iter().map(f64::to_string).collect();
            arguments.push(format!("--smoothing={}", radii.join(",")));
        }
        let mut config = plan.config.clone();
        config.instrument.psf_file = config.instrument.psf_file.as_deref().map(absolute).transpose()?;
        for file in config.haloes.lightcone.iter_mut().flat_map(|cone| &mut cone.files) {
            *file = absolute(file)?;
        }
        let asked = format!("# {}, {} shards\n", arguments.join(" "), self.shards);
        let config_toml = asked + &provenance(&config, 0)?.config_toml;
        let before = std::fs::read_to_string(parts.join("config.toml"));
        if before.is_ok_and(|before| before != config_toml) {
            let allowed = format!("another folder: {} has shards of another ensemble", parts.display());
            return Err(Error::argument("--output", given.display(), &allowed));
        }
        let job = SlurmJob {
            name: output.file_name().map_or("haloray".into(), |name| name.to_string_lossy().into_owned()),
            shards: self.shards,
            cpus: self.cpus,
            options: self.options(),
            command: self.command()?,
            arguments,
            output: utf8(&output)?,
        };
        let scripts = job.scripts()?;
        let names: Vec<&str> = scripts.iter().map(|(name, _)| *name).chain(["config.toml"]).collect();
        let staging = begin(&parts, &names, bars)?;
        stage_text(&staging, "config.toml", &config_toml)?;
        for (name, text) in &scripts {
            stage_text(&staging, name, text)?;
        }
        commit(staging)?;
        let script = parts.join(SUBMIT_SCRIPT);
        if self.no_submit {
            return print_result(&format!(
                "scripts in {}; submit them by: sh {}\n",
                parts.display(),
                script.display()
            ));
        }
        let ran = Command::new("sh").arg(&script).stdin(Stdio::null()).status();
        match ran {
            Ok(status) if status.success() => {
                print_result(&format!("how far it is: haloray status {}\n", parts.display()))
            }
            Ok(_) => {
                let allowed = format!("taken by sbatch; the scripts are in {}", parts.display());
                Err(Error::argument("--submit", "slurm", &allowed))
            }
            Err(error) => Err(Error::read(&script)(error)),
        }
    }

    fn options(&self) -> Vec<String> {
        let named = [
            ("partition", &self.partition),
            ("account", &self.account),
            ("time", &self.time),
            ("mem", &self.memory),
        ];
        let named = named.iter().filter_map(|(name, value)| Some(format!("--{name}={}", value.as_ref()?)));
        named.chain(self.sbatch.iter().cloned()).collect()
    }

    /// This very program, or that of a container.
    fn command(&self) -> Result<Vec<String>> {
        match &self.container {
            Some(image) => {
                let image = utf8(&absolute(image)?)?;
                Ok(["apptainer", "exec", &image, "haloray"].map(String::from).to_vec())
            }
            None => {
                let program = std::env::current_exe().map_err(Error::read(Path::new("haloray")))?;
                Ok(vec![utf8(&program)?])
            }
        }
    }
}

/// What the queue says of the jobs that `folder` was submitted as; none where nothing was, or nothing can be asked.
pub fn in_queue(folder: &Path) -> Option<String> {
    let jobs = std::fs::read_to_string(folder.join("jobs")).ok()?;
    let asked = ["--noheader", "--array", "--format=%T", "--jobs", jobs.trim()];
    let told = Command::new("squeue").args(asked).stderr(Stdio::null()).output().ok()?;
    let told = String::from_utf8_lossy(&told.stdout).to_lowercase();
    let mut counts = std::collections::BTreeMap::<&str, usize>::new();
    told.lines().for_each(|state| *counts.entry(state).or_default() += 1);
    let counts: Vec<String> = counts.iter().map(|(state, count)| format!("{count} {state}")).collect();
    Some(if counts.is_empty() { "no task left".into() } else { counts.join(", ") })
}

/// `DIR.parts`, where the shards of DIR are computed.
fn parts_beside(output: &Path) -> Result<PathBuf> {
    let named = if output.file_name().is_some() { output.to_path_buf() } else { absolute(output)? };
    let mut parts = named.components().as_path().as_os_str().to_owned();
    parts.push(".parts");
    Ok(parts.into())
}

fn is_there(program: &str) -> bool {
    let started = Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    started.is_ok_and(|status| status.success())
}

fn absolute(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path).map_err(Error::read(path))
}

/// Scripts are text.
fn utf8(path: &Path) -> Result<String> {
    let text = path.to_str().map(String::from);
    text.ok_or_else(|| Error::argument("path", path.display(), "UTF-8 text, as it stands in scripts"))
}
