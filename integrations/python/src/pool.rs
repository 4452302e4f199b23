//! Threads and scratch memory, which survive a fork.
//!
//! The threads of rayon's global pool do not exist in a forked process, where work given to them
//! would wait forever. So work runs in a pool of our own, which a forked process makes anew.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::sync::OnceLock;

use bytemuck::Zeroable;
use nearmiss::{BatchScratch, Scratch, each};
use pyo3::{PyResult, Python};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::failure::refused;

/// Batches are cut into parts of this many queries; between them Python handles signals.
const PART: usize = 1 << 14;

/// The pool of a process, followed by that of a process forked from it.
struct Threads {
    here: OnceLock<(u32, Result<ThreadPool, String>)>,
    forked: OnceLock<Box<Self>>,
}

impl Threads {
    const fn new() -> Self {
        Self { here: OnceLock::new(), forked: OnceLock::new() }
    }

    fn pool(&self) -> PyResult<&ThreadPool> {
        let (mut threads, this) = (self, std::process::id());
        loop {
            let made = || (this, ThreadPoolBuilder::new().build().map_err(|cause| cause.to_string()));
            let (process, pool) = threads.here.get_or_init(made);
            if *process == this {
                return pool.as_ref().map_err(refused);
            }
            threads = threads.forked.get_or_init(Box::default);
        }
    }
}

impl Default for Threads {
    fn default() -> Self {
        Self::new()
    }
}

static THREADS: Threads = Threads::new();

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Runs `work` with the scratch memory of this thread, without the interpreter.
pub(crate) fn ask<T: Send>(py: Python<'_>, work: impl FnOnce(&mut Scratch) -> T + Send) -> T {
    py.detach(|| with_scratch(work))
}

/// Runs `work` with the scratch memory of this thread.
pub(crate) fn with_scratch<T>(work: impl FnOnce(&mut Scratch) -> T) -> T {
    SCRATCH.with(|scratch| match scratch.try_borrow_mut() {
        Ok(mut scratch) => work(&mut scratch),
        Err(_) => work(&mut Scratch::default()),
    })
}

/// Runs `work` with all threads of this process.
pub(crate) fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<T> {
    Ok(THREADS.pool()?.install(work))
}

/// Answers `count` questions on all cores, without the interpreter. Ctrl-C ends it between parts.
pub(crate) fn ask_each<T: Zeroable + Copy + Send>(
    py: Python<'_>,
    count: usize,
    ask: impl Fn(usize, &mut Scratch) -> T + Sync,
) -> PyResult<Vec<T>> {
    let mut answers = vec![T::zeroed(); count];
    let mut scratch = BatchScratch::default();
    for (part, answers) in answers.chunks_mut(PART).enumerate() {
        py.check_signals()?;
        let scratch = &mut scratch;
        py.detach(|| {
            in_pool(|| {
                each(answers, None, scratch, |i, scratch| {
                    ControlFlow::Continue(ask(part * PART + i, scratch))
                })
            })
        })?;
    }
    Ok(answers)
}
