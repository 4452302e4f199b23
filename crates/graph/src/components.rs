//! Connected components.

use crate::adjacency::Adjacency;

/// Returns for each point the least point of its component, and the number of components.
#[expect(clippy::cast_possible_truncation, reason = "there are fewer than 2^32 points")]
pub(crate) fn components(graph: &Adjacency) -> (Vec<u32>, usize) {
    // Roots are the least points of their sets, so a parent is never greater than its child.
    let mut parents: Vec<u32> = (0..graph.len() as u32).collect();
    for i in 0..graph.len() {
        for &j in graph.of(i).iter().take_while(|&&j| (j as usize) < i) {
            let (a, b) = (root(&mut parents, i as u32), root(&mut parents, j));
            let (least, other) = (a.min(b), a.max(b));
            parents[other as usize] = least;
        }
    }
    let mut count = 0;
    for i in 0..graph.len() {
        let parent = parents[i] as usize;
        // The parent comes first, so its root is already known.
        parents[i] = parents[parent];
        count += usize::from(parent == i);
    }
    (parents, count)
}

/// Returns the root of `i`, with path halving.
fn root(parents: &mut [u32], mut i: u32) -> u32 {
    while parents[i as usize] != i {
        let grandparent = parents[parents[i as usize] as usize];
        parents[i as usize] = grandparent;
        i = grandparent;
    }
    i
}
