//! Threads that step.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors::{Fault, guarded};

/// Pools by their number of threads, made once: simulations come and go.
static POOLS: Mutex<BTreeMap<usize, Arc<ThreadPool>>> = Mutex::new(BTreeMap::new());

/// A pool of so many threads; 0: one for each processor.
pub(crate) fn pool(threads: usize) -> Result<Arc<ThreadPool>, Fault> {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(pool) = pools.get(&threads) {
        return Ok(Arc::clone(pool));
    }
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = Arc::new(pool.map_err(|error| {
        Fault::Defect(format!(
            "cannot start {threads} threads: {error}; ask for fewer"
        ))
    })?);
    pools.insert(threads, Arc::clone(&pool));
    Ok(pool)
}

/// Does some work on a pool, while other threads of Python go on.
pub(crate) fn on_pool<T: Send>(
    py: Python<'_>,
    pool: &ThreadPool,
    work: impl FnOnce() -> Result<T, Fault> + Send,
) -> PyResult<T> {
    Ok(py.detach(|| pool.install(|| guarded(work)))?)
}
