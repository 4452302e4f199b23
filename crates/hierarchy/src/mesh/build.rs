//! [`MeshHierarchy`]: a mesh prepared for queries.

use bytemuck::Zeroable;
use nearmiss_geometry::{Aabb, Frame, TriangleMesh};
use nearmiss_lanes::id32;
use nearmiss_lanes::parallel::{fill, map, map_all, on_threads};
use nearmiss_mesh::{CleanMesh, Corners};
use xxhash_rust::xxh3::Xxh3;

use crate::bounds::boxes::OrientedBox;
use crate::mesh::block::{LEAF_TRIANGLES, TriangleBlock};
use crate::mesh::cells::filled_cells;
use crate::mesh::data::{DroppedTriangles, MeshArrays, MeshMeta};
use crate::mesh::extents::boxes_of_triangles;
use crate::mesh::moments::axes_of_nodes;
use crate::mesh::options::{MeshBuildError, MeshBuildOptions};
use crate::scan::outline::Ball;
use crate::tree::items::{Bounds, Item, Parts};
use crate::tree::split::split;
use crate::tree::topology::Topology;
use crate::tree::wide::{Root, Siblings, Tree, siblings};

/// A triangle mesh prepared for queries: its triangles in the order of a tree with oriented boxes.
///
/// The tree is that of a [`PointHierarchy`](crate::PointHierarchy), with four triangles in a leaf
/// instead of points. Triangles keep their vertices in double precision and in the caller's frame,
/// so that tests of triangles are exact. The mesh need be neither closed nor manifold.
///
/// ```
/// use nearmiss_geometry::TriangleMesh;
/// use nearmiss_hierarchy::{MeshBuildOptions, MeshHierarchy};
///
/// let vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let square = TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3], [3, 2, 0]])?;
/// let prepared = MeshHierarchy::build(&square, &MeshBuildOptions::default())?;
/// assert_eq!((prepared.len(), prepared.dropped().duplicate), (2, 1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct MeshHierarchy {
    pub(crate) meta: MeshMeta,
    pub(crate) topology: Topology,
    pub(crate) arrays: MeshArrays,
}

impl MeshHierarchy {
    /// Prepares `mesh`, after [cleaning](CleanMesh) it: vertices are welded, triangles without area
    /// and repeated triangles are dropped and counted. O(n log n), on all cores by default. The
    /// result does not depend on the number of threads.
    ///
    /// # Errors
    /// If a coordinate is not finite or too large, an option is out of range, no triangle has an
    /// area, or the threads cannot be started.
    pub fn build(mesh: &TriangleMesh, options: &MeshBuildOptions) -> Result<Self, MeshBuildError> {
        on_threads(options.threads, || build(mesh, options))
            .or(Err(MeshBuildError::Threads(options.threads)))?
    }

    /// Returns the number of triangles.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a prepared mesh has a triangle")]
    pub fn len(&self) -> usize {
        self.arrays.triangles.len()
    }

    /// Returns the number of vertices.
    #[must_use]
    pub fn vertices(&self) -> usize {
        self.arrays.vertices.len()
    }

    /// Returns the bounds of the mesh in the caller's frame.
    #[must_use]
    pub fn bounds(&self) -> &Aabb {
        &self.meta.bounds
    }

    /// Returns the frame of the boxes and of the triangles in single precision.
    #[must_use]
    pub fn frame(&self) -> &Frame {
        &self.meta.frame
    }

    /// Returns the counts of what the build dropped.
    #[must_use]
    pub fn dropped(&self) -> DroppedTriangles {
        self.meta.dropped
    }

    /// Returns a hash of all triangles, which identifies the mesh.
    #[must_use]
    pub fn identity(&self) -> u64 {
        self.meta.identity
    }

    /// Computes [`Self::identity`].
    pub(crate) fn hashed(&self) -> u64 {
        let mut hash = Xxh3::new();
        hash.update(bytemuck::cast_slice(&self.arrays.vertices));
        hash.update(bytemuck::cast_slice(&self.arrays.triangles));
        hash.update(bytemuck::cast_slice(&self.arrays.seams));
        hash.update(&(self.arrays.seams.len() as u64).to_le_bytes());
        hash.digest()
    }

    /// Returns the nodes and the triangles under each.
    #[must_use]
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// Returns the arrays that a query reads.
    #[inline]
    #[must_use]
    pub fn arrays(&self) -> MeshView<'_> {
        MeshView {
            tree: Tree {
                topology: &self.topology,
                root: &self.meta.root,
                siblings: &self.arrays.siblings,
                reaches: &[],
                growths: [&[]; 2],
            },
            blocks: &self.arrays.blocks,
            vertices: &self.arrays.vertices,
            triangles: &self.arrays.triangles,
            source: &self.arrays.source,
            seams: &self.arrays.seams,
            cells: &self.arrays.cells,
            ball: &self.meta.ball,
        }
    }
}

/// The arrays that a query of a mesh reads, as plain slices.
#[derive(Debug, Clone, Copy)]
pub struct MeshView<'a> {
    /// The nodes and their boxes.
    pub tree: Tree<'a>,
    /// The triangles of each leaf in lanes, in the stored frame.
    pub blocks: &'a [TriangleBlock],
    /// The vertices in the caller's frame.
    pub vertices: &'a [[f64; 3]],
    /// The vertex indices of each triangle, in leaf order.
    pub triangles: &'a [[u32; 3]],
    /// The index of each triangle in the caller's mesh.
    pub source: &'a [u32],
    /// The vertex indices of dropped triangles that may connect others ([`CleanMesh::seams`]).
    pub seams: &'a [[u32; 3]],
    /// The number of well-filled cells of each node, of [`CELLS`](crate::CELLS); empty if they were
    /// not counted.
    pub cells: &'a [u8],
    /// A ball around the mesh, in the stored frame.
    pub ball: &'a Ball,
}

impl MeshView<'_> {
    /// Returns the corners of the `i`-th triangle in the caller's frame. Corners that a damaged file
    /// numbers wrongly are at the origin.
    ///
    /// # Panics
    /// If there is no such triangle.
    #[inline]
    #[must_use]
    pub fn corners(&self, i: usize) -> Corners {
        self.triangles[i].map(|v| self.vertices.get(v as usize).copied().unwrap_or_default())
    }
}

/// Coordinates beyond this would overflow in products.
pub(crate) const FARTHEST: f64 = 1e150;

fn build(mesh: &TriangleMesh, options: &MeshBuildOptions) -> Result<MeshHierarchy, MeshBuildError> {
    let clean = CleanMesh::new(mesh, &options.clean)?;
    let given = id32(mesh.triangles().len());
    if clean.triangles().is_empty() {
        return Err(MeshBuildError::Empty { triangles: mesh.triangles().len() });
    }
    let (items, mut built) = over(clean.vertices(), clean.triangles(), options.cells)?;
    let Ordered { vertices, triangles, seams } = in_order(&clean, &items);
    let source: Vec<u32> = items.iter().map(|item| clean.sources()[item.index as usize]).collect();
    let report = clean.report();
    built.meta.given = given;
    built.meta.dropped = DroppedTriangles {
        degenerate: id32(report.degenerate_triangles),
        duplicate: id32(report.duplicate_triangles),
        welded_vertices: id32(report.welded_vertices),
    };
    built.arrays.vertices = vertices.into();
    built.arrays.triangles = triangles.into();
    built.arrays.source = source.into();
    built.arrays.seams = seams.into();
    built.meta.identity = built.hashed();
    Ok(built)
}

/// Prepares a valid mesh as it is: vertices keep their order, none is welded, and triangles without
/// area or with the corners of another stay.
pub(crate) fn build_as_given(
    vertices: Vec<[f64; 3]>,
    triangles: &[[u32; 3]],
    options: &MeshBuildOptions,
) -> Result<MeshHierarchy, MeshBuildError> {
    if triangles.is_empty() {
        return Err(MeshBuildError::Empty { triangles: 0 });
    }
    on_threads(options.threads, || {
        let (items, mut built) = over(&vertices, triangles, options.cells)?;
        let source: Vec<u32> = items.iter().map(|item| item.index).collect();
        built.meta.given = id32(triangles.len());
        built.arrays.triangles = map_all(&source, |i| triangles[*i as usize]).into();
        built.arrays.source = source.into();
        built.arrays.vertices = vertices.into();
        built.meta.identity = built.hashed();
        Ok(built)
    })
    .or(Err(MeshBuildError::Threads(options.threads)))?
}

/// Returns the greatest coordinate, if coordinates are so large that products overflow.
pub(crate) fn too_far(bounds: &Aabb) -> Option<f64> {
    let far = bounds.min.iter().chain(&bounds.max).fold(0.0_f64, |far, x| far.max(x.abs()));
    (far > FARTHEST).then_some(far)
}

/// Orders triangles into a tree and fits its boxes. Returns the triangles in order, and the mesh
/// without vertices, triangles and their sources.
fn over(
    vertices: &[[f64; 3]],
    triangles: &[[u32; 3]],
    counts_cells: bool,
) -> Result<(Vec<Item>, MeshHierarchy), MeshBuildError> {
    let bounds = Aabb::of(vertices.iter().copied());
    if let Some(far) = too_far(&bounds) {
        return Err(MeshBuildError::TooFar(far));
    }
    let frame = Frame::around(bounds.min, bounds.max);
    let local: Vec<[f32; 3]> = map_all(vertices, |p| frame.to_local(*p));
    let corners_of = |i: usize| triangles[i].map(|v| local[v as usize]);

    let topology = Topology::new(id32(triangles.len()), id32(LEAF_TRIANGLES));
    let mut items: Vec<Item> = map(triangles.len(), |i| {
        let [a, b, c] = corners_of(i);
        let position = [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0);
        Item { position, index: id32(i) }
    });
    let bounds_of: Vec<Bounds> = map(triangles.len(), |i| Bounds::of(&corners_of(i)));
    let mut boxes = vec![OrientedBox::default(); topology.len()];
    let count = items.len();
    split(&mut items, &topology, count, Parts::Triangles(&bounds_of), &mut boxes);

    let mut blocks = vec![TriangleBlock::zeroed(); topology.leaves()];
    fill(&mut blocks, |number| block(&topology, number, |i| corners_of(items[i].index as usize)));
    let axes = axes_of_nodes(&topology, |i| blocks[i / LEAF_TRIANGLES].get(i % LEAF_TRIANGLES));
    for (bounds, axes) in boxes.iter_mut().zip(axes) {
        bounds.axes = axes.unwrap_or(bounds.axes);
    }
    boxes_of_triangles(&topology, &mut boxes, &blocks);
    let mut packed = vec![Siblings::NONE; topology.inner()];
    siblings(&topology, &boxes, &mut packed);

    let cells = if counts_cells { filled_cells(&topology, &boxes, &blocks) } else { Vec::new() };
    let root = Root { bounds: boxes[0], ..Root::default() };
    let (ball, dropped) = (Ball::about(&root.bounds), DroppedTriangles::default());
    let meta = MeshMeta { frame, bounds, ball, root, identity: 0, given: 0, dropped };
    let arrays = MeshArrays {
        siblings: packed.into(),
        blocks: blocks.into(),
        cells: cells.into(),
        ..MeshArrays::default()
    };
    Ok((items, MeshHierarchy { meta, topology, arrays }))
}

/// Returns the block of a leaf, given the corners of each triangle in leaf order.
pub(crate) fn block(
    topology: &Topology,
    number: usize,
    corners: impl Fn(usize) -> [[f32; 3]; 3],
) -> TriangleBlock {
    let mut triangles = [[[0.0; 3]; 3]; LEAF_TRIANGLES];
    let own = topology.points_of_leaf(number);
    let count = own.len();
    for (place, i) in triangles.iter_mut().zip(own) {
        *place = corners(i);
    }
    TriangleBlock::new(&triangles[..count])
}

/// The vertices in the order of their first use, the triangles in leaf order, and the seams.
struct Ordered {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    seams: Vec<[u32; 3]>,
}

fn in_order(clean: &CleanMesh, items: &[Item]) -> Ordered {
    let mut numbers = vec![u32::MAX; clean.vertices().len()];
    let mut vertices = Vec::with_capacity(clean.vertices().len());
    let triangles = items
        .iter()
        .map(|item| {
            clean.triangles()[item.index as usize].map(|v| {
                let number = &mut numbers[v as usize];
                if *number == u32::MAX {
                    *number = id32(vertices.len());
                    vertices.push(clean.vertices()[v as usize]);
                }
                *number
            })
        })
        .collect();
    // A vertex that no triangle has keeps a number beyond theirs.
    let number = |v: u32| numbers.get(v as usize).copied().unwrap_or(v);
    let seams = clean.seams().iter().map(|t| t.map(number)).collect();
    Ordered { vertices, triangles, seams }
}
