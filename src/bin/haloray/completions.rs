//! `haloray completions`: completion scripts for shells.

use haloray::Result;

/// Print the completion script of a shell.
#[derive(clap::Args)]
#[command(
    after_help = "Example:\n  haloray completions bash > ~/.local/share/bash-completion/completions/haloray"
)]
pub struct Args {
    /// The shell.
    #[arg(value_enum)]
    shell: clap_complete::Shell,
}

pub fn run(args: &Args, mut command: clap::Command) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "haloray", &mut script);
    crate::terminal::print_result(&String::from_utf8_lossy(&script))
}
