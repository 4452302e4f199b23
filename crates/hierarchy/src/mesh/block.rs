//! The triangles of a leaf, side by side in lanes.

use bytemuck::{Pod, Zeroable};
use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4};

use crate::tree::topology::FAN;
use crate::tree::wide::{Lanes, rows};

/// The number of triangles in a full leaf: the pairs of two leaves fill sixteen lanes.
pub const LEAF_TRIANGLES: usize = FAN;

/// The corners of up to four triangles in the stored frame, in single precision. Unused lanes
/// repeat the first triangle.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct TriangleBlock {
    /// By corner, coordinate and triangle.
    corners: [[Lanes; 3]; 3],
}

impl TriangleBlock {
    /// A block of one to four triangles.
    pub(crate) fn new(triangles: &[[[f32; 3]; 3]]) -> Self {
        let mut corners = [[[0.0; FAN]; 3]; 3];
        for lane in 0..FAN {
            let triangle = triangles.get(lane).unwrap_or(&triangles[0]);
            for (rows, corner) in corners.iter_mut().zip(triangle) {
                for (row, coordinate) in rows.iter_mut().zip(corner) {
                    row[lane] = *coordinate;
                }
            }
        }
        Self { corners }
    }

    /// Returns the corners of the triangle in a lane.
    pub(crate) fn get(&self, lane: usize) -> [[f32; 3]; 3] {
        self.corners.map(|corner| corner.map(|row| row[lane]))
    }

    /// Loads the corners, one triangle in each lane.
    #[inline(always)]
    #[must_use]
    pub fn load<S: Simd>(&self, simd: S) -> [[f32x4<S>; 3]; 3] {
        let [a, b, c] = &self.corners;
        [rows(simd, a), rows(simd, b), rows(simd, c)]
    }

    /// Returns the least and the greatest coordinate of the triangles along each axis.
    #[inline(always)]
    pub(crate) fn extents<S: Simd>(
        &self,
        simd: S,
        axes: &[[f32; 3]; 3],
        [low, high]: &mut [[f32x4<S>; 3]; 2],
    ) {
        for [x, y, z] in self.load(simd) {
            for k in 0..3 {
                let along = x * axes[k][0] + y * axes[k][1] + z * axes[k][2];
                (low[k], high[k]) = (low[k].min(along), high[k].max(along));
            }
        }
    }
}
