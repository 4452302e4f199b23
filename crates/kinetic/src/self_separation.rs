//! `SelfSeparationList`: continuous collision detection of a kinetic tree with itself.

use crate::error::KineticError;
use crate::separation::{FirstContact, SeparationList, Trees};
use crate::tree::KineticTree;

/// The node pairs of one kinetic tree that are apart, as [`SeparationList`] has those of two: which
/// primitives of a deforming thing meet each other.
///
/// Each pair of primitives counts once. Primitives with common points, such as neighbouring triangles
/// of a mesh, always overlap; it is for the caller to leave them out.
///
/// ```
/// use nearmiss_kinetic::{FlightPlan, KineticTree, SelfSeparationList};
///
/// // Three points on a line; the first two move towards each other.
/// let plans = [(0.0, 1.0), (4.0, -1.0), (9.0, 0.0)]
///     .map(|(x, speed)| FlightPlan::linear(0.0, [x, 0.0, 0.0], [speed, 0.0, 0.0]).unwrap());
/// let mut tree = KineticTree::of_points(0.0, plans.to_vec())?;
/// let mut list = SelfSeparationList::new();
/// list.advance(&mut tree, 2.0)?;
/// let mut found = Vec::new();
/// list.for_each_overlap(&tree, |i, j| found.push([i, j]));
/// assert_eq!(found, [[0, 1]]);
/// # Ok::<(), nearmiss_kinetic::KineticError>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct SelfSeparationList(SeparationList);

impl SelfSeparationList {
    /// Creates a list. The first call compares the tree with itself from its root.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Returns the number of events of the list so far: pairs that met or parted.
    #[must_use]
    pub const fn events(&self) -> u64 {
        self.0.events()
    }

    /// Returns the number of pairs that are apart, and of leaf pairs that meet, each leaf with itself
    /// among them. Looks at all pairs.
    #[must_use]
    pub fn pair_counts(&self) -> [usize; 2] {
        self.0.pair_counts()
    }

    /// Advances the tree and the list to `time`, in seconds.
    ///
    /// # Errors
    /// [`KineticError::Past`] if `time` is before the clock of the tree, [`KineticError::Number`] if it is
    /// not finite.
    pub fn advance(&mut self, tree: &mut KineticTree, time: f64) -> Result<(), KineticError> {
        self.0.advance_trees(&mut Trees::One(tree), time)
    }

    /// Advances the tree and the list to the earliest time, up to `until`, at which two primitives meet,
    /// and returns it; to `until` if none do. `narrow` decides about two primitives, as in
    /// [`SeparationList::next_contact`].
    ///
    /// # Errors
    /// As [`advance`](Self::advance).
    pub fn next_contact(
        &mut self,
        tree: &mut KineticTree,
        until: f64,
        mut narrow: impl FnMut(&KineticTree, [u32; 2], [f64; 2]) -> Option<f64>,
    ) -> Result<Option<FirstContact>, KineticError> {
        let mut narrow = |[tree, _]: [&KineticTree; 2], pair, span| narrow(tree, pair, span);
        self.0.next_contact_of(&mut Trees::One(tree), until, &mut narrow)
    }

    /// Calls `visit` with each pair of primitives whose boxes now have a point in common, after a
    /// call of [`advance`](Self::advance) or [`next_contact`](Self::next_contact) with this tree.
    pub fn for_each_overlap(&self, tree: &KineticTree, mut visit: impl FnMut(u32, u32)) {
        self.any_overlap(tree, |i, j| {
            visit(i, j);
            false
        });
    }

    /// Returns `true` if `found` does for one of the pairs that [`for_each_overlap`](Self::for_each_overlap)
    /// visits. Calls it for none after that.
    pub fn any_overlap(&self, tree: &KineticTree, found: impl FnMut(u32, u32) -> bool) -> bool {
        self.0.has_overlap([tree; 2], true, found)
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};

    use super::*;
    use crate::plan::FlightPlan;

    /// The primitives under a node.
    fn under(tree: &KineticTree, node: u32, found: &mut Vec<u32>) {
        let link = tree.nodes.link(node);
        if link.is_leaf() {
            return found.extend(tree.nodes.primitives_of(node));
        }
        (0..2).for_each(|k| under(tree, link.children + k, found));
    }

    /// Checks that the pairs of a list cover every two primitives once, and are apart as they claim.
    fn check_own(list: &SelfSeparationList, tree: &KineticTree) {
        let mut covered = Vec::new();
        list.0.pairs.for_each(|nodes, meets| {
            let [a, b] = nodes.map(|node| tree.node_box(node));
            let overlaps = (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k]);
            assert_eq!(overlaps, meets, "nodes {nodes:?}");
            let mut of = [Vec::new(), Vec::new()];
            (0..2).for_each(|k| under(tree, nodes[k], &mut of[k]));
            for (n, i) in of[0].iter().enumerate() {
                let others = if nodes[0] == nodes[1] { &of[1][n + 1..] } else { &of[1][..] };
                covered.extend(others.iter().map(|j| [*i.min(j), *i.max(j)]));
            }
        });
        covered.sort_unstable();
        let count = u32::try_from(tree.len()).unwrap();
        let expected: Vec<[u32; 2]> = (0..count).flat_map(|i| (i + 1..count).map(move |j| [i, j])).collect();
        assert!(covered == expected, "{} of {} pairs", covered.len(), expected.len());
    }

    #[test]
    fn pairs_of_one_tree_cover_every_two_primitives_once() {
        let rng = &mut rng(7);
        for count in [1, 2, 5, 40, 150] {
            let plan = |rng: &mut _| FlightPlan::linear(0.0, point_in(rng, 1.0), unit_vector(rng)).unwrap();
            let plans: Vec<_> = (0..count).map(|_| plan(rng)).collect();
            let mut tree = KineticTree::of_points(0.0, plans).unwrap();
            let mut list = SelfSeparationList::new();
            for step in 0..30_u32 {
                let time = 0.05 * f64::from(step);
                list.advance(&mut tree, time).unwrap();
                check_own(&list, &tree);
                if step % 10 == 9 {
                    tree.set_plan(0, FlightPlan::linear(time, point_in(rng, 1.0), unit_vector(rng)).unwrap())
                        .unwrap();
                    list.advance(&mut tree, time).unwrap();
                    check_own(&list, &tree);
                }
            }
            assert!(count < 150 || list.events() > 100, "{} events", list.events());
        }
    }
}
