//! Threads that step.

use std::collections::BTreeMap;
use std::mem;
use std::sync::{Arc, Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::errors::Fault;

/// Pools by number of threads. They are kept, because simulations come and go.
#[derive(Default)]
struct Pools {
    /// Process that owns these threads.
    process: u32,
    by_size: BTreeMap<usize, Arc<ThreadPool>>,
}

static POOLS: Mutex<Option<Pools>> = Mutex::new(None);

/// Returns a pool of `threads` threads; 0 means one per processor.
pub(crate) fn pool(threads: usize) -> Result<Arc<ThreadPool>, Fault> {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    let pools = pools.get_or_insert_default();
    if pools.process != std::process::id() {
        // A forked process has only one thread. The threads of its parent do not exist here and
        // cannot be ended.
        mem::forget(mem::take(&mut pools.by_size));
        pools.process = std::process::id();
    }
    if let Some(pool) = pools.by_size.get(&threads) {
        return Ok(Arc::clone(pool));
    }
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| {
        let text = format!("cannot start {threads} threads: {error}; ask for fewer");
        Fault::Threads(text)
    })?;
    let pool = Arc::new(pool);
    pools.by_size.insert(threads, Arc::clone(&pool));
    Ok(pool)
}
