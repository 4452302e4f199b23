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
