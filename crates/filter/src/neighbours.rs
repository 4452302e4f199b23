//! Filter by neighbour count, and the nearest-neighbour search that filters share.

use std::num::NonZero;

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nearmiss_geometry::PointCloud;
use nearmiss_lanes::parallel;

use crate::error::{FilterError, enough, positive};

/// Returns the points that have at least `n` other points within `radius`.
///
/// ```
/// # use nearmiss_geometry::PointCloud;
/// let mut points: Vec<[f64; 3]> = (0..20).map(|i| [f64::from(i), 0.0, 0.0]).collect();
/// points.push([50.0, 0.0, 0.0]);
/// let cloud = PointCloud::from_positions(&points)?;
/// // The ends of the row have one neighbour, the last point has none.
/// assert_eq!(nearmiss_filter::min_neighbours(&cloud, 1, 1.0)?, (0..20).collect::<Vec<u32>>());
/// assert_eq!(nearmiss_filter::min_neighbours(&cloud, 2, 1.0)?, (1..19).collect::<Vec<u32>>());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Fails if `n` is 0 or not below the number of points, if `radius` is not positive and finite, or
/// if fewer than 8 points stay.
pub fn min_neighbours(cloud: &PointCloud, n: usize, radius: f64) -> Result<Vec<u32>, FilterError> {
    positive("radius", radius)?;
    // All distances here are in the local frame.
    let reach = radius / cloud.frame().scale;
    let near = Neighbours::new(cloud, n)?.map(|distances| distances.last().is_some_and(|d| *d <= reach));
    let kept = (0_u32..).zip(near).filter_map(|(id, near)| near.then_some(id)).collect();
    enough(kept, cloud.len(), "ask for fewer neighbours or a larger radius")
}

/// The nearest neighbours of every point.
pub(crate) struct Neighbours<'a> {
    cloud: &'a PointCloud,
    tree: ImmutableKdTree<f64, 3>,
    /// Number of neighbours, without the point itself.
    count: NonZero<usize>,
}

impl<'a> Neighbours<'a> {
    pub(crate) fn new(cloud: &'a PointCloud, count: usize) -> Result<Self, FilterError> {
        let points = cloud.len();
        let Some(count) = NonZero::new(count) else { return Err(FilterError::NoNeighbours) };
        if count.get() >= points {
            return Err(FilterError::TooManyNeighbours { neighbours: count.get(), points });
        }
        let positions: Vec<[f64; 3]> = cloud.positions().iter().map(|p| p.map(f64::from)).collect();
        let tree = ImmutableKdTree::new_from_slice(&positions);
        Ok(Self { cloud, tree: tree.expect("positions are finite"), count })
    }

    /// Calls `work` for each point with the distances of its nearest neighbours, and returns the
    /// results.
    ///
    /// Distances ascend and are in the local frame.
    pub(crate) fn map<T: Send>(&self, work: impl Fn(&[f64]) -> T + Sync + Send) -> Vec<T> {
        let positions = self.cloud.positions();
        // The nearest point found is the point itself, because points are distinct.
        let asked = self.count.saturating_add(1);
        parallel::map_with(positions.len(), Vec::new, |distances, i| {
            let p = positions[i].map(f64::from);
            let found = self.tree.query(&p).nearest_n::<SquaredEuclidean<f64>>(asked).execute();
            distances.clear();
            distances.extend(found.iter().map(|near| near.distance.sqrt()));
            distances.sort_unstable_by(f64::total_cmp);
            work(distances.get(1..).unwrap_or_default())
        })
    }
}
