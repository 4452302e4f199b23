//! `Mesh`: a prepared mesh, in memory or in a file.

use std::io::Write;
use std::ops::Deref;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use nearmiss_geometry::{Pose, TriangleMesh};
use nearmiss_hierarchy::{MeshBuildError, MeshBuildOptions, MeshHierarchy, MeshMeta};
use nearmiss_query::{MeshSolid, PlacedMesh, PreparedMesh};
use nearmiss_store::{Bytes, Check, File, LoadError, WriteError, Writer};

/// Version of the layout of a mesh's sections and metadata. Raise it whenever one of them is added
/// or changes.
const VERSION: u32 = 3;

/// A triangle mesh prepared for queries. Cloning it costs a reference count. Threads can share it.
///
/// Dereferences to its [`MeshHierarchy`].
///
/// ```
/// use nearmiss::{Check, Mesh, MeshBuildOptions, MeshPair, MeshScratch, Pose, TriangleMesh};
///
/// let vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let tetrahedron = TriangleMesh::new(vertices, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])?;
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("tetrahedron.nm");
/// Mesh::build(&tetrahedron, &MeshBuildOptions::default())?.save(&path)?;
///
/// let mesh = Mesh::open(&path, Check::Structure)?;
/// let moved = Pose::from_translation([0.5, 0.1, 0.1]);
/// let pair = MeshPair::new(mesh.at(&Pose::IDENTITY), mesh.at(&moved));
/// let answer = pair.collide(&mut MeshScratch::default());
/// assert!(answer.verdict.is_intersecting());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Mesh {
    hierarchy: Arc<MeshHierarchy>,
    solid: Arc<OnceLock<MeshSolid>>,
}

impl Deref for Mesh {
    type Target = MeshHierarchy;

    fn deref(&self) -> &MeshHierarchy {
        &self.hierarchy
    }
}

impl PreparedMesh for Mesh {
    #[inline]
    fn at(&self, pose: &Pose) -> PlacedMesh<'_> {
        Self::at(self, pose)
    }
}

impl Mesh {
    /// The kind of the container of a mesh, as [`File::kind`] returns it.
    pub const KIND: [u8; 4] = *b"MESH";

    /// Prepares `mesh`. Takes about 50 ms for 100,000 triangles on two cores.
    ///
    /// # Errors
    /// As [`MeshHierarchy::build`].
    pub fn build(mesh: &TriangleMesh, options: &MeshBuildOptions) -> Result<Self, MeshBuildError> {
        Ok(Self::new(MeshHierarchy::build(mesh, options)?))
    }

    fn new(hierarchy: MeshHierarchy) -> Self {
        Self { hierarchy: Arc::new(hierarchy), solid: Arc::default() }
    }

    /// Returns the closed parts of the mesh, which make it a solid. The first call finds them, in about 20 ms
    /// for 100,000 triangles; clones share them.
    #[must_use]
    pub fn solid(&self) -> &MeshSolid {
        self.solid.get_or_init(|| MeshSolid::new(&self.hierarchy))
    }

    /// Places the mesh at `pose`, which maps the frame of its input to the world.
    #[inline]
    #[must_use]
    pub fn at(&self, pose: &Pose) -> PlacedMesh<'_> {
        PlacedMesh::new(&self.hierarchy, pose)
    }

    /// Saves the mesh to a file and returns the file's length in bytes. An existing file is replaced
    /// atomically.
    ///
    /// # Errors
    /// Fails if the file cannot be written. An existing file then stays intact.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<u64, WriteError> {
        self.writer()?.save(path)
    }

    /// Writes the contents of a file of [`Mesh::save`] to `out` and returns their length in bytes.
    ///
    /// # Errors
    /// Fails if `out` fails.
    pub fn write_to(&self, out: impl Write) -> Result<u64, WriteError> {
        self.writer()?.write_to(out)
    }

    fn writer(&self) -> Result<Writer<'_>, WriteError> {
        let mut writer = Writer::new(Self::KIND, VERSION);
        writer.metadata(self.hierarchy.meta())?;
        self.hierarchy.add_to(&mut writer)?;
        Ok(writer)
    }

    /// Opens a saved mesh by mapping its file. Nothing is copied. The checks and their meaning are
    /// those of [`Scan::open`](crate::Scan::open).
    ///
    /// # Errors
    /// Fails if the file cannot be opened, is not a prepared mesh, has another version, is damaged
    /// or is inconsistent.
    pub fn open(path: impl AsRef<Path>, check: Check) -> Result<Self, LoadError> {
        Self::load(&File::open(path, check)?, check)
    }

    /// Loads a mesh from bytes written by [`Mesh::save`] or [`Mesh::write_to`].
    ///
    /// # Errors
    /// As [`Mesh::open`].
    pub fn from_bytes(bytes: impl Into<Bytes>, check: Check) -> Result<Self, LoadError> {
        Self::load(&File::from_bytes(bytes, check)?, check)
    }

    fn load(file: &File, check: Check) -> Result<Self, LoadError> {
        file.expect(Self::KIND, VERSION..=VERSION)?;
        let meta: MeshMeta = file.metadata()?;
        Ok(Self::new(MeshHierarchy::load(file, meta, check)?))
    }
}
