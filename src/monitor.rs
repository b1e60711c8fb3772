//! How long work tells where it is, and how it is told to stop: one trait between a computation and whoever watches.

use crate::error::{Error, Result};

/// Somebody who watches: a progress bar, a log, nobody. Everything may be called from any thread.
///
/// Work announces itself as a [`Task`] with a name and, where it knows them, its units; tasks nest. Loops call
/// `monitor.check()` or [`Task::check`] often (many times a second), and pass its error on.
pub trait Monitor: Sync {
    /// A task begins; `units` is how many steps it will take, if known.
    fn begin(&self, task: &str, units: Option<u64>);
    /// So many more units of the innermost task are done.
    fn advance(&self, units: u64);
    /// What the innermost task is doing now, in a few words; replaces what was said before.
    fn tell(&self, message: &str);
    /// The innermost task is over.
    fn end(&self);
    /// Whether work is to stop.
    fn is_cancelled(&self) -> bool {
        false
    }
}

impl dyn Monitor + '_ {
    /// Begins a task, which ends when it is dropped.
    pub fn task(&self, name: &str, units: Option<u64>) -> Task<'_> {
        self.begin(name, units);
        Task { monitor: self }
    }

    /// # Errors
    /// [`Error::Cancelled`] once work is to stop.
    pub fn check(&self) -> Result<()> {
        if self.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// A piece of work under a name, from its beginning until it is dropped.
pub struct Task<'a> {
    monitor: &'a dyn Monitor,
}

impl Task<'_> {
    /// So many more units are done.
    pub fn advance(&self, units: u64) {
        self.monitor.advance(units);
    }

    /// What is done now, in a few words.
    pub fn tell(&self, message: &str) {
        self.monitor.tell(message);
    }

    /// # Errors
    /// [`Error::Cancelled`] once work is to stop.
    pub fn check(&self) -> Result<()> {
        self.monitor.check()
    }
}

impl Drop for Task<'_> {
    fn drop(&mut self) {
        self.monitor.end();
    }
}

/// Nobody watches, nobody stops the work.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Monitor for Silent {
    fn begin(&self, _: &str, _: Option<u64>) {}
    fn advance(&self, _: u64) {}
    fn tell(&self, _: &str) {}
    fn end(&self) {}
}

/// Work inside a task that has its own count: it can be stopped, but does not report.
pub struct Uncounted<'a>(pub &'a dyn Monitor);

impl Monitor for Uncounted<'_> {
    fn begin(&self, _: &str, _: Option<u64>) {}
    fn advance(&self, _: u64) {}
    fn tell(&self, _: &str) {}
    fn end(&self) {}
    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[derive(Default)]
    struct Log(Mutex<Vec<String>>);

    impl Log {
        fn note(&self, text: String) {
            self.0.lock().unwrap().push(text);
        }
    }

    impl Monitor for Log {
        fn begin(&self, task: &str, units: Option<u64>) {
            self.note(format!("{task} {units:?}"));
        }
        fn advance(&self, units: u64) {
            self.note(format!("+{units}"));
        }
        fn tell(&self, message: &str) {
            self.note(message.into());
        }
        fn end(&self) {
            self.note("end".into());
        }
        fn is_cancelled(&self) -> bool {
            self.0.lock().unwrap().len() > 3
        }
    }

    #[test]
    fn a_task_ends_when_it_is_dropped_and_hears_that_it_is_to_stop() {
        let log = Log::default();
        let monitor: &dyn Monitor = &log;
        {
            let outer = monitor.task("cone", None);
            let inner = monitor.task("rays", Some(2));
            inner.advance(1);
            assert!(outer.check().is_ok());
            inner.tell("half");
            assert!(matches!(inner.check(), Err(Error::Cancelled)));
        }
        assert_eq!(*log.0.lock().unwrap(), ["cone None", "rays Some(2)", "+1", "half", "end", "end"]);
    }
}
