//! The search for triangles that meet the obstacle or the surface of a scan: tangent discs and
//! balls of its points against the triangles of a mesh.
//!
//! Boxes contain the discs with their thickness and the balls, so pruning never loses a contact. In
//! two leaves, a filter in lanes finds the discs and balls that may meet a triangle; each of them is
//! decided in double precision.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{BoxVisitor, NodePair, Open, PairVisitor, Part, Tree};
use nearmiss_lanes::wide::{Bits, blocks_of, lanes_of};
use nearmiss_mesh::{Corners, unit_normal};

use crate::ask::answer::{Contact, Evidence, Reason};
use crate::ask::options::{CollideOptions, Detail};
use crate::leaf::disc_triangle::{FlatDisc, Nearest};
use crate::mesh_scan::mesh_scan_pair::MeshScanPairing;
use crate::mesh_scan::triangle_lanes::discs_reach_box;
use crate::mesh_scan::witness::Witness;
use crate::pair::pairing::Pairing;
use crate::pair::placed::ViewScratch;

const WIDTH: usize = 16;

/// Discs at which a witness is tried before the first contact is reported as estimated.
const TRIES: u32 = 8;

/// The cost of a disc and a triangle in double precision, in node pairs.
const EXACT: u64 = 8;

/// The search for a contact.
pub(crate) struct Search<'s, 'a> {
    pub(crate) pair: MeshScanPairing<'a>,
    detail: Detail,
    /// Places nearer than this, in the world, meet.
    margin: f64,
    /// The distance beyond which pairs are pruned, in the scan's stored frame.
    pub(crate) reach: f32,
    /// The leaf pairs that were compared without a contact, if a proof may follow.
    compared: Option<&'s mut Vec<NodePair>>,
    gather: &'s mut ViewScratch,
    tries: u32,
    /// The best contact so far.
    pub(crate) found: Option<(Contact, Evidence)>,
    /// The point and the triangle of the first contact.
    pub(crate) met: Option<[usize; 2]>,
    /// All contacts, one per leaf pair that meets, if requested.
    pub(crate) all: Option<&'s mut Vec<Contact>>,
    /// Why the query stays undecided if nothing else meets.
    pub(crate) doubt: Option<Reason>,
}

impl<'s, 'a> Search<'s, 'a> {
    pub(crate) fn new(
        pair: MeshScanPairing<'a>,
        options: &CollideOptions,
        (gather, compared): (&'s mut ViewScratch, &'s mut Vec<NodePair>),
        all: Option<&'s mut Vec<Contact>>,
    ) -> Self {
        compared.clear();
        Self {
            detail: options.detail,
            margin: options.margin,
            reach: pair.to_stored(options.margin),
            pair,
            compared: options.certifies().then_some(compared),
            gather,
            tries: 0,
            found: None,
            met: None,
            all,
            doubt: None,
        }
    }

    /// Returns `true` if any leaf pair with a contact will do. Then the likeliest pairs come first.
    pub(crate) fn wants_any(&self) -> bool {
        self.all.is_none() && self.margin == 0.0
    }

    /// Returns `true` if no witness is needed, or none is searched for any more.
    fn is_settled(&self) -> bool {
        self.detail == Detail::Verdict
            || self.tries >= TRIES
            || self.found.is_some_and(|(_, evidence)| evidence == Evidence::Certified)
    }

    /// Compares the leaves that met last, if there are any and one contact will do. Breaks if they
    /// settle the question.
    pub(crate) fn compare_first(&mut self, met: Option<NodePair>) -> ControlFlow<()> {
        let Some(nodes) = met.filter(|&nodes| self.all.is_none() && self.pair.are_leaves(nodes)) else {
            return ControlFlow::Continue(());
        };
        let number = |tree: &Tree<'_>, node| tree.topology().leaf_number(node);
        let flow =
            self.compare([number(&self.pair.a.tree, nodes.a), number(&self.pair.b.tree, nodes.b)], nodes);
        if let Some(compared) = &mut self.compared {
            compared.clear();
        }
        flow
    }

    /// Compares the points of a leaf with the triangles of another and records a contact.
    fn compare(&mut self, leaves: [usize; 2], nodes: NodePair) -> ControlFlow<()> {
        self.pair.count(leaves);
        let contact = match self.ball_contact(leaves) {
            Some(contact) => Some(contact),
            None => self.disc_contact(leaves),
        };
        let Some(contact) = contact else {
            if let Some(compared) = &mut self.compared {
                compared.push(nodes);
            }
            return self.pair.meter.go_on();
        };
        let is_settled = self.is_settled();
        match &mut self.all {
            Some(all) => all.push(contact),
            None if is_settled => return ControlFlow::Break(()),
            None => {}
        }
        self.pair.meter.go_on()
    }

    /// Returns `true` if no disc or ball of a leaf of the scan reaches the box of a node of the mesh.
    fn is_beside(&self, pair: NodePair) -> bool {
        let (pair, a, nodes) = (&self.pair, self.pair.a, pair);
        let [is_leaf, _] = pair.which_are_leaves(nodes);
        if !is_leaf {
            return false;
        }
        let leaf = a.tree.topology().leaf_number(nodes.a);
        if pair.part == Part::Obstacle && a.leaves.has_balls(leaf) {
            return pair.gap_of_leaf_boxes(nodes) > self.reach;
        }
        if pair.part == Part::Surface && a.leaves.is_sparse(leaf) {
            return false;
        }
        let bounds = pair.relative.moved(&pair.b.tree.bounds(nodes.b));
        let most = (self.reach, pair.relative.slack());
        !a.leaves
            .blocks(leaf)
            .any(|(block, _, count)| discs_reach_box(pair.level, (block, count), &bounds, most))
    }

    /// Records a contact of a point and a triangle, first with the evidence so far.
    fn record(&mut self, items: [usize; 2], contact: Contact, evidence: Evidence) {
        if self.found.is_none_or(|(_, known)| known == Evidence::Estimated && evidence == Evidence::Certified)
        {
            self.found = Some((contact, evidence));
        }
        self.met.get_or_insert(items);
    }

    /// The first contact of a ball and a triangle of two leaves. Records it. Notes a doubt where a
    /// triangle comes near a sparse point of a surface.
    fn ball_contact(&mut self, [a, b]: [usize; 2]) -> Option<Contact> {
        let of_obstacle = self.pair.part == Part::Obstacle;
        let leaves = self.pair.a.leaves;
        if !(if of_obstacle { leaves.has_balls(a) } else { leaves.is_sparse(a) }) {
            return None;
        }
        let points = &leaves.points(a);
        // The box contains the balls.
        let bounds = self.pair.a.tree.bounds(self.pair.a.tree.topology().leaf(a));
        let reach = self.reach + 2.0 * self.pair.relative.slack();
        for block in blocks_of(points) {
            let balls =
                if of_obstacle { self.pair.a.obstacle_balls(block) } else { self.sparse_balls(block) };
            let positions = &self.pair.a.blocks[block].position;
            let near = self.pair.triangles(b).balls_near(positions, &balls, &bounds, reach);
            for lane in self.pair.lanes(b) {
                for of_block in Bits(near[lane] & lanes_of(block, points)) {
                    let i = block * WIDTH + of_block;
                    let j = MeshScanPairing::triangle(b, lane);
                    self.pair.meter.leaf_work(1);
                    let (distance, foot) = self.pair.apart(i, &self.pair.corners(j));
                    let scale = self.pair.scan.stored_to_world().scale();
                    let ball = f64::from(balls[of_block]) * scale;
                    if distance > ball + self.margin {
                        continue;
                    }
                    if !of_obstacle {
                        self.doubt = Some(Reason::Undersampled);
                        continue;
                    }
                    let contact = self.contact_of_ball([i, j], foot, (distance, ball));
                    self.record([i, j], contact, Evidence::Certified);
                    return Some(contact);
                }
            }
        }
        None
    }

    /// The radii of the balls about the sparse points of a block, within which there may be surface
    /// that no disc represents.
    #[cold]
    fn sparse_balls(&self, block: usize) -> [f32; WIDTH] {
        let first = block * WIDTH;
        let mut balls = [0.0; WIDTH];
        for (i, ball) in (first..self.pair.a.radii.len()).zip(&mut balls) {
            *ball = self.pair.a.ball(i);
        }
        balls
    }

    fn contact_of_ball(&self, items: [usize; 2], foot: [f64; 3], (distance, ball): (f64, f64)) -> Contact {
        let [p, q] = [self.pair.a.position(items[0]).map(f64::from), foot].map(Vector3::from);
        // In the middle of the overlap, or of the gap within the margin.
        let share = if distance > 0.0 { (0.5 * (ball + distance) / distance).min(1.0) } else { 1.0 };
        Contact {
            point: self.pair.scan.stored_to_world().apply((p + (q - p) * share).into()),
            normals: None,
            residual: 0.5 * distance,
            sources: self.pair.sources(items),
        }
    }

    /// The first contact of a disc and a triangle of two leaves. Records it, or the first of a few
    /// that is verified.
    fn disc_contact(&mut self, [a, b]: [usize; 2]) -> Option<Contact> {
        let leaves = self.pair.a.leaves;
        if self.pair.part == Part::Obstacle && leaves.points(a).start >= self.pair.a.dense {
            return None;
        }
        let mut first = None;
        let reach = self.reach + 2.0 * self.pair.relative.slack();
        for (block, from, count) in leaves.blocks(a) {
            let near = self.pair.triangles(b).discs_near(block, reach);
            for lane in self.pair.lanes(b) {
                let j = MeshScanPairing::triangle(b, lane);
                let mut corners = None;
                for i in Bits(near[lane] & ((1 << count) - 1)).map(|lane| from + lane) {
                    if self.pair.part == Part::Obstacle && !self.pair.a.is_on_sheet(i) {
                        continue;
                    }
                    let corners = corners.get_or_insert_with(|| self.pair.corners(j));
                    let Some((contact, start)) = self.disc_meets([i, j], corners) else { continue };
                    if self.pair.part == Part::Surface && self.pair.scan.scan().kind(i).is_sparse() {
                        self.doubt = Some(Reason::Undersampled);
                        continue;
                    }
                    let is_settled = self.is_settled();
                    let certified = if is_settled { None } else { self.verify(&contact, [i, j], start) };
                    first.get_or_insert(contact);
                    match certified {
                        Some(certified) => self.record([i, j], certified, Evidence::Certified),
                        None => self.record([i, j], contact, Evidence::Estimated),
                    }
                    if is_settled || certified.is_some() || self.pair.meter.go_on().is_break() {
                        return first;
                    }
                }
            }
        }
        first
    }

    /// The contact of a disc and a triangle, and the nearest point of the triangle in the world, if
    /// they are within the thickness of the disc or within the margin.
    fn disc_meets(&mut self, items: [usize; 2], corners: &Corners) -> Option<(Contact, [f64; 3])> {
        self.pair.meter.leaf_work(EXACT);
        let [i, _] = items;
        let placed = self.pair.scan.stored_to_world();
        let normal = Vector3::from(self.pair.a.normals[i].map(f64::from));
        let disc = FlatDisc {
            centre: self.pair.a.position(i).map(f64::from).into(),
            normal: normal.normalize(),
            radius: self.pair.a.discs.get(i).into(),
        };
        let most = (self.margin / placed.scale()).max(disc.thickness());
        let Nearest { distance, on_triangle, on_disc } = disc.nearest_to(corners);
        if distance > most || distance.is_nan() {
            return None;
        }
        let of_triangle = unit_normal(corners).unwrap_or([0.0; 3]);
        let off = if distance > 0.0 {
            0.5 * distance
        } else {
            Vector3::from(of_triangle).dot(&(disc.centre - Vector3::from(corners[0]))).abs()
        };
        let contact = Contact {
            point: placed.apply((0.5 * (on_triangle + on_disc)).into()),
            normals: Some([disc.normal.into(), of_triangle].map(|normal| placed.rotate(normal))),
            residual: off * placed.scale(),
            sources: self.pair.sources(items),
        };
        Some((contact, placed.apply(on_triangle.into())))
    }

    /// Returns the contact at a verified point. `start` is the point of the triangle nearest to the
    /// disc.
    fn verify(&mut self, contact: &Contact, [i, j]: [usize; 2], start: [f64; 3]) -> Option<Contact> {
        self.tries += 1;
        let triangle = self.pair.world_corners(j);
        let margin = self.margin;
        if margin > 0.0 && self.pair.part == Part::Obstacle {
            // A measured point is part of the obstacle.
            let (distance, foot) = self.pair.apart(i, &self.pair.corners(j));
            if distance <= margin {
                let foot = self.pair.scan.stored_to_world().apply(foot);
                let p = self.pair.scan.point(i);
                let point = [0, 1, 2].map(|k| 0.5 * (p[k] + foot[k]));
                return Some(Contact { point, residual: 0.5 * distance, ..*contact });
            }
        }
        let mut witness = Witness { pair: &mut self.pair, scratch: &mut *self.gather, i, triangle };
        if margin > 0.0 { witness.within(contact, start, margin) } else { witness.touching(contact) }
    }
}

impl PairVisitor for Search<'_, '_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
    }

    #[inline]
    fn is_apart(&mut self, pair: NodePair) -> bool {
        self.is_beside(pair)
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], open: &Open) -> ControlFlow<()> {
        self.compare(leaves, open.pair)
    }
}

impl BoxVisitor for Search<'_, '_> {}
