//! A scan of all points through kiddo's kd-tree, as a user without a mesh would write in ten lines.
//! Two copies meet if a point of one lies within r of a point of the other.
//!
//! Points outside the inflated bounding box of the other copy are skipped. The first point that is
//! near enough ends the scan.

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss::{Aabb, PointCloud, Pose};

use crate::Failure;
use crate::rivals::method::{Method, Reply};

/// Points in a kd-tree, and the distance that counts as a hit.
#[expect(missing_debug_implementations, reason = "the tree's is a dump of all its points")]
pub struct PointScan {
    tree: ImmutableKdTree<f32, 3>,
    points: Vec<[f32; 3]>,
    bounds: Aabb,
    reach: f64,
}

impl PointScan {
    /// Points that meet when they are within `reach`.
    ///
    /// # Errors
    /// When the tree rejects the points.
    pub fn new(cloud: &PointCloud, reach: f64) -> Result<Self, Failure> {
        let points: Vec<[f32; 3]> = (0..cloud.len()).map(|i| single(cloud.point(i))).collect();
        let tree = ImmutableKdTree::new_from_slice(&points).map_err(|e| format!("{e:?}"))?;
        Ok(Self { tree, points, bounds: cloud.bounds(), reach })
    }

    /// The least distance between a point of the copy at `pose` and a point of the resting copy.
    #[must_use]
    pub fn least_distance(&self, pose: &Pose) -> f32 {
        let mut least_sq = f32::INFINITY;
        for p in &self.points {
            let p = single(pose.apply(p.map(f64::from)));
            let nearest = self.tree.query(&p).nearest_one::<SquaredEuclidean<f32>>().execute();
            least_sq = least_sq.min(nearest.distance);
        }
        least_sq.sqrt()
    }
}

impl PointScan {
    /// The nearest pair of one of these points and one of `body` at `pose`: their distance in
    /// double precision and their indices.
    #[must_use]
    pub fn nearest_pair(&self, body: &PointCloud, pose: &Pose) -> (f64, usize, usize) {
        let mut best = (f64::INFINITY, 0, 0);
        for j in 0..body.len() {
            let q = pose.apply(body.point(j));
            let nearest = self.tree.query(&single(q)).nearest_one::<SquaredEuclidean<f32>>().execute();
            let i = nearest.item as usize;
            let distance = (0..3).map(|k| (f64::from(self.points[i][k]) - q[k]).powi(2)).sum::<f64>().sqrt();
            if distance < best.0 {
                best = (distance, i, j);
            }
        }
        best
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the tree is single precision")]
fn single(p: [f64; 3]) -> [f32; 3] {
    p.map(|x| x as f32)
}

impl Method for PointScan {
    fn name(&self) -> String {
        "kiddo scan within r (points)".into()
    }

    fn ask(&mut self, a: &Pose, b: &Pose) -> Reply {
        let pose = a.inverse().after(b);
        let Aabb { min, max } = self.bounds;
        // Tests the rotated box of the other copy first: far copies cost nothing.
        let half = self.bounds.half_extents();
        let (centre, moved) = (self.bounds.centre(), pose.apply(self.bounds.centre()));
        let apart = (0..3).any(|i| {
            let turned: f64 = (0..3).map(|j| pose.rotation()[(i, j)].abs() * half[j]).sum();
            (moved[i] - centre[i]).abs() > half[i] + turned + self.reach
        });
        if apart {
            return Reply::default();
        }
        let rows: [[f32; 3]; 3] =
            std::array::from_fn(|i| single(std::array::from_fn(|j| pose.rotation()[(i, j)])));
        let (shift, reach) = (single(pose.translation()), single([self.reach; 3])[0]);
        let (low, high) = (single(min.map(|x| x - self.reach)), single(max.map(|x| x + self.reach)));
        let mut evaluations = 0;
        let hit = self.points.iter().any(|&[x, y, z]| {
            let p = [0, 1, 2].map(|i| rows[i][0] * x + rows[i][1] * y + rows[i][2] * z + shift[i]);
            // All six comparisons at once: branches would be mispredicted where boxes overlap in
            // part.
            if (0..3).fold(false, |beyond, k| beyond | (p[k] < low[k]) | (p[k] > high[k])) {
                return false;
            }
            evaluations += 1;
            // Limited to the radius: from afar an unlimited nearest-neighbour search takes
            // microseconds.
            let query = self.tree.query(&p).within::<SquaredEuclidean<f32>>(reach * reach);
            query.unsorted().iter().next().is_some()
        });
        Reply { hit, evaluations, node_pairs: 0 }
    }
}
