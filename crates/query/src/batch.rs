//! Many questions at once, on the threads of the current rayon pool.
//!
//! Workers take the questions in order, some at a time, so that the first ones are answered first. What a
//! question is answered depends on nothing but the question: a batch says what single queries say, bit for
//! bit, on any number of threads. Only a deadline, which no clock repeats, can change that.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use nearmiss_geometry::Pose;

use crate::budget::{Budget, Deadline};
use crate::collide::{CollideScratch, collide_with};
use crate::options::CollidePlan;
use crate::prepared::Prepared;
use crate::verdict::{Answer, Reason, Statistics, Verdict};
use crate::view::ScanView;

/// Questions that a worker takes at once: few enough that those cut short by a deadline, a look at the clock
/// each, take some microseconds together, and enough to hide the lock.
const MOST_AT_ONCE: usize = 16;

/// Of a small batch each worker has so many turns, so that a hard question holds up few others.
const TURNS: usize = 4;

/// When a batch is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Until {
    /// When all questions are answered.
    #[default]
    All,
    /// With the first question, in the order they are asked, whose answer is a hit.
    First,
}

/// Reused between batches; never influences an answer. Holds a [`CollideScratch`] a thread.
#[derive(Debug, Clone, Default)]
pub struct BatchScratch {
    workers: Vec<CollideScratch>,
    answers: Vec<Answer>,
}

/// The answer to a question that a deadline left no time to ask: nothing was spent, and nothing is known.
const UNASKED: Answer = Answer {
    band: f64::INFINITY,
    verdict: Verdict::Undecided(Reason::Budget { likelihood: 0.5 }),
    distance_estimate: None,
    statistics: Statistics { evaluations: 0, node_pairs: 0, leaf_pairs: 0, neighbour_steps: 0 },
};

/// Whether the two scans of each question meet. Allocates a scratch of its own; see [`collide_many_with`].
#[must_use]
pub fn collide_many(
    questions: &[[ScanView<'_>; 2]],
    plan: &CollidePlan,
    budget: &Budget,
    until: Until,
) -> Vec<Answer> {
    let mut scratch = BatchScratch::default();
    collide_many_with(questions, plan, budget, until, &mut scratch);
    scratch.answers
}

/// Whether the two scans of each question meet, as `plan` means it: the answers of
/// [`collide_with`], in order.
///
/// With [`Until::First`] they end with the first hit. A budget of work holds for each question. A deadline
/// holds for all: questions not begun by then are undecided, with a likelihood of a half and no work spent.
///
/// Runs on the current rayon pool (`pool.install(|| …)` chooses one), or on the calling thread without the
/// feature `rayon`. Does not allocate once `scratch` is warm.
pub fn collide_many_with<'s>(
    questions: &[[ScanView<'_>; 2]],
    plan: &CollidePlan,
    budget: &Budget,
    until: Until,
    scratch: &'s mut BatchScratch,
) -> &'s [Answer] {
    let ask = |i: usize, scratch: &mut CollideScratch| {
        let [a, b] = &questions[i];
        collide_with(a, b, plan, budget, scratch)
    };
    ask_all(questions.len(), ask, budget.deadline, until, scratch)
}

/// Whether two scans meet in each of many pairs of poses. Allocates a scratch of its own; see
/// [`collide_poses_with`].
#[must_use]
pub fn collide_poses<S: Prepared + Sync + ?Sized>(
    scans: [&S; 2],
    poses: &[[Pose; 2]],
    plan: &CollidePlan,
    budget: &Budget,
    until: Until,
) -> Vec<Answer> {
    let mut scratch = BatchScratch::default();
    collide_poses_with(scans, poses, plan, budget, until, &mut scratch);
    scratch.answers
}

/// Whether two scans meet in each of many pairs of poses; otherwise as [`collide_many_with`].
///
/// ```
/// use std::time::Duration;
///
/// use nearmiss_geometry::{PointCloud, Pose};
/// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
/// use nearmiss_query::{
///     BatchScratch, Budget, CollideOptions, CollidePlan, Deadline, Until, collide_poses_with,
/// };
///
/// let points: Vec<[f32; 3]> =
///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
/// let square = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
/// let plan = CollidePlan::new(&CollideOptions::default(), &square, &square)?;
///
/// // An upright square is lowered onto a lying one in steps of 0.1: when does it touch?
/// let upright = Pose::from_axis_angle([1.0, 0.0, 0.0], 1.5);
/// let lowered = |step: u32| upright.with_translation([0.3, 0.5, 0.55 - 0.1 * f64::from(step)]);
/// let path: Vec<[Pose; 2]> = (0..20).map(|step| [Pose::IDENTITY, lowered(step)]).collect();
/// let budget = Budget::UNLIMITED.with_deadline(Deadline::within(Duration::from_secs(10)));
/// let mut scratch = BatchScratch::default();
/// let answers = collide_poses_with([&square, &square], &path, &plan, &budget, Until::First, &mut scratch);
/// assert_eq!(answers.len(), 7, "with step 6");
/// assert!(answers[6].verdict.is_intersecting());
/// assert!(answers[..6].iter().all(|answer| answer.verdict.is_separated()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn collide_poses_with<'s, S: Prepared + Sync + ?Sized>(
    scans: [&S; 2],
    poses: &[[Pose; 2]],
    plan: &CollidePlan,
    budget: &Budget,
    until: Until,
    scratch: &'s mut BatchScratch,
) -> &'s [Answer] {
    let ask = |i: usize, scratch: &mut CollideScratch| {
        let [a, b] = [0, 1].map(|k: usize| scans[k].at(&poses[i][k]));
        collide_with(&a, &b, plan, budget, scratch)
    };
    ask_all(poses.len(), ask, budget.deadline, until, scratch)
}

/// The answers that `ask` gives to questions 0 to `count`.
pub(crate) fn ask_all(
    count: usize,
    ask: impl Fn(usize, &mut CollideScratch) -> Answer + Sync,
    deadline: Option<Deadline>,
    until: Until,
    scratch: &mut BatchScratch,
) -> &[Answer] {
    let mut answers = std::mem::take(&mut scratch.answers);
    answers.clear();
    answers.resize(count, UNASKED);
    let ask = |i: usize, scratch: &mut CollideScratch| {
        let answer = ask(i, scratch);
        if until == Until::First && answer.verdict.is_intersecting() {
            ControlFlow::Break(answer)
        } else {
            ControlFlow::Continue(answer)
        }
    };
    let told = answer_each(&mut answers, deadline, ask, scratch);
    answers.truncate(told);
    scratch.answers = answers;
    &scratch.answers
}

/// Answers question i into `answers[i]`, whatever a question and an answer are: `ask` is given i and a
/// scratch, and breaks with the answer after which none is wanted. Returns how many are told: all up to the
/// first that breaks, in the order of the questions; what stands after them means nothing.
///
/// The workhorse of [`collide_many`], for those who measure, prove or parse on the way. Questions not begun
/// by `deadline` keep what stood there. Threads and memory as for [`collide_many_with`].
pub fn answer_each<T: Send>(
    answers: &mut [T],
    deadline: Option<Deadline>,
    ask: impl Fn(usize, &mut CollideScratch) -> ControlFlow<T, T> + Sync,
    scratch: &mut BatchScratch,
) -> usize {
    let count = answers.len();
    let threads = if count > 1 { threads() } else { 1 };
    let at_once = count.div_ceil(threads * TURNS).clamp(1, MOST_AT_ONCE);
    let workers = threads.min(count.div_ceil(at_once));
    if scratch.workers.len() < workers {
        scratch.workers.resize_with(workers, CollideScratch::default);
    }
    let queue = Mutex::new(answers.chunks_mut(at_once).enumerate());
    let told = AtomicUsize::new(count);
    let work = |scratch: &mut CollideScratch| {
        while !deadline.is_some_and(is_past) {
            let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((turn, slots)) = next else { return };
            for (i, slot) in (turn * at_once..).zip(slots) {
                // Whatever is told lies before all ends that others find later.
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
    each(&mut scratch.workers[..workers], work);
    told.into_inner()
}

fn is_past(deadline: Deadline) -> bool {
    deadline <= Deadline::within(Duration::ZERO)
}

#[cfg(feature = "rayon")]
fn threads() -> usize {
    rayon::current_num_threads()
}

#[cfg(not(feature = "rayon"))]
const fn threads() -> usize {
    1
}

/// Runs `work` for each worker: a single one on this thread.
fn each(workers: &mut [CollideScratch], work: impl Fn(&mut CollideScratch) + Send + Sync) {
    #[cfg(feature = "rayon")]
    if workers.len() > 1 {
        use rayon::prelude::*;
        return workers.par_iter_mut().with_max_len(1).for_each(work);
    }
    workers.iter_mut().for_each(work);
}
