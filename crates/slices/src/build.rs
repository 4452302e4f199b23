//! Points into voxels: of each the lowest and the highest, which no order of the points changes.

use std::sync::atomic::{AtomicU16, Ordering};

use nearmiss_geometry::{PointCloud, TriangleMesh};
use nearmiss_mesh::lattice_samples;

use crate::error::SliceError;
use crate::map::About;
use crate::options::SlicePlan;
use crate::parallel::each_chunk;
use crate::{Grid, SliceMap, finish};

/// Points that a thread takes at a time; any number gives the same map.
const CHUNK: usize = 1 << 14;

/// Samples of a mesh that are kept before they are poured into the map.
const BATCH: usize = 1 << 16;

/// What a voxel has seen: 255 less the lowest level in the high byte, the highest level plus one in the low byte; 0 if
/// nothing. So either byte only ever grows, and memory that is zero is a map without points.
pub(crate) type Cell = AtomicU16;

/// Lowest and highest level of a cell; none if nothing is in it.
#[inline]
pub(crate) fn span(cell: &Cell) -> Option<[i32; 2]> {
    match cell.load(Ordering::Relaxed) {
        0 => None,
        seen => Some([255 - i32::from(seen >> 8), i32::from(seen & 0xff) - 1]),
    }
}

/// Takes points in any number of pieces and makes a map of them.
///
/// Takes 2 bytes a voxel until it is done, touched only where points are. The map depends on the points alone, not on
/// their order, their pieces or the number of threads.
#[derive(Debug)]
pub struct SliceBuilder {
    plan: SlicePlan,
    /// A layer a slice, a cell a pixel.
    layers: Vec<Vec<Cell>>,
    points: u64,
    outside: u64,
}

impl SliceBuilder {
    /// A map without points.
    ///
    /// # Errors
    /// When the system gives no memory.
    pub fn new(plan: &SlicePlan) -> Result<Self, SliceError> {
        let area = plan.grid().area();
        let layers = (0..plan.grid().counts[2]).map(|_| bytemuck::allocation::try_zeroed_vec(area)).collect();
        let layers: Result<_, ()> = layers;
        let layers = layers.map_err(|()| SliceError::OutOfMemory { bytes: 2 * area })?;
        Ok(Self { plan: *plan, layers, points: 0, outside: 0 })
    }

    /// Adds points given in the caller's coordinates. Those outside the bounds of the plan, and those with a coordinate that is
    /// not a number, are left out and counted.
    ///
    /// Some ten nanoseconds a point and thread.
    pub fn add(&mut self, points: &[[f64; 3]]) {
        let up = self.plan.grid().up;
        self.pour(points, |p| up.to_map(*p));
    }

    /// Adds the points of a cloud.
    pub fn add_cloud(&mut self, cloud: &PointCloud) {
        let (up, frame) = (self.plan.grid().up, cloud.frame());
        self.pour(cloud.positions(), |p| up.to_map(frame.to_world(*p)));
    }

    /// Adds a mesh by samples of its own making: every voxel that its surface passes gets the lowest and the highest point of the
    /// surface in it, up to rounding. Tells how many samples that took.
    pub fn add_mesh(&mut self, mesh: &TriangleMesh) -> u64 {
        let grid = *self.plan.grid();
        let before = self.points + self.outside;
        let mut batch = Vec::with_capacity(BATCH);
        let corners = mesh.vertices();
        let cells = [grid.pixel, grid.pixel, grid.slice_height];
        for triangle in mesh.triangles() {
            let triangle = triangle.map(|v| grid.up.to_map(corners[v as usize]));
            lattice_samples(triangle, grid.origin, cells, |p| {
                batch.push(p);
                if batch.len() == BATCH {
                    self.pour(&batch, |p| *p);
                    batch.clear();
                }
            });
        }
        self.pour(&batch, |p| *p);
        self.points + self.outside - before
    }

    fn pour<P: Sync>(&mut self, points: &[P], to_map: impl Fn(&P) -> [f64; 3] + Sync + Send) {
        let (grid, layers): (Grid, &[Vec<Cell>]) = (*self.plan.grid(), &self.layers);
        let outside = each_chunk(points, CHUNK, |chunk| {
            let mut outside = 0;
            for point in chunk {
                match grid.voxel(to_map(point)) {
                    Some(voxel) => see(&layers[voxel.slice][voxel.pixel], voxel.level),
                    None => outside += 1,
                }
            }
            outside
        });
        self.outside += outside;
        self.points += points.len() as u64 - outside;
    }

    /// How many points are in, and how many were left out.
    #[must_use]
    pub fn counts(&self) -> [u64; 2] {
        [self.points, self.outside]
    }

    /// The map.
    #[must_use]
    pub fn finish(self) -> SliceMap {
        let grid = *self.plan.grid();
        let noise = finish::noise(&grid, &self.layers);
        // A noise as high as a slice would leave no obstacle.
        let share = self.plan.share(noise).min(MOST_SHARE.max(self.plan.share(0.0)));
        let most = finish::most_levels(share);
        let mut layers = self.layers;
        let slices = finish::slices(&grid, &mut layers, most);
        SliceMap::of_slices(grid, slices, About { share, noise, points: self.points })
    }
}

/// However noisy points are, what spans more than this share of a slice is an obstacle.
const MOST_SHARE: f64 = 0.9;

/// Most points of a voxel change nothing.
#[inline]
fn see(cell: &Cell, level: u8) {
    let [low, high] = [u16::from(255 - level), u16::from(level) + 1];
    let mut seen = cell.load(Ordering::Relaxed);
    while seen >> 8 < low || seen & 0xff < high {
        let wider = (seen >> 8).max(low) << 8 | (seen & 0xff).max(high);
        match cell.compare_exchange_weak(seen, wider, Ordering::Relaxed, Ordering::Relaxed) {
            Ok(_) => return,
            Err(other) => seen = other,
        }
    }
}
