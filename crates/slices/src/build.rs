//! Points into voxels: of each the lowest and the highest level, which no order of the points changes.
//!
//! A block of points at a time is sorted by the part of the map that they lie in; then every part is filled by one thread. So nothing
//! is shared between threads, and what is written lies close together.

use nearmiss_geometry::{PointCloud, TriangleMesh};
use nearmiss_mesh::lattice_samples;

use crate::error::SliceError;
use crate::map::About;
use crate::options::SlicePlan;
use crate::parallel::{change_each, map_each};
use crate::{Grid, SliceMap, finish};

/// Points that a thread sorts at a time: they and what becomes of them fit its cache.
const BLOCK: usize = 1 << 15;

/// Blocks that are sorted before the map is filled from them; any number gives the same map.
const BLOCKS: usize = 16;

/// Cells of a part of a slice: as many as fit a cache, so that one large floor keeps several threads busy.
const PART: usize = 1 << 16;

/// Samples of a mesh that are kept before they are poured into the map.
const BATCH: usize = BLOCK * BLOCKS;

/// What a voxel has seen: 255 less the lowest level in the high byte, the highest level plus one in the low byte; 0 if
/// nothing. So either byte only ever grows, and memory that is zero is a map without points.
pub(crate) type Cell = u16;

/// Lowest and highest level of a cell; none if nothing is in it.
#[inline]
pub(crate) fn span(cell: Cell) -> Option<[i32; 2]> {
    match cell {
        0 => None,
        seen => Some([255 - i32::from(seen >> 8), i32::from(seen & 0xff) - 1]),
    }
}

/// Takes points in any number of pieces and makes a map of them.
///
/// Takes 2 bytes a voxel until it is done, touched only where points are, and some 20 MB to sort in. The map depends on the points
/// alone, not on their order, their pieces or the number of threads.
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
        let grid = *self.plan.grid();
        let parts = grid.area().div_ceil(PART);
        for points in points.chunks(BLOCK * BLOCKS) {
            let blocks: Vec<&[P]> = points.chunks(BLOCK).collect();
            let sorted = map_each(blocks.len(), |i| Sorted::new(&grid, parts, blocks[i], &to_map));
            change_each(&mut self.layers, PART, |slice, part, cells| {
                for block in &sorted {
                    for &(cell, level) in block.part(slice * parts + part) {
                        see(&mut cells[usize::from(cell)], level);
                    }
                }
            });
            let inside: usize = sorted.iter().map(|block| block.entries.len()).sum();
            self.points += inside as u64;
            self.outside += (points.len() - inside) as u64;
        }
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
fn see(cell: &mut Cell, level: u8) {
    let [low, high] = [u16::from(255 - level), u16::from(level) + 1];
    *cell = (*cell >> 8).max(low) << 8 | (*cell & 0xff).max(high);
}

/// Points of a block by the part of the map that they are in.
struct Sorted {
    /// Where each part's entries begin, and where the last ends.
    starts: Vec<u32>,
    /// Cell in the part, and level.
    entries: Vec<(u16, u8)>,
}

impl Sorted {
    /// Sorts by counting. `parts` are those of a slice.
    fn new<P>(grid: &Grid, parts: usize, points: &[P], to_map: impl Fn(&P) -> [f64; 3]) -> Self {
        let mut starts = vec![0_u32; parts * grid.counts[2] as usize + 1];
        let mut found: Vec<(u32, u16, u8)> = Vec::with_capacity(points.len());
        for voxel in points.iter().filter_map(|point| grid.voxel(to_map(point))) {
            let part = voxel.slice * parts + voxel.pixel / PART;
            starts[part + 1] += 1;
            #[expect(
                clippy::cast_possible_truncation,
                reason = "parts are far fewer than 2^32, cells of one 2^16"
            )]
            found.push((part as u32, (voxel.pixel % PART) as u16, voxel.level));
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut entries = vec![(0, 0); found.len()];
        for (part, cell, level) in found {
            let place = &mut next[part as usize];
            entries[*place as usize] = (cell, level);
            *place += 1;
        }
        Self { starts, entries }
    }

    fn part(&self, part: usize) -> &[(u16, u8)] {
        &self.entries[self.starts[part] as usize..self.starts[part + 1] as usize]
    }
}
