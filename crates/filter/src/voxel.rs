//! Voxel grid: keeps one point for each occupied cell.

use nearmiss_geometry::PointCloud;
use nearmiss_lanes::parallel;

use crate::error::{FilterError, enough, positive};

/// Slightly less than 2⁶³, so that a quotient below it fits into 64 bits however it is rounded.
const MOST_CELLS: f64 = 9.2e18;

/// Returns one point for each occupied cell of a grid of cubes with edges of length `size`.
///
/// The point kept is the one nearest to the mean of the cell's points; of equally near points, the
/// first.
///
/// Cell walls are at multiples of `size` in the frame of the cloud's input, so equal positions in
/// different clouds are in the same cell. A cell contains its lower walls.
///
/// Takes O(n log n) time and 32 bytes a point.
///
/// ```
/// # use nearmiss_geometry::PointCloud;
/// // Cells 0 to 9 hold the points 0.1, 0.4 and 0.6 beyond their lower wall.
/// let points: Vec<[f64; 3]> =
///     (0..10).flat_map(|i| [0.1, 0.4, 0.6].map(|x| [f64::from(i) + x, 0.5, 0.5])).collect();
/// let cloud = PointCloud::from_positions(&points)?;
/// let kept = nearmiss_filter::voxel(&cloud, 1.0)?;
/// assert_eq!(kept, [1, 4, 7, 10, 13, 16, 19, 22, 25, 28]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// Fails if `size` is not positive and finite, if 64 bits cannot number the cells, or if fewer than
/// 8 points stay.
pub fn voxel(cloud: &PointCloud, size: f64) -> Result<Vec<u32>, FilterError> {
    positive("voxel size", size)?;
    let bounds = cloud.bounds();
    let farthest = bounds.min.iter().chain(&bounds.max).fold(0.0, |far: f64, x| far.max(x.abs()));
    if farthest / size >= MOST_CELLS {
        // The recommended size is rounded up slightly.
        return Err(FilterError::VoxelTooSmall { size, least: farthest / (0.99 * MOST_CELLS) });
    }
    let frame = cloud.frame();
    let positions = cloud.positions();
    #[expect(clippy::cast_possible_truncation, reason = "checked above")]
    let cell = |p: [f32; 3]| frame.to_world(p).map(|x| (x / size).floor() as i64);
    let mut keys: Vec<([i64; 3], u32)> =
        positions.iter().zip(0_u32..).map(|(p, id)| (cell(*p), id)).collect();
    parallel::sort(&mut keys);
    let cells = keys.chunk_by(|a, b| a.0 == b.0);
    let mut kept: Vec<u32> = cells.map(|cell| most_central(positions, cell)).collect();
    kept.sort_unstable();
    enough(kept, cloud.len(), "choose a smaller voxel size")
}

/// Returns the point of a cell that is nearest to the mean of the cell's points.
///
/// Compares |n p − Σ p| instead of |p − Σ p / n|, with p relative to the cell's first point. In
/// double precision this is exact for all but the largest cells, so equally near points compare
/// equal.
fn most_central(positions: &[[f32; 3]], cell: &[([i64; 3], u32)]) -> u32 {
    let first = cell[0].1;
    let [x, y, z] = positions[first as usize].map(f64::from);
    let relative = |id: u32| {
        let p = positions[id as usize].map(f64::from);
        [p[0] - x, p[1] - y, p[2] - z]
    };
    let mut sum = [0.0; 3];
    for (_, id) in cell {
        let p = relative(*id);
        for k in 0..3 {
            sum[k] += p[k];
        }
    }
    #[expect(clippy::cast_precision_loss, reason = "a cell has fewer than 2³² points")]
    let count = cell.len() as f64;
    let (mut best, mut least) = (first, f64::INFINITY);
    for (_, id) in cell {
        let p = relative(*id);
        let distance_sq: f64 = (0..3).map(|k| (count * p[k] - sum[k]).powi(2)).sum();
        if distance_sq < least {
            (best, least) = (*id, distance_sq);
        }
    }
    best
}
