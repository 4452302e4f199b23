//! What must hold of a hierarchy. What queries rely on for safety and for a bounded cost is checked whenever
//! one is loaded, what their answers rely on too when the whole file is compared with its checksums
//! ([`Check`](nearmiss_store::Check)), and all of it by [`PointHierarchy::sanity_check`].

mod flaw;
#[cfg(test)]
mod lies;
mod lists;
mod metadata;
mod nodes;
mod points;
mod samples;

use nearmiss_geometry::nalgebra::Vector3;

pub use flaw::Flaw;

use crate::build::PointHierarchy;
use crate::topology::Node;
use crate::topology::TREE_STACK;

/// Checks that the nodes form one tree over all points: each node is the child of one before it, splits its
/// points between its children, and no leaf has more than `leaf_size`. One pass.
pub(crate) fn check_topology(nodes: &[Node], points: usize, leaf_size: u32) -> Result<(), Flaw> {
    let bad = |node: usize| Err(Flaw::Node { node });
    let Some(root) = nodes.first() else { return bad(0) };
    if root.first != 0 || root.count as usize != points || points == 0 || !(4..=64).contains(&leaf_size) {
        return bad(0);
    }
    // In preorder the open right children are a stack; the next node is the left child or its top.
    let mut open = [(0_u32, 0_u32, 0_u32); TREE_STACK];
    let mut depth = 0;
    let mut expected = (root.first, root.count);
    for (id, node) in nodes.iter().enumerate() {
        if (node.first, node.count) != expected || node.count == 0 {
            return bad(id);
        }
        if node.is_leaf() {
            if node.count > leaf_size || node.first % leaf_size != 0 {
                return bad(id);
            }
            if depth == 0 {
                return if id + 1 == nodes.len() { Ok(()) } else { bad(id + 1) };
            }
            depth -= 1;
            let (right, first, count) = open[depth];
            if right as usize != id + 1 {
                return bad(id + 1);
            }
            expected = (first, count);
        } else {
            let left = nodes.get(id + 1).map_or(0, |left| left.count);
            if left == 0 || left >= node.count || depth == TREE_STACK - 2 {
                return bad(id);
            }
            open[depth] = (node.right, node.first + left, node.count - left);
            depth += 1;
            expected = (node.first, left);
        }
    }
    bad(nodes.len())
}

impl PointHierarchy {
    /// What queries need to stay within their arrays: lengths, tree, metadata, numbers of boxes in their
    /// ranges, and neighbour lists that are there. One pass over the nodes; the points are not read.
    pub(crate) fn check_structure(&self) -> Result<(), Flaw> {
        self.check_lengths()?;
        check_topology(&self.nodes, self.len(), self.leaf_size)?;
        self.check_metadata()?;
        nodes::check_ranges(&self.boxes)?;
        nodes::check_growths(&self.growths)?;
        nodes::check_growths(&self.obstacle_growths)?;
        samples::check_ranges(self)?;
        lists::check_ranges(&self.lists, self.listed.len())
    }

    /// What their answers need besides, given the structure: each box lies within its parent's, and every
    /// number of every point is one that a build writes, and lies within what its leaf says. One pass over
    /// the whole.
    pub(crate) fn check_contents(&self) -> Result<(), Flaw> {
        nodes::check(&self.nodes, &self.boxes)?;
        points::check(self)?;
        samples::check(self)?;
        lists::check(self)?;
        self.check_summary()
    }

    /// Checks every invariant: what a load checks, that each box of each node holds the discs of all points
    /// under it, that neighbour lists are complete, and that no point of the input is stored twice. O(n log
    /// n); for tests.
    ///
    /// # Errors
    /// Names the first that does not hold.
    pub fn sanity_check(&self) -> Result<(), Flaw> {
        let wrong = |what, index| Err(Flaw::Value { what, index });
        self.check_structure()?;
        self.check_contents()?;
        for (id, node) in self.nodes.iter().enumerate() {
            for i in node.points() {
                if self.boxes[id].reach < self.radii[i] {
                    return wrong("the reach of node", id);
                }
                if !self.box_holds(id, i) {
                    return wrong("the box of node", id);
                }
            }
        }
        lists::check_complete(self)?;
        let mut sources: Vec<u32> = self.source.to_vec();
        sources.sort_unstable();
        match sources.windows(2).find(|two| two[0] == two[1]) {
            Some(two) => wrong("the place in the input, stored twice,", two[0] as usize),
            None => Ok(()),
        }
    }

    /// Whether the box of node `id` holds the disc and the ball of point `i`.
    fn box_holds(&self, id: usize, i: usize) -> bool {
        let bounds = &self.boxes[id];
        let double = |v: [f32; 3]| Vector3::from(v.map(f64::from));
        let d = double(self.positions[i]) - double(bounds.centre);
        let ball = f64::from(self.slices().ball(i).max(self.slices().obstacle_ball(i)));
        (0..3).all(|k| {
            let axis = double(bounds.axes[k]);
            let spread = f64::from(self.discs[i]) * double(self.normals[i]).cross(&axis).norm();
            d.dot(&axis).abs() + spread.max(ball) <= f64::from(bounds.half[k])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree() -> Vec<Node> {
        let node = |first, count, right| Node { first, count, right };
        vec![node(0, 40, 4), node(0, 32, 3), node(0, 16, 0), node(16, 16, 0), node(32, 8, 0)]
    }

    #[test]
    fn a_tree_over_all_points_is_accepted() {
        assert_eq!(check_topology(&tree(), 40, 16), Ok(()));
        assert_eq!(check_topology(&[Node { first: 0, count: 9, right: 0 }], 9, 16), Ok(()));
    }

    #[test]
    fn every_other_value_of_every_field_is_refused() {
        for id in 0..5 {
            for value in [0, 1, 2, 3, 4, 5, 8, 16, 17, 32, 40, u32::MAX] {
                for field in 0..3 {
                    let mut nodes = tree();
                    let slot = match field {
                        0 => &mut nodes[id].first,
                        1 => &mut nodes[id].count,
                        _ => &mut nodes[id].right,
                    };
                    if *slot != value {
                        *slot = value;
                        let verdict = check_topology(&nodes, 40, 16);
                        assert!(verdict.is_err(), "node {id}, field {field} = {value}");
                    }
                }
            }
        }
        assert!(check_topology(&tree()[..4], 40, 16).is_err(), "a node short");
        assert!(check_topology(&tree(), 41, 16).is_err(), "a point more");
        assert!(check_topology(&[], 0, 16).is_err(), "no node at all");
    }
}
