//! The `haloray` command: reads arguments, runs one subcommand, turns errors into exit codes.

mod advantage;
mod bars;
mod calibration;
mod catalogue;
mod centres;
mod completions;
mod cut;
mod distances;
mod ensemble;
mod expected;
mod extract;
mod fit;
mod halo_choices;
mod image;
mod images;
mod interrupt;
mod lens;
mod map;
mod merge;
mod mock;
mod models;
mod output;
mod populate;
mod record;
mod relations;
mod report;
mod sampling;
mod saved;
mod schema;
mod settings;
mod sheets;
mod simulate;
mod slurm;
mod status;
mod study;
mod summary;
mod terminal;
mod through_haloes;
mod trace;
mod validity;
mod which_shear;

use std::io::Write;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};
use haloray::io::FigureFiles;
use haloray::plot::Style;
use haloray::{Error, Result};
use mimalloc::MiMalloc;

use bars::Bars;
use settings::whole;

#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

/// Simulates what every dark-matter halo along a line of sight does to a strong-lensing image.
#[derive(Parser)]
#[command(
    name = "haloray",
    version,
    long_version = concat!(env!("CARGO_PKG_VERSION"), " (", env!("HALORAY_GIT_REVISION"), ")"),
    max_term_width = 110,
    after_help = "Start with:  haloray simulate -o run\n\
                  Exit codes:  0 done, 1 the run failed, 2 bad input (nothing was written), 130 and 143 stopped by Ctrl-C, SIGTERM."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Threads to use; all cores when left out. Results do not depend on it.
    #[arg(long, global = true, display_order = 900, allow_negative_numbers = true, value_name = "N")]
    #[arg(value_parser = whole::<usize>(1..=1024))]
    threads: Option<usize>,
    /// No progress bars and no summary.
    #[arg(long, short, global = true, display_order = 901)]
    quiet: bool,
    /// Print the results as one JSON object, for programs: folder, files, and what summary or tables say.
    #[arg(long, global = true, display_order = 901, conflicts_with = "quiet")]
    json: bool,
    /// No figures, and none on the page of the run.
    #[arg(long, global = true, display_order = 903)]
    no_figures: bool,
    /// How figures look: for the screen, for print at 3.3 or 7 inches with no letter below 6 pt, or light on dark.
    #[arg(long, global = true, display_order = 905, value_enum, default_value_t = FigureStyle::Screen)]
    style: FigureStyle,
    /// As what figures are written; pages show SVGs, or PNGs where there are none.
    #[arg(long, global = true, display_order = 904, value_delimiter = ',', default_value = "svg,png")]
    format: Vec<FigureFormat>,
    /// Replace files that haloray did not write, and files of an earlier run that were changed since.
    #[arg(long, global = true, display_order = 902)]
    overwrite: bool,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum FigureFormat {
    /// Drawings that scale.
    Svg,
    /// Pictures of 300 dpi.
    Png,
    /// Drawings for papers.
    Pdf,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum FigureStyle {
    /// Letters of 7 and 8 pt, black on white.
    Screen,
    /// Letters of 8.4 pt and more, their scripts of 6 pt.
    Paper,
    /// The letters of screen, light on dark.
    Dark,
}

impl Cli {
    /// As what figures are written, and how they look.
    fn figures(&self) -> FigureFiles {
        let all = [(FigureFormat::Svg, "svg"), (FigureFormat::Png, "png"), (FigureFormat::Pdf, "pdf")];
        let is_wanted = |format: FigureFormat| !self.no_figures && self.format.contains(&format);
        let extensions = all.into_iter().filter(|(format, _)| is_wanted(*format));
        let style = match self.style {
            FigureStyle::Screen => Style::SCREEN,
            FigureStyle::Paper => Style::PAPER,
            FigureStyle::Dark => Style::DARK,
        };
        FigureFiles { extensions: extensions.map(|(_, extension)| extension).collect(), style: style.name }
    }
}

#[derive(Subcommand)]
enum Command {
    Simulate(simulate::Args),
    Ensemble(Box<ensemble::Args>),
    Merge(merge::Args),
    Status(status::Args),
    Extract(Box<extract::Args>),
    Populate(populate::Args),
    Trace(trace::Args),
    Map(map::Args),
    Image(image::Args),
    Lens(lens::Args),
    Fit(Box<fit::Args>),
    Images(images::Args),
    Mock(mock::Args),
    Study(study::Args),
    Report(report::Args),
    Relations(relations::Args),
    Distances(distances::Args),
    Schema(schema::Args),
    Completions(completions::Args),
}

fn main() -> ExitCode {
    match Cli::try_parse() {
        Err(refused) => report_arguments(&refused),
        Ok(mut cli) => {
            terminal::listen(cli.quiet);
            let bars: &'static Bars =
                Box::leak(Box::new(Bars::new(cli.quiet, cli.json, cli.overwrite, cli.figures())));
            bars.speak();
            let result = interrupt::watch(bars).and_then(|()| run(&mut cli, bars));
            result.unwrap_or_else(|error| {
                interrupt::end(bars);
                report(&error)
            })
        }
    }
}

/// Help and version go to stdout; arguments that cannot be used are reported as every other error is.
fn report_arguments(refused: &clap::Error) -> ExitCode {
    if !refused.use_stderr() || refused.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        return match refused.print() {
            _ if refused.use_stderr() => ExitCode::from(2),
            Err(source) if source.kind() != std::io::ErrorKind::BrokenPipe => {
                report(&Error::StandardOutput { source })
            }
            _ => ExitCode::SUCCESS,
        };
    }
    let text = refused.render().to_string();
    // How to pass an unknown option as a value, which nobody wants here.
    let is_tip = |line: &&str| line.trim_start().starts_with("tip: to pass '");
    let text =
        text.lines().filter(|line| !is_tip(line)).collect::<Vec<_>>().join("\n").replace("\n\n\n", "\n\n");
    let text = text.trim_end().trim_end_matches("For more information, try '--help'.").trim_end();
    let _ = writeln!(std::io::stderr(), "{text}\nhint: `--help` after the subcommand explains its arguments");
    ExitCode::from(2)
}

fn run(cli: &mut Cli, bars: &Bars) -> Result<ExitCode> {
    // Built now, so that threads that the system refuses are an error and no panic later; 0 means all cores.
    let built = rayon::ThreadPoolBuilder::new().num_threads(cli.threads.unwrap_or(0)).build_global();
    let number = cli.threads.map_or("all cores".into(), |threads| threads.to_string());
    built.map_err(|e| Error::argument("--threads", number, &format!("possible here ({e})")))?;
    match &mut cli.command {
        Command::Ensemble(args) => ensemble::run(args, bars),
        Command::Merge(args) => merge::run(args, bars),
        Command::Status(args) => status::run(args),
        Command::Extract(args) => extract::run(args, bars),
        Command::Populate(args) => populate::run(args, bars),
        Command::Trace(args) => trace::run(args, bars),
        Command::Map(args) => map::run(args, bars),
        Command::Image(args) => image::run(args, bars),
        Command::Lens(args) => lens::run(args, bars),
        Command::Images(args) => images::run(args, bars),
        Command::Mock(args) => mock::run(args, bars),
        Command::Relations(args) => relations::run(args, bars),
        Command::Distances(args) => distances::run(args),
        Command::Report(args) => report::run(args, bars),
        Command::Schema(args) => schema::run(args),
        Command::Completions(args) => completions::run(args, Cli::command()),
        Command::Simulate(args) => return Ok(simulate::run(args, bars)?.into()),
        Command::Study(args) => return Ok(study::run(args, bars)?.into()),
        Command::Fit(args) => return Ok(fit::run(args, bars)?.into()),
    }?;
    Ok(ExitCode::SUCCESS)
}

/// Prints `error:` and `hint:` to stderr and chooses the exit code.
fn report(error: &Error) -> ExitCode {
    // Nothing can be done about a closed stderr.
    let _ = writeln!(std::io::stderr(), "error: {error}\nhint: {}", error.hint());
    ExitCode::from(if error.is_bad_input() { 2 } else { 1 })
}
