//! The threads that work: a pool of their own, made anew in a process that was forked.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// What threads have for their stacks, as the main thread of a command has: kernels keep many lanes there.
const STACK_BYTES: usize = 16 << 20;

/// A pool with the process that it belongs to, and its number of threads (0 means all cores).
struct Threads {
    process: u32,
    number: usize,
    pool: Option<Arc<ThreadPool>>,
}

static THREADS: Mutex<Threads> = Mutex::new(Threads { process: 0, number: 0, pool: None });

/// The pool of this process.
pub fn pool() -> PyResult<Arc<ThreadPool>> {
    let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    if threads.process != std::process::id() {
        // The threads of the parent are not here, and cannot be waited for.
        std::mem::forget(threads.pool.take());
        threads.process = std::process::id();
    }
    if let Some(pool) = &threads.pool {
        return Ok(pool.clone());
    }
    let built = ThreadPoolBuilder::new().num_threads(threads.number).stack_size(STACK_BYTES).build();
    let refused = |error| PyRuntimeError::new_err(format!("the system gives no threads: {error}"));
    let pool = Arc::new(built.map_err(refused)?);
    threads.pool = Some(pool.clone());
    Ok(pool)
}

/// Work from now on has so many threads; 0 means all cores. Results do not depend on it.
#[pyfunction]
pub fn set_threads(number: usize) {
    let mut threads = THREADS.lock().unwrap_or_else(PoisonError::into_inner);
    threads.number = number;
    let old = threads.pool.take();
    if threads.process != std::process::id() {
        std::mem::forget(old);
    }
}

/// How many threads work.
#[pyfunction]
pub fn number_of_threads() -> PyResult<usize> {
    Ok(pool()?.current_num_threads())
}
