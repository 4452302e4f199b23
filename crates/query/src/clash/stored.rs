//! The positions in storage of the points of contacts.

use crate::ask::answer::Contact;
use crate::pair::placed::Placed;

/// Returns the indices of the stored points of both scans for each contact.
pub(crate) fn stored(views: [&Placed<'_>; 2], contacts: &[Contact]) -> Vec<[usize; 2]> {
    let [of_a, of_b] = [0, 1].map(|side| stored_of(views[side], contacts, side));
    of_a.into_iter().zip(of_b).map(|(a, b)| [a, b]).collect()
}

fn stored_of(view: &Placed<'_>, contacts: &[Contact], side: usize) -> Vec<usize> {
    let sources = || contacts.iter().map(|contact| contact.sources[side].0);
    let mut wanted: Vec<u32> = sources().collect();
    wanted.sort_unstable();
    wanted.dedup();
    // One pass over the points, and memory for the contacts only: a scan may exceed memory.
    let mut stored = vec![0; wanted.len()];
    for (i, id) in view.scan().source().iter().enumerate() {
        if let Ok(at) = wanted.binary_search(id) {
            stored[at] = i;
        }
    }
    sources().map(|id| wanted.binary_search(&id).map_or(0, |at| stored[at])).collect()
}

/// Returns the numbers of the leaves that hold two stored points.
pub(crate) fn leaves(views: [&Placed<'_>; 2], points: [usize; 2]) -> [usize; 2] {
    [0, 1].map(|side| views[side].scan().arrays().leaves.leaf_of(points[side]))
}
