//! One run of a process and what is wrong with how it ended.

use std::collections::BTreeSet;
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use haloray::io::{ImageFile, Table, Values};

use crate::formats::{BESIDE, Format};

/// A command that takes longer hangs.
const LONGEST: Duration = Duration::from_secs(20);
/// KiB of address space: two GiB, and what an allocator and threads reserve without using it.
const ADDRESS_SPACE_KIB: u64 = 4 << 20;

/// How a process ended.
#[derive(Clone, Copy)]
pub enum Outcome {
    /// With this exit code.
    Ended(i32),
    /// By this signal.
    Killed(i32),
    /// Not in time.
    Hung,
}

/// A process that has ended, and what it said on stderr.
pub struct Run {
    pub outcome: Outcome,
    pub stderr: String,
}

impl Run {
    /// What no process may do, whatever it reads.
    pub fn fault(&self) -> Option<String> {
        match self.outcome {
            Outcome::Hung => Some("hung".into()),
            Outcome::Killed(signal) => Some(format!("killed by signal {signal}: {}", self.last_line())),
            Outcome::Ended(_) if self.stderr.contains("panicked") => {
                Some(format!("panic: {}", self.last_line()))
            }
            Outcome::Ended(0 | 2) => None,
            Outcome::Ended(code) => Some(format!("exit code {code}: {}", self.last_line())),
        }
    }

    fn last_line(&self) -> &str {
        let is_telling = |line: &&str| line.contains("panicked") || line.starts_with("error");
        self.stderr.lines().find(is_telling).or(self.stderr.lines().last()).unwrap_or_default()
    }
}

/// Runs a command to its end, or kills it when it takes too long.
pub fn run(mut command: Command, longest: Duration) -> Run {
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("a process");
    let mut stderr = child.stderr.take().expect("its stderr");
    let reader = std::thread::spawn(move || {
        let mut text = Vec::new();
        let _ = stderr.read_to_end(&mut text);
        String::from_utf8_lossy(&text).into_owned()
    });
    let outcome = wait(&mut child, longest);
    Run { outcome, stderr: reader.join().unwrap_or_default() }
}

fn wait(child: &mut Child, longest: Duration) -> Outcome {
    let start = Instant::now();
    loop {
        match child.try_wait().expect("a child") {
            Some(status) => {
                return status
                    .code()
                    .map_or_else(|| Outcome::Killed(status.signal().unwrap_or(0)), Outcome::Ended);
            }
            None if start.elapsed() > longest => {
                let _ = child.kill();
                let _ = child.wait();
                return Outcome::Hung;
            }
            None => std::thread::sleep(Duration::from_millis(2)),
        }
    }
}

/// A program with arguments, in a folder and with little memory.
pub fn limited(program: &Path, arguments: &str, folder: &Path) -> Command {
    let mut command = Command::new("sh");
    let text = format!("ulimit -v {ADDRESS_SPACE_KIB}; exec \"$0\" {arguments}");
    command.args(["-c", &text]).arg(program).current_dir(folder);
    command
}

/// Runs the format's command on the bytes in an empty folder.
pub fn through_binary(
    format: &Format,
    bytes: &[u8],
    binary: &Path,
    folder: &Path,
) -> (Outcome, Option<String>) {
    for (name, content) in BESIDE.into_iter().chain([(format.file, bytes)]) {
        std::fs::write(folder.join(name), content).expect("a writable folder");
    }
    let run = run(limited(binary, &format!("--threads 1 {}", format.command), folder), LONGEST);
    let is_done = matches!(run.outcome, Outcome::Ended(0));
    let fault = run
        .fault()
        .or_else(|| left_over(format, folder, is_done))
        .or_else(|| no_number(format, folder, is_done));
    (run.outcome, fault)
}

/// Files beside those that the command found and, if it succeeded, was to write.
fn left_over(format: &Format, folder: &Path, is_done: bool) -> Option<String> {
    let mut allowed: BTreeSet<&str> = BESIDE.iter().map(|(name, _)| *name).chain([format.file]).collect();
    if is_done {
        allowed.extend(format.outputs);
    }
    let found =
        std::fs::read_dir(folder).expect("the folder").map(|entry| entry.expect("an entry").file_name());
    let unknown: Vec<String> = found
        .map(|name| name.to_string_lossy().into_owned())
        .filter(|name| !allowed.contains(name.as_str()))
        .collect();
    (!unknown.is_empty()).then(|| format!("left behind: {}", unknown.join(", ")))
}

/// A result that is no number; columns that came from the input may be anything.
fn no_number(format: &Format, folder: &Path, is_done: bool) -> Option<String> {
    let output = format.outputs.first().filter(|_| is_done)?;
    let path = folder.join(output);
    if output.ends_with(".fits") {
        let image = ImageFile::read(&path).map_err(|error| format!("the output cannot be read: {error}"));
        return image.err();
    }
    let table = match Table::read(&path, "rays") {
        Ok(table) => table,
        Err(error) => return Some(format!("the output cannot be read: {error}")),
    };
    let is_result =
        |name: &str| ["beta_", "a_", "f_", "delay", "fermat"].iter().any(|start| name.starts_with(start));
    let bad =
        table.columns().iter().filter(|column| is_result(&column.name)).find(|column| match &column.values {
            Values::F64(values) => values.iter().any(|value| !value.is_finite()),
            Values::Text(_) => true,
        });
    bad.map(|column| format!("column {} is not finite", column.name))
}
