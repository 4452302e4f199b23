//! Methods of `Mesh`: a prepared triangle mesh and the questions about it.

use std::path::PathBuf;

use nearmiss::geometry::TriangleMesh;
use nearmiss::mesh::CleanOptions;
use nearmiss::store::Progress;
use nearmiss::{Mesh as Prepared, MeshBuildOptions, Metric};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

use crate::answers::{Answer, AnswerRecord, Distance, MeshContactRecord};
use crate::arrays::{Points, corners};
use crate::cloud::rows;
use crate::failure::{refused, unloadable, unreadable, unwritable};
use crate::options::{OF_BUDGET, Options};
use crate::pair::{Apart, Contact, Overlap, Question, mesh_pair_of};
use crate::penetration::Penetration;
use crate::pool::ask;
use crate::poses::both;
use crate::prepare::watched;
use crate::record::array;
use crate::scan::check_of;
use crate::things::{Mesh, Side, Thing};

impl Mesh {
    fn new_of(mesh: Prepared) -> Self {
        Self { mesh }
    }

    fn build(py: Python<'_>, mesh: TriangleMesh, weld: f64) -> PyResult<Self> {
        let options = MeshBuildOptions::default().with_clean(CleanOptions::default().with_weld(weld));
        let built = watched(py, None, &Progress::default(), move || Prepared::build(&mesh, &options))?;
        built.map(Self::new_of).map_err(refused)
    }

    /// Prepares a question about this mesh and another thing.
    fn ask<'a, Q: Question<'a>>(
        &'a self,
        other: &'a Thing<'_>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Q> {
        Q::new([Side::Mesh(self), other.side()], options)
    }
}

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (vertices, triangles, *, weld = 0.0))]
    fn new(vertices: &Bound<'_, PyAny>, triangles: &Bound<'_, PyAny>, weld: f64) -> PyResult<Self> {
        let mesh =
            TriangleMesh::new(Points::new(vertices)?.to_doubles()?, corners(triangles)?).map_err(refused)?;
        Self::build(vertices.py(), mesh, weld)
    }

    /// Prepare the triangles of a file: OBJ, PLY with faces, STL, OFF or glTF.
    ///
    /// `format` is recognised by default; `weld` is that of `Mesh`.
    #[staticmethod]
    #[pyo3(signature = (path, *, format = None, weld = 0.0))]
    fn read(py: Python<'_>, path: PathBuf, format: Option<&str>, weld: f64) -> PyResult<Self> {
        let format = format.map(str::parse).transpose().map_err(refused)?;
        let mesh = py.detach(|| nearmiss::io::read_mesh(&path, format)).map_err(unreadable)?;
        Self::build(py, mesh, weld)
    }

    /// Open a prepared file (`.nm`) by mapping it. `check` is that of `Scan.open`.
    #[staticmethod]
    #[pyo3(signature = (path, *, check = "full"))]
    fn open(py: Python<'_>, path: PathBuf, check: &str) -> PyResult<Self> {
        let check = check_of(check)?;
        py.detach(|| Prepared::open(&path, check)).map(Self::new_of).map_err(unloadable)
    }

    /// Load a mesh from the bytes of `to_bytes` or of a prepared file.
    #[staticmethod]
    #[pyo3(signature = (data, *, check = "full"))]
    fn from_bytes(py: Python<'_>, data: &[u8], check: &str) -> PyResult<Self> {
        let check = check_of(check)?;
        let bytes = data.to_vec();
        py.detach(|| Prepared::from_bytes(bytes, check)).map(Self::new_of).map_err(unloadable)
    }

    /// Return the contents of a prepared file. Pickling uses them.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut bytes = Vec::new();
        py.detach(|| self.mesh.write_to(&mut bytes)).map_err(unwritable)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Save the mesh to a prepared file and return its length in bytes.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<u64> {
        py.detach(|| self.mesh.save(&path)).map_err(unwritable)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let py = slf.py();
        let bytes = slf.get().to_bytes(py)?;
        PyTuple::new(py, [slf.get_type().getattr("from_bytes")?, PyTuple::new(py, [bytes])?.into_any()])
    }

    fn __len__(&self) -> usize {
        self.mesh.len()
    }

    fn __repr__(&self) -> String {
        format!("<Mesh of {} triangles>", self.mesh.len())
    }

    /// The least and the greatest corner, of shape (2, 3).
    #[getter]
    fn bounds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let bounds = self.mesh.bounds();
        rows(py, [bounds.min, bounds.max].concat(), &[2, 3])
    }

    /// True if a part of the mesh is closed, and counts as solid in `penetration`.
    #[getter]
    fn is_closed(&self, py: Python<'_>) -> bool {
        // The closed parts are found when first asked for.
        py.detach(|| self.mesh.solid().is_closed())
    }

    /// Decide whether this mesh, at `own_pose`, touches `other`, at `pose`: a Mesh or any scan.
    ///
    /// Poses have shape (4, 4); the default is the identity. Options for two meshes: `p_min` and
    /// `k_min` (stop once `k_min` pairs of nodes, by default 3, are likely to collide with this
    /// probability), `work` and `seconds`; for a scan those of `Scan.collide`. Returns an Answer, in
    /// which the source of a mesh is the index of a triangle.
    #[pyo3(signature = (other, pose = None, own_pose = None, **options))]
    fn collide(
        &self,
        py: Python<'_>,
        other: Thing<'_>,
        pose: Option<&Bound<'_, PyAny>>,
        own_pose: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Answer> {
        self.ask::<Contact<'_>>(&other, options)?.one(py, [own_pose, pose]).map(Answer)
    }

    /// Answer `collide` for many poses on all cores; see `Scan.collide_each`.
    #[pyo3(signature = (other, poses, own_poses = None, **options))]
    fn collide_each<'py>(
        &self,
        other: Thing<'py>,
        poses: &Bound<'py, PyAny>,
        own_poses: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.ask::<Contact<'_>>(&other, options)?.each(poses.py(), [own_poses, Some(poses)])
    }

    /// Measure the distance of this mesh, at `own_pose`, and `other`, at `pose`: a Mesh or any scan.
    ///
    /// The distance of two meshes is exact: both bounds are equal, unless `work` or `seconds` end the search.
    /// Options for a scan are those of `Scan.distance`. Returns a Distance, in which the source of a
    /// mesh is the index of a triangle.
    #[pyo3(signature = (other, pose = None, own_pose = None, **options))]
    fn distance(
        &self,
        py: Python<'_>,
        other: Thing<'_>,
        pose: Option<&Bound<'_, PyAny>>,
        own_pose: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Distance> {
        self.ask::<Apart<'_>>(&other, options)?.one(py, [own_pose, pose]).map(Distance)
    }

    /// Answer `distance` for many poses on all cores; see `Scan.distance_each`.
    #[pyo3(signature = (other, poses, own_poses = None, **options))]
    fn distance_each<'py>(
        &self,
        other: Thing<'py>,
        poses: &Bound<'py, PyAny>,
        own_poses: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.ask::<Apart<'_>>(&other, options)?.each(poses.py(), [own_poses, Some(poses)])
    }

    /// Find a contact of each pair of triangles of two meshes that meet. Returns the Answer and the contacts,
    /// as a structured array of shape (N,). Contacts may be missing if `Answer.complete` is False.
    ///
    /// The fields of the array are `point`, `ends` (of the segment that both have in common, of shape (2,
    /// 3)), `normal_a`, `normal_b`, `triangle_a` and `triangle_b`. Options are `work` and `seconds`.
    #[pyo3(signature = (other, pose = None, own_pose = None, **options))]
    fn contacts<'py>(
        &self,
        other: &Bound<'py, Self>,
        pose: Option<&Bound<'py, PyAny>>,
        own_pose: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Answer, Bound<'py, PyAny>)> {
        let (py, meshes) = (other.py(), [&self.mesh, &other.get().mesh]);
        let options = Options::new(options, OF_BUDGET, Metric::Euclidean)?;
        let poses = both(meshes.map(|mesh| mesh as _), [own_pose, pose])?;
        let mut found = Vec::new();
        let (answer, is_complete) = ask(py, |scratch| {
            mesh_pair_of(&meshes, &poses).within(&options.budget()).contacts(&mut found, scratch.meshes())
        });
        let answer = Answer(AnswerRecord::of_meshes(&answer).with_list(is_complete));
        Ok((answer, array(py, found.iter().map(MeshContactRecord::new).collect())?))
    }

    /// Bound the length of the shortest move that takes `other`, at `pose`, out of this mesh, at
    /// `own_pose`. `other` is a Mesh or any scan. Closed parts of meshes are solid; `solid="b"` tells that
    /// the surface of a scan encloses a solid.
    ///
    /// Returns a Penetration: `other` is free if it moves by `upper` along `direction`, and no move shorter
    /// than `lower` frees it. Both are 0 for separate things. Options are `work` and `seconds`; for a scan
    /// those of `Scan.collide`.
    #[pyo3(signature = (other, pose = None, own_pose = None, *, solid = None, **options))]
    #[expect(clippy::too_many_arguments, reason = "names in Python")]
    fn penetration(
        &self,
        py: Python<'_>,
        other: Thing<'_>,
        pose: Option<&Bound<'_, PyAny>>,
        own_pose: Option<&Bound<'_, PyAny>>,
        solid: Option<&str>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Penetration> {
        Overlap::new([Side::Mesh(self), other.side()], solid, options)?.one(py, [own_pose, pose])
    }
}
