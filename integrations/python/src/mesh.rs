//! `Mesh`: a prepared triangle mesh and the questions about it.

use std::path::PathBuf;
use std::sync::OnceLock;

use nearmiss::geometry::TriangleMesh;
use nearmiss::mesh::CleanOptions;
use nearmiss::{
    DistanceOptions, DistancePlan, Mesh as Prepared, MeshBuildOptions, MeshPair, MeshScanPair, MeshScanPlan,
    MeshSolid, Pose, Scratch,
};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};

use crate::answers::{Answer, AnswerRecord, Distance, DistanceRecord, MeshContactRecord};
use crate::arrays::{Points, corners};
use crate::cloud::rows;
use crate::each::{each_answer, each_distance};
use crate::failure::{refused, unloadable, unreadable, unwritable};
use crate::options::{OF_BUDGET, OF_DISTANCE, OF_MESHES, OF_SCANS, Options};
use crate::pool::{ask, in_pool};
use crate::poses::{Placeable, PosePairs, Poses};
use crate::record::array;
use crate::scan::{Scan, check_of};

/// A prepared triangle mesh.
#[pyclass(frozen, module = "nearmiss")]
#[derive(Debug)]
pub(crate) struct Mesh {
    mesh: Prepared,
    /// The closed parts, once they were asked for.
    solid: OnceLock<MeshSolid>,
}

/// The thing that a mesh is compared with.
#[derive(FromPyObject)]
enum Other<'py> {
    Mesh(Bound<'py, Mesh>),
    Scan(Bound<'py, Scan>),
}

impl Other<'_> {
    fn thing(&self) -> &dyn Placeable {
        match self {
            Self::Mesh(mesh) => &mesh.get().mesh,
            Self::Scan(scan) => &scan.get().0,
        }
    }
}

/// A question about contact, with its options.
enum Contact<'a> {
    Meshes(&'a Prepared, Options),
    MeshAndScan(&'a nearmiss::Scan, MeshScanPlan, Options),
}

/// A question about distance, with its options.
enum Apart<'a> {
    Meshes(&'a Prepared, Options),
    MeshAndScan(&'a nearmiss::Scan, Box<DistancePlan>, Options),
}

impl Mesh {
    fn new_of(mesh: Prepared) -> Self {
        Self { mesh, solid: OnceLock::new() }
    }

    fn build(py: Python<'_>, mesh: &TriangleMesh, weld: f64) -> PyResult<Self> {
        let options = MeshBuildOptions::default().with_clean(CleanOptions::default().with_weld(weld));
        let built = py.detach(|| in_pool(|| Prepared::build(mesh, &options)))?;
        built.map(Self::new_of).map_err(refused)
    }

    fn contact<'a>(
        &'a self,
        other: &'a Other<'_>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Contact<'a>> {
        match other {
            Other::Mesh(mesh) => {
                let options = Options::of_metric(options, OF_MESHES, nearmiss::Metric::Euclidean)?;
                Ok(Contact::Meshes(&mesh.get().mesh, options))
            }
            Other::Scan(scan) => {
                let scan = &scan.get().0;
                let options = Options::new(options, OF_SCANS, scan)?;
                let plan = MeshScanPlan::new(&options.collide, scan).map_err(refused)?;
                Ok(Contact::MeshAndScan(scan, plan, options))
            }
        }
    }

    fn collide_at(&self, asked: &Contact<'_>, [a, b]: [Pose; 2], scratch: &mut Scratch) -> AnswerRecord {
        match asked {
            Contact::Meshes(other, options) => {
                let pair = MeshPair::new(self.mesh.at(&a), other.at(&b)).within(&options.budget());
                AnswerRecord::of_meshes(&match &options.quality {
                    Some(quality) => pair.collide_likely(quality, scratch.meshes()),
                    None => pair.collide(scratch.meshes()),
                })
            }
            Contact::MeshAndScan(scan, plan, options) => {
                let pair = MeshScanPair::new(scan.at(&b), self.mesh.at(&a)).within(&options.budget());
                AnswerRecord::new(&pair.collide(plan, scratch)).swapped()
            }
        }
    }

    fn apart<'a>(&'a self, other: &'a Other<'_>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Apart<'a>> {
        match other {
            Other::Mesh(mesh) => {
                let options = Options::of_metric(options, OF_BUDGET, nearmiss::Metric::Euclidean)?;
                Ok(Apart::Meshes(&mesh.get().mesh, options))
            }
            Other::Scan(scan) => {
                let scan = &scan.get().0;
                let options = Options::new(options, OF_DISTANCE, scan)?;
                let asked = DistanceOptions::default()
                    .with_semantics(options.collide.semantics)
                    .with_relative(options.relative);
                let plan = DistancePlan::against_mesh(&asked, scan).map_err(refused)?;
                Ok(Apart::MeshAndScan(scan, Box::new(plan), options))
            }
        }
    }

    fn distance_at(&self, asked: &Apart<'_>, [a, b]: [Pose; 2], scratch: &mut Scratch) -> DistanceRecord {
        match asked {
            Apart::Meshes(other, options) => {
                let pair = MeshPair::new(self.mesh.at(&a), other.at(&b)).within(&options.budget());
                DistanceRecord::of_meshes(&pair.distance(scratch.meshes()))
            }
            Apart::MeshAndScan(scan, plan, options) => {
                let pair = MeshScanPair::new(scan.at(&b), self.mesh.at(&a)).within(&options.budget());
                DistanceRecord::new(&pair.distance(plan, scratch)).swapped()
            }
        }
    }

    /// Returns the one pose of each of both.
    fn both(
        &self,
        other: &dyn Placeable,
        pose: Option<&Bound<'_, PyAny>>,
        own: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<[Pose; 2]> {
        Ok([Poses::new(own)?.one(&self.mesh)?, Poses::new(pose)?.one(other)?])
    }

    fn solid(&self) -> &MeshSolid {
        self.solid.get_or_init(|| MeshSolid::new(&self.mesh))
    }
}

#[pymethods]
impl Mesh {
    /// Prepare triangles: vertices of shape (N, 3) and their indices of shape (M, 3).
    ///
    /// Vertices at one place are welded, those up to `weld` apart too. Triangles without area and
    /// repeated ones are dropped. Takes about 0.1 s for 100,000 triangles.
    #[new]
    #[pyo3(signature = (vertices, triangles, *, weld = 0.0))]
    fn new(vertices: &Bound<'_, PyAny>, triangles: &Bound<'_, PyAny>, weld: f64) -> PyResult<Self> {
        let mesh =
            TriangleMesh::new(Points::new(vertices)?.to_doubles()?, corners(triangles)?).map_err(refused)?;
        Self::build(vertices.py(), &mesh, weld)
    }

    /// Prepare the triangles of a file: OBJ, PLY with faces, STL, OFF or glTF.
    ///
    /// `format` is recognised by default; `weld` is that of `Mesh`.
    #[staticmethod]
    #[pyo3(signature = (path, *, format = None, weld = 0.0))]
    fn read(py: Python<'_>, path: PathBuf, format: Option<&str>, weld: f64) -> PyResult<Self> {
        let format = format.map(str::parse).transpose().map_err(refused)?;
        let mesh = py.detach(|| nearmiss::io::read_mesh(&path, format)).map_err(unreadable)?;
        Self::build(py, &mesh, weld)
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
    fn is_closed(&self) -> bool {
        self.solid().is_closed()
    }

    /// Decide whether this mesh, at `own_pose`, touches `other`, at `pose`: a Mesh or a Scan.
    ///
    /// Poses have shape (4, 4); the default is the identity. Options for two meshes: `p_min` and
    /// `k_min` (stop once `k_min` pairs of nodes, by default 3, are likely to collide with this
    /// probability), `work` and `seconds`; for a scan those of `Scan.collide`. Returns an Answer, in
    /// which the source of a mesh is the index of a triangle.
    #[pyo3(signature = (other, pose = None, own_pose = None, **options))]
    fn collide(
        &self,
        py: Python<'_>,
        other: Other<'_>,
        pose: Option<&Bound<'_, PyAny>>,
        own_pose: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Answer> {
        let asked = self.contact(&other, options)?;
        let poses = self.both(other.thing(), pose, own_pose)?;
        Ok(Answer(ask(py, |scratch| self.collide_at(&asked, poses, scratch))))
    }

    /// Answer `collide` for many poses on all cores; see `Scan.collide_each`.
    #[pyo3(signature = (other, poses, own_poses = None, **options))]
    fn collide_each<'py>(
        &self,
        other: Other<'py>,
        poses: &Bound<'py, PyAny>,
        own_poses: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let asked = self.contact(&other, options)?;
        let given = [Poses::new(own_poses)?, Poses::new(Some(poses))?];
        let pairs = PosePairs::new(&given, [&self.mesh, other.thing()])?;
        each_answer(poses.py(), &pairs, |poses, scratch| self.collide_at(&asked, poses, scratch))
    }

    /// Measure the distance of this mesh, at `own_pose`, and `other`, at `pose`: a Mesh or a Scan.
    ///
    /// The distance of two meshes is exact: both bounds are equal, unless `work` or `seconds` end the search.
    /// Options for a scan are those of `Scan.distance`. Returns a Distance, in which the source of a
    /// mesh is the index of a triangle.
    #[pyo3(signature = (other, pose = None, own_pose = None, **options))]
    fn distance(
        &self,
        py: Python<'_>,
        other: Other<'_>,
        pose: Option<&Bound<'_, PyAny>>,
        own_pose: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Distance> {
        let asked = self.apart(&other, options)?;
        let poses = self.both(other.thing(), pose, own_pose)?;
        Ok(Distance(ask(py, |scratch| self.distance_at(&asked, poses, scratch))))
    }

    /// Answer `distance` for many poses on all cores; see `Scan.distance_each`.
    #[pyo3(signature = (other, poses, own_poses = None, **options))]
    fn distance_each<'py>(
        &self,
        other: Other<'py>,
        poses: &Bound<'py, PyAny>,
        own_poses: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let asked = self.apart(&other, options)?;
        let given = [Poses::new(own_poses)?, Poses::new(Some(poses))?];
        let pairs = PosePairs::new(&given, [&self.mesh, other.thing()])?;
        each_distance(poses.py(), &pairs, |poses, scratch| self.distance_at(&asked, poses, scratch))
    }

    /// Return a contact of each pair of triangles of two meshes that meet, as a structured array of
    /// shape (N,).
    ///
    /// Its fields are `point`, `ends` (of the segment that both have in common, of shape (2, 3)),
    /// `normal_a`, `normal_b`, `triangle_a` and `triangle_b`.
    #[pyo3(signature = (other, pose = None, own_pose = None))]
    fn contacts<'py>(
        &self,
        other: &Bound<'py, Self>,
        pose: Option<&Bound<'py, PyAny>>,
        own_pose: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, other) = (other.py(), &other.get().mesh);
        let [a, b] = self.both(other, pose, own_pose)?;
        let mut found = Vec::new();
        ask(py, |scratch| {
            MeshPair::new(self.mesh.at(&a), other.at(&b)).contacts(&mut found, scratch.meshes())
        });
        array(py, found.iter().map(MeshContactRecord::new).collect())
    }

    /// Bound the length of the shortest move that takes `other`, at `pose`, out of this mesh, at
    /// `own_pose`. Closed parts are solid.
    ///
    /// Returns (lower, upper, direction): `other` is free if it moves by `upper` along the direction,
    /// and no move shorter than `lower` frees it. Both are 0 for separate meshes.
    #[pyo3(signature = (other, pose = None, own_pose = None, **options))]
    fn penetration(
        &self,
        other: &Bound<'_, Self>,
        pose: Option<&Bound<'_, PyAny>>,
        own_pose: Option<&Bound<'_, PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<(f64, f64, [f64; 3])> {
        let (py, other) = (other.py(), other.get());
        let options = Options::of_metric(options, OF_BUDGET, nearmiss::Metric::Euclidean)?;
        let [a, b] = self.both(&other.mesh, pose, own_pose)?;
        let found = ask(py, |scratch| {
            let pair = MeshPair::new(self.mesh.at(&a), other.mesh.at(&b)).within(&options.budget());
            pair.penetration([self.solid(), other.solid()], scratch.meshes())
        });
        Ok((found.lower, found.upper, found.direction))
    }
}
