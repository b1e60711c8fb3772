//! Long work: on other threads, without the interpreter's lock; this one hears Ctrl-C and tells of progress.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use haloray::monitor::Monitor;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::errors::OrRaise;
use crate::threads::pool;

/// How often signals are looked for.
const LOOK: Duration = Duration::from_millis(50);

/// A task that has begun and not ended.
#[derive(Debug, Clone, PartialEq)]
struct Task {
    name: String,
    units: Option<u64>,
    done: u64,
    message: String,
}

/// What a piece of work says of itself, and whether it is to stop.
#[derive(Default)]
struct Watch {
    tasks: Mutex<Vec<Task>>,
    /// The task that ended last.
    ended: Mutex<Option<Task>>,
    is_cancelled: AtomicBool,
}

impl Watch {
    fn innermost(&self, change: impl FnOnce(&mut Task)) {
        let mut tasks = self.tasks.lock().unwrap_or_else(PoisonError::into_inner);
        tasks.last_mut().map(change);
    }

    /// Hears signals; calls `progress(task, done, units, message)` for the innermost task if it has gone on since `told`.
    fn look(&self, py: Python<'_>, progress: Option<&Py<PyAny>>, told: &mut Option<Task>) -> PyResult<()> {
        py.check_signals()?;
        let Some(progress) = progress else { return Ok(()) };
        let going_on = self.tasks.lock().unwrap_or_else(PoisonError::into_inner).last().cloned();
        let ended = || self.ended.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let innermost = going_on.or_else(ended);
        if innermost != *told {
            if let Some(Task { name, units, done, message }) = &innermost {
                progress.call1(py, (name, *done, *units, message))?;
            }
            *told = innermost;
        }
        Ok(())
    }
}

impl Monitor for Watch {
    fn begin(&self, task: &str, units: Option<u64>) {
        let task = Task { name: task.into(), units, done: 0, message: String::new() };
        self.tasks.lock().unwrap_or_else(PoisonError::into_inner).push(task);
    }

    fn advance(&self, units: u64) {
        self.innermost(|task| task.done += units);
    }

    fn tell(&self, message: &str) {
        self.innermost(|task| task.message = message.into());
    }

    fn end(&self) {
        let ended = self.tasks.lock().unwrap_or_else(PoisonError::into_inner).pop();
        *self.ended.lock().unwrap_or_else(PoisonError::into_inner) = ended;
    }

    fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }
}

/// Runs `work` on the pool until it ends, or until a signal's handler raises: then the work is told to stop, and that exception
/// is passed on.
pub fn run<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&dyn Monitor) -> haloray::Result<T> + Send,
) -> PyResult<T> {
    let (pool, watch) = (pool()?, Watch::default());
    let (result, raised) = py.detach(|| {
        let (mut result, mut raised, mut told) = (None, None, None);
        let (ends, ended) = sync_channel::<()>(1);
        pool.in_place_scope(|scope| {
            let (watch, result) = (&watch, &mut result);
            scope.spawn(move |_| {
                *result = Some(work(watch));
                drop(ends);
            });
            while ended.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                if raised.is_none() {
                    raised = Python::attach(|py| watch.look(py, progress, &mut told)).err();
                    watch.is_cancelled.store(raised.is_some(), Ordering::Relaxed);
                }
            }
        });
        // Work that was quicker than the first look is told of too.
        if raised.is_none() && progress.is_some() {
            raised = Python::attach(|py| watch.look(py, progress, &mut told)).err();
        }
        (result, raised)
    });
    match (raised, result) {
        (Some(raised), _) => Err(raised),
        (None, Some(result)) => result.or_raise(py),
        (None, None) => Err(PyRuntimeError::new_err("the work ended without a result")),
    }
}
