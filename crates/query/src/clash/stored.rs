//! The positions in storage of the points and triangles of contacts.

use crate::ask::answer::Contact;
use crate::pair::placed::Placed;

/// Returns the indices of the stored points of both scans for each contact.
pub(crate) fn stored(views: [&Placed<'_>; 2], contacts: &[Contact]) -> Vec<[usize; 2]> {
    let [of_a, of_b] = [0, 1].map(|side| stored_of(views[side], contacts, side));
    of_a.into_iter().zip(of_b).map(|(a, b)| [a, b]).collect()
}

/// Returns the index of the stored point of scan `side` for each contact.
pub(crate) fn stored_of(view: &Placed<'_>, contacts: &[Contact], side: usize) -> Vec<usize> {
    positions(view.scan().source(), || contacts.iter().map(|contact| contact.sources[side].0))
}

/// Returns the position of each id in `source`, or 0 for ids that are not there.
pub(crate) fn positions<I: Iterator<Item = u32>>(source: &[u32], ids: impl Fn() -> I) -> Vec<usize> {
    let mut wanted: Vec<u32> = ids().collect();
    wanted.sort_unstable();
    wanted.dedup();
    // One pass over the source, and memory for the contacts only: a scan may exceed memory.
    let mut stored = vec![0; wanted.len()];
    for (i, id) in source.iter().enumerate() {
        if let Ok(at) = wanted.binary_search(id) {
            stored[at] = i;
        }
    }
    ids().map(|id| wanted.binary_search(&id).map_or(0, |at| stored[at])).collect()
}

/// Returns the numbers of the leaves that hold two stored points.
pub(crate) fn leaves(views: [&Placed<'_>; 2], points: [usize; 2]) -> [usize; 2] {
    [0, 1].map(|side| views[side].scan().arrays().leaves.leaf_of(points[side]))
}
