//! What the command says on stdout and stderr.

use std::io::Write;
use std::path::Path;

use haloray::{Error, Result};

/// Warns on stderr, whether or not anybody can hear it.
pub fn warn(text: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "warning: {text}");
}

/// Prints what a person reads beside the files of a run; its loss is no reason to call the run failed.
pub fn print(text: &str) {
    let _ = print_result(text);
}

/// Writes a result to stdout; a reader that closed the pipe (`| head`) has what it wanted.
pub fn print_result(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Error::write(Path::new("standard output"), error))
        }
        _ => Ok(()),
    }
}
