//! `Scan`: a preprocessed scan, in memory or in a file.

use std::io::Write;
use std::ops::Deref;
use std::path::Path;
use std::sync::Arc;

use nearmiss_geometry::{PointCloud, Pose, Scanner};
use nearmiss_graph::{
    GeodesicKernel, GraphError, GraphOptions, KernelScratch, Sides, SurfaceGraph, SurfaceGraphMeta,
    SurfaceSamples, Viewpoint,
};
use nearmiss_hierarchy::{BuildError, BuildOptions, HierarchyMeta, PointHierarchy, ScanPoints};
use nearmiss_query::{Placed, Prepared, ShapeIndex};
use nearmiss_store::{Bytes, Check, File, Flaw, Progress, Workspace, Writer};
use nearmiss_surface::Metric;
use serde::{Deserialize, Serialize};

pub use nearmiss_store::{LoadError, WriteError as SaveError};

/// Version of the layout of a scan's sections and metadata.
const VERSION: u32 = 11;

/// The oldest layout version that can be read; the error for an older file names its version.
/// Whenever a section or a metadata field is added or changes, raise this together with [`VERSION`]
/// and record a golden file.
const OLDEST: u32 = 11;

/// The progress of a fit for the geodesic kernel once all points are fitted.
const FITTED: f64 = 0.7;

/// The points that are fitted between two reports of the progress.
const TOLD: u32 = 1024;

/// Metadata of a scan's file: everything except the arrays.
#[derive(Debug, Serialize, Deserialize)]
struct ScanMeta {
    hierarchy: HierarchyMeta,
    graph: Option<SurfaceGraphMeta>,
    density: Option<Density>,
}

/// Sampling density at which [`Interpolation`](crate::Interpolation) without hierarchy draws points
/// of a scan.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Density {
    /// Number of surfels that the surface is taken to consist of.
    pub surfels: u32,
    /// Measured rate of wrong verdicts with this number of surfels.
    pub error: f64,
}

/// A scan preprocessed for queries. Cloning it costs a reference count. Threads can share it.
///
/// Dereferences to its [`PointHierarchy`].
#[derive(Debug, Clone)]
pub struct Scan {
    hierarchy: Arc<PointHierarchy>,
    graph: Option<Arc<SurfaceGraph>>,
    shapes: Option<Arc<ShapeIndex>>,
    density: Option<Density>,
}

impl Deref for Scan {
    type Target = PointHierarchy;

    fn deref(&self) -> &PointHierarchy {
        &self.hierarchy
    }
}

impl Scan {
    /// The kind of the container of a scan, as [`File::kind`] returns it.
    pub const KIND: [u8; 4] = *b"SCAN";

    pub(crate) fn of(hierarchy: PointHierarchy, graph: Option<Arc<SurfaceGraph>>) -> Self {
        Self { hierarchy: Arc::new(hierarchy), graph, shapes: None, density: None }
    }

    /// Returns the prepared points without graph, shape index and density.
    pub(crate) fn into_hierarchy(self) -> PointHierarchy {
        Arc::unwrap_or_clone(self.hierarchy)
    }

    /// Preprocesses `cloud`. Takes about 1.5 s for a million points on two cores.
    ///
    /// # Errors
    /// Fails if an option is out of range; the error names it.
    pub fn build(cloud: &PointCloud, options: &BuildOptions) -> Result<Self, BuildError> {
        Ok(Self::of(PointHierarchy::build(cloud, options)?, None))
    }

    /// Preprocesses points that may be stored in files, and keeps intermediate and final arrays in
    /// a workspace. The scan may thus be larger than memory. The result is the same as that of
    /// [`Scan::build`].
    ///
    /// ```
    /// # use nearmiss::{BuildOptions, GatheredPoints, Intake, PointCloud, PointGatherer, Scan, Workspace};
    /// # let points: Vec<[f64; 3]> =
    /// #     (0..400_u32).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
    /// let folder = tempfile::tempdir()?;
    /// let work = Workspace::in_folder(folder.path().join("work"), "what it is made of", 500_000_000)?;
    /// let points = match GatheredPoints::kept(&work)? {
    ///     Some(kept) => kept,
    ///     None => {
    ///         let mut intake = Intake::default();
    ///         points.iter().for_each(|p| intake.add(*p));
    ///         let mut gatherer = PointGatherer::new(&work, &intake)?;
    ///         points.chunks(100).for_each(|some| gatherer.add(some, |_, _| true));
    ///         gatherer.finish()?
    ///     }
    /// };
    /// let scan = Scan::build_in(&points.points(), &BuildOptions::default(), &work)?;
    /// assert_eq!(scan.len(), 400);
    /// drop(scan);
    /// work.remove();
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Fails if an option is out of range, in which case the error names it, or if the workspace is
    /// full.
    pub fn build_in(
        points: &ScanPoints<'_>,
        options: &BuildOptions,
        work: &Workspace,
    ) -> Result<Self, BuildError> {
        Ok(Self::of(PointHierarchy::build_in(points, options, work)?, None))
    }

    /// Adds a proximity graph over the points of `cloud`, the cloud that the scan was built from,
    /// and orients the normals along the graph.
    ///
    /// The side of the normals is that of the cloud's own normals if it has any. Otherwise normals
    /// point towards `scanner`, a position in the frame of the cloud, or towards the cloud's own
    /// [scanners](PointCloud::scanners). Without a scanner they point outwards. Takes about as long
    /// as [`Scan::build`], and about three times as long with the map of close pairs.
    ///
    /// ```
    /// # use nearmiss::{BuildOptions, GraphOptions, PointCloud, Scan};
    /// # let points: Vec<[f64; 3]> =
    /// #     (0..400_u32).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
    /// let cloud = PointCloud::from_positions(&points)?;
    /// let above = [10.0, 10.0, 5.0];
    /// let scan = Scan::build(&cloud, &BuildOptions::default())?;
    /// let scan = scan.with_graph(&cloud, &GraphOptions::default(), Some(above))?;
    /// assert!(scan.normals().iter().all(|n| n[2] > 0.9));
    /// assert_eq!(scan.graph().map(|graph| graph.counts().components), Some(1));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Fails if an option is out of range; the error names it. [`GraphError::NoClosePairs`] if the
    /// scan [uses the geodesic kernel](Self::with_geodesic_kernel), which is then fitted again, and
    /// `options` exclude the map of close pairs.
    pub fn with_graph(
        self,
        cloud: &PointCloud,
        options: &GraphOptions,
        scanner: Option<[f64; 3]>,
    ) -> Result<Self, GraphError> {
        self.with_graph_watched(cloud, options, scanner, &Progress::default())
    }

    /// Like [`Self::with_graph`], and tells `progress` the share of the work that is done. The work
    /// for the geodesic kernel is not part of it.
    ///
    /// # Errors
    /// As [`Self::with_graph`].
    pub fn with_graph_watched(
        self,
        cloud: &PointCloud,
        options: &GraphOptions,
        scanner: Option<[f64; 3]>,
        progress: &Progress,
    ) -> Result<Self, GraphError> {
        let metric = self.metric();
        if let Some(place) = scanner.filter(|place| place.iter().any(|c| !c.is_finite())) {
            return Err(GraphError::Scanner(place));
        }
        let mut hierarchy = Arc::unwrap_or_clone(self.hierarchy);
        let own = cloud.normals().map(|normals| in_order_of(&hierarchy, cloud, normals));
        let each = if scanner.is_none() { viewpoints(&hierarchy, cloud) } else { None };
        let one = scanner.map(|place| Viewpoint::One(hierarchy.frame().to_local(place)));
        let scanner = one.or(each.as_deref().map(Viewpoint::Each));
        let mut normals = hierarchy.normals().to_vec();
        let sides = Sides { normals: own.as_deref(), scanner };
        let graph = SurfaceGraph::build_watched(samples(&hierarchy), sides, &mut normals, options, progress)?;
        hierarchy.turn_normals(&normals);
        let scan = Self::of(hierarchy, Some(Arc::new(graph)));
        match metric {
            Metric::Euclidean => Ok(scan),
            Metric::Geodesic => scan.with_geodesic_kernel(),
        }
    }

    /// Fits the scan for the geodesic kernel (Klein & Zachmann 2005, §3).
    ///
    /// Its normals, discs and boxes become those of f with distances along the graph, which keeps
    /// apart sheets that straight-line distances merge. Queries use the same distances. Only
    /// contacts can be certified then, never separations. [`Scan::save`] stores the metric.
    ///
    /// ```
    /// # use nearmiss::{BuildOptions, GraphOptions, Metric, Paths, PointCloud, Scan};
    /// # let points: Vec<[f64; 3]> =
    /// #     (0..400_u32).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
    /// let cloud = PointCloud::from_positions(&points)?;
    /// let scan = Scan::build(&cloud, &BuildOptions::default())?;
    /// let options = GraphOptions::default().with_close_pairs(Some(Paths::Rebuilt));
    /// let scan = scan.with_graph(&cloud, &options, None)?.with_geodesic_kernel()?;
    /// assert_eq!(scan.metric(), Metric::Geodesic);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`GraphError::NoClosePairs`] if the scan has no graph, or one without a map of close pairs.
    pub fn with_geodesic_kernel(self) -> Result<Self, GraphError> {
        self.with_geodesic_kernel_watched(&Progress::default())
    }

    /// Like [`Self::with_geodesic_kernel`], and tells `progress` the share of the work that is
    /// done.
    ///
    /// # Errors
    /// As [`Self::with_geodesic_kernel`].
    pub fn with_geodesic_kernel_watched(self, progress: &Progress) -> Result<Self, GraphError> {
        let Self { hierarchy, graph, density, .. } = self;
        let graph = graph.ok_or(GraphError::NoClosePairs)?;
        let mut hierarchy = Arc::unwrap_or_clone(hierarchy);
        let (positions, radii) = (hierarchy.positions().to_vec(), hierarchy.radii().to_vec());
        let plan = *hierarchy.plan();
        let samples = SurfaceSamples { plan: &plan, positions: &positions, radii: &radii };
        let kernel = graph.kernel(samples).ok_or(GraphError::NoClosePairs)?;
        #[expect(clippy::cast_precision_loss, reason = "a share")]
        let step = FITTED * f64::from(TOLD) / positions.len() as f64;
        hierarchy.use_metric(Metric::Geodesic, |i, scratch: &mut KernelScratch, supporting| {
            if i.is_multiple_of(TOLD) {
                progress.add(step);
            }
            let (at, near) = kernel.evaluate_at(i, scratch);
            supporting.extend(near.iter().map(|close| close.point));
            at
        });
        Ok(Self { density, ..Self::of(hierarchy, Some(graph)) })
    }

    /// Adds a shape index, which speeds up large numbers of queries with [`Placed::touches`],
    /// [`Placed::nearest`], and small shapes and rays against a [`Target`](nearmiss_query::Target).
    /// Takes about 20 ms for 100,000 points, and 0.1 ms more where a shape comes for the first time;
    /// [`ShapeIndex`] tells when that pays off. The index is not saved.
    ///
    /// ```
    /// # use nearmiss::{BuildOptions, PointCloud, Pose, Scan, Shape};
    /// # let points: Vec<[f64; 3]> =
    /// #     (0..400_u32).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
    /// # let cloud = PointCloud::from_positions(&points)?;
    /// let scan = Scan::build(&cloud, &BuildOptions::default())?.with_shapes();
    /// let placed = scan.at(&Pose::IDENTITY);
    /// let gripper = Shape::Sphere { centre: [5.0, 5.0, 1.2], radius: 1.0 };
    /// assert!(!placed.touches(&gripper));
    /// assert_eq!(placed.nearest(&gripper, 1.0).map(|near| near.point), Some([5.0, 5.0, 0.0]));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn with_shapes(self) -> Self {
        Self { shapes: Some(Arc::new(ShapeIndex::new(&self.hierarchy))), ..self }
    }

    /// Returns the proximity graph over the points, if one was built.
    #[must_use]
    pub fn graph(&self) -> Option<&SurfaceGraph> {
        self.graph.as_deref()
    }

    /// Returns f with distances along the graph (Klein & Zachmann 2005, eq. 5), in the frame of the
    /// stored positions. `None` without a graph with a map of close pairs.
    #[must_use]
    pub fn geodesic_kernel(&self) -> Option<GeodesicKernel<'_>> {
        self.graph.as_ref()?.kernel(samples(&self.hierarchy))
    }

    /// Saves the scan to a file and returns the file's length in bytes. An existing file is
    /// replaced atomically.
    ///
    /// # Errors
    /// Fails if the file cannot be written. An existing file then stays intact.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<u64, SaveError> {
        let meta = self.meta();
        self.writer(&meta)?.save(path)
    }

    /// Computes everything that searches along the graph otherwise compute at first use, if there
    /// is a graph.
    ///
    /// Takes some tenths of a second for a million points with a map of close pairs, and about
    /// 1.5 s without. The first [`Interpolation`](crate::Interpolation) is then as fast as later
    /// ones, and keeps its deadline.
    pub fn make_ready(&self) {
        if let Some(graph) = &self.graph {
            graph.make_ready(samples(&self.hierarchy));
        }
    }

    /// Sets the density for searches that draw points of the scan.
    #[must_use]
    pub fn with_density(self, density: Density) -> Self {
        Self { density: Some(density), ..self }
    }

    /// Returns the density, if one was set.
    #[must_use]
    pub fn density(&self) -> Option<Density> {
        self.density
    }

    /// Writes the contents of a file of [`Scan::save`] to `out` and returns their length in bytes.
    ///
    /// # Errors
    /// Fails if `out` fails.
    pub fn write_to(&self, out: impl Write) -> Result<u64, SaveError> {
        let meta = self.meta();
        self.writer(&meta)?.write_to(out)
    }

    fn meta(&self) -> ScanMeta {
        ScanMeta {
            hierarchy: self.hierarchy.meta().clone(),
            graph: self.graph.as_ref().map(|graph| graph.meta()),
            density: self.density,
        }
    }

    fn writer(&self, meta: &ScanMeta) -> Result<Writer<'_>, SaveError> {
        let mut writer = Writer::new(Self::KIND, VERSION);
        writer.metadata(meta)?;
        self.hierarchy.add_to(&mut writer)?;
        if let Some(graph) = &self.graph {
            graph.add_to(&mut writer)?;
        }
        Ok(writer)
    }

    /// Opens a saved scan by mapping its file. Nothing is copied, and pages are read when a query
    /// needs them.
    ///
    /// [`Check::Structure`] checks the metadata and the lengths of arrays, and is for files from a
    /// trusted source: a damaged number may cause a wrong answer. Without a graph it takes the same
    /// time for any scan. [`Check::Full`], for all other files, also compares checksums and checks
    /// every number. Files that pass could have been written by [`Scan::save`]. With either check,
    /// queries terminate and never index out of bounds.
    ///
    /// The file must not be modified in place while it is open (see `nearmiss_store::File::open`).
    /// Replacing it with [`Scan::save`] is fine.
    ///
    /// # Errors
    /// Fails if the file cannot be opened, is not a preprocessed scan, has another version, is
    /// damaged or is inconsistent.
    pub fn open(path: impl AsRef<Path>, check: Check) -> Result<Self, LoadError> {
        Self::load(&File::open(path, check)?, check)
    }

    /// Reads a saved scan into memory.
    ///
    /// # Errors
    /// As [`Scan::open`].
    pub fn read(path: impl AsRef<Path>, check: Check) -> Result<Self, LoadError> {
        Self::load(&File::read(path, check)?, check)
    }

    /// Loads a scan from bytes written by [`Scan::save`] or [`Scan::write_to`].
    ///
    /// # Errors
    /// As [`Scan::open`].
    pub fn from_bytes(bytes: impl Into<Bytes>, check: Check) -> Result<Self, LoadError> {
        Self::load(&File::from_bytes(bytes, check)?, check)
    }

    fn load(file: &File, check: Check) -> Result<Self, LoadError> {
        file.expect(Self::KIND, OLDEST..=VERSION)?;
        let meta: ScanMeta = file.metadata()?;
        let hierarchy = PointHierarchy::load(file, meta.hierarchy, check)?;
        let samples = (hierarchy.plan(), hierarchy.radii());
        let graph = meta.graph.map(|meta| SurfaceGraph::load(file, meta, samples, check)).transpose()?;
        if hierarchy.metric() == Metric::Geodesic && graph.as_ref().is_none_or(|g| g.close_pairs().is_none())
        {
            let cause = "its bounds are for the geodesic kernel, but it has no map of close pairs";
            return Err(Flaw::options(cause).into());
        }
        Ok(Self { density: meta.density, ..Self::of(hierarchy, graph.map(Arc::new)) })
    }

    /// Places the scan at `pose`, which maps the frame of its input to the world. The graph and the
    /// shape index are included.
    #[inline]
    #[must_use]
    pub fn at(&self, pose: &Pose) -> Placed<'_> {
        let placed = Placed::new(&self.hierarchy, pose);
        let placed = self.graph.as_deref().map_or(placed, |graph| placed.with_graph(graph));
        self.shapes.as_deref().map_or(placed, |shapes| placed.with_shapes(shapes))
    }
}

impl Prepared for Scan {
    fn at(&self, pose: &Pose) -> Placed<'_> {
        Self::at(self, pose)
    }
}

/// Returns the points as the graph needs them.
fn samples(hierarchy: &PointHierarchy) -> SurfaceSamples<'_> {
    SurfaceSamples { plan: hierarchy.plan(), positions: hierarchy.positions(), radii: hierarchy.radii() }
}

/// Returns for each point, in the order of the hierarchy, the position of its scanner in the local
/// frame, or of the point itself if its scanner is unknown. `None` if the scanners of all points
/// are unknown.
fn viewpoints(hierarchy: &PointHierarchy, cloud: &PointCloud) -> Option<Vec<[f32; 3]>> {
    let finite = |scanner: &&Scanner| scanner.position.iter().all(|c| c.is_finite());
    let scanners: Vec<&Scanner> = cloud.scanners().iter().filter(finite).collect();
    if scanners.is_empty() {
        return None;
    }
    let places: Vec<[f32; 3]> = scanners.iter().map(|s| hierarchy.frame().to_local(s.position)).collect();
    let of = |(source, own): (&u32, &[f32; 3])| {
        let scanner = scanners.iter().position(|scanner| scanner.points.contains(&(*source as usize)));
        scanner.map_or(*own, |scanner| places[scanner])
    };
    Some(hierarchy.source().iter().zip(hierarchy.positions()).map(of).collect())
}

/// Returns the normals of a cloud in the order of the hierarchy over it; zero for points that the
/// cloud lacks.
fn in_order_of(hierarchy: &PointHierarchy, cloud: &PointCloud, normals: &[[f32; 3]]) -> Vec<[f32; 3]> {
    // Input indices ascend in a cloud.
    let place = |source: &u32| cloud.source().binary_search(source).ok();
    let normal = |source: &u32| place(source).and_then(|place| normals.get(place)).copied();
    hierarchy.source().iter().map(|source| normal(source).unwrap_or_default()).collect()
}
