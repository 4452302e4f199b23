//! Points into voxels: of each the lowest and the highest level, which no order of the points changes.
//!
//! A block of points at a time is sorted by the part of the map that they lie in; then every part is filled
//! by one thread. So nothing is shared between threads, and what is written lies close together.

use std::convert::Infallible;

use nearmiss_geometry::{PointCloud, TriangleMesh};
use nearmiss_lanes::parallel::{change_each, map_each};
use nearmiss_mesh::{Lattice, lattice_samples};
use nearmiss_store::Workspace;

use crate::error::SliceError;
use crate::layer::{BLOCKS, Layer, PART};
use crate::map::{About, Index};
use crate::options::{Obstacle, SlicePlan};
use crate::slice::Slice;
use crate::{Grid, SliceMap, finish};

/// Points that a thread sorts at a time: they and what becomes of them fit its cache.
const BLOCK: usize = 1 << 15;

/// The stage of the work that ends when all points are in.
const STAGE: &str = "voxels";

/// Samples of a mesh that are kept before they are poured into the map.
const BATCH: usize = BLOCK * BLOCKS;

/// Slices that are finished together; their cells are then let go of.
const WAVE: usize = 16;

/// Takes points in any number of pieces and makes a map of them.
///
/// Takes 2 bytes a voxel until it is done, touched only where points are, and some 20 MB to sort in. The map
/// depends on the points alone, not on their order, their pieces, the number of threads or the workspace.
#[derive(Debug)]
pub struct SliceBuilder {
    plan: SlicePlan,
    /// A layer a slice.
    layers: Vec<Layer>,
    points: u64,
    left_out: u64,
    is_filled: bool,
}

impl SliceBuilder {
    /// A map without points.
    ///
    /// # Errors
    /// When the system gives no memory.
    pub fn new(plan: &SlicePlan) -> Result<Self, SliceError> {
        Self::new_in(plan, &Workspace::in_memory())
    }

    /// A map without points whose voxels lie in a workspace, so that they may exceed memory; or, if
    /// [`Self::is_filled`], one with all of its points, that a process which has ended has left there.
    ///
    /// # Errors
    /// When the workspace gives no memory, or no space on the disk.
    pub fn new_in(plan: &SlicePlan, work: &Workspace) -> Result<Self, SliceError> {
        let stage = work.stage(STAGE);
        let filled: Option<[u64; 2]> = stage.done();
        let [points, left_out] = filled.unwrap_or_default();
        let area = plan.grid().area();
        let layers =
            (0..plan.grid().counts[2]).map(|s| Layer::new(&stage, s, area)).collect::<Result<_, _>>()?;
        Ok(Self { plan: *plan, layers, points, left_out, is_filled: filled.is_some() })
    }

    /// Returns `true` if all points are in: [`Self::keep`] has said so, in this process or an earlier one.
    #[must_use]
    pub fn is_filled(&self) -> bool {
        self.is_filled
    }

    /// Says that all points are in, so that the next process need not add them again if this one ends.
    ///
    /// # Errors
    /// When the workspace's folder cannot be written.
    pub fn keep(&mut self, work: &Workspace) -> Result<(), SliceError> {
        work.stage(STAGE).close(&[self.points, self.left_out])?;
        self.is_filled = true;
        Ok(())
    }

    /// Adds points given in the caller's coordinates. Those outside the bounds of the plan, and those with a
    /// coordinate that is not a number, are left out and counted.
    ///
    /// Some ten nanoseconds a point and thread.
    pub fn add(&mut self, points: &[[f64; 3]]) {
        let up = self.plan.grid().up;
        self.left_out += self.pour(points, |p| up.to_map(*p));
    }

    /// Adds the points of a cloud.
    pub fn add_cloud(&mut self, cloud: &PointCloud) {
        let (up, frame) = (self.plan.grid().up, cloud.frame());
        self.left_out += self.pour(cloud.positions(), |p| up.to_map(frame.to_world(*p)));
    }

    /// Adds a mesh by samples of its own making: every voxel that its surface passes gets the lowest and the
    /// highest point of the surface in it, up to rounding. Tells how many samples that took.
    ///
    /// Of a triangle that reaches beyond the bounds of the plan the part inside is added; of one with a
    /// corner that is not finite, nothing. Each such triangle counts as one left out.
    pub fn add_mesh(&mut self, mesh: &TriangleMesh) -> u64 {
        let Grid { up, origin, pixel, slice_height, counts } = *self.plan.grid();
        let lattice = Lattice { origin, sides: [pixel, pixel, slice_height], counts };
        let before = self.points;
        let mut batch = Vec::with_capacity(BATCH);
        let corners = mesh.vertices();
        for triangle in mesh.triangles() {
            let triangle = triangle.map(|v| up.to_map(corners[v as usize]));
            let is_whole = lattice_samples(triangle, &lattice, |p| {
                batch.push(p);
                if batch.len() == BATCH {
                    self.pour(&batch, |p| *p);
                    batch.clear();
                }
            });
            self.left_out += u64::from(!is_whole);
        }
        self.pour(&batch, |p| *p);
        self.points - before
    }

    /// Tells how many of the points are outside.
    fn pour<P: Sync>(&mut self, points: &[P], to_map: impl Fn(&P) -> [f64; 3] + Sync + Send) -> u64 {
        let grid = *self.plan.grid();
        let parts = grid.area().div_ceil(PART);
        let mut added = 0;
        for points in points.chunks(BLOCK * BLOCKS) {
            let blocks: Vec<&[P]> = points.chunks(BLOCK).collect();
            let sorted = map_each(blocks.len(), |i| Sorted::new(&grid, parts, blocks[i], &to_map));
            change_each(&mut self.layers, 1, |slice, layer| {
                change_each(&mut layer.parts(), 1, |part, cells| {
                    for block in &sorted {
                        for &(cell, level) in block.part(slice * parts + part) {
                            cells.see(cell, level);
                        }
                    }
                });
            });
            let inside: usize = sorted.iter().map(|block| block.entries.len()).sum();
            added += inside as u64;
        }
        self.points += added;
        points.len() as u64 - added
    }

    /// How many points are in, samples of meshes among them; and how many points, or triangles at least a
    /// part of which, were left out.
    #[must_use]
    pub fn counts(&self) -> [u64; 2] {
        [self.points, self.left_out]
    }

    /// The map.
    #[must_use]
    pub fn finish(self) -> SliceMap {
        let index = self.index();
        let mut slices = Vec::with_capacity(self.layers.len());
        let all: Result<(), Infallible> = self.each(index, WAVE, |wave| {
            slices.extend(wave);
            Ok(())
        });
        let Ok(()) = all;
        SliceMap::of_slices(index, slices)
    }

    /// The index of the map. Goes over all voxels if noise is to be estimated.
    pub(crate) fn index(&self) -> Index {
        let grid = *self.plan.grid();
        let rule = self.plan.obstacle();
        let noise = match rule {
            Obstacle::Share(_) => 0.0,
            Obstacle::Slope { noise, .. } => noise.unwrap_or_else(|| finish::noise(&grid, &self.layers)),
        };
        let share = self.plan.share(noise);
        Index { grid, about: About { rule, share, noise, points: self.points, left_out: self.left_out } }
    }

    /// Hands out the slices of the map, lowest first, some at a time, until the first error.
    pub(crate) fn each<E>(
        self,
        index: Index,
        together: usize,
        take: impl FnMut(Vec<Slice>) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut layers = self.layers;
        finish::each(&index.grid, &mut layers, finish::most_levels(index.about.share), together, take)
    }

    /// How many slices may be made at a time.
    pub(crate) fn together(&self) -> usize {
        self.plan.together().min(WAVE)
    }
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
