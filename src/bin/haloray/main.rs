//! The `haloray` command: reads arguments, runs one subcommand, turns errors into exit codes.

mod bars;
mod completions;
mod distances;
mod image;
mod lens;
mod map;
mod populate;
mod relations;
mod schema;
mod settings;
mod simulate;
mod study;
mod summary;
mod trace;

use std::io::Write;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use haloray::{Error, Result};

/// Simulates what every dark-matter halo along a line of sight does to a strong-lensing image.
#[derive(Parser)]
#[command(
    name = "haloray",
    version,
    max_term_width = 110,
    after_help = "Start with:  haloray simulate -o run\n\
                  Exit codes:  0 done, 1 the run failed, 2 bad input (nothing was written)."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Threads to use; all cores when left out. Results do not depend on it.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1024))]
    threads: Option<u64>,
    /// No progress bars and no summary.
    #[arg(long, short, global = true)]
    quiet: bool,
}

#[derive(Subcommand)]
enum Command {
    Simulate(simulate::Args),
    Populate(populate::Args),
    Trace(trace::Args),
    Map(map::Args),
    Image(image::Args),
    Lens(lens::Args),
    Study(study::Args),
    Relations(relations::Args),
    Distances(distances::Args),
    Schema(schema::Args),
    Completions(completions::Args),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => report(&error),
    }
}

fn run(cli: &Cli) -> Result<()> {
    if let Some(threads) = cli.threads {
        let built = rayon::ThreadPoolBuilder::new().num_threads(threads as usize).build_global();
        built.map_err(|e| Error::out_of_range("--threads", threads, &format!("possible here ({e})")))?;
    }
    let bars = bars::Bars::new(cli.quiet);
    match &cli.command {
        Command::Simulate(args) => simulate::run(args, &bars),
        Command::Populate(args) => populate::run(args, &bars),
        Command::Trace(args) => trace::run(args, &bars),
        Command::Map(args) => map::run(args, &bars),
        Command::Image(args) => image::run(args, &bars),
        Command::Lens(args) => lens::run(args, &bars),
        Command::Study(args) => study::run(args, &bars),
        Command::Relations(args) => relations::run(args, &bars),
        Command::Distances(args) => distances::run(args),
        Command::Schema(args) => schema::run(args),
        Command::Completions(args) => completions::run(args),
    }
}

/// Prints `error:` and `hint:` to stderr and chooses the exit code.
fn report(error: &Error) -> ExitCode {
    let mut stderr = std::io::stderr().lock();
    // Nothing can be done about a closed stderr.
    let _ = writeln!(stderr, "error: {error}");
    let _ = writeln!(stderr, "hint: {}", hint(error));
    ExitCode::from(if error.is_bad_input() { 2 } else { 1 })
}

fn hint(error: &Error) -> &'static str {
    match error {
        Error::Config { .. } | Error::OutOfRange { .. } | Error::MassDefinition { .. } => {
            "`haloray schema` lists every key of a configuration with its unit and meaning"
        }
        Error::Table { .. } => {
            "a halo table has z,theta_x_arcsec,theta_y_arcsec and r_s_arcsec,alpha_rs_arcsec or m200c_msun,c200c; \
             a points table has theta_x_arcsec,theta_y_arcsec"
        }
        Error::Format { .. } => "tables are .csv, .h5 or .fits files; images are .fits files",
        Error::Read { .. } => "check the path and its permissions",
        Error::OutputPlace { .. } => {
            "choose another place with -o; its parent folder must exist and be writable"
        }
        Error::Write { .. } => "is the disk full?",
        _ => "see `haloray --help`",
    }
}

/// Writes to stdout; a reader that closed the pipe (`| head`) is not an error.
fn print(text: &str) {
    let _ = std::io::stdout().lock().write_all(text.as_bytes());
}
