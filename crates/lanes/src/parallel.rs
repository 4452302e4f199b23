//! The same work on one thread, or with the feature `rayon` on all threads of the current pool. Results come
//! in order, so they are the same on any number of threads.

use std::ops::Range;

/// Items of a microsecond or less that a thread takes at once: enough to hide the hand-over.
const AT_ONCE: usize = 1024;

/// `f` of each number below `count`: light work, many at once.
pub fn map<R: Send>(count: usize, f: impl Fn(usize) -> R + Sync + Send) -> Vec<R> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().with_min_len(AT_ONCE).map(f).collect()
    }
    #[cfg(not(feature = "rayon"))]
    (0..count).map(f).collect()
}

/// `f` of each item: light work, many at once.
pub fn map_all<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync + Send) -> Vec<R> {
    map(items.len(), |i| f(&items[i]))
}

/// `f` of some items at a time: heavy work.
pub fn chunks<T: Sync, R: Send>(items: &[T], f: impl Fn(&[T]) -> R + Sync + Send) -> Vec<R> {
    const LENGTH: usize = 16;
    ranges_with(items.len(), LENGTH, || (), |(), range| f(&items[range]))
}

/// `f` of each number below `count`: heavy work, one by one.
pub fn map_each<R: Send>(count: usize, f: impl Fn(usize) -> R + Sync + Send) -> Vec<R> {
    map_with(count, || (), |(), i| f(i))
}

/// `f` of each number below `count`, with scratch that is made now and then and must not change a result.
pub fn map_with<S, R: Send>(
    count: usize,
    scratch: impl Fn() -> S + Sync + Send,
    f: impl Fn(&mut S, usize) -> R + Sync + Send,
) -> Vec<R> {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().map_init(scratch, f).collect()
    }
    #[cfg(not(feature = "rayon"))]
    {
        let mut scratch = scratch();
        (0..count).map(|i| f(&mut scratch, i)).collect()
    }
}

/// `f` of consecutive ranges of some thousand numbers that make up `0..count`.
pub fn ranges<R: Send>(count: usize, f: impl Fn(Range<usize>) -> R + Sync + Send) -> Vec<R> {
    ranges_with(count, AT_ONCE, || (), |(), range| f(range))
}

/// As [`ranges`], each `length` long but the last, with scratch that is made now and then and must not change
/// a result.
pub fn ranges_with<S, R: Send>(
    count: usize,
    length: usize,
    scratch: impl Fn() -> S + Sync + Send,
    f: impl Fn(&mut S, Range<usize>) -> R + Sync + Send,
) -> Vec<R> {
    let range = |k: usize| k * length..((k + 1) * length).min(count);
    map_with(count.div_ceil(length), scratch, |scratch, k| f(scratch, range(k)))
}

/// Runs that wait to be taken by [`in_order`], at most.
const WAVE: usize = 1 << 12;

/// `f` of consecutive runs of numbers that make up `0..count`: heavy work. `take` gets what it gives, in
/// order, and soon: never more than some thousand results exist.
pub fn in_order<R: Send>(count: usize, f: impl Fn(Range<usize>) -> R + Sync + Send, mut take: impl FnMut(R)) {
    const LENGTH: usize = 16;
    let runs = count.div_ceil(LENGTH);
    let run = |k: usize| f(k * LENGTH..((k + 1) * LENGTH).min(count));
    for wave in (0..runs).step_by(WAVE) {
        map_each(WAVE.min(runs - wave), |k| run(wave + k)).into_iter().for_each(&mut take);
    }
}

/// Sets the items of `out` to what `f` gives of consecutive runs of numbers that make up `0..count`, one
/// after the other: heavy work.
///
/// # Panics
/// When it gives more items than there are.
pub fn collect_into<T: Copy + Send>(
    out: &mut [T],
    count: usize,
    f: impl Fn(Range<usize>) -> Vec<T> + Sync + Send,
) {
    let mut next = 0;
    in_order(count, f, |some| {
        out[next..next + some.len()].copy_from_slice(&some);
        next += some.len();
    });
}

/// Sets every item of `out` to `f` of its number: light work, many at once.
pub fn fill<T: Send>(out: &mut [T], f: impl Fn(usize) -> T + Sync + Send) {
    change_each(out, AT_ONCE, |i, item| *item = f(i));
}

/// `f` of consecutive runs of `length` items where they stand, with their numbers: light work, many at once.
pub fn fill_runs<T: Send>(out: &mut [T], length: usize, f: impl Fn(usize, &mut [T]) + Sync + Send) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        let runs = out.par_chunks_mut(length).with_min_len(AT_ONCE).enumerate();
        runs.for_each(|(number, run)| f(number, run));
    }
    #[cfg(not(feature = "rayon"))]
    out.chunks_mut(length).enumerate().for_each(|(number, run)| f(number, run));
}

/// `f` of every item.
pub fn for_each<T: Send>(items: Vec<T>, f: impl Fn(T) + Sync + Send) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        items.into_par_iter().for_each(f);
    }
    #[cfg(not(feature = "rayon"))]
    items.into_iter().for_each(f);
}

/// `f` of every item where it stands, with its number. A thread takes `at_once` or more of them.
pub fn change_each<T: Send>(all: &mut [T], at_once: usize, f: impl Fn(usize, &mut T) + Sync + Send) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        all.par_iter_mut().with_min_len(at_once).enumerate().for_each(|(i, one)| f(i, one));
    }
    #[cfg(not(feature = "rayon"))]
    {
        let _ = at_once;
        all.iter_mut().enumerate().for_each(|(i, one)| f(i, one));
    }
}

/// `f` of every pair of items where they stand, with its number. A thread takes `at_once` or more of them.
pub fn change_both<A: Send, B: Send>(
    a: &mut [A],
    b: &mut [B],
    at_once: usize,
    f: impl Fn(usize, &mut A, &mut B) + Sync + Send,
) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        let all = a.par_iter_mut().zip(b).with_min_len(at_once).enumerate();
        all.for_each(|(i, (a, b))| f(i, a, b));
    }
    #[cfg(not(feature = "rayon"))]
    {
        let _ = at_once;
        a.iter_mut().zip(b).enumerate().for_each(|(i, (a, b))| f(i, a, b));
    }
}

/// What both give, each on a thread of its own where there are several.
pub fn both<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    #[cfg(feature = "rayon")]
    return rayon::join(a, b);
    #[cfg(not(feature = "rayon"))]
    (a(), b())
}

/// Sorts values that are all different.
pub fn sort<T: Ord + Send>(values: &mut [T]) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        values.par_sort_unstable();
    }
    #[cfg(not(feature = "rayon"))]
    values.sort_unstable();
}

/// `work` on so many threads, or on those of the current pool if that is 0. Without the feature `rayon` there
/// is one.
///
/// # Errors
/// When so many threads cannot be started.
pub fn on_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> Result<R, NoThreads> {
    #[cfg(feature = "rayon")]
    if threads > 0 {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        return Ok(pool.or(Err(NoThreads))?.install(work));
    }
    let _ = threads;
    Ok(work())
}

/// The threads asked for cannot be started.
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
            |range| range,
            |range: Range<usize>| {
                assert_eq!(range.start, next, "no run is left out");
                next = range.end;
            },
        );
        assert_eq!(next, count);
        let mut out = vec![0; 100];
        collect_into(&mut out, 50, |range| range.flat_map(|i| [2 * i, 2 * i + 1]).collect());
        assert_eq!(out, (0..100).collect::<Vec<_>>());
        in_order(0, |_| (), |()| unreachable!("there is nothing to do"));
    }

    #[test]
    fn runs_are_filled_where_they_stand() {
        let mut out = vec![0; 10];
        fill_runs(&mut out, 4, |number, run| run.fill(number));
        assert_eq!(out, [0, 0, 0, 0, 1, 1, 1, 1, 2, 2]);
        fill(&mut out, |i| 3 * i);
        assert_eq!(out[9], 27);
    }
}
