//! Statistical outliers: removes the points that are unusually far from their nearest neighbours.

use nearmiss_geometry::PointCloud;

use crate::error::{FilterError, enough, positive};
use crate::neighbours::Neighbours;

/// Bound on the relative rounding error of a mean distance.
const ROUNDING: f64 = 1e-9;

/// Returns the points whose mean distance to their `k` nearest neighbours is at most
/// μ + `sigma` · s, where μ and s are the mean and the standard deviation of that distance over all
/// points.
///
/// This is the statistical outlier filter of PCL and Open3D. As in PCL, and unlike in Open3D, a
/// point is not counted among its own neighbours. s is the sample standard deviation, with n − 1 in
/// the denominator.
///
/// ```
/// # use nearmiss_geometry::PointCloud;
/// let mut points: Vec<[f64; 3]> = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
/// points.push([10.0, 10.0, 20.0]);
/// let cloud = PointCloud::from_positions(&points)?;
/// assert_eq!(nearmiss_filter::remove_outliers(&cloud, 8, 3.0)?, (0..400).collect::<Vec<u32>>());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Fails if `k` is 0 or not below the number of points, if `sigma` is not positive and finite, or
/// if fewer than 8 points stay.
pub fn remove_outliers(cloud: &PointCloud, k: usize, sigma: f64) -> Result<Vec<u32>, FilterError> {
    positive("sigma", sigma)?;
    let distances = Neighbours::new(cloud, k)?.map(mean);
    let centre = mean(&distances);
    let squares: f64 = distances.iter().map(|d| (d - centre).powi(2)).sum();
    #[expect(clippy::cast_precision_loss, reason = "there are fewer than 2³² points")]
    let deviation = (squares / (distances.len() - 1) as f64).sqrt();
    // If all distances are equal up to rounding, no point is an outlier.
    let most = (centre + sigma * deviation) * (1.0 + ROUNDING);
    let kept = (0_u32..).zip(&distances).filter(|(_, d)| **d <= most).map(|(id, _)| id).collect();
    enough(kept, cloud.len(), "choose a larger sigma")
}

/// Sums in order, so the mean does not depend on the number of threads.
#[expect(clippy::cast_precision_loss, reason = "there are fewer than 2³² points")]
fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
