//! Storage of a tree in a container, and the checks when it is read.

use std::io::Write;
use std::path::Path;

use nearmiss_lanes::id32;
use nearmiss_store::{Bytes, Check, File, WriteError, Writer};
use serde::{Deserialize, Serialize};

use crate::build::MOST_CORNERS;
use crate::counts::Counts;
use crate::error::KineticError;
use crate::nodes::{Node, Nodes, ROOT, SIDES, Siblings};
use crate::plan::{Leg, is_valid, seconds};
use crate::points::{MOST, Points};
use crate::primitives::{NONE, Primitives};
use crate::tree::KineticTree;

/// The kind of the container.
const KIND: [u8; 4] = *b"KTRE";

/// The version of its content.
const VERSION: u32 = 1;

/// The most primitives of a leaf in a file.
const MOST_IN_LEAF: usize = 64;

/// Parts 0 to 2 hold the courses in each slot, for each axis, part 3 the slot of each point.
const LEGS: [u8; 4] = *b"LEGS";
/// Part 0 holds the point of each leg to come, part 1 the legs.
const LATER: [u8; 4] = *b"LATR";
const CORNERS: [u8; 4] = *b"CORN";
/// Part 0 holds extremal points and certificates, part 1 links.
const NODES: [u8; 4] = *b"NODE";
const LEAVES: [u8; 4] = *b"LEAF";
/// Unused indices of points, primitives, pairs of nodes and leaves.
const FREE: [u8; 4] = *b"FREE";

/// The metadata of a file.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct About {
    clock: f64,
    arity: u32,
    leaf_size: u32,
    counts: Counts,
}

impl KineticTree {
    /// Saves the tree, at its present time, as a file at `path`, which is replaced in one step. A
    /// tree that is opened from it continues exactly as this one. Returns the bytes written.
    ///
    /// # Errors
    /// [`WriteError`] if the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<u64, WriteError> {
        self.with_writer(|writer| writer.save(path))
    }

    /// Writes what [`save`](Self::save) saves.
    ///
    /// # Errors
    /// [`WriteError`] if `out` fails.
    pub fn write_to(&self, out: impl Write) -> Result<u64, WriteError> {
        self.with_writer(|writer| writer.write_to(out))
    }

    fn with_writer<T>(
        &self,
        write: impl FnOnce(&Writer<'_>) -> Result<T, WriteError>,
    ) -> Result<T, WriteError> {
        let about = About {
            clock: self.clock,
            arity: id32(self.primitives.arity),
            leaf_size: id32(self.nodes.leaf_size),
            counts: self.counts,
        };
        let later: Vec<Leg> = self.points.later.iter().flatten().copied().collect();
        let of = (0..).zip(&self.points.later).flat_map(|(point, legs)| legs.iter().map(move |_| point));
        let of: Vec<u32> = of.collect();
        let mut writer = Writer::new(KIND, VERSION);
        writer
            .metadata(&about)?
            .section(LEGS, 0, &self.points.courses[0])?
            .section(LEGS, 1, &self.points.courses[1])?
            .section(LEGS, 2, &self.points.courses[2])?
            .section(LEGS, 3, &self.points.slots)?
            .section(LATER, 0, &of)?
            .section(LATER, 1, &later)?
            .section(CORNERS, 0, &self.primitives.corners)?
            .section(NODES, 0, &self.nodes.nodes)?
            .section(NODES, 1, &self.nodes.links)?
            .section(LEAVES, 0, &self.nodes.primitives)?
            .section(FREE, 0, &self.points.free)?
            .section(FREE, 1, &self.primitives.free)?
            .section(FREE, 2, &self.nodes.free_pairs)?
            .section(FREE, 3, &self.nodes.free_blocks)?;
        write(&writer)
    }

    /// Opens a tree that was saved. All of the file is read and checked, so that no later call
    /// fails because of it.
    ///
    /// # Errors
    /// [`KineticError::Open`] if it is no such file or is damaged, [`KineticError::Damaged`] if its
    /// arrays contradict each other.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, KineticError> {
        Self::load(&File::read(path, Check::Full)?)
    }

    /// Opens a tree from the bytes of a file.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn from_bytes(bytes: impl Into<Bytes>) -> Result<Self, KineticError> {
        Self::load(&File::from_bytes(bytes, Check::Full)?)
    }

    fn load(file: &File) -> Result<Self, KineticError> {
        file.expect(KIND, VERSION..=VERSION)?;
        let about: About = file.metadata()?;
        let clock = seconds(about.clock)?;
        let [arity, leaf_size] = [about.arity, about.leaf_size].map(|count| count as usize);
        require(arity > 0 && arity <= MOST_CORNERS, "number of points of a primitive", arity)?;
        require(leaf_size > 0 && leaf_size <= MOST_IN_LEAF, "size of leaves", leaf_size)?;
        require(about.counts.is_plausible(), "number of events", 0)?;
        let free = |part| file.array::<u32>(FREE, part);
        let points = load_points(file, clock)?;
        let mut primitives = Primitives::new(arity);
        primitives.corners = file.array(CORNERS, 0)?.to_vec();
        let slots = primitives.corners.len() / arity;
        let is_whole = slots * arity == primitives.corners.len() && primitives.corners.len() <= MOST;
        require(is_whole, "number of corners", primitives.corners.len())?;
        primitives.leaves = vec![NONE; slots];
        primitives.free = free(1)?.to_vec();
        let mut nodes = Nodes::new(leaf_size, arity);
        nodes.nodes = file.array::<Node>(NODES, 0)?.to_vec();
        nodes.links = file.array::<Siblings>(NODES, 1)?.to_vec();
        nodes.primitives = file.array(LEAVES, 0)?.to_vec();
        nodes.free_pairs = free(2)?.to_vec();
        nodes.free_blocks = free(3)?.to_vec();
        let is_whole = !nodes.links.is_empty() && nodes.nodes.len() == 2 * nodes.links.len();
        require(is_whole && nodes.nodes.len() <= MOST, "number of nodes", nodes.nodes.len())?;
        let blocks = nodes.primitives.len() / leaf_size;
        let is_whole = blocks * leaf_size == nodes.primitives.len() && blocks <= MOST;
        require(is_whole, "number of leaves", nodes.primitives.len())?;
        let whole = blocks.checked_mul(nodes.leaf_points).filter(|&count| count <= MOST);
        nodes.points = vec![NONE; whole.ok_or(KineticError::TooMany)?];
        let counts = about.counts;
        let mut tree =
            Self { clock, points, primitives, nodes, counts, edits: 0, changes: None, states: Vec::new() };
        tree.check()?;
        Ok(tree)
    }

    /// Checks the arrays against each other, and fills those that are not stored.
    fn check(&mut self) -> Result<(), KineticError> {
        let mut unused = Unused::new(self)?;
        self.check_below(ROOT, NONE, &mut unused)?;
        unused.all_seen()?;
        for primitive in 0..id32(self.primitives.slots()) {
            if self.primitives.has(primitive) {
                let mut points = self.primitives.points(primitive).iter();
                require(points.all(|&point| self.points.has(point)), "primitive", primitive as usize)?;
            }
        }
        self.primitives.clear_links();
        for primitive in 0..id32(self.primitives.slots()) {
            if self.primitives.has(primitive) {
                self.primitives.link(primitive);
            }
        }
        self.check_certificates(ROOT)
    }

    /// Checks the topology at and below a node. Its height is limited, because each node must be
    /// balanced.
    fn check_below(&mut self, at: u32, parent: u32, unused: &mut Unused) -> Result<(), KineticError> {
        let (index, node) = (at as usize, *self.nodes.link(at));
        require(node.parent == parent, "parent of node", index)?;
        if !node.is_leaf() {
            unused.pairs.take(node.children as usize / 2, "children of node", index)?;
            require(node.children.is_multiple_of(2) && node.children > 0, "children of node", index)?;
            let sizes =
                [node.children, node.children + 1].map(|child| u64::from(self.nodes.link(child).size));
            require(sizes[0] + sizes[1] == u64::from(node.size), "size of node", index)?;
            require(!self.nodes.is_unbalanced(at), "size of node", index)?;
            let place = self.nodes.get_mut(at);
            (place.flags, place.block) = (0, NONE);
            self.check_below(node.children, at, unused)?;
            return self.check_below(node.children + 1, at, unused);
        }
        let is_small = node.size as usize <= self.nodes.leaf_size && (node.size > 0 || at == ROOT);
        require(is_small, "size of leaf", index)?;
        self.nodes.get_mut(at).flags = 0;
        let block = self.nodes.get(at).block;
        if block == NONE {
            return require(node.size == 0, "size of leaf", index);
        }
        unused.blocks.take(block as usize, "place of leaf", index)?;
        for i in 0..node.size as usize {
            let primitive = self.nodes.primitives_of(at)[i] as usize;
            unused.primitives.take(primitive, "primitive of leaf", index)?;
            self.primitives.leaves[primitive] = at;
        }
        Ok(())
    }

    /// Checks the extremal points and certificates at and below a node of a valid topology.
    fn check_certificates(&mut self, at: u32) -> Result<(), KineticError> {
        let (node, link) = (*self.nodes.get(at), *self.nodes.link(at));
        if link.is_leaf() {
            self.list_points(at);
        } else {
            self.check_certificates(link.children)?;
            self.check_certificates(link.children + 1)?;
        }
        for side in 0..SIDES {
            let (winner, time) = (node.winners[side], node.times[side]);
            require(time >= self.clock, "time of a certificate of node", at as usize)?;
            let among = [link.children, link.children + 1].map(|child| self.nodes.get(child).winners[side]);
            let among = if link.is_leaf() { self.nodes.points_of(at) } else { &among };
            let is_known = if link.size == 0 { winner == NONE } else { among.contains(&winner) };
            require(is_known, "extremal point of node", at as usize)?;
            let is_known = time == f64::INFINITY || among.contains(&node.rivals[side]);
            require(is_known, "rival of an extremal point of node", at as usize)?;
        }
        self.nodes.retime(at);
        self.nodes.compare(at);
        Ok(())
    }
}

/// Reads plans.
fn load_points(file: &File, clock: f64) -> Result<Points, KineticError> {
    let mut points = Points::default();
    points.slots = file.array(LEGS, 3)?.to_vec();
    let count = points.slots.len();
    require(count <= MOST, "number of points", count)?;
    for (part, courses) in (0..).zip(&mut points.courses) {
        *courses = file.array(LEGS, part)?.to_vec();
        require(courses.len() == count, "number of courses", count)?;
    }
    let mut unused = Marks(vec![false; count]);
    for (i, &slot) in points.slots.iter().enumerate() {
        unused.take(slot as usize, "place of point", i)?;
    }
    points.free = file.array(FREE, 0)?.to_vec();
    let mut unused = Marks(vec![false; count]);
    for &point in &points.free {
        unused.take(point as usize, "free point", point as usize)?;
    }
    for i in 0..count {
        let leg = points.leg(id32(i));
        let is_right = if unused.0[i] { leg[0].start.is_nan() } else { is_valid(&leg) };
        require(is_right, "plan of point", i)?;
    }
    let (of, legs) = (file.array::<u32>(LATER, 0)?, file.array::<Leg>(LATER, 1)?);
    require(of.len() == legs.len(), "number of legs to come", of.len())?;
    for (i, (&point, leg)) in of.iter().zip(legs.iter()).enumerate() {
        require(points.has(point) && is_valid(leg) && leg[0].start > clock, "leg to come", i)?;
        let ascends = i == 0 || of[i - 1] < point;
        let follows = i > 0 && of[i - 1] == point && leg[0].start < legs[i - 1][0].start;
        require(ascends || follows, "leg to come", i)?;
        if points.later.len() <= point as usize {
            points.later.resize(point as usize + 1, Vec::new());
        }
        points.later[point as usize].push(*leg);
        points.knots.set(point, leg[0].start);
    }
    Ok(points)
}

fn require(is_right: bool, what: &'static str, index: usize) -> Result<(), KineticError> {
    if is_right { Ok(()) } else { Err(KineticError::Damaged { what, index }) }
}

/// Marks for items that a file may use once.
struct Marks(Vec<bool>);

impl Marks {
    /// Marks item `i`. Fails if there is no such item, or if it is marked already.
    fn take(&mut self, i: usize, what: &'static str, index: usize) -> Result<(), KineticError> {
        let mark = self.0.get_mut(i).filter(|mark| !**mark);
        *mark.ok_or(KineticError::Damaged { what, index })? = true;
        Ok(())
    }
}

/// The pairs of nodes, leaves and primitives that must be met below the root, once each.
struct Unused {
    pairs: Marks,
    blocks: Marks,
    primitives: Marks,
}

impl Unused {
    fn new(tree: &KineticTree) -> Result<Self, KineticError> {
        let mut pairs = Marks(vec![false; tree.nodes.nodes.len() / 2]);
        let mut blocks = Marks(vec![false; tree.nodes.primitives.len() / tree.nodes.leaf_size]);
        let mut primitives = Marks(vec![false; tree.primitives.slots()]);
        pairs.take(0, "root", 0)?;
        for (i, &pair) in tree.nodes.free_pairs.iter().enumerate() {
            require(pair.is_multiple_of(2), "free node", i)?;
            pairs.take(pair as usize / 2, "free node", i)?;
        }
        for (i, &block) in tree.nodes.free_blocks.iter().enumerate() {
            blocks.take(block as usize, "free leaf", i)?;
        }
        for (i, &primitive) in tree.primitives.free.iter().enumerate() {
            primitives.take(primitive as usize, "free primitive", i)?;
        }
        Ok(Self { pairs, blocks, primitives })
    }

    fn all_seen(&self) -> Result<(), KineticError> {
        let all = [(&self.pairs, "node"), (&self.blocks, "leaf"), (&self.primitives, "primitive")];
        all.into_iter().try_for_each(|(marks, what)| {
            let missed = marks.0.iter().position(|mark| !mark);
            missed.map_or(Ok(()), |index| Err(KineticError::Damaged { what, index }))
        })
    }
}
