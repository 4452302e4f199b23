//! Work on all cores, whose results come in order.

use std::ops::Range;

/// Items that a thread works on at once: enough to hide the hand-over.
const ITEMS_A_TASK: usize = 1024;

/// `f` of consecutive ranges that make up `0..count`, in order, on all cores where there are several.
pub(crate) fn ranges<R: Send>(count: usize, f: impl Fn(Range<usize>) -> R + Sync + Send) -> Vec<R> {
    let tasks = count.div_ceil(ITEMS_A_TASK);
    let range = |task: usize| task * ITEMS_A_TASK..((task + 1) * ITEMS_A_TASK).min(count);
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        (0..tasks).into_par_iter().map(|task| f(range(task))).collect()
    }
    #[cfg(not(feature = "rayon"))]
    (0..tasks).map(|task| f(range(task))).collect()
}

/// `f` of each of `0..count`, in order.
pub(crate) fn map<R: Send>(count: usize, f: impl Fn(usize) -> R + Sync + Send) -> Vec<R> {
    ranges(count, |range| range.map(&f).collect::<Vec<R>>()).into_iter().flatten().collect()
}

/// As [`ranges`], `length` items each but the last, with scratch that a thread makes once for several of
/// them.
pub(crate) fn ranges_with<S, R: Send>(
    count: usize,
    length: usize,
    scratch: impl Fn() -> S + Sync + Send,
    f: impl Fn(&mut S, Range<usize>) -> R + Sync + Send,
) -> Vec<R> {
    let range = |k: usize| k * length..((k + 1) * length).min(count);
    let tasks = 0..count.div_ceil(length);
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        tasks.into_par_iter().map_init(scratch, |scratch, k| f(scratch, range(k))).collect()
    }
    #[cfg(not(feature = "rayon"))]
    {
        let mut scratch = scratch();
        tasks.map(|k| f(&mut scratch, range(k))).collect()
    }
}

/// `f` of every item.
pub(crate) fn for_each<T: Send>(items: Vec<T>, f: impl Fn(T) + Sync + Send) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        items.into_par_iter().for_each(f);
    }
    #[cfg(not(feature = "rayon"))]
    items.into_iter().for_each(f);
}

/// What both give, each on a core of its own where there are several.
pub(crate) fn both<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    #[cfg(feature = "rayon")]
    return rayon::join(a, b);
    #[cfg(not(feature = "rayon"))]
    (a(), b())
}
