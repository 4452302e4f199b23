//! Many scans, meshes and shapes in one world, and the broad phase that finds the pairs that may meet.
//!
//! An R*-tree over world-space boxes prunes the pairs that are further apart than the reach of a
//! question. It is that of the crate `rstar` (Beckmann, Kriegel, Schneider & Seeger, "The R*-tree:
//! an efficient and robust access method for points and rectangles", SIGMOD 1990).

use std::collections::{BTreeMap, BTreeSet};
use std::convert::Infallible;

use nearmiss_geometry::{Aabb, Pose};
use rstar::{AABB, ParentNode, RTree, RTreeNode, RTreeObject};
use serde::{Deserialize, Serialize};

use crate::many::body::{Body, BodyPair, PlacedBody};
use crate::many::bounds::{bounds, bounds_of_body, is_moderate};
use crate::mesh::prepared::PreparedMesh;
use crate::pair::placed::Placed;
use crate::pair::prepared::Prepared;
use crate::question::Pair;
use crate::solid::as_shape::AsShape;
use crate::solid::shape::Shape;

/// The id of a body in a [`World`]. Ids increase and are never reused, even after removals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct BodyId(pub u64);

/// The bodies whose pairs are requested.
#[derive(Debug, Clone, Copy)]
pub enum Bodies<'a> {
    /// All bodies: every pair.
    All,
    /// These bodies, such as those that have moved since the last call: each pair with at least one
    /// of them, once.
    These(&'a [BodyId]),
}

/// Placed scans, meshes and convex shapes, each a *body* with an id.
///
/// `S` is what holds a preprocessed scan: `nearmiss::Scan`, an `Arc` of one, or a reference. Its
/// graph and kernel are included. One scan may be placed many times. `M` is what holds a preprocessed
/// mesh, likewise, and `H` what holds a convex shape ([`AsShape`]). A world made with [`World::new`] has
/// scans alone. [`World::with_meshes`], [`World::with_shapes`] and [`World::with_meshes_and_shapes`] make
/// worlds of several kinds of bodies.
///
/// ```
/// use nearmiss_geometry::{PointCloud, Pose};
/// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
/// use nearmiss_query::{Bodies, CollideOptions, CollidePlan, Scratch, World};
///
/// let points: Vec<[f32; 3]> =
///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
/// let square = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
/// let plan = CollidePlan::new(&CollideOptions::default(), &square, &square)?;
///
/// let mut world = World::new();
/// let floor = world.insert(&square, &Pose::IDENTITY);
/// let upright = Pose::from_axis_angle([1.0, 0.0, 0.0], 1.5);
/// let door = world.insert(&square, &upright.with_translation([0.3, 0.5, -0.4]));
/// let hinge = world.insert(&square, &upright.with_translation([0.4, 0.4, -0.4]));
///
/// // The door and its hinge belong together, so their pair is ignored.
/// let mut pairs = Vec::new();
/// world.near_pairs(Bodies::All, plan.reach(), &mut pairs);
/// pairs.retain(|&pair| pair != [door, hinge]);
/// let mut scratch = Scratch::default();
/// let mut touches = |world: &World<_>, pair| {
///     let pair = world.pair(pair).expect("both bodies are there");
///     pair.collide(&plan, &mut scratch).verdict.is_intersecting()
/// };
/// let touching: Vec<_> = pairs.iter().copied().filter(|&pair| touches(&world, pair)).collect();
/// assert_eq!(touching, [[floor, door], [floor, hinge]]);
///
/// // After a body has moved, only its own pairs are requested.
/// world.move_to(door, &upright.with_translation([0.3, 0.5, 0.1]));
/// world.near_pairs(Bodies::These(&[door]), plan.reach(), &mut pairs);
/// assert!(pairs.iter().all(|&pair| pair[0] != floor || !touches(&world, pair)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// With meshes, [`World::body_pair`] yields the pair that fits:
///
/// ```
/// use nearmiss_geometry::{PointCloud, Pose, TriangleMesh};
/// use nearmiss_hierarchy::{BuildOptions, MeshBuildOptions, MeshHierarchy, PointHierarchy};
/// use nearmiss_query::{Bodies, BodyPair, CollideOptions, CollidePlan, MeshScanPlan, Scratch, World};
///
/// let points: Vec<[f32; 3]> =
///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
/// let floor = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
/// let corners = vec![[0.0, 0.0, 0.0], [0.2, 0.0, 0.5], [-0.2, 0.0, 0.5]];
/// let tip = TriangleMesh::new(corners, vec![[0, 1, 2]])?;
/// let tip = MeshHierarchy::build(&tip, &MeshBuildOptions::default())?;
///
/// let mut world = World::with_meshes();
/// world.insert(&floor, &Pose::IDENTITY);
/// world.insert_mesh(&tip, &Pose::from_translation([0.5, 0.5, -0.1]));
/// world.insert_mesh(&tip, &Pose::from_translation([0.5, 0.5, 0.2]));
/// let options = CollideOptions::default();
/// let plan = CollidePlan::new(&options, &floor, &floor)?;
/// let of_mesh = MeshScanPlan::new(&options, &floor)?;
///
/// let (mut near, mut scratch) = (Vec::new(), Scratch::default());
/// world.near_pairs(Bodies::All, plan.reach(), &mut near);
/// let meets = near.iter().filter_map(|&pair| world.body_pair(pair)).map(|pair| match pair {
///     BodyPair::Scans(pair) => pair.collide(&plan, &mut scratch).verdict.is_intersecting(),
///     BodyPair::MeshAndScan { pair, .. } => pair.collide(&of_mesh, &mut scratch).verdict.is_intersecting(),
///     BodyPair::Meshes(pair) => pair.collide(scratch.meshes()).verdict.is_intersecting(),
///     _ => false, // This world has no shapes.
/// });
/// assert_eq!(meets.filter(|&meets| meets).count(), 2, "the lower tip meets the floor and the upper tip");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// With shapes, a link of a robot can consist of several bodies, which move together:
///
/// ```
/// use nearmiss_geometry::{PointCloud, Pose};
/// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
/// use nearmiss_query::{Bodies, BodyId, DistanceOptions, DistancePlan, Scratch, Shape, World};
///
/// let points: Vec<[f32; 3]> =
///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
/// let floor = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
/// let plan = DistancePlan::new(&DistanceOptions::default(), &floor, &floor)?;
///
/// let mut world = World::with_shapes();
/// let room = world.insert(&floor, &Pose::IDENTITY);
/// let rod = Shape::Capsule { ends: [[0.0; 3], [0.0, 0.0, 0.3]], radius: 0.02 };
/// let foot = Shape::Box { pose: Pose::IDENTITY, half: [0.1, 0.1, 0.01], radius: 0.0 };
/// // The bodies of the link, and their poses in its frame.
/// let link = [(rod, [0.0; 3]), (foot, [0.0, 0.0, -0.05])].map(|(shape, offset)| {
///     let offset = Pose::from_translation(offset);
///     (world.insert_shape(shape, &offset), offset)
/// });
/// let pose = Pose::from_translation([0.5, 0.5, 0.4]);
/// for (id, offset) in &link {
///     world.move_to(*id, &pose.after(offset));
/// }
/// // The bodies of the link belong together, so their pair is ignored.
/// let counts = |a: BodyId, _: BodyId| a == room;
/// let found = world.nearest_pair(Bodies::All, f64::INFINITY, counts, &plan, &mut Scratch::default());
/// let nearest = found.expect("two pairs count");
/// assert_eq!(nearest.ids, [room, link[1].0]);
/// assert!(nearest.lower > 0.3 && (nearest.upper - 0.34).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct World<S, M = Infallible, H = Infallible> {
    bodies: BTreeMap<BodyId, Entry<S, M, H>>,
    /// The bounding boxes of the bodies that have one.
    tree: RTree<Leaf>,
    /// The other bodies, which count as near everything.
    unbounded: BTreeSet<BodyId>,
    next: u64,
}

#[derive(Debug, Clone)]
struct Entry<S, M, H> {
    body: Body<S, M, H>,
    pose: Pose,
    bounds: Option<Aabb>,
}

impl<S: Prepared, M: PreparedMesh, H: AsShape> Entry<S, M, H> {
    fn new(body: Body<S, M, H>, pose: &Pose) -> Self {
        let bounds = bounds_of_body(&body.at(pose));
        Self { body, pose: *pose, bounds }
    }

    fn placed(&self) -> PlacedBody<'_> {
        self.body.at(&self.pose)
    }
}

/// A body's entry in the tree.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Leaf {
    id: BodyId,
    bounds: Envelope,
}

/// A bounding box in the type of `rstar`.
type Envelope = AABB<[f64; 3]>;

impl Leaf {
    fn new(id: BodyId, bounds: &Aabb) -> Self {
        Self { id, bounds: AABB::from_corners(bounds.min, bounds.max) }
    }
}

impl RTreeObject for Leaf {
    type Envelope = Envelope;

    #[inline]
    fn envelope(&self) -> Envelope {
        self.bounds
    }
}

impl<S, M, H> Default for World<S, M, H> {
    fn default() -> Self {
        Self { bodies: BTreeMap::new(), tree: RTree::new(), unbounded: BTreeSet::new(), next: 0 }
    }
}

impl<S: Prepared> World<S> {
    /// Creates a world without bodies, for scans.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

impl<S: Prepared, M: PreparedMesh> World<S, M> {
    /// Creates a world without bodies, for scans and meshes.
    #[must_use]
    pub fn with_meshes() -> Self {
        Self::default()
    }
}

impl<S: Prepared, H: AsShape> World<S, Infallible, H> {
    /// Creates a world without bodies, for scans and convex shapes.
    #[must_use]
    pub fn with_shapes() -> Self {
        Self::default()
    }
}

impl<S: Prepared, M: PreparedMesh, H: AsShape> World<S, M, H> {
    /// Creates a world without bodies, for scans, meshes and convex shapes.
    #[must_use]
    pub fn with_meshes_and_shapes() -> Self {
        Self::default()
    }

    /// Places `scan` at `pose`, which maps the frame of its input to the world. O(log n).
    pub fn insert(&mut self, scan: S, pose: &Pose) -> BodyId {
        self.insert_body(Body::Scan(scan), pose)
    }

    /// Places `mesh` at `pose`, which maps the frame of its input to the world. O(log n).
    pub fn insert_mesh(&mut self, mesh: M, pose: &Pose) -> BodyId {
        self.insert_body(Body::Mesh(mesh), pose)
    }

    /// Places `shape` at `pose`, which maps the frame in which the shape is given to the world. O(log n).
    pub fn insert_shape(&mut self, shape: H, pose: &Pose) -> BodyId {
        self.insert_body(Body::Shape(shape), pose)
    }

    /// Places a scan, a mesh or a shape. O(log n).
    pub fn insert_body(&mut self, body: Body<S, M, H>, pose: &Pose) -> BodyId {
        let id = BodyId(self.next);
        self.next += 1;
        self.place(id, Entry::new(body, pose));
        id
    }

    /// Removes a scan and returns it; `None` if no scan has this id. O(log n).
    pub fn remove(&mut self, id: BodyId) -> Option<S> {
        if !matches!(self.bodies.get(&id)?.body, Body::Scan(_)) {
            return None;
        }
        match self.remove_body(id)? {
            Body::Scan(scan) => Some(scan),
            Body::Mesh(_) | Body::Shape(_) => None,
        }
    }

    /// Removes a body and returns what it is; `None` if no body has this id. O(log n).
    pub fn remove_body(&mut self, id: BodyId) -> Option<Body<S, M, H>> {
        let entry = self.bodies.remove(&id)?;
        match entry.bounds {
            Some(bounds) => _ = self.tree.remove(&Leaf::new(id, &bounds)),
            None => _ = self.unbounded.remove(&id),
        }
        Some(entry.body)
    }

    /// Moves a body. Returns `false` if no body has this id. O(log n).
    pub fn move_to(&mut self, id: BodyId, pose: &Pose) -> bool {
        let body = self.remove_body(id);
        body.map(|body| self.place(id, Entry::new(body, pose))).is_some()
    }

    /// Changes a body, as a deforming one changes in every frame, and returns the result of `change`;
    /// `None` if no body has this id. O(log n) besides.
    pub fn change<R>(&mut self, id: BodyId, change: impl FnOnce(&mut Body<S, M, H>) -> R) -> Option<R> {
        let pose = self.bodies.get(&id)?.pose;
        let mut body = self.remove_body(id)?;
        let changed = change(&mut body);
        self.place(id, Entry::new(body, &pose));
        Some(changed)
    }

    fn place(&mut self, id: BodyId, entry: Entry<S, M, H>) {
        match entry.bounds {
            Some(bounds) => self.tree.insert(Leaf::new(id, &bounds)),
            None => _ = self.unbounded.insert(id),
        }
        self.bodies.insert(id, entry);
    }

    /// Returns the number of bodies.
    #[must_use]
    pub fn len(&self) -> usize {
        self.bodies.len()
    }

    /// Returns `true` if there are no bodies.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// Returns the bodies in the order of insertion.
    #[must_use]
    pub fn ids(&self) -> impl ExactSizeIterator<Item = BodyId> {
        self.bodies.keys().copied()
    }

    /// Returns a body without its pose, or `None` if no body has this id.
    #[must_use]
    pub fn get(&self, id: BodyId) -> Option<&Body<S, M, H>> {
        self.bodies.get(&id).map(|entry| &entry.body)
    }

    /// Returns a placed body, or `None` if no body has this id.
    #[must_use]
    pub fn body(&self, id: BodyId) -> Option<PlacedBody<'_>> {
        self.bodies.get(&id).map(Entry::placed)
    }

    /// Returns a body as a placed scan, or `None` if no scan has this id.
    #[must_use]
    pub fn placed(&self, id: BodyId) -> Option<Placed<'_>> {
        match self.body(id)? {
            PlacedBody::Scan(scan) => Some(scan),
            PlacedBody::Mesh(_) | PlacedBody::Shape(_) => None,
        }
    }

    /// Returns a pair of scans, or `None` if one of them does not exist or is no scan.
    #[must_use]
    pub fn pair(&self, [a, b]: [BodyId; 2]) -> Option<Pair<'_>> {
        Some(Pair::new(self.placed(a)?, self.placed(b)?))
    }

    /// Returns a pair of bodies, whatever they are, or `None` if one of them does not exist.
    #[must_use]
    pub fn body_pair(&self, [a, b]: [BodyId; 2]) -> Option<BodyPair<'_>> {
        Some(BodyPair::new(self.body(a)?, self.body(b)?))
    }

    /// Returns the world-space bounding box of a body in the broad phase; `None` if the body counts
    /// as unbounded or no body has this id.
    #[must_use]
    pub fn bounds(&self, id: BodyId) -> Option<Aabb> {
        self.bodies.get(&id).and_then(|body| body.bounds)
    }

    /// The broad phase: writes the pairs whose bounding boxes come within `reach` of each other to
    /// `pairs`, smaller id first, in ascending order.
    ///
    /// All other pairs are separated by more than `reach`; pass
    /// [`CollidePlan::reach`](crate::CollidePlan::reach) for a collision query. A body with an
    /// invalid pose ([`Reason::Pose`](crate::Reason::Pose)) or shape, or at the limits of double
    /// precision, counts as near every other body.
    ///
    /// Takes about 0.5 µs per body on one thread if each is near twelve others. Does not allocate
    /// once `pairs` is warm.
    pub fn near_pairs(&self, bodies: Bodies<'_>, reach: f64, pairs: &mut Vec<[BodyId; 2]>) {
        pairs.clear();
        match bodies {
            Bodies::All => {
                let mut visit = |a: BodyId, b: BodyId| pairs.push([a.min(b), a.max(b)]);
                visit_pairs(self.tree.root(), widened(reach), &mut visit);
                for &id in &self.unbounded {
                    self.bodies.keys().filter(|&&other| other != id).for_each(|&other| visit(id, other));
                }
            }
            Bodies::These(ids) => {
                for &id in ids {
                    let Some(body) = self.bodies.get(&id) else { continue };
                    self.visit_near(body.bounds, reach, |other| {
                        if other != id {
                            pairs.push([id.min(other), id.max(other)]);
                        }
                    });
                }
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
    }

    /// The broad phase with a reach of its own for each pair: writes the pairs whose bounding boxes come
    /// within `reach_of` each other to `pairs`, as [`Self::near_pairs`] does. `None` leaves a pair out,
    /// such as two neighbouring links of a robot. No reach may exceed `most`.
    ///
    /// `reach_of` is called in ascending order, once for each pair within `most`. Groups of bodies are a
    /// map of the caller's from ids to groups, which `reach_of` asks.
    pub fn near_pairs_by(
        &self,
        bodies: Bodies<'_>,
        most: f64,
        mut reach_of: impl FnMut(BodyId, BodyId) -> Option<f64>,
        pairs: &mut Vec<[BodyId; 2]>,
    ) {
        self.near_pairs(bodies, most, pairs);
        let bounds = |id: BodyId| self.bounds(id).map(|bounds| Leaf::new(id, &bounds).bounds);
        pairs.retain(|&[a, b]| {
            reach_of(a, b).is_some_and(|reach| match (bounds(a), bounds(b)) {
                (Some(of_a), Some(of_b)) => are_near(&of_a, &of_b, widened(reach)),
                _ => true,
            })
        });
    }

    /// Writes the bodies whose bounding boxes come within `reach` of `scan` to `ids`, in ascending
    /// order. `scan` need not be a body of this world.
    pub fn near(&self, scan: &Placed<'_>, reach: f64, ids: &mut Vec<BodyId>) {
        self.near_bounds(bounds(scan), reach, ids);
    }

    /// Writes the bodies whose bounding boxes come within `reach` of `shape` to `ids`, in ascending
    /// order. No other body [touches](Placed::touches) the shape.
    pub fn near_shape(&self, shape: &Shape<'_>, reach: f64, ids: &mut Vec<BodyId>) {
        let bounds = shape.bounds().filter(is_moderate);
        self.near_bounds(bounds, reach, ids);
    }

    fn near_bounds(&self, bounds: Option<Aabb>, reach: f64, ids: &mut Vec<BodyId>) {
        ids.clear();
        self.visit_near(bounds, reach, |id| ids.push(id));
        ids.sort_unstable();
    }

    fn visit_near(&self, bounds: Option<Aabb>, reach: f64, mut visit: impl FnMut(BodyId)) {
        let Some(bounds) = bounds else { return self.bodies.keys().copied().for_each(visit) };
        let reach = widened(reach);
        let [min, max] = [bounds.min.map(|x| x - reach), bounds.max.map(|x| x + reach)];
        let near = self.tree.locate_in_envelope_intersecting(AABB::from_corners(min, max));
        near.for_each(|leaf| visit(leaf.id));
        self.unbounded.iter().copied().for_each(visit);
    }
}

/// Widens the reach, as single queries count slightly more than their reach as near.
fn widened(reach: f64) -> f64 {
    reach * (1.0 + 1e-4)
}

/// Visits each pair of leaves below `node` whose boxes come within `reach`, once.
fn visit_pairs(node: &ParentNode<Leaf>, reach: f64, visit: &mut impl FnMut(BodyId, BodyId)) {
    for (i, a) in node.children().iter().enumerate() {
        if let RTreeNode::Parent(a) = a {
            visit_pairs(a, reach, visit);
        }
        node.children()[..i].iter().for_each(|b| visit_across(a, b, reach, visit));
    }
}

/// Visits each pair of a leaf below `a` and one below `b` whose boxes come within `reach`.
fn visit_across(
    a: &RTreeNode<Leaf>,
    b: &RTreeNode<Leaf>,
    reach: f64,
    visit: &mut impl FnMut(BodyId, BodyId),
) {
    if !are_near(&a.envelope(), &b.envelope(), reach) {
        return;
    }
    match (a, b) {
        (RTreeNode::Leaf(a), RTreeNode::Leaf(b)) => visit(a.id, b.id),
        // Swapping the arguments splits both nodes in turn.
        (RTreeNode::Parent(a), _) => a.children().iter().for_each(|a| visit_across(b, a, reach, visit)),
        (_, RTreeNode::Parent(b)) => b.children().iter().for_each(|b| visit_across(a, b, reach, visit)),
    }
}

#[inline]
fn are_near(a: &Envelope, b: &Envelope, reach: f64) -> bool {
    let (low_a, high_a, low_b, high_b) = (a.lower(), a.upper(), b.lower(), b.upper());
    (0..3).all(|k| low_a[k] <= high_b[k] + reach && low_b[k] <= high_a[k] + reach)
}
