//! Crop: keeps the points within a box.

use nearmiss_geometry::{Aabb, PointCloud};

use crate::error::{FilterError, enough};

/// Returns the points within the box from `min` to `max`, border included, in the frame of the
/// cloud's input.
///
/// A corner may be infinite, which leaves the box open on that side. The positions compared are
/// those of the cloud, which differ from the input by at most [`PointCloud::step`].
///
/// ```
/// # use nearmiss_geometry::PointCloud;
/// let points: Vec<[f64; 3]> = (0..100).map(|i| [f64::from(i), 0.0, 0.0]).collect();
/// let cloud = PointCloud::from_positions(&points)?;
/// let open = f64::INFINITY;
/// let kept = nearmiss_filter::crop(&cloud, [10.0, -open, -open], [19.0, open, open])?;
/// assert_eq!(kept, (10..=19).collect::<Vec<u32>>());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Fails if a corner is NaN, if `min` exceeds `max` on an axis, or if fewer than 8 points are in
/// the box.
pub fn crop(cloud: &PointCloud, min: [f64; 3], max: [f64; 3]) -> Result<Vec<u32>, FilterError> {
    for axis in 0..3 {
        let (min, max) = (min[axis], max[axis]);
        if min.is_nan() || max.is_nan() {
            return Err(FilterError::BoxNotANumber { axis });
        }
        if min > max {
            return Err(FilterError::EmptyBox { axis, min, max });
        }
    }
    let within = Aabb { min, max };
    let frame = cloud.frame();
    let kept = (0_u32..).zip(cloud.positions()).filter(|(_, p)| within.contains(frame.to_world(**p)));
    enough(kept.map(|(id, _)| id).collect(), cloud.len(), "make the box larger")
}
