//! A campaign of mutated inputs against the library and the binary: no crash, panic, hang, flood of memory, wrong exit code,
//! result that is no number, or file left behind.
//!
//! cargo run --release --example fuzz -- BINARY MINUTES [SEED [PAGE]]
//! prints the counts per format in Markdown, and puts them between `<!-- fuzz -->` and `<!-- /fuzz -->` of the page; inputs at
//! fault stay in target/fuzz, and make it exit with 1.

mod formats;
mod mutation;
mod trial;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use formats::{FORMATS, Format};
use trial::Outcome;

/// Inputs that one child process reads through the library; when it dies, its last input is at fault.
const BATCH: u64 = 200;
/// Inputs of a batch that the binary reads too.
const BINARY_BATCH: u64 = 8;
/// Between which the counts stand in a page.
const MARKS: [&str; 2] = ["<!-- fuzz -->", "<!-- /fuzz -->"];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize| arguments.get(i).and_then(|text| text.parse::<u64>().ok());
    match (arguments.first().map(String::as_str), number(1)) {
        (Some("--library"), Some(format)) => library(&FORMATS[format as usize], number(2).unwrap_or(1)),
        (Some(binary), Some(minutes)) => {
            let (text, faults) = campaign(binary.into(), minutes, number(2).unwrap_or(1));
            print!("{text}");
            if let Some(page) = arguments.get(3) {
                let old = std::fs::read_to_string(page).expect("a page");
                let (before, rest) = old.split_once(MARKS[0]).expect("a page with <!-- fuzz -->");
                let (_, after) = rest.split_once(MARKS[1]).expect("a page with <!-- /fuzz -->");
                let new = format!("{before}{}\n\n{text}\n{}{after}", MARKS[0], MARKS[1]);
                std::fs::write(page, new).expect("a page that can be written");
            }
            ExitCode::from(u8::from(faults > 0))
        }
        _ => {
            eprintln!("fuzz BINARY MINUTES [SEED [PAGE]]");
            ExitCode::from(2)
        }
    }
}

/// Reads a batch of inputs through the library, in a process of its own in the folder of the batch.
fn library(format: &Format, batch: u64) -> ExitCode {
    for trial in 0..BATCH {
        let bytes = mutation::mutated(format, batch, trial);
        std::fs::write(format.file, &bytes).expect("a writable folder");
        (format.library)(format.file.as_ref());
    }
    ExitCode::SUCCESS
}

/// What was seen of one format.
#[derive(Default)]
struct Counts {
    library: u64,
    binary: u64,
    accepted: u64,
    refused: u64,
    faults: u64,
}

/// The counts as a table in Markdown, and the number of faults.
fn campaign(binary: PathBuf, minutes: u64, seed: u64) -> (String, u64) {
    let binary = binary.canonicalize().expect("the binary");
    let kept = PathBuf::from("target/fuzz");
    std::fs::create_dir_all(&kept).expect("target/fuzz");
    let end = Instant::now() + Duration::from_secs(60 * minutes);
    let threads = std::thread::available_parallelism().map_or(1, usize::from) as u64;
    let worker = |worker: u64| {
        let mut counts: Vec<Counts> = FORMATS.iter().map(|_| Counts::default()).collect();
        let mut batch = seed * 1_000_000 + worker;
        while Instant::now() < end {
            for (i, format) in FORMATS.iter().enumerate() {
                one_batch((i, format), batch, &binary, &kept, &mut counts[i]);
            }
            batch += threads;
        }
        counts
    };
    let of_workers: Vec<Vec<Counts>> = std::thread::scope(|scope| {
        let started: Vec<_> = (0..threads).map(|i| scope.spawn(move || worker(i))).collect();
        started.into_iter().map(|thread| thread.join().expect("a worker")).collect()
    });
    let mut text = format!(
        "Seed {seed}, {minutes} minutes.\n\n| input | through the library | through the binary | accepted | refused | faults |\n\
         |---|---|---|---|---|---|\n"
    );
    let mut total = Counts::default();
    for (i, format) in FORMATS.iter().enumerate() {
        let counts = of_workers.iter().map(|counts| &counts[i]).fold(Counts::default(), |sum, c| sum.plus(c));
        text += &counts.row(format.name);
        total = total.plus(&counts);
    }
    (text + &total.row("all"), total.faults)
}

impl Counts {
    fn plus(self, other: &Self) -> Self {
        Self {
            library: self.library + other.library,
            binary: self.binary + other.binary,
            accepted: self.accepted + other.accepted,
            refused: self.refused + other.refused,
            faults: self.faults + other.faults,
        }
    }

    fn row(&self, name: &str) -> String {
        let Self { library, binary, accepted, refused, faults } = self;
        format!("| {name} | {library} | {binary} | {accepted} | {refused} | {faults} |\n")
    }
}

fn one_batch(
    (number, format): (usize, &Format),
    batch: u64,
    binary: &Path,
    kept: &Path,
    counts: &mut Counts,
) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut fault = |what: &str| {
        counts.faults += 1;
        let input = folder.path().join(format.file);
        let name = format!("{batch}_{}_{}", counts.faults, format.file);
        let _ = std::fs::copy(input, kept.join(&name));
        eprintln!("fault: {}: {what}: target/fuzz/{name}", format.name);
    };
    let this = std::env::current_exe().expect("this program");
    let child = trial::limited(&this, &format!("--library {number} {batch}"), folder.path());
    counts.library += BATCH;
    // A batch may take long for its many inputs, but not without an end.
    if let Some(what) = trial::run(child, Duration::from_secs(120)).fault() {
        fault(&what);
    }
    for i in 0..BINARY_BATCH {
        let folder_of_trial = tempfile::tempdir_in(folder.path()).expect("a temporary folder");
        let bytes = mutation::mutated(format, batch, i);
        let (outcome, what) = trial::through_binary(format, &bytes, binary, folder_of_trial.path());
        counts.binary += 1;
        match outcome {
            Outcome::Ended(0) => counts.accepted += 1,
            _ => counts.refused += 1,
        }
        if let Some(what) = what {
            let _ = std::fs::write(folder.path().join(format.file), &bytes);
            fault(&what);
        }
    }
}
