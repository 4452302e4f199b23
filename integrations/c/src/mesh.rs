//! Meshes: preparing, opening, saving.

use std::ffi::c_char;
use std::mem::MaybeUninit;

use nearmiss::MeshBuildOptions;
use nearmiss::geometry::TriangleMesh;
use nearmiss::mesh::CleanOptions;

use crate::file::{check, unloadable, unreadable, unwritable};
use crate::handle::{Handle, free, get, make, opaque};
use crate::pointer::{fill, path, slice, write};
use crate::status::{Failure, Status, guard};

/// A prepared triangle mesh, for worlds (`nearmiss_world_insert_mesh`). Any number of threads may use one at
/// the same time.
#[derive(Debug)]
pub struct Mesh(Handle<nearmiss::Mesh>);

opaque!(Mesh of nearmiss::Mesh as b"nm-mesh.");

/// Facts about a mesh. Lengths are in the units of its input.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct MeshAbout {
    /// The number of triangles.
    pub triangles: u64,
    /// The number of vertices.
    pub vertices: u64,
    /// The least corner of the bounds.
    pub min: [f64; 3],
    /// The greatest corner of the bounds.
    pub max: [f64; 3],
    /// True if a part of the mesh is closed, and counts as solid in `nearmiss_world_penetration`.
    pub is_closed: bool,
    /// The input triangles that were dropped, as they have no area.
    pub degenerate: u64,
    /// The input triangles that were dropped, as they repeat others.
    pub duplicate: u64,
    /// The input vertices that were welded to others.
    pub welded: u64,
}

fn prepare(mesh: &TriangleMesh, weld: f64) -> Result<nearmiss::Mesh, Failure> {
    let options = MeshBuildOptions::default().with_clean(CleanOptions::default().with_weld(weld));
    nearmiss::Mesh::build(mesh, &options).map_err(Failure::argument)
}

/// Prepares `triangle_count` triangles, three indices of vertices each, over `vertex_count` vertices, three
/// numbers each, and writes the handle to `out`. Vertices within `weld` of each other become one; 0 welds
/// those at the same place. Takes about 50 ms for 100,000 triangles on two cores. Thread safety: any thread.
///
/// # Safety
/// `vertices` are `3 · vertex_count` numbers, `triangles` are `3 · triangle_count`; `out` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_mesh_from_triangles(
    vertices: *const f64,
    vertex_count: usize,
    triangles: *const u32,
    triangle_count: usize,
    weld: f64,
    out: Option<&mut MaybeUninit<*mut Mesh>>,
) -> Status {
    guard(|| {
        make(out, || {
            // SAFETY: the caller promises the numbers; three in a row are one array.
            let vertices = unsafe { slice(vertices.cast::<[f64; 3]>(), vertex_count, "vertices") }?;
            // SAFETY: as before.
            let triangles = unsafe { slice(triangles.cast::<[u32; 3]>(), triangle_count, "triangles") }?;
            let mesh = TriangleMesh::new(vertices.to_vec(), triangles.to_vec()).map_err(Failure::argument)?;
            prepare(&mesh, weld)
        })
    })
}

/// Reads and prepares the triangles of a file: PLY, OBJ, STL, OFF or glTF. `weld` is that of
/// `nearmiss_mesh_from_triangles`. Thread safety: any thread.
///
/// # Safety
/// `file` is null or text that ends with a zero byte; `out` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_mesh_read(
    file: *const c_char,
    weld: f64,
    out: Option<&mut MaybeUninit<*mut Mesh>>,
) -> Status {
    guard(|| {
        make(out, || {
            // SAFETY: the caller promises the text.
            let mesh = nearmiss::io::read_mesh(unsafe { path(file) }?, None).map_err(unreadable)?;
            prepare(&mesh, weld)
        })
    })
}

/// Opens a prepared file by mapping it; `checks` is a `NearmissChecks`. The file must not be changed in
/// place while it is open; saving over it is fine. Thread safety: any thread.
///
/// # Safety
/// `file` is null or text that ends with a zero byte; `out` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_mesh_open(
    file: *const c_char,
    checks: i32,
    out: Option<&mut MaybeUninit<*mut Mesh>>,
) -> Status {
    guard(|| {
        make(out, || {
            // SAFETY: the caller promises the text.
            nearmiss::Mesh::open(unsafe { path(file) }?, check(checks)?).map_err(unloadable)
        })
    })
}

/// Loads a mesh from the bytes of a prepared file, which are copied; `checks` is a `NearmissChecks`.
/// Thread safety: any thread.
///
/// # Safety
/// `bytes` are `length` bytes; `out` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_mesh_from_bytes(
    bytes: *const u8,
    length: usize,
    checks: i32,
    out: Option<&mut MaybeUninit<*mut Mesh>>,
) -> Status {
    guard(|| {
        make(out, || {
            // SAFETY: the caller promises the bytes.
            let bytes = unsafe { slice(bytes, length, "bytes") }?.to_vec();
            nearmiss::Mesh::from_bytes(bytes, check(checks)?).map_err(unloadable)
        })
    })
}

/// Saves a mesh to a prepared file, atomically. Thread safety: any thread.
///
/// # Safety
/// `file` is null or text that ends with a zero byte; `mesh` is null or a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_mesh_save(mesh: Option<&Mesh>, file: *const c_char) -> Status {
    guard(|| {
        // SAFETY: the caller promises the text.
        get(mesh, "mesh")?.save(unsafe { path(file) }?).map(drop).map_err(unwritable)
    })
}

/// Writes the bytes of a prepared file to `buffer`, as many as its capacity holds, and their whole
/// number to `length`. Ask with a capacity of 0 first. Thread safety: any thread.
///
/// # Safety
/// `buffer` are `capacity` bytes that nothing else uses; other pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_mesh_to_bytes(
    mesh: Option<&Mesh>,
    buffer: *mut u8,
    capacity: usize,
    length: Option<&mut MaybeUninit<usize>>,
) -> Status {
    guard(|| {
        let mut bytes = Vec::new();
        get(mesh, "mesh")?.write_to(&mut bytes).map_err(unwritable)?;
        // SAFETY: the caller promises the buffer.
        unsafe { fill(bytes.into_iter(), (buffer, capacity), length) }
    })
}

/// Writes facts about a mesh to `out`. The first call finds the closed parts, in 20 ms for 100,000 triangles.
/// Thread safety: any thread.
#[unsafe(no_mangle)]
pub extern "C" fn nearmiss_mesh_about(
    mesh: Option<&Mesh>,
    out: Option<&mut MaybeUninit<MeshAbout>>,
) -> Status {
    guard(|| {
        let mesh = get(mesh, "mesh")?;
        let (bounds, dropped) = (mesh.bounds(), mesh.dropped());
        let about = MeshAbout {
            triangles: mesh.len() as u64,
            vertices: mesh.vertices() as u64,
            min: bounds.min,
            max: bounds.max,
            is_closed: mesh.solid().is_closed(),
            degenerate: dropped.degenerate.into(),
            duplicate: dropped.duplicate.into(),
            welded: dropped.welded_vertices.into(),
        };
        write(out, about)
    })
}

/// Frees a mesh; null is fine. Worlds keep the meshes that were inserted. Thread safety: no other call may
/// use the handle at the same time or later.
///
/// # Safety
/// `mesh` is null or a handle that no other call uses.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn nearmiss_mesh_free(mesh: *mut Mesh) -> Status {
    guard(|| free(mesh))
}
