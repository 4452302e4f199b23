#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod ball_pair;
mod batch;
mod bounds;
mod budget;
mod certify;
mod collide;
mod compare;
mod crossing;
mod curve;
mod disc_pair;
mod distance;
mod hint;
mod interpolation;
mod leaf_pair;
mod likelihood;
mod manifold;
mod margin;
mod nearest_points;
mod occupancy;
mod options;
mod pacer;
mod point_gap;
mod posed;
mod prepared;
mod priority;
mod random;
mod resolution;
mod sampling;
mod shape;
mod surface;
mod thickened;
mod verdict;
mod view;
mod world;

pub use batch::{
    BatchScratch, Until, answer_each, collide_many, collide_many_with, collide_poses, collide_poses_with,
};
pub use budget::{Budget, Deadline};
pub use certify::Proof;
pub use collide::{
    CollideScratch, Contacts, collide, collide_all, collide_hinted, collide_proving, collide_with,
};
pub use crossing::{Disc, crossing};
pub use curve::{Curve, CurveEnd, CurveOptions, CurvePlan, CurveScratch, Curves, curves, curves_with};
pub use distance::{Distance, DistanceOptions, DistancePlan, DistanceScratch, distance, distance_with};
pub use hint::PairHint;
pub use manifold::ManifoldPoint;
pub use occupancy::{occupancy, points_for};
pub use options::{
    Brackets, CollideOptions, CollidePlan, Detail, Interpolation, Method, Order, PlanError, Refinement,
    Sampling, Semantics, Surfels,
};
pub use pacer::{Pacer, collide_paced};
pub use prepared::Prepared;
pub use shape::{NearestPoint, PlacedIndex, Shape, ShapeIndex};
pub use verdict::{Answer, Contact, Evidence, Reason, Statistics, Verdict};
pub use view::{ScanView, ViewScratch};
pub use world::{Bodies, BodyId, World};
