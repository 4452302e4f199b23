//! Data-parallel loops: on one thread, or with the feature `rayon` on all threads of the current
//! pool. Results come in order, so they are the same for any number of threads.
//!
//! Every loop divides its items in halves until few are left ([`change_together`]). The division is compiled
//! once, not for each closure: the iterators of rayon are a hundred functions a loop, and were half of what
//! the compiler had to do for the libraries with many loops.

use std::mem::MaybeUninit;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// The number of items of at most a microsecond that a thread takes at once, enough to hide the
/// cost of scheduling.
const AT_ONCE: usize = 1024;

/// The number of pieces of a long loop with expensive steps. A thread that has finished can take over pieces
/// that no other has begun, so threads finish at nearly the same time.
const PIECES: usize = 256;

/// Maps each number below `count`. For cheap `f`: a thread takes many numbers at once.
pub fn map<R: Send>(count: usize, f: impl Fn(usize) -> R + Sync + Send) -> Vec<R> {
    collected(count, AT_ONCE, |range| range.map(&f))
}

/// Maps each item. For cheap `f`: a thread takes many items at once.
pub fn map_all<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    map(items.len(), |i| f(&items[i]))
}

/// Maps consecutive chunks of items. For expensive `f`.
pub fn chunks<T: Sync, R: Send>(items: &[T], f: impl Fn(&[T]) -> R + Sync + Send) -> Vec<R> {
    const LENGTH: usize = 16;
    ranges_with(items.len(), LENGTH, || (), |(), range| f(&items[range]))
}

/// Maps each number below `count`. For expensive `f`: the numbers are scheduled one by one.
pub fn map_each<R: Send>(count: usize, f: impl Fn(usize) -> R + Sync + Send) -> Vec<R> {
    map_with(count, || (), |(), i| f(i))
}

/// Maps each number below `count`, with scratch memory. `scratch` is called about once for each thread; its
/// contents must not affect the results.
pub fn map_with<S: Send, R: Send>(
    count: usize,
    scratch: impl Fn() -> S + Sync + Send,
    f: impl Fn(&mut S, usize) -> R + Sync + Send,
) -> Vec<R> {
    let pool = Mutex::new(Vec::new());
    let (scratch, f) = (&scratch, &f);
    collected(count, count.div_ceil(PIECES), |range| {
        let mut lent = Lent::new(&pool, scratch);
        range.map(move |i| f(lent.scratch(), i))
    })
}

/// Collects what `f` yields for consecutive ranges of about `at_once` numbers that partition `0..count`.
/// Panics if it yields too little.
#[expect(unsafe_code, reason = "the standard library has no safe function for it")]
fn collected<R: Send, I: Iterator<Item = R>>(
    count: usize,
    at_once: usize,
    f: impl Fn(Range<usize>) -> I + Sync,
) -> Vec<R> {
    let mut all = Vec::with_capacity(count);
    let slots: &mut [MaybeUninit<R>] = &mut all.spare_capacity_mut()[..count];
    change_together(0..count, at_once, runs(slots, 1), &|range, part: Runs<'_, MaybeUninit<R>>| {
        let mut results = f(range);
        for slot in part.elements {
            slot.write(results.next().expect("a result for each number"));
        }
    });
    // SAFETY: the loop has written every slot; had it panicked, the length would still be 0.
    unsafe { all.set_len(count) };
    all
}

/// Scratch memory that returns to a pool after use.
struct Lent<'a, S, F> {
    scratch: Option<S>,
    pool: &'a Mutex<Vec<S>>,
    make: &'a F,
}

impl<'a, S, F: Fn() -> S> Lent<'a, S, F> {
    /// Takes scratch memory from a pool, if there is some.
    fn new(pool: &'a Mutex<Vec<S>>, make: &'a F) -> Self {
        let scratch = pool.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Self { scratch, pool, make }
    }

    fn scratch(&mut self) -> &mut S {
        self.scratch.get_or_insert_with(self.make)
    }
}

impl<S, F> Drop for Lent<'_, S, F> {
    fn drop(&mut self) {
        let mut pool = self.pool.lock().unwrap_or_else(PoisonError::into_inner);
        pool.extend(self.scratch.take());
    }
}

/// Maps consecutive ranges of 1024 numbers that partition `0..count`.
pub fn ranges<R: Send>(count: usize, f: impl Fn(Range<usize>) -> R + Sync + Send) -> Vec<R> {
    ranges_with(count, AT_ONCE, || (), |(), range| f(range))
}

/// Like [`ranges`], with ranges of `length` numbers (the last may be shorter) and scratch memory.
/// `scratch` is called about once for each thread; its contents must not affect the results.
pub fn ranges_with<S: Send, R: Send>(
    count: usize,
    length: usize,
    scratch: impl Fn() -> S + Sync + Send,
    f: impl Fn(&mut S, Range<usize>) -> R + Sync + Send,
) -> Vec<R> {
    let range = |k: usize| k * length..((k + 1) * length).min(count);
    map_with(count.div_ceil(length), scratch, |scratch, k| f(scratch, range(k)))
}

/// The number of results of [`in_order`] that are computed while those before are taken.
const WAVE: usize = 1 << 9;

/// Maps consecutive ranges that partition `0..count`, for expensive `f`, with scratch memory as
/// [`map_with`] has it. `take` receives the results in order, while later ones are computed. At most 1024
/// results are held at once.
pub fn in_order<S: Send, R: Send>(
    count: usize,
    scratch: impl Fn() -> S + Sync + Send,
    f: impl Fn(&mut S, Range<usize>) -> R + Sync + Send,
    mut take: impl FnMut(R) + Send,
) {
    const LENGTH: usize = 16;
    let runs = count.div_ceil(LENGTH);
    let run = |scratch: &mut S, k: usize| f(scratch, k * LENGTH..((k + 1) * LENGTH).min(count));
    let mut last = Vec::new();
    for wave in (0..runs).step_by(WAVE) {
        let next = || map_with(WAVE.min(runs - wave), &scratch, |scratch, k| run(scratch, wave + k));
        last = both(next, || std::mem::take(&mut last).into_iter().for_each(&mut take)).0;
    }
    last.into_iter().for_each(take);
}

/// Passes consecutive ranges of items, of which `out` has `each` elements for one, with these elements to
/// `f`, which fills them in place; the last item may have fewer. For expensive `f`, with scratch memory as
/// [`map_with`] has it.
pub fn fill_with<S: Send, T: Send>(
    out: &mut [T],
    each: usize,
    scratch: impl Fn() -> S + Sync + Send,
    f: impl Fn(&mut S, Range<usize>, &mut [T]) + Sync + Send,
) {
    let count = out.len().div_ceil(each);
    // Few items at once if there are not many, so that threads finish at nearly the same time.
    let at_once = (count / PIECES).clamp(1, 16);
    let pool = Mutex::new(Vec::new());
    change_together(0..count, at_once, runs(out, each), &|items, part: Runs<'_, T>| {
        f(Lent::new(&pool, &scratch).scratch(), items, part.elements);
    });
}

/// Sets every item of `out` to `f` of its index. For cheap `f`: a thread takes many items at once.
pub fn fill<T: Send>(out: &mut [T], f: impl Fn(usize) -> T + Sync + Send) {
    change_each(out, AT_ONCE, |i, item| *item = f(i));
}

/// Passes each run of `length` items and its number to `f`, which fills it in place; the last run
/// may be shorter. For cheap `f`: a thread takes many runs at once.
pub fn fill_runs<T: Send>(out: &mut [T], length: usize, f: impl Fn(usize, &mut [T]) + Sync + Send) {
    change_runs_by(out, length, AT_ONCE, f);
}

/// Does the same as [`fill_runs`] for expensive `f`: the runs are scheduled one by one.
pub fn change_runs<T: Send>(out: &mut [T], length: usize, f: impl Fn(usize, &mut [T]) + Sync + Send) {
    change_runs_by(out, length, 1, f);
}

fn change_runs_by<T: Send>(
    out: &mut [T],
    length: usize,
    at_once: usize,
    f: impl Fn(usize, &mut [T]) + Sync + Send,
) {
    let count = out.len().div_ceil(length);
    change_together(0..count, at_once, runs(out, length), &|numbers, part: Runs<'_, T>| {
        numbers.zip(part.elements.chunks_mut(length)).for_each(|(number, run)| f(number, run));
    });
}

/// Passes every item and its index to `f`, which changes it in place. A thread takes at least
/// `at_once` items.
pub fn change_each<T: Send>(all: &mut [T], at_once: usize, f: impl Fn(usize, &mut T) + Sync + Send) {
    change_together(0..all.len(), at_once, runs(all, 1), &|range, part: Runs<'_, T>| {
        range.zip(part.elements).for_each(|(i, one)| f(i, one));
    });
}

/// Passes every pair of items and its index to `f`, which changes both in place. A thread takes at
/// least `at_once` pairs.
pub fn change_both<A: Send, B: Send>(
    a: &mut [A],
    b: &mut [B],
    at_once: usize,
    f: impl Fn(usize, &mut A, &mut B) + Sync + Send,
) {
    let count = a.len().min(b.len());
    change_together(
        0..count,
        at_once,
        (runs(a, 1), runs(b, 1)),
        &|range, (a, b): (Runs<'_, A>, Runs<'_, B>)| {
            range.zip(a.elements).zip(b.elements).for_each(|((i, a), b)| f(i, a, b));
        },
    );
}

/// Parts of arrays that belong to the same items, and can be divided between threads.
pub trait Divide: Sized + Send {
    /// Divides the parts before an item, counted from the first one.
    fn divide(self, item: usize) -> (Self, Self);
}

/// A part of an array with a number of elements for each item; the last item may have fewer.
#[derive(Debug)]
pub struct Runs<'a, T> {
    /// The elements.
    pub elements: &'a mut [T],
    /// The number of elements for an item.
    pub each: usize,
}

/// Creates the [`Runs`] of `each` elements.
pub const fn runs<T>(elements: &mut [T], each: usize) -> Runs<'_, T> {
    Runs { elements, each }
}

impl<T: Send> Divide for Runs<'_, T> {
    fn divide(self, item: usize) -> (Self, Self) {
        let place = self.elements.len().min(item * self.each);
        let (left, right) = self.elements.split_at_mut(place);
        (runs(left, self.each), runs(right, self.each))
    }
}

macro_rules! divide_tuples {
    ($($part:ident $place:tt),*) => {
        impl<$($part: Divide),*> Divide for ($($part,)*) {
            fn divide(self, item: usize) -> (Self, Self) {
                let halves = ($(self.$place.divide(item),)*);
                (($(halves.$place.0,)*), ($(halves.$place.1,)*))
            }
        }
    };
}
divide_tuples!(A 0, B 1);
divide_tuples!(A 0, B 1, C 2, D 3);
divide_tuples!(A 0, B 1, C 2, D 3, E 4, F 5);

/// Passes ranges of `items` with the `parts` of several arrays that belong to them to `f`, which changes
/// these. Ranges have `at_once` items, the last may have fewer.
///
/// One loop over several arrays reads each of them once, while it is in the cache. The closure is no type
/// parameter, so that the loop is compiled once for each kind of array.
pub fn change_together<P: Divide>(
    items: Range<usize>,
    at_once: usize,
    parts: P,
    f: &(dyn Fn(Range<usize>, P) + Sync),
) {
    let at_once = at_once.max(1);
    if items.len() <= at_once {
        return f(items, parts);
    }
    let half = items.len().div_ceil(at_once) / 2 * at_once;
    let middle = items.start + half;
    let (left, right) = parts.divide(half);
    both(
        || change_together(items.start..middle, at_once, left, f),
        || change_together(middle..items.end, at_once, right, f),
    );
}

/// Runs both closures, in parallel if there are several threads, and returns both results.
pub fn both<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    by_reference(a, |a| by_reference(b, |b| join(a, b)).0)
}

/// Passes `work` to `run` by reference, so that `run` is compiled once for all closures. Returns the results
/// of both. `run` must call `work`.
fn by_reference<R: Send, T>(
    work: impl FnOnce() -> R + Send,
    run: impl FnOnce(&mut (dyn FnMut() + Send)) -> T,
) -> (R, T) {
    let (mut work, mut result) = (Some(work), None);
    let of_run = run(&mut || result = work.take().map(|work| work()));
    (result.expect("the closure has run"), of_run)
}

/// Runs both closures, in parallel if there are several threads.
fn join(a: &mut (dyn FnMut() + Send), b: &mut (dyn FnMut() + Send)) {
    #[cfg(feature = "rayon")]
    rayon::join(a, b);
    #[cfg(not(feature = "rayon"))]
    {
        a();
        b();
    }
}

/// Returns the number of threads of the current pool; without the feature `rayon`, 1.
#[must_use]
pub fn threads() -> usize {
    #[cfg(feature = "rayon")]
    return rayon::current_num_threads();
    #[cfg(not(feature = "rayon"))]
    1
}

/// Sorts values, which must be distinct.
pub fn sort<T: Ord + Send>(values: &mut [T]) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        values.par_sort_unstable();
    }
    #[cfg(not(feature = "rayon"))]
    values.sort_unstable();
}

/// Runs `work` on `threads` threads, or on those of the current pool if `threads` is 0. Without the
/// feature `rayon` it always runs on the calling thread.
///
/// # Errors
/// If the threads cannot be started.
pub fn on_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> Result<R, NoThreads> {
    #[cfg(feature = "rayon")]
    if threads > 0 {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.or(Err(NoThreads))?;
        return Ok(by_reference(work, |work| pool.install(work)).0);
    }
    let _ = threads;
    Ok(in_pool(work))
}

/// Runs `work` on a thread of the current pool; without the feature `rayon`, on the calling thread.
///
/// A loop that starts outside the pool wakes the threads of the pool and waits for them, which takes tens
/// of microseconds. Work with several loops waits once.
pub fn in_pool<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    #[cfg(feature = "rayon")]
    return by_reference(work, |work| rayon::scope(|_| work())).0;
    #[cfg(not(feature = "rayon"))]
    work()
}

/// Runs `work` as [`in_pool`] does, and keeps another thread of the pool awake meanwhile.
///
/// A thread without work falls asleep after some ten microseconds, and takes as long to wake. This is for
/// work of a few milliseconds that alternates between short loops and short steps on one thread. The other
/// thread is busy until the end, even where only one has something to do.
pub fn in_pool_awake<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    #[cfg(feature = "rayon")]
    return in_pool(|| {
        use std::sync::atomic::{AtomicBool, Ordering};
        /// Ends the waiting, also if the work panics.
        struct End<'a>(&'a AtomicBool);
        impl Drop for End<'_> {
            fn drop(&mut self) {
                self.0.store(true, Ordering::Release);
            }
        }
        let (here, is_over) = (rayon::current_thread_index(), AtomicBool::new(false));
        let end = End(&is_over);
        let work = || {
            let _end = end;
            work()
        };
        // The thread of the work takes this up where one of its loops waits for another thread, and must
        // return to the work then.
        let wait = || {
            let is_elsewhere = rayon::current_thread_index() != here;
            while is_elsewhere && !is_over.load(Ordering::Acquire) {
                if rayon::yield_now() != Some(rayon::Yield::Executed) {
                    std::thread::yield_now();
                }
            }
        };
        rayon::join(work, wait).0
    });
    #[cfg(not(feature = "rayon"))]
    work()
}

/// The error of [`on_threads`] if the threads cannot be started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoThreads;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order_over_many_waves() {
        let count = 16 * WAVE * 2 + 5;
        let mut next = 0;
        in_order(
            count,
            || (),
            |(), range| range,
            |range: Range<usize>| {
                assert_eq!(range.start, next, "no run is left out");
                next = range.end;
            },
        );
        assert_eq!(next, count);
        in_order(0, || (), |(), _| (), |()| unreachable!("there is nothing to do"));
    }

    #[test]
    fn each_range_fills_the_elements_of_its_items() {
        for len in [0, 1, 2, 99, 100, 3001] {
            let mut out = vec![0; len];
            fill_with(&mut out, 3, Vec::new, |scratch, items, part| {
                scratch.clear();
                scratch.extend(items.flat_map(|i| [3 * i, 3 * i + 1, 3 * i + 2]));
                assert!(scratch.len() - part.len() < 3, "only the last item may have fewer elements");
                part.copy_from_slice(&scratch[..part.len()]);
            });
            assert_eq!(out, (0..len).collect::<Vec<_>>());
        }
    }

    #[test]
    #[cfg(feature = "rayon")]
    fn work_with_another_thread_awake_ends() {
        for threads in [1, 2, 3] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            // Loops within loops, so that the thread of the work waits for others and takes up what it finds.
            let sum = || map_each(64, |i| map(5000, |k| i * k % 7).into_iter().sum::<usize>());
            for _ in 0..50 {
                assert_eq!(pool.install(|| in_pool_awake(sum)), sum());
            }
            let fails = || pool.install(|| in_pool_awake(|| panic!("as intended")));
            let failed = std::panic::catch_unwind::<_, ()>(std::panic::AssertUnwindSafe(fails));
            assert!(failed.is_err());
        }
        assert_eq!(in_pool_awake(|| 3), 3, "from outside of a pool");
    }

    #[test]
    #[cfg(feature = "rayon")]
    fn scratch_memory_is_used_again() {
        use std::sync::atomic::{AtomicUsize, Ordering};
        let made = AtomicUsize::new(0);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        let scratch = || made.fetch_add(1, Ordering::Relaxed);
        let found = pool.install(|| map_with(1000, scratch, |_, i| i));
        assert_eq!(found, (0..1000).collect::<Vec<_>>());
        assert!(made.into_inner() <= 2, "one for each thread");
    }

    #[test]
    fn arrays_are_changed_together() {
        let (mut a, mut b) = (vec![0; 23], vec![0; 12]);
        change_together(3..15, 5, (runs(&mut a, 2), runs(&mut b, 1)), &|items, (a, b)| {
            assert!((a.each, b.each) == (2, 1) && items.len() == b.elements.len(), "{items:?}");
            a.elements.fill(items.start);
            b.elements.fill(items.end);
        });
        assert_eq!(b, [8, 8, 8, 8, 8, 13, 13, 13, 13, 13, 15, 15]);
        assert_eq!(a, [vec![3; 10], vec![8; 10], vec![13; 3]].concat(), "the last item has one element");
    }

    #[test]
    fn runs_are_filled_where_they_stand() {
        let mut out = vec![0; 10];
        fill_runs(&mut out, 4, |number, run| run.fill(number));
        assert_eq!(out, [0, 0, 0, 0, 1, 1, 1, 1, 2, 2]);
        change_runs(&mut out, 5, |number, run| run.fill(run.len() + number));
        assert_eq!(out, [5, 5, 5, 5, 5, 6, 6, 6, 6, 6]);
        fill(&mut out, |i| 3 * i);
        assert_eq!(out[9], 27);
    }
}
