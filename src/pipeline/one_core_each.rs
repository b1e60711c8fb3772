//! Independent pieces of work, each on one core: whole fits share the cores better than the chains of one.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// `work(0..number)` in order; an error stops what has not begun.
///
/// # Errors
/// The first of `work`; threads that the system refuses.
pub fn one_core_each<T: Send>(number: u64, work: impl Fn(u64) -> Result<T> + Sync) -> Result<Vec<T>> {
    /// What the main thread has: unoptimised builds need more than the usual two mebibytes for fits.
    const STACK_BYTES: usize = 8 << 20;
    let next = AtomicU64::new(0);
    let worker = || -> Result<Vec<(u64, T)>> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).stack_size(STACK_BYTES).build();
        let pool =
            pool.map_err(|e| Error::out_of_range("number of threads", 1, &format!("possible here ({e})")))?;
        let mut done = Vec::new();
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= number {
                return Ok(done);
            }
            let result = pool.install(|| work(i));
            if result.is_err() {
                next.store(number, Ordering::Relaxed);
            }
            done.push((i, result?));
        }
    };
    let parts: Vec<Result<Vec<(u64, T)>>> = std::thread::scope(|scope| {
        let spawn = |_| std::thread::Builder::new().spawn_scoped(scope, worker);
        let workers: std::io::Result<Vec<_>> = (0..rayon::current_num_threads()).map(spawn).collect();
        let Ok(workers) = workers else {
            let refused =
                Error::out_of_range("number of threads", rayon::current_num_threads(), "possible here");
            return vec![Err(refused)];
        };
        let join = |worker: std::thread::ScopedJoinHandle<_>| {
            worker.join().unwrap_or_else(|cause| std::panic::resume_unwind(cause))
        };
        workers.into_iter().map(join).collect()
    });
    let mut all: Vec<(u64, T)> =
        parts.into_iter().collect::<Result<Vec<_>>>()?.into_iter().flatten().collect();
    all.sort_by_key(|(i, _)| *i);
    Ok(all.into_iter().map(|(_, result)| result).collect())
}
