#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod moving_mesh;
mod moving_scan;
mod prepared_mesh;
mod scan;

/// Compiles the example in the repository's README.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct FrontPage;

/// The examples of the guide compile and run.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/in-rust.md")]
struct Guide;

/// The example of the guide about moving scans compiles and runs.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/moving.md")]
struct MovingGuide;

/// The example of the guide about motions compiles.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/motions.md")]
struct MotionsGuide;

/// The examples of the guide about robots compile and run.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/robots.md")]
struct RobotsGuide;

/// The examples of the guide about shapes and rays compile and run.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/shapes.md")]
struct ShapesGuide;

#[cfg(feature = "filter")]
pub use nearmiss_filter as filter;
pub use nearmiss_geometry as geometry;
pub use nearmiss_graph as graph;
pub use nearmiss_hierarchy as hierarchy;
pub use nearmiss_index as index;
#[cfg(feature = "io")]
pub use nearmiss_io as io;
#[cfg(feature = "kinetic")]
pub use nearmiss_kinetic as kinetic;
#[cfg(feature = "mesh")]
pub use nearmiss_mesh as mesh;
pub use nearmiss_query as query;
#[cfg(feature = "slices")]
pub use nearmiss_slices as slices;
pub use nearmiss_store as store;
pub use nearmiss_surface as surface;

pub use moving_mesh::{MovingMesh, Renewal};
pub use moving_scan::MovingScan;
pub use nearmiss_geometry::{
    Aabb, CloudError, Intake, Motion, MotionError, PointCloud, PointId, Pose, PoseError, Screw, TriangleMesh,
};
pub use nearmiss_graph::{GraphError, GraphOptions, Paths, SurfaceGraph};
pub use nearmiss_hierarchy::{
    BuildError, BuildOptions, DeformError, DeformingMesh, DeformingScan, GatheredPoints, IntakeError,
    MeshBuildError, MeshBuildOptions, MeshHierarchy, PointGatherer, PointHierarchy, PointKind, Refitted,
    ScanPoints,
};
pub use nearmiss_query::{
    Answer, AsShape, BatchScratch, Bodies, Body, BodyAnswer, BodyDistance, BodyId, BodyInterior, BodyPair,
    BodyVerdict, Brackets, Budget, Clash, ClashKind, ClashOptions, ClashPlan, Clashes, CollideOptions,
    CollidePlan, Contact, ContactGroup, ContactRegion, Contacts, Curve, CurveEnd, CurveOptions, CurvePlan,
    Curves, Deadline, Detail, Distance, DistanceOptions, DistancePlan, Evidence, Interior, Interpolation,
    ManifoldPoint, MeshAnswer, MeshContact, MeshDistance, MeshHint, MeshItself, MeshPair, MeshQuality,
    MeshScanHint, MeshScanPair, MeshScanPlan, MeshScanSweep, MeshScratch, MeshSolid, MeshSweep, MeshVerdict,
    Method, Moving, NearestPair, NearestPoint, Order, Pacer, Pair, PairHint, Penetration, Placed, PlacedBody,
    PlacedMesh, PlacedShape, PlanError, Prepared, PreparedMesh, Proof, Question, Ray, RayAnswer, RayHit,
    Reason, Refinement, Sampling, Scratch, Semantics, Shape, ShapeAnswer, ShapeContact, ShapeDistance,
    ShapeGap, ShapeHint, ShapeIndex, ShapeMeshDistance, ShapeMeshPair, ShapePair, ShapePlan, ShapeScanPair,
    ShapeSweep, ShapeSweepVerdict, ShapeVerdict, SolidMoments, Statistics, SupportMap, SurfelSize, Sweep,
    SweepAnswer, SweepOptions, SweepPlan, SweepReason, SweepVerdict, Target, Until, Verdict, World, each,
};
pub use nearmiss_store::{Check, WorkError, Workspace};
pub use nearmiss_surface::{Bandwidth, Evaluation, Kernel, Metric, Status, SurfaceOptions};
pub use prepared_mesh::Mesh;
pub use scan::{Density, LoadError, SaveError, Scan};
