//! What must hold of a hierarchy: the part that queries rely on for safety is checked whenever one is loaded,
//! all of it by [`PointHierarchy::sanity_check`].

use thiserror::Error;

use nearmiss_geometry::nalgebra::Vector3;

use crate::boxes::dot;
use crate::build::PointHierarchy;
use crate::gather::TREE_STACK;
use crate::topology::Node;

/// What is wrong with a hierarchy.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Flaw {
    /// Two arrays do not fit each other.
    #[error("{array} has {found} entries where {expected} belong; prepare the scan again")]
    Length {
        /// Which array.
        array: &'static str,
        /// How many entries it has.
        found: usize,
        /// How many it should have.
        expected: usize,
    },
    /// A node's children or points are not there, or not its own.
    #[error("node {node} is not a node of this tree; prepare the scan again")]
    Node {
        /// Its id.
        node: usize,
    },
    /// A number contradicts what it says about others.
    #[error("{what} of entry {index} is wrong")]
    Value {
        /// Which number.
        what: &'static str,
        /// Whose.
        index: usize,
    },
}

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
    /// Checks every invariant, those included that only the quality of answers rests on. O(n log n); for tests.
    ///
    /// # Errors
    /// Names the first that does not hold.
    pub fn sanity_check(&self) -> Result<(), Flaw> {
        let wrong = |what, index| Err(Flaw::Value { what, index });
        check_topology(&self.nodes, self.len(), self.leaf_size)?;
        for i in 0..self.len() {
            let (n, r) = (self.normals[i], self.radii[i]);
            if (dot(n, n) - 1.0).abs() > 1e-5 {
                return wrong("normal", i);
            }
            if !(r > 0.0 && r.is_finite()) {
                return wrong("radius", i);
            }
            if !(self.discs[i] > 0.0 && self.discs[i] <= r) {
                return wrong("disc", i);
            }
            let cone = &self.cones[i / self.leaf_size as usize];
            if dot(n, cone.axis) < cone.cosine - 1e-5 || !(-1e-5..=1.0 + 1e-5).contains(&cone.cosine) {
                return wrong("cone", i / self.leaf_size as usize);
            }
        }
        for (id, node) in self.nodes.iter().enumerate() {
            for i in node.points() {
                if self.boxes[id].reach < self.radii[i] {
                    return wrong("reach", id);
                }
                if !self.box_holds_disc(id, i) {
                    return wrong("box", id);
                }
            }
        }
        Ok(())
    }

    fn box_holds_disc(&self, id: usize, i: usize) -> bool {
        let bounds = &self.boxes[id];
        let double = |v: [f32; 3]| Vector3::from(v.map(f64::from));
        let d = double(self.positions[i]) - double(bounds.centre);
        (0..3).all(|k| {
            let axis = double(bounds.axes[k]);
            let spread = f64::from(self.discs[i]) * double(self.normals[i]).cross(&axis).norm();
            d.dot(&axis).abs() + spread <= f64::from(bounds.half[k])
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
