//! `Semantics::Surface`: the tangent discs of one scan against those of the other.
//!
//! Boxes contain the discs of their points, so pruning never loses a crossing, and the descent
//! finds a crossing exactly if there is one. Discs of isolated points and of points on lines are
//! unreliable. If only such discs cross, or if the other scan comes within a local radius of such a
//! point, the query stays undecided. Where two discs cross, Newton's method searches for a point on
//! both implicit surfaces. It adds a witness and certainty but never overrules the discs: the
//! weighted fit rounds off tips and ends early at borders, where discs remain valid
//! (docs/decisions).

use std::ops::{ControlFlow, Range};

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{BoxVisitor, NodePair, Open, PairVisitor, Part};
use nearmiss_surface::meet;

use crate::ask::answer::{Contact, Evidence, Reason};
use crate::ask::options::{CollideOptions, Detail};
use crate::contact::certificate::Bound;
use crate::leaf::crossing::Disc;
use crate::pair::placed::{Placed, ViewScratch};
use crate::pair::scan_pair::ScanPair;

/// Leaf pairs in which a witness is tried before the first crossing is reported as estimated.
const TRIES: u32 = 5;

/// A verified point further than this from the crossing belongs to another contact. In units of the
/// greater local radius.
const NEARBY: f64 = 4.0;

/// The search for a crossing.
#[derive(Debug)]
pub(crate) struct Surfaces<'a> {
    pub(crate) pair: ScanPair<'a>,
    pub(crate) detail: Detail,
    /// Surfaces nearer than this, in the world, meet.
    pub(crate) margin: f64,
    /// The distance beyond which pairs are pruned, in a's stored frame.
    pub(crate) reach: f32,
    /// `true` if pruned pairs are recorded.
    pub(crate) notes: bool,
    /// `true` if compared leaf pairs are recorded.
    pub(crate) notes_leaves: bool,
    /// The smallest gap of any pruned pair.
    nearest: f32,
    /// The pruned pairs.
    pub(crate) excluded: &'a mut Vec<Bound>,
    /// The leaf pairs whose points were compared without a contact.
    pub(crate) compared: &'a mut Vec<NodePair>,
    pub(crate) gathers: &'a mut [ViewScratch; 2],
    pub(crate) tries: u32,
    /// The best contact so far.
    pub(crate) found: Option<(Contact, Evidence)>,
    /// The points of the first contact.
    pub(crate) met: Option<[usize; 2]>,
    /// All contacts, one per leaf pair that meets, if requested.
    pub(crate) all: Option<&'a mut Vec<Contact>>,
    /// Why a crossing of unreliable discs leaves the query undecided, if there was one.
    pub(crate) doubt: Option<Reason>,
}

/// The buffers that a search writes to.
#[derive(Debug)]
pub(crate) struct Workspace<'a> {
    pub(crate) gathers: &'a mut [ViewScratch; 2],
    pub(crate) excluded: &'a mut Vec<Bound>,
    pub(crate) compared: &'a mut Vec<NodePair>,
    /// All contacts, if requested.
    pub(crate) all: Option<&'a mut Vec<Contact>>,
}

impl<'a> Surfaces<'a> {
    /// `notes`: whether pruned and compared pairs are recorded.
    pub(crate) fn new(
        pair: ScanPair<'a>,
        options: &CollideOptions,
        notes: bool,
        workspace: Workspace<'a>,
    ) -> Self {
        let Workspace { gathers, excluded, compared, all } = workspace;
        excluded.clear();
        compared.clear();
        Self {
            detail: options.detail,
            margin: options.margin,
            reach: pair.stored(options.margin),
            pair,
            notes,
            notes_leaves: notes || options.certifies(),
            nearest: f32::INFINITY,
            excluded,
            compared,
            gathers,
            tries: 0,
            found: None,
            met: None,
            all,
            doubt: None,
        }
    }

    /// Returns `true` if the disc of one of these points of b comes into the `ball` about the
    /// centre of `disc` of a, or `disc` into one of their balls. The disc of a point with a ball
    /// counts as a point here.
    pub(crate) fn comes_near_sparse(&self, disc: &Disc, ball: f32, mut points: Range<usize>) -> bool {
        let point =
            |disc: &Disc, ball: f32| Disc { radius: if ball > 0.0 { 0.0 } else { disc.radius }, ..*disc };
        // The margin enlarges each ball.
        let reach = |ball: f32| if ball > 0.0 { ball + self.reach } else { 0.0 };
        points.any(|j| {
            let other = self.pair.disc_b(j);
            let ball_b = self.pair.b.ball(j) * self.pair.relative.scale();
            comes_within(reach(ball), disc.centre, &point(&other, ball_b))
                || comes_within(reach(ball_b), other.centre, &point(disc, ball))
        })
    }

    /// Handles crossing discs of two leaves, those of points `i` and `j` first.
    pub(crate) fn crossed(&mut self, i: usize, j: usize) -> ControlFlow<()> {
        let contact = self.pair.single([i, j]).shared_chord();
        self.hit(contact, i, j)
    }

    /// Handles surfaces that meet at `contact`, to first order, near points `i` and `j`.
    pub(crate) fn hit(&mut self, contact: Contact, i: usize, j: usize) -> ControlFlow<()> {
        self.tries += 1;
        self.met.get_or_insert([i, j]);
        let certified = if self.is_settled() { None } else { self.refine(&contact, i, j) };
        let enough = self.detail == Detail::Verdict || certified.is_some() || self.tries >= TRIES;
        let flow = self.record(contact, certified);
        if enough { flow } else { ControlFlow::Continue(()) }
    }

    /// Records `contact`, and `certified` if it was verified. Continues if all contacts are
    /// requested.
    pub(crate) fn record(&mut self, contact: Contact, certified: Option<Contact>) -> ControlFlow<()> {
        if let Some(contact) = certified {
            self.found = Some((contact, Evidence::Certified));
        }
        self.found.get_or_insert((contact, Evidence::Estimated));
        match &mut self.all {
            Some(all) => {
                all.push(contact);
                ControlFlow::Continue(())
            }
            None => ControlFlow::Break(()),
        }
    }

    /// Returns `true` if no witness is needed, or none is searched for any more.
    pub(crate) fn is_settled(&self) -> bool {
        self.detail == Detail::Verdict
            || self.tries > TRIES
            || self.found.is_some_and(|(_, evidence)| evidence == Evidence::Certified)
    }

    /// Returns `true` if a common zero of both functions would verify a crossing of discs.
    pub(crate) fn verifies(&self) -> bool {
        self.pair.views.into_iter().all(Placed::verifies)
    }

    /// Searches for a verified point on both surfaces near `contact`.
    fn refine(&mut self, contact: &Contact, i: usize, j: usize) -> Option<Contact> {
        let [va, vb] = self.pair.views;
        if !self.verifies() {
            return None;
        }
        let [scratch_a, scratch_b] = &mut *self.gathers;
        let scale = vb.stored_to_world().scale() / va.stored_to_world().scale();
        let radius = f64::from(self.pair.a.radii[i]).max(f64::from(self.pair.b.radii[j]) * scale);
        let start = contact.point;
        let meter = &mut self.pair.meter;
        let (mut near_a, mut near_b) = (va.near(i, scratch_a), vb.near(j, scratch_b));
        let meeting = meet(start, |x| {
            if meter.go_on().is_break() {
                return None;
            }
            meter.evaluated(2);
            Some([near_a.evaluate(x), near_b.evaluate(x)])
        })?;
        let moved = (Vector3::from(meeting.point) - Vector3::from(contact.point)).norm();
        let nearby = NEARBY * radius * va.stored_to_world().scale();
        let is_obstacle = || va.is_obstacle(i, meeting.point) && vb.is_obstacle(j, meeting.point);
        let holds = meeting.verified && moved <= nearby;
        (holds && (self.pair.part == Part::Surface || is_obstacle())).then(|| Contact {
            point: meeting.point,
            normals: Some(meeting.at.map(|e| e.normal)),
            residual: meeting.residual(),
            ..*contact
        })
    }
}

/// Returns `true` if some point of `disc` is within `radius` of `p` and `radius` is positive.
fn comes_within(radius: f32, p: [f32; 3], disc: &Disc) -> bool {
    let d = Vector3::from(p) - Vector3::from(disc.centre);
    let height = d.dot(&Vector3::from(disc.normal));
    let beside = (d.norm_squared() - height * height).max(0.0).sqrt() - disc.radius;
    radius > 0.0 && height * height + beside.max(0.0).powi(2) <= radius * radius
}

/// A search that compares boxes only and records nothing.
pub(crate) struct Plain<'s, 'a>(pub(crate) &'s mut Surfaces<'a>);

impl PairVisitor for Plain<'_, '_> {
    #[inline]
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.0.compared(pairs)
    }

    #[inline]
    fn is_apart(&mut self, pair: NodePair) -> bool {
        self.0.pair.gap_by_leaf(pair).is_some_and(|gap| gap > self.0.reach)
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], _: &Open) -> ControlFlow<()> {
        self.0.leaf_pair(leaves)
    }
}

impl BoxVisitor for Plain<'_, '_> {}

/// A search that records the pairs it prunes.
pub(crate) struct Closer<'s, 'a>(pub(crate) &'s mut Surfaces<'a>);

impl PairVisitor for Closer<'_, '_> {
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.0.compared(pairs)
    }

    fn is_apart(&mut self, pair: NodePair) -> bool {
        match self.0.pair.gap_by_leaf(pair) {
            Some(gap) if gap > self.0.reach => {
                self.0.exclude(pair, gap);
                true
            }
            _ => false,
        }
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], _: &Open) -> ControlFlow<()> {
        self.0.leaf_pair(leaves)
    }
}

impl BoxVisitor for Closer<'_, '_> {
    const NOTES_PAIRS: bool = true;

    fn apart(&mut self, pair: NodePair, gap: f32) {
        self.0.exclude(pair, gap);
    }
}

impl Surfaces<'_> {
    /// Returns `true` if any leaf pair with a contact will do. Then the likeliest pairs come first.
    pub(crate) fn wants_any(&self) -> bool {
        // With a margin, the boxes that overlap most are rather beside than near each other, and
        // fewer witnesses verify there.
        self.all.is_none() && self.margin == 0.0
    }

    #[inline]
    pub(crate) fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
    }

    /// Records a pruned pair if requested. The pair with the smallest gap stays last.
    fn exclude(&mut self, pair: NodePair, gap: f32) {
        if !self.notes {
            return;
        }
        self.excluded.push(Bound { gap, pair });
        if gap < self.nearest {
            self.nearest = gap;
        } else {
            let last = self.excluded.len() - 1;
            self.excluded.swap(last, last.saturating_sub(1));
        }
    }

    /// Counts two leaves, given by leaf numbers, whose points are compared next.
    #[inline]
    pub(crate) fn begin_leaves(&mut self, leaves: [usize; 2]) {
        let (a, b) = (self.pair.a.leaves, self.pair.b.leaves);
        self.pair.meter.leaf_pair(a.points(leaves[0]).len(), b.points(leaves[1]).len());
        if self.notes_leaves {
            self.compared.push(self.pair.leaves(leaves));
        }
    }

    /// Compares the points of two leaves, given by leaf numbers.
    pub(crate) fn leaf_pair(&mut self, leaves: [usize; 2]) -> ControlFlow<()> {
        self.begin_leaves(leaves);
        self.compare_leaves(leaves, true)
    }
}
