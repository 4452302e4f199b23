//! Positions side by side, for nearest-distance queries.

use nearmiss_lanes::vector::dot;

use crate::tree::topology::MOST_LEAF_POINTS;

/// The number of samples processed together.
pub(crate) const WIDTH: usize = 16;

/// Positions side by side; unused lanes are infinitely far away.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Centres {
    blocks: [[[f32; WIDTH]; 3]; MOST_LEAF_POINTS / WIDTH],
    len: usize,
}

impl Default for Centres {
    fn default() -> Self {
        Self { blocks: [[[f32::INFINITY; WIDTH]; 3]; MOST_LEAF_POINTS / WIDTH], len: 0 }
    }
}

impl Centres {
    /// Adds a position. There must be a free lane.
    #[inline]
    pub(crate) fn push(&mut self, p: [f32; 3]) {
        let (block, lane) = (self.len / WIDTH, self.len % WIDTH);
        for (lanes, x) in self.blocks[block].iter_mut().zip(p) {
            lanes[lane] = x;
        }
        self.len += 1;
    }

    #[inline]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = [f32; 3]> {
        (0..self.len).map(|i| self.get(i))
    }

    #[inline(always)]
    pub(crate) fn get(&self, i: usize) -> [f32; 3] {
        let [x, y, z] = &self.blocks[i / WIDTH];
        [x[i % WIDTH], y[i % WIDTH], z[i % WIDTH]]
    }

    #[inline(always)]
    pub(crate) fn blocks(&self) -> &[[[f32; WIDTH]; 3]] {
        &self.blocks[..self.len.div_ceil(WIDTH)]
    }

    /// Returns the squared distance of the nearest position, or infinity without positions.
    #[inline(always)]
    pub(crate) fn nearest_sq(&self, p: [f32; 3]) -> f32 {
        let mut least = [f32::INFINITY; WIDTH];
        for [x, y, z] in self.blocks() {
            for i in 0..WIDTH {
                let d = [x[i] - p[0], y[i] - p[1], z[i] - p[2]];
                let d_sq = dot(d, d);
                least[i] = if d_sq < least[i] { d_sq } else { least[i] };
            }
        }
        fold_min(&least)
    }
}

#[inline(always)]
pub(crate) fn fold_min(lanes: &[f32; WIDTH]) -> f32 {
    let mut least = *lanes;
    let mut width = WIDTH / 2;
    while width > 0 {
        for i in 0..width {
            least[i] = if least[i] < least[i + width] { least[i] } else { least[i + width] };
        }
        width /= 2;
    }
    least[0]
}
