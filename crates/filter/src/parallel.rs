//! The same work on one thread or on all of them.

/// Returns `work` of each number below `count`, in order. `scratch` is made anew now and then, and must not
/// change a result.
#[cfg(feature = "rayon")]
pub(crate) fn map_with<S, T: Send>(
    count: usize,
    scratch: impl Fn() -> S + Sync + Send,
    work: impl Fn(&mut S, usize) -> T + Sync + Send,
) -> Vec<T> {
    use rayon::prelude::*;
    (0..count).into_par_iter().map_init(scratch, work).collect()
}

/// Returns `work` of each number below `count`, in order.
#[cfg(not(feature = "rayon"))]
pub(crate) fn map_with<S, T: Send>(
    count: usize,
    scratch: impl Fn() -> S + Sync + Send,
    work: impl Fn(&mut S, usize) -> T + Sync + Send,
) -> Vec<T> {
    let mut scratch = scratch();
    (0..count).map(|i| work(&mut scratch, i)).collect()
}

/// Sorts values that are all different.
#[cfg(feature = "rayon")]
pub(crate) fn sort<T: Ord + Send>(values: &mut [T]) {
    use rayon::prelude::*;
    values.par_sort_unstable();
}

/// Sorts values that are all different.
#[cfg(not(feature = "rayon"))]
pub(crate) fn sort<T: Ord + Send>(values: &mut [T]) {
    values.sort_unstable();
}
