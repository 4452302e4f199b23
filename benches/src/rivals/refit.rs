//! Refitting of a hierarchy of boxes, bottom up, in flat arrays.

/// Points of a leaf.
const LEAF: usize = 8;

/// The least coordinates of a box and the negated greatest ones, so that the union of two boxes is
/// the least of each number. The last two numbers are unused.
type Extremes = [f32; 8];

/// A complete binary tree of boxes over leaves of eight points. Node i has the children 2i and
/// 2i + 1, so a refit is one pass over the leaves and one pass over the nodes.
#[derive(Debug, Clone)]
pub struct FlatTree {
    /// The points in the order of the leaves.
    order: Vec<u32>,
    boxes: Vec<Extremes>,
    first_leaf: usize,
}

impl FlatTree {
    /// Creates a tree over points in this order, which should be that of a spatial tree.
    #[must_use]
    pub fn new(order: Vec<u32>) -> Self {
        let leaves = order.len().div_ceil(LEAF).max(1).next_power_of_two();
        Self { order, boxes: vec![[f32::INFINITY; 8]; 2 * leaves], first_leaf: leaves }
    }

    /// Computes all boxes from positions in single precision; returns that of the root as least and
    /// greatest coordinates.
    pub fn refit(&mut self, positions: &[[f32; 4]]) -> [[f32; 3]; 2] {
        let (nodes, leaves) = self.boxes.split_at_mut(self.first_leaf);
        for (points, leaf) in self.order.chunks(LEAF).zip(&mut *leaves) {
            let mut extremes = [f32::INFINITY; 8];
            for &point in points {
                let p = positions[point as usize];
                for k in 0..4 {
                    extremes[k] = extremes[k].min(p[k]);
                    extremes[4 + k] = extremes[4 + k].min(-p[k]);
                }
            }
            *leaf = extremes;
        }
        let mut below: &[Extremes] = leaves;
        let mut above = nodes;
        while above.len() > 1 {
            let (rest, level) = above.split_at_mut(above.len() / 2);
            for (node, children) in level.iter_mut().zip(below.chunks_exact(2)) {
                *node = std::array::from_fn(|k| children[0][k].min(children[1][k]));
            }
            below = level;
            above = rest;
        }
        let root = &below[0];
        [[root[0], root[1], root[2]], [-root[4], -root[5], -root[6]]]
    }

    /// The number of nodes that a refit computes.
    #[must_use]
    pub fn nodes(&self) -> usize {
        2 * self.order.len().div_ceil(LEAF) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_contains_all_points_tightly() {
        for count in [1, 7, 8, 9, 64, 100, 1000_u16] {
            let positions: Vec<[f32; 4]> =
                (0..count).map(|i| [f32::from(i), -f32::from(i) - 1.0, f32::from(i % 7), 0.0]).collect();
            let mut tree = FlatTree::new((0..u32::from(count)).collect());
            let last = f32::from(count - 1);
            let expected = [[0.0, -last - 1.0, 0.0], [last, -1.0, last.min(6.0)]];
            assert_eq!(tree.refit(&positions), expected, "{count} points");
        }
    }
}
