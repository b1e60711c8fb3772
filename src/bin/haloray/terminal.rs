//! What the command says on stdout and stderr.

use std::io::Write;

use haloray::{Error, Result};

/// Warns on stderr, whether or not anybody can hear it.
pub fn warn(text: impl std::fmt::Display) {
    let _ = writeln!(std::io::stderr(), "warning: {text}");
}

/// Says on stderr what the library logs: notes unless `quiet`, warnings always.
pub fn listen(quiet: bool) {
    struct Listener;
    impl log::Log for Listener {
        fn enabled(&self, metadata: &log::Metadata) -> bool {
            metadata.target().starts_with("haloray")
        }
        fn log(&self, record: &log::Record) {
            match record.level() {
                _ if !self.enabled(record.metadata()) => {}
                log::Level::Error | log::Level::Warn => warn(record.args()),
                _ => _ = writeln!(std::io::stderr(), "note: {}", record.args()),
            }
        }
        fn flush(&self) {}
    }
    if log::set_logger(&Listener).is_ok() {
        log::set_max_level(if quiet { log::LevelFilter::Warn } else { log::LevelFilter::Info });
    }
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
            Err(Error::StandardOutput { source: error })
        }
        _ => Ok(()),
    }
}
