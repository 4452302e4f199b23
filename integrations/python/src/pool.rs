//! Threads and scratch memory, which survive a fork.
//!
//! The threads of rayon's global pool do not exist in a forked process, where work given to them
//! would wait forever. So work runs in a pool of our own, which a forked process makes anew.

use std::cell::RefCell;
use std::ops::ControlFlow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, Thread};
use std::time::Duration;

use bytemuck::Zeroable;
use bytemuck::allocation::zeroed_vec;
use nearmiss::{BatchScratch, Scratch, each};
use pyo3::{PyErr, PyResult, Python};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::failure::refused;

/// How long a signal may wait during a batch.
const BETWEEN_SIGNALS: Duration = Duration::from_millis(50);

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

/// Sets a flag and wakes a thread when dropped, also by a panic.
struct Announcement<'a> {
    is_done: &'a AtomicBool,
    waiting: Thread,
}

impl Drop for Announcement<'_> {
    fn drop(&mut self) {
        self.is_done.store(true, Ordering::Release);
        self.waiting.unpark();
    }
}

/// Answers `count` questions on all cores, without the interpreter. This thread waits and lets Python
/// handle signals meanwhile; Ctrl-C ends the batch.
pub(crate) fn ask_each<T: Zeroable + Copy + Send>(
    py: Python<'_>,
    count: usize,
    ask: impl Fn(usize, &mut Scratch) -> T + Sync,
) -> PyResult<Vec<T>> {
    let mut answers: Vec<T> = zeroed_vec(count);
    let (is_done, is_ended) = (AtomicBool::new(false), AtomicBool::new(false));
    let announcement = Announcement { is_done: &is_done, waiting: thread::current() };
    let ask = |i: usize, scratch: &mut Scratch| {
        if is_ended.load(Ordering::Relaxed) {
            ControlFlow::Break(T::zeroed())
        } else {
            ControlFlow::Continue(ask(i, scratch))
        }
    };
    let slots = &mut answers[..];
    THREADS.pool()?.in_place_scope(|scope| {
        scope.spawn(move |_| {
            let _announcement = announcement;
            each(slots, None, &mut BatchScratch::default(), ask);
        });
        while !is_done.load(Ordering::Acquire) {
            py.detach(|| thread::park_timeout(BETWEEN_SIGNALS));
            py.check_signals().inspect_err(|_| is_ended.store(true, Ordering::Relaxed))?;
        }
        Ok::<(), PyErr>(())
    })?;
    Ok(answers)
}
