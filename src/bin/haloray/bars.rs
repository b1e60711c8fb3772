//! Progress bars on stderr, and how long each stage took.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use haloray::monitor::Monitor;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Draws a bar for the stage that runs and remembers the seconds of those that ended.
pub struct Bars {
    quiet: bool,
    running: Mutex<Vec<Stage>>,
    ended: Mutex<Vec<(String, Duration)>>,
}

struct Stage {
    name: String,
    start: Instant,
    bar: ProgressBar,
}

impl Bars {
    pub fn new(quiet: bool) -> Self {
        Self { quiet, running: Mutex::default(), ended: Mutex::default() }
    }

    pub fn is_quiet(&self) -> bool {
        self.quiet
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
        let ended = self.ended.lock().unwrap_or_else(|e| e.into_inner());
        ended.iter().map(|(name, time)| (name.clone(), time.as_secs_f64())).collect()
    }
}

impl Monitor for Bars {
    fn begin(&self, stage: &str, units: Option<u64>) {
        let bar = match units {
            Some(units) => {
                ProgressBar::new(units).with_style(style("{bar:30} {human_pos}/{human_len} {eta}"))
            }
            None => ProgressBar::new_spinner().with_style(style("{spinner} {elapsed}")),
        };
        bar.set_draw_target(if self.quiet {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        });
        bar.set_message(stage.to_string());
        bar.enable_steady_tick(Duration::from_millis(100));
        let stage = Stage { name: stage.into(), start: Instant::now(), bar };
        self.running.lock().unwrap_or_else(|e| e.into_inner()).push(stage);
    }

    fn advance(&self, units: u64) {
        if let Some(stage) = self.running.lock().unwrap_or_else(|e| e.into_inner()).last() {
            stage.bar.inc(units);
        }
    }

    fn tell(&self, message: &str) {
        if let Some(stage) = self.running.lock().unwrap_or_else(|e| e.into_inner()).last() {
            stage.bar.set_message(message.to_string());
        }
    }

    fn end(&self) {
        if let Some(stage) = self.running.lock().unwrap_or_else(|e| e.into_inner()).pop() {
            stage.bar.finish_and_clear();
            let mut ended = self.ended.lock().unwrap_or_else(|e| e.into_inner());
            ended.push((stage.name, stage.start.elapsed()));
        }
    }
}

fn style(rest: &str) -> ProgressStyle {
    ProgressStyle::with_template(&format!("  {{msg:36}} {rest}"))
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}
