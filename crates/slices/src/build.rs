//! From points to voxels: the lowest and the highest level of each voxel, whatever the order of the
//! points.
//!
//! Each block of points is sorted by the part of the map that contains them; then each part is
//! filled by one thread. So threads share no data, and writes are local.

use std::convert::Infallible;

use nearmiss_geometry::{PointCloud, TriangleMesh};
use nearmiss_lanes::parallel::{change_each, map_each};
use nearmiss_mesh::{Lattice, lattice_samples};
use nearmiss_store::{Progress, Workspace};

use crate::error::SliceError;
use crate::layer::{BLOCKS, Layer, PART};
use crate::map::{About, Index};
use crate::options::{Obstacle, SlicePlan};
use crate::slice::Slice;
use crate::{Grid, SliceMap, finish};

/// Points that a thread sorts at a time; they and their entries fit its cache.
const BLOCK: usize = 1 << 15;

/// The stage of the work that ends when all points are added.
const STAGE: &str = "voxels";

/// Samples of a mesh that are collected before they are added to the map.
const BATCH: usize = BLOCK * BLOCKS;

/// Slices that are finished together; their cells are freed afterwards.
const WAVE: usize = 16;

/// Builds a map from points in any number of pieces.
///
/// Needs 2 bytes a voxel until it is done, paged in only where points are, and some 20 MB to sort.
/// The map depends on the points alone, not on their order, their pieces, the number of threads or
/// the workspace.
#[derive(Debug)]
pub struct SliceBuilder {
    plan: SlicePlan,
    /// A layer for each slice.
    layers: Vec<Layer>,
    points: u64,
    left_out: u64,
    is_filled: bool,
    /// The progress of the present step: adding a mesh, or making the slices.
    progress: Progress,
}

impl SliceBuilder {
    /// Creates a builder without points.
    ///
    /// # Errors
    /// If memory cannot be allocated.
    pub fn new(plan: &SlicePlan) -> Result<Self, SliceError> {
        Self::new_in(plan, &Workspace::in_memory())
    }

    /// Creates a builder without points whose voxels are in a workspace, so that they may exceed
    /// memory. If the workspace holds the finished work of an earlier process, all points are in
    /// already ([`Self::is_filled`]).
    ///
    /// # Errors
    /// If the workspace cannot allocate memory or disk space.
    pub fn new_in(plan: &SlicePlan, work: &Workspace) -> Result<Self, SliceError> {
        let stage = work.stage(STAGE);
        let filled: Option<[u64; 2]> = stage.done();
        let [points, left_out] = filled.unwrap_or_default();
        let area = plan.grid().area();
        let layers =
            (0..plan.grid().counts[2]).map(|s| Layer::new(&stage, s, area)).collect::<Result<_, _>>()?;
        let progress = work.progress().clone();
        Ok(Self { plan: *plan, layers, points, left_out, is_filled: filled.is_some(), progress })
    }

    /// Returns `true` if all points are in, as recorded by [`Self::keep`] in this process or an
    /// earlier one.
    #[must_use]
    pub fn is_filled(&self) -> bool {
        self.is_filled
    }

    /// Records that all points are in, so that a later process need not add them again if this one
    /// ends.
    ///
    /// # Errors
    /// If the workspace's folder cannot be written.
    pub fn keep(&mut self, work: &Workspace) -> Result<(), SliceError> {
        work.stage(STAGE).close(&[self.points, self.left_out])?;
        self.is_filled = true;
        Ok(())
    }

    /// Adds points in the caller's coordinates. Points outside the bounds of the plan, and points
    /// with a NaN coordinate, are left out and counted.
    ///
    /// Takes some ten nanoseconds a point and thread.
    pub fn add(&mut self, points: &[[f64; 3]]) {
        let up = self.plan.grid().up;
        self.left_out += self.pour(points, |p| up.to_map(*p));
    }

    /// Adds the points of a cloud.
    pub fn add_cloud(&mut self, cloud: &PointCloud) {
        let (up, frame) = (self.plan.grid().up, cloud.frame());
        self.left_out += self.pour(cloud.positions(), |p| up.to_map(frame.to_world(*p)));
    }

    /// Adds a mesh by sampling it: every voxel that its surface passes gets the lowest and the
    /// highest point of the surface in it, up to rounding. Returns the number of samples.
    ///
    /// Tells the progress of the workspace the share of the surface that is added.
    ///
    /// Only the part of a triangle within the bounds of the plan is added. Triangles with a corner
    /// that is not finite are left out. Each triangle that is left out in part or whole is counted.
    pub fn add_mesh(&mut self, mesh: &TriangleMesh) -> u64 {
        let Grid { up, origin, pixel, slice_height, counts } = *self.plan.grid();
        let lattice = Lattice { origin, sides: [pixel, pixel, slice_height], counts };
        let before = self.points;
        let mut batch = Vec::with_capacity(BATCH);
        let corners = mesh.vertices();
        let triangle_of = |triangle: &[u32; 3]| triangle.map(|v| up.to_map(corners[v as usize]));
        let whole: f64 = mesh.triangles().iter().map(|triangle| area(triangle_of(triangle))).sum();
        let (mut added, mut told) = (0.0, 0.0);
        self.progress.reach(0.0);
        for triangle in mesh.triangles() {
            let triangle = triangle_of(triangle);
            added += area(triangle);
            if added >= told + TOLD * whole {
                self.progress.reach(added / whole);
                told = added;
            }
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

    /// Adds points. Returns the number of points outside the map.
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

    /// Returns the number of points in the map, samples of meshes included, and the number of
    /// points or triangles that were left out in part or whole.
    #[must_use]
    pub fn counts(&self) -> [u64; 2] {
        [self.points, self.left_out]
    }

    /// Builds the map.
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

    /// Returns the index of the map. Visits all voxels if noise is to be estimated.
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

    /// Passes the slices of the map to `take`, lowest first, some at a time, until the first error.
    /// Tells the progress of the workspace the share of the slices that are taken.
    pub(crate) fn each<E>(
        self,
        index: Index,
        together: usize,
        take: impl FnMut(Vec<Slice>) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut layers = self.layers;
        let steps = (finish::most_levels(index.about.share), together);
        finish::each(&index.grid, &mut layers, steps, &self.progress, take)
    }

    /// Returns the number of slices that may be made at a time.
    pub(crate) fn together(&self) -> usize {
        self.plan.together().min(WAVE)
    }
}

/// The share of a mesh's surface between two reports of the progress.
const TOLD: f64 = 1e-3;

/// Returns the area of a triangle; 0 if a corner is not finite.
fn area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let [u, v] = [b, c].map(|p| [0, 1, 2].map(|k| p[k] - a[k]));
    let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let area = 0.5 * cross.iter().map(|x| x * x).sum::<f64>().sqrt();
    if area.is_finite() { area } else { 0.0 }
}

/// The points of a block, sorted by the part of the map that contains them.
struct Sorted {
    /// Start of each part's entries, and the end of the last.
    starts: Vec<u32>,
    /// Cell in the part, and level.
    entries: Vec<(u16, u8)>,
}

impl Sorted {
    /// Sorts points by counting. `parts` is the number of parts of a slice.
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
