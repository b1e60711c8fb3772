//! The terminal's side of the monitor: progress bars on stderr, how long each stage took, what is kept when stopped.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use haloray::io::FigureFiles;
use haloray::monitor::Monitor;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Draws a bar for the stage that runs and remembers the seconds of those that ended.
pub struct Bars {
    quiet: bool,
    json: bool,
    overwrite: bool,
    figures: FigureFiles,
    cancelled: AtomicBool,
    running: Mutex<Vec<Stage>>,
    ended: Mutex<Vec<(String, Duration)>>,
    kept: Mutex<Option<(&'static str, PathBuf)>>,
}

struct Stage {
    name: String,
    start: Instant,
    bar: ProgressBar,
}

impl Stage {
    /// What runs, how much of it has ended, how long it has taken and may still take.
    fn told(&self) -> String {
        let elapsed = self.start.elapsed().as_secs_f64();
        let message = self.bar.message();
        let of = match self.bar.length().filter(|length| *length > 0) {
            None => String::new(),
            Some(all) => {
                let (done, share) = (self.bar.position(), self.bar.position() as f64 / all as f64);
                let left = elapsed / share - elapsed;
                let left = if left.is_finite() { format!(", about {left:.0} s left") } else { String::new() };
                format!(", {done} of {all}{left}")
            }
        };
        format!("{message}{of}, {elapsed:.0} s elapsed")
    }
}

impl Bars {
    pub fn new(quiet: bool, json: bool, overwrite: bool, figures: FigureFiles) -> Self {
        Self {
            quiet,
            json,
            overwrite,
            figures,
            cancelled: AtomicBool::new(false),
            running: Mutex::default(),
            ended: Mutex::default(),
            kept: Mutex::default(),
        }
    }

    /// Whether results are not printed for a person to read.
    pub fn is_quiet(&self) -> bool {
        self.quiet || self.json
    }

    /// Whether results are printed for a program to read.
    pub fn is_json(&self) -> bool {
        self.json
    }

    /// Where nobody sees bars, says on stderr every ten seconds how far the running stage is, for as long as the
    /// program lives.
    pub fn speak(&'static self) {
        const EVERY: Duration = Duration::from_secs(10);
        if self.quiet || std::io::stderr().is_terminal() {
            return;
        }
        // Without the thread nothing is lost but these lines.
        let _ = std::thread::Builder::new().spawn(move || {
            loop {
                std::thread::sleep(EVERY);
                let line = lock(&self.running).last().map(Stage::told);
                if let Some(line) = line.filter(|_| !self.is_cancelled()) {
                    let _ = writeln!(std::io::stderr(), "progress: {line}");
                }
            }
        });
    }

    /// Whether files of the user's own may be replaced.
    pub fn overwrites(&self) -> bool {
        self.overwrite
    }

    /// As what figures are written, and how they look.
    pub fn figures(&self) -> &FigureFiles {
        &self.figures
    }

    /// Runs `work` as a stage of its own.
    pub fn stage<T>(&self, name: &str, work: impl FnOnce() -> T) -> T {
        self.begin(name, None);
        let result = work();
        self.end();
        result
    }

    /// The stages that ended, in order, with their seconds.
    pub fn seconds(&self) -> Vec<(String, f64)> {
        lock(&self.ended).iter().map(|(name, time)| (name.clone(), time.as_secs_f64())).collect()
    }

    /// Says what of the command outlives an interruption, once `path` is there: the same command continues with it.
    pub fn keeps(&self, what: &'static str, path: &Path) {
        *lock(&self.kept) = Some((what, path.into()));
    }

    /// What is there to continue with.
    pub fn kept(&self) -> Option<(&'static str, PathBuf)> {
        lock(&self.kept).clone().filter(|(_, path)| path.exists())
    }

    /// Tells the work to stop and takes the bars off the terminal.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
        lock(&self.running).iter().for_each(|stage| stage.bar.finish_and_clear());
    }
}

impl Monitor for Bars {
    fn begin(&self, stage: &str, units: Option<u64>) {
        let bar = match units {
            Some(units) => ProgressBar::new(units)
                .with_style(style("{bar:30} {human_pos} of {human_len} · {elapsed} elapsed · {eta} left")),
            None => ProgressBar::new_spinner().with_style(style("{spinner} {elapsed} elapsed")),
        };
        let mut running = lock(&self.running);
        let hidden = self.quiet || self.is_cancelled();
        bar.set_draw_target(if hidden { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() });
        bar.set_message(stage.to_string());
        // A thread for each, and nobody looks where there is no terminal.
        if !hidden && std::io::stderr().is_terminal() {
            bar.enable_steady_tick(Duration::from_millis(100));
        }
        running.push(Stage { name: stage.into(), start: Instant::now(), bar });
    }

    fn advance(&self, units: u64) {
        if let Some(stage) = lock(&self.running).last().filter(|_| !self.is_cancelled()) {
            stage.bar.inc(units);
        }
    }

    fn tell(&self, message: &str) {
        if let Some(stage) = lock(&self.running).last().filter(|_| !self.is_cancelled()) {
            stage.bar.set_message(message.to_string());
        }
    }

    fn end(&self) {
        if let Some(stage) = lock(&self.running).pop() {
            stage.bar.finish_and_clear();
            lock(&self.ended).push((stage.name, stage.start.elapsed()));
        }
    }

    fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

fn style(rest: &str) -> ProgressStyle {
    ProgressStyle::with_template(&format!("  {{msg:36}} {rest}"))
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}
