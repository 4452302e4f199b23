//! The points of a leaf of the scan against the triangles of a leaf of the mesh: gaps, and the
//! nearest point and triangle.

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{NodePair, Part};
use nearmiss_index::PointBlock;
use nearmiss_lanes::wide::{Bits, blocks_of, lanes_of};
use nearmiss_mesh::{Corners, nearest_on_triangle};

use crate::leaf::point_gap::near_box;
use crate::mesh_scan::mesh_scan_pair::MeshScanPairing;
use crate::mesh_scan::triangle_lanes::LeafTriangles;
use crate::pair::pairing::ItemPair;

const WIDTH: usize = PointBlock::WIDTH;

/// The cost of a point and a triangle in double precision, in node pairs.
const EXACT: u64 = 2;

impl MeshScanPairing<'_> {
    /// A lower bound on the distance of two leaves: of each triangle from the enclosure of the points and,
    /// for obstacles, from the parts of the points.
    pub(crate) fn gap_of_two_leaves(&self, pair: NodePair) -> f32 {
        let leaf = self.b.tree.topology().leaf_number(pair.b);
        let (triangles, lanes) = (self.triangles(leaf), self.lanes(leaf).0);
        let enclosure = self.a.tree.enclosure(self.part, pair.a);
        if self.part == Part::Surface {
            return triangles.least_gap(lanes, &enclosure, None);
        }
        let points = &self.a.tree.topology().points(pair.a);
        let mut least = f32::INFINITY;
        for block in blocks_of(points) {
            let (positions, parts) = (&self.a.blocks[block].position, self.a.obstacle_parts(block));
            let of_block = (positions, &parts, lanes_of(block, points));
            least = least.min(triangles.least_gap(lanes, &enclosure, Some(of_block)));
        }
        least
    }

    /// The distance of a point and a triangle, given by its corners in the scan's stored frame.
    /// Includes the point of the triangle nearest to the point, in the same frame.
    pub(crate) fn apart(&self, i: usize, corners: &Corners) -> (f64, [f64; 3]) {
        let p = self.a.position(i).map(f64::from);
        let foot = nearest_on_triangle(corners, p);
        let distance = (Vector3::from(p) - Vector3::from(foot)).norm();
        (distance * self.scan.stored_to_world().scale(), foot)
    }

    /// The radius, in the world, of the ball of point `i`; zero for points on sheets, and if
    /// surfaces or points are compared.
    pub(crate) fn ball(&self, i: usize) -> f64 {
        let is_ball = self.part == Part::Obstacle && !self.a.is_on_sheet(i);
        if is_ball { f64::from(self.a.obstacle_ball(i)) * self.scan.stored_to_world().scale() } else { 0.0 }
    }

    /// The distance of a point, less the radius of its ball, and a triangle.
    pub(crate) fn item_pair(&self, items: [usize; 2]) -> ItemPair {
        let (distance, _) = self.apart(items[0], &self.corners(items[1]));
        ItemPair { distance: distance - self.ball(items[0]), items }
    }

    /// The nearest of `best` and all pairs of a point and a triangle of two leaves; among equals the
    /// first found.
    pub(crate) fn nearest_items(&mut self, leaves: NodePair, mut best: ItemPair) -> ItemPair {
        let leaf = self.b.tree.topology().leaf_number(leaves.b);
        let points = &self.a.tree.topology().points(leaves.a);
        let relative = self.relative;
        let triangles = LeafTriangles { level: self.level, block: &self.b.blocks[leaf], relative: &relative };
        // The box of the points contains their balls.
        let bounds = self.a.tree.bounds(leaves.a);
        let beside = relative.moved(&self.b.tree.bounds(leaves.b));
        let mut most = self.most(best.distance);
        for block in blocks_of(points) {
            let balls = if self.part == Part::Obstacle { self.a.obstacle_balls(block) } else { [0.0; WIDTH] };
            let positions = &self.a.blocks[block].position;
            let of_block = (positions, &balls, lanes_of(block, points));
            // Most points are too far from all triangles.
            let near = near_box(self.level, of_block, &beside, most + 3.0 * relative.slack());
            if near == 0 {
                continue;
            }
            let Some((gaps, lanes)) = triangles.point_gaps((positions, &balls, near), &bounds, most) else {
                continue;
            };
            for lane in self.lanes(leaf) {
                let (gaps, mut left) = (&gaps[lane], lanes[lane]);
                let mut corners = None;
                while let Some(i) = nearest_lane(gaps, left) {
                    left &= !(1 << i);
                    if gaps[i] > most {
                        break;
                    }
                    let items = [block * WIDTH + i, Self::triangle(leaf, lane)];
                    let corners = corners.get_or_insert_with(|| self.corners(items[1]));
                    self.meter.leaf_work(EXACT);
                    let distance = self.apart(items[0], corners).0 - self.ball(items[0]);
                    if distance < best.distance {
                        best = ItemPair { distance, items };
                        most = self.most(distance);
                    }
                }
            }
        }
        best
    }

    /// A distance in the world as one in the scan's stored frame, rounded up.
    fn most(&self, distance: f64) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
        let most = (distance / self.scan.stored_to_world().scale()) as f32;
        most + 1e-6 * most.abs() + self.relative.slack()
    }
}

/// Returns the lane with the least gap, the first among equals; `None` if `lanes` is empty.
#[inline]
fn nearest_lane(gaps: &[f32; WIDTH], lanes: u32) -> Option<usize> {
    let mut lanes = Bits(lanes);
    let mut least = lanes.next()?;
    for lane in lanes {
        if gaps[lane].total_cmp(&gaps[least]).is_lt() {
            least = lane;
        }
    }
    Some(least)
}
