//! Classes: keeps the points with certain class codes.

use nearmiss_geometry::PointCloud;

use crate::error::{FilterError, enough};

/// Returns the points whose class is in `wanted`. Classes are LAS codes: 2 is ground, 6 is
/// buildings.
///
/// ```
/// # use nearmiss_geometry::PointCloud;
/// let points: Vec<[f64; 3]> = (0..40).map(|i| [f64::from(i), 0.0, 0.0]).collect();
/// let classes: Vec<u8> = (0..40).map(|i| [2, 5][i % 2]).collect();
/// let cloud = PointCloud::from_positions(&points)?.with_classes(&classes)?;
/// let ground = nearmiss_filter::classes(&cloud, &[2])?;
/// assert_eq!(ground, (0..40).step_by(2).collect::<Vec<u32>>());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Fails if the cloud has no classes, or if fewer than 8 points have a wanted class.
pub fn classes(cloud: &PointCloud, wanted: &[u8]) -> Result<Vec<u32>, FilterError> {
    let classes = cloud.classes().ok_or(FilterError::NoClasses)?;
    let kept = (0_u32..).zip(classes).filter(|(_, class)| wanted.contains(class));
    enough(kept.map(|(id, _)| id).collect(), cloud.len(), "ask for more classes")
}
