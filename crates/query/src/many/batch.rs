//! Many questions at once, on the threads of the current rayon pool.
//!
//! Workers take the questions in order, a few at a time, so that the first ones are answered first.
//! Each answer depends only on its question: a batch gives the same answers as single queries, bit
//! for bit, on any number of threads. Only a deadline, which depends on the clock, can change that.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use nearmiss_lanes::parallel::{self, change_each};

use crate::ask::answer::Answer;
use crate::ask::budget::Deadline;
use crate::question::Scratch;

/// Questions that a worker takes at once: enough to hide the cost of the lock, and few enough to
/// end soon after a deadline. Each of them then takes only a clock read.
const MOST_AT_ONCE: usize = 16;

/// Turns per worker in a small batch, so that a hard question delays few others.
const TURNS: usize = 4;

/// When a batch of collision queries ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Until {
    /// After all questions.
    #[default]
    All,
    /// After the first question, in their order, that is answered with a contact.
    First,
}

impl Until {
    /// Returns the control flow of [`each`] after `answer`: a break at a contact if only the first
    /// one is requested.
    pub fn after(self, answer: Answer) -> ControlFlow<Answer, Answer> {
        if self == Self::First && answer.verdict.is_intersecting() {
            ControlFlow::Break(answer)
        } else {
            ControlFlow::Continue(answer)
        }
    }
}

/// Working memory of batches: a [`Scratch`] per thread.
#[derive(Debug, Clone, Default)]
pub struct BatchScratch {
    workers: Vec<Scratch>,
}

/// Answers many questions on all threads: calls `ask(i, scratch)` for each i and writes the answer
/// to `answers[i]`.
///
/// `ask` breaks with an answer to end the batch there. Returns the number of answers up to and
/// including the first break, in the order of the questions; the entries after it are unspecified.
/// A question that was not begun by `deadline` keeps its entry, for example [`Answer::UNASKED`].
/// Answers do not depend on the number of threads.
///
/// Runs on the current rayon pool (choose one with `pool.install(|| …)`), or on the calling thread
/// without the feature `rayon`. Does not allocate once `scratch` is warm.
/// ```
/// use nearmiss_geometry::{PointCloud, Pose};
/// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
/// use nearmiss_query::{
///     Answer, BatchScratch, CollideOptions, CollidePlan, Pair, Prepared, Until, each,
/// };
///
/// let points: Vec<[f32; 3]> =
///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
/// let square = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
/// let plan = CollidePlan::new(&CollideOptions::default(), &square, &square)?;
///
/// // An upright square is lowered onto a horizontal one in steps of 0.1: when does it touch?
/// let upright = Pose::from_axis_angle([1.0, 0.0, 0.0], 1.5);
/// let lowered = |step: u32| upright.with_translation([0.3, 0.5, 0.55 - 0.1 * f64::from(step)]);
/// let path: Vec<Pose> = (0..20).map(lowered).collect();
/// let mut answers = vec![Answer::UNASKED; path.len()];
/// let told = each(&mut answers, None, &mut BatchScratch::default(), |i, scratch| {
///     let pair = Pair::new(square.at(&Pose::IDENTITY), square.at(&path[i]));
///     Until::First.after(pair.collide(&plan, scratch))
/// });
/// assert_eq!(told, 7, "with step 6");
/// assert!(answers[6].verdict.is_intersecting());
/// assert!(answers[..6].iter().all(|answer| answer.verdict.is_separated()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn each<T: Send>(
    answers: &mut [T],
    deadline: Option<Deadline>,
    scratch: &mut BatchScratch,
    ask: impl Fn(usize, &mut Scratch) -> ControlFlow<T, T> + Sync,
) -> usize {
    let count = answers.len();
    let threads = if count > 1 { parallel::threads() } else { 1 };
    let at_once = count.div_ceil(threads * TURNS).clamp(1, MOST_AT_ONCE);
    let workers = threads.min(count.div_ceil(at_once));
    if scratch.workers.len() < workers {
        scratch.workers.resize_with(workers, Scratch::default);
    }
    let queue = Mutex::new(answers.chunks_mut(at_once).enumerate());
    let told = AtomicUsize::new(count);
    let work = |_, scratch: &mut Scratch| {
        while !deadline.is_some_and(is_past) {
            let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((turn, slots)) = next else { return };
            for (i, slot) in (turn * at_once..).zip(slots) {
                // Answers before `told` are needed, as another worker can only lower it to a later
                // index.
                if i >= told.load(Ordering::Relaxed) {
                    return;
                }
                *slot = match ask(i, scratch) {
                    ControlFlow::Continue(answer) => answer,
                    ControlFlow::Break(answer) => {
                        told.fetch_min(i + 1, Ordering::Relaxed);
                        answer
                    }
                };
            }
        }
    };
    change_each(&mut scratch.workers[..workers], 1, work);
    told.into_inner()
}

fn is_past(deadline: Deadline) -> bool {
    deadline <= Deadline::within(Duration::ZERO)
}
