#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod ask;
mod clash;
mod contact;
mod curve;
mod distance;
mod leaf;
mod many;
mod mesh;
mod mesh_scan;
mod pair;
mod papers;
mod question;
mod shape;

pub use ask::answer::{Answer, Contact, Contacts, Evidence, ManifoldPoint, Reason, Statistics, Verdict};
pub use ask::budget::{Budget, Deadline};
pub use ask::interpolation::{Brackets, Interpolation, Refinement, SurfelSize};
pub use ask::occupancy::{occupancy, points_for};
pub use ask::options::{CollideOptions, CollidePlan, Detail, Method, Order, PlanError, Sampling, Semantics};
pub use clash::{Clash, ClashKind, ClashOptions, ClashPlan, Clashes, ContactGroup, components, default_link};
pub use contact::certificate::Proof;
pub use contact::hint::PairHint;
pub use curve::{Curve, CurveEnd, CurveOptions, CurvePlan, Curves};
pub use distance::{Distance, DistanceOptions, DistancePlan};
pub use leaf::crossing::{Disc, crossing};
pub use many::batch::{BatchScratch, Until, each};
pub use many::body::{Body, BodyPair, PlacedBody};
pub use many::world::{Bodies, BodyId, World};
pub use mesh::answer::{ContactRegion, MeshAnswer, MeshContact, MeshVerdict};
pub use mesh::distance::MeshDistance;
pub use mesh::hint::MeshHint;
pub use mesh::itself::MeshItself;
pub use mesh::pair::{MeshPair, MeshScratch};
pub use mesh::placed::PlacedMesh;
pub use mesh::prepared::PreparedMesh;
pub use mesh::quality::MeshQuality;
pub use mesh_scan::hint::MeshScanHint;
pub use mesh_scan::pair::MeshScanPair;
pub use mesh_scan::plan::MeshScanPlan;
pub use pair::placed::Placed;
pub use pair::prepared::Prepared;
pub use pair::shape_index::ShapeIndex;
pub use papers::pacer::Pacer;
pub use question::{Pair, Question, Scratch};
pub use shape::{NearestPoint, Shape};
