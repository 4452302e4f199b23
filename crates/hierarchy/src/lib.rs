#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod bounds;
mod descent;
mod file;
mod mesh;
mod patch;
mod point;
mod scan;
mod tree;

pub use bounds::boxes::{OrientedBox, Relative, SLACK};
pub use bounds::cells::CELLS;
pub use bounds::growth::Growth;
pub use bounds::lanes::{Boxes, along_normals};
pub use bounds::part::Part;
pub use descent::{
    BoxVisitor, Comparison, Frontier, Heap, MostUrgent, Open, PairVisitor, PlaceVisitor, Plunging, Stack,
    TreePair, descend, resume,
};
pub use mesh::block::{LEAF_TRIANGLES, TriangleBlock};
pub use mesh::build::{MeshHierarchy, MeshView};
pub use mesh::data::{DroppedTriangles, MeshMeta};
pub use mesh::deforming::DeformingMesh;
pub use mesh::options::{MeshBuildError, MeshBuildOptions};
pub use patch::covering::Covering;
pub use patch::samples::NodeSamples;
pub use point::disc::DiscRadii;
pub use point::gather::{GatherScratch, NeighbourList};
pub use point::kind::{PointKind, SLAB, THICKNESS};
pub use point::leaf_block::{LeafBlock, Leaves};
pub use point::stored_point::StoredPoint;
pub use scan::apart::{Extent, apart};
pub use scan::arrays::{ObstacleParts, ScanArrays};
pub use scan::build::PointHierarchy;
pub use scan::clearance::{Clearance, ClearanceGrid};
pub use scan::data::HierarchyMeta;
pub use scan::deform_error::DeformError;
pub use scan::deforming::DeformingScan;
pub use scan::evaluate::NearField;
pub use scan::intake::{GatheredPoints, IntakeError, PointGatherer};
pub use scan::leaf_boxes::LeafBoxes;
pub use scan::options::{BuildError, BuildOptions};
pub use scan::outline::{Ball, Outline};
pub use scan::points::ScanPoints;
pub use scan::refit::Refitted;
pub use scan::survey::SamplingSurvey;
pub use tree::topology::{Children, Grandchildren, LaneNodes, MOST_LEAF_POINTS, NodePair, Topology};
pub use tree::wide::{Growths, NodeBounds, Siblings, Tree, whole};
