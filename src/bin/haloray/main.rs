//! The `haloray` command: reads arguments, runs one subcommand, turns errors into exit codes.

mod advantage;
mod bars;
mod calibration;
mod catalogue;
mod completions;
mod cut;
mod distances;
mod fit;
mod image;
mod images;
mod lens;
mod map;
mod mock;
mod output;
mod populate;
mod relations;
mod schema;
mod settings;
mod simulate;
mod study;
mod summary;
mod trace;

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use mimalloc::MiMalloc;

#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;
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
    #[arg(long, global = true, display_order = 900, allow_negative_numbers = true, value_name = "N")]
    #[arg(value_parser = clap::builder::RangedI64ValueParser::<usize>::new().range(1..=1024))]
    threads: Option<usize>,
    /// No progress bars and no summary.
    #[arg(long, short, global = true, display_order = 901)]
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
    Fit(Box<fit::Args>),
    Images(images::Args),
    Mock(mock::Args),
    Study(study::Args),
    Relations(relations::Args),
    Distances(distances::Args),
    Schema(schema::Args),
    Completions(completions::Args),
}

fn main() -> ExitCode {
    match Cli::try_parse() {
        Err(refused) => report_arguments(&refused),
        Ok(cli) => match run(&cli) {
            Ok(code) => code,
            Err(error) => report(&error, &cli.command),
        },
    }
}

/// Help and version go to stdout; arguments that cannot be used are reported as every other error is.
fn report_arguments(refused: &clap::Error) -> ExitCode {
    if !refused.use_stderr() || refused.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        let _ = refused.print();
        return ExitCode::from(if refused.use_stderr() { 2 } else { 0 });
    }
    let text = refused.render().to_string();
    let text = text.trim_end().trim_end_matches("For more information, try '--help'.").trim_end();
    let _ = writeln!(std::io::stderr(), "{text}\nhint: `--help` after the subcommand explains its arguments");
    ExitCode::from(2)
}

fn run(cli: &Cli) -> Result<ExitCode> {
    if let Some(threads) = cli.threads {
        let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
        built.map_err(|e| Error::out_of_range("--threads", threads, &format!("possible here ({e})")))?;
    }
    let bars = bars::Bars::new(cli.quiet);
    match &cli.command {
        Command::Populate(args) => populate::run(args, &bars),
        Command::Trace(args) => trace::run(args, &bars),
        Command::Map(args) => map::run(args, &bars),
        Command::Image(args) => image::run(args, &bars),
        Command::Lens(args) => lens::run(args, &bars),
        Command::Images(args) => images::run(args, &bars),
        Command::Mock(args) => mock::run(args, &bars),
        Command::Relations(args) => relations::run(args, &bars),
        Command::Distances(args) => distances::run(args),
        Command::Schema(args) => schema::run(args),
        Command::Completions(args) => completions::run(args),
        Command::Simulate(args) => return Ok(simulate::run(args, &bars)?.into()),
        Command::Study(args) => return Ok(study::run(args, &bars)?.into()),
        Command::Fit(args) => return Ok(fit::run(args, &bars)?.into()),
    }?;
    Ok(ExitCode::SUCCESS)
}

/// Prints `error:` and `hint:` to stderr and chooses the exit code.
fn report(error: &Error, command: &Command) -> ExitCode {
    let mut stderr = std::io::stderr().lock();
    // Nothing can be done about a closed stderr.
    let _ = writeln!(stderr, "error: {error}");
    let hint = if matches!(command, Command::Fit(_)) { fit_hint(error) } else { None }
        .unwrap_or_else(|| hint(error));
    let _ = writeln!(stderr, "hint: {hint}");
    ExitCode::from(if error.is_bad_input() { 2 } else { 1 })
}

/// What helps a fit where the general hint would mislead.
fn fit_hint(error: &Error) -> Option<&'static str> {
    match error {
        Error::OutOfRange { what, .. } if what == "the model" => {
            Some("`haloray fit --list` explains the built-in models")
        }
        Error::OutOfRange { what, .. } if what.starts_with("--") => None,
        Error::Config { .. } | Error::OutOfRange { .. } => Some(
            "`haloray fit --list --model NAME` prints a model to compare with; `haloray fit --list` explains the priors",
        ),
        Error::Format { problem, .. } if problem.contains("truncated") => None,
        Error::Format { problem, .. } if problem.contains("kernel") => Some(
            "the extension PSF is a square kernel of odd size that sums to 1, on pixels as large as those of the image",
        ),
        Error::Format { .. } => Some(
            "`haloray fit --help` lists the keywords and extensions that an image needs: EXPTIME, BKGRMS, PSFFWHM or PSF, MASK",
        ),
        _ => None,
    }
}

fn hint(error: &Error) -> &'static str {
    match error {
        Error::OutOfRange { what, .. } if what.starts_with("--") => {
            "`--help` after the subcommand explains its arguments"
        }
        Error::Config { problem, .. } if problem.contains("not calibrated for the mass definition") => {
            "sheth99 and press74 go with mass_definition = \"fof\", tinker08 with \"200c\""
        }
        Error::Config { .. } | Error::OutOfRange { .. } | Error::MassDefinition { .. } => {
            "`haloray schema` lists every key of a configuration with its unit and meaning"
        }
        Error::Table { .. } => {
            "a halo table has z,theta_x_arcsec,theta_y_arcsec and r_s_arcsec,alpha_rs_arcsec or m200c_msun,c200c; \
             a points table has theta_x_arcsec,theta_y_arcsec; a truth.csv has image,gamma1_los,gamma2_los"
        }
        Error::Format { problem, .. } if problem.contains("PSF") => {
            "a PSF kernel is a square FITS image of odd size, on pixels as large as those of the image"
        }
        Error::Format { problem, .. } if problem.contains("truncated") => {
            "the file is damaged; make or copy it again"
        }
        Error::Format { .. } => {
            "tables are .csv, .h5 or .fits files; images are .fits files, lens models .json (`haloray lens --help`)"
        }
        Error::Read { .. } => {
            "check the path and its permissions; files named in a configuration are looked for beside it"
        }
        Error::OutputPlace { .. } => {
            "choose another place with -o; its parent folder must exist and be writable"
        }
        Error::Write { .. } => "is the disk full?",
        _ => "see `haloray --help`",
    }
}

/// Prints what a person reads beside the files of a run; its loss is no reason to call the run failed.
fn print(text: &str) {
    let _ = print_result(text);
}

/// Writes a result to stdout; a reader that closed the pipe (`| head`) has what it wanted.
fn print_result(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::write(Path::new("standard output"), error))
        }
        _ => Ok(()),
    }
}
