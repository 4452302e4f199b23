//! Pools of threads.

use crate::error::CliError;

/// Returns a pool of this many threads; 0 for all cores.
pub(crate) fn pool(threads: usize) -> Result<rayon::ThreadPool, CliError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.or(Err(CliError::Threads(threads)))
}
