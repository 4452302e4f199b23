//! Refitting of a hierarchy of boxes, bottom up, in flat arrays.

/// The least coordinates of a box and the negated greatest ones, so that the union of two boxes is
/// the least of each number. The last two numbers are unused.
type Extremes = [f32; 8];

/// A complete binary tree of boxes over leaves of points or triangles. Each level is an array of its
/// own, so a refit is one pass over the leaves and one pass over each level.
#[derive(Debug, Clone)]
pub struct FlatTree {
    /// The points of the leaves.
    corners: Vec<u32>,
    per_leaf: usize,
    boxes: Vec<Extremes>,
    first_leaf: usize,
}

impl FlatTree {
    /// Creates a tree over points, or corners of triangles, in this order, which should be that of
    /// a spatial tree, with `per_leaf` of them in each leaf.
    #[must_use]
    pub fn new(corners: Vec<u32>, per_leaf: usize) -> Self {
        let leaves = corners.len().div_ceil(per_leaf).max(1).next_power_of_two();
        Self { corners, per_leaf, boxes: vec![[f32::INFINITY; 8]; 2 * leaves], first_leaf: leaves }
    }

    /// Computes all boxes from positions in single precision; returns that of the root as least and
    /// greatest coordinates.
    pub fn refit(&mut self, positions: &[[f32; 4]]) -> [[f32; 3]; 2] {
        let (nodes, leaves) = self.boxes.split_at_mut(self.first_leaf);
        for (points, leaf) in self.corners.chunks(self.per_leaf).zip(&mut *leaves) {
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_root_contains_all_points_tightly() {
        for count in [1, 7, 8, 9, 64, 100, 1000_u16] {
            let positions: Vec<[f32; 4]> =
                (0..count).map(|i| [f32::from(i), -f32::from(i) - 1.0, f32::from(i % 7), 0.0]).collect();
            let mut tree = FlatTree::new((0..u32::from(count)).collect(), 8);
            let last = f32::from(count - 1);
            let expected = [[0.0, -last - 1.0, 0.0], [last, -1.0, last.min(6.0)]];
            assert_eq!(tree.refit(&positions), expected, "{count} points");
        }
    }
}
