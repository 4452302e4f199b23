//! `Semantics::Surface`: the tangent discs of one scan against those of the other.
//!
//! Boxes hold the discs of their points, so a pair of disjoint boxes hides no crossing, and the descent finds
//! a crossing exactly if there is one. Discs of points on lines and of lone ones are not to be trusted: where
//! only they cross, or the other scan comes within a local radius of such a point, the answer stays open.
//! Where two discs cross, Newton's method looks for a point on both implicit surfaces; it adds a witness and
//! certainty, and does not overrule: the weighted fit rounds off tips and ends early at borders, where discs
//! of points still tell (docs/decisions).

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

/// A witness is tried for in so many pairs of leaves before the first crossing stands as estimated.
const TRIES: u32 = 5;

/// A verified point further than this from the crossing, in the greater of the two local radii, is some other
/// place.
const NEARBY: f64 = 4.0;

/// The search for a crossing.
#[derive(Debug)]
pub(crate) struct Surfaces<'a> {
    pub(crate) pair: ScanPair<'a>,
    pub(crate) detail: Detail,
    /// Surfaces nearer than this, in the world, meet.
    pub(crate) margin: f64,
    /// What is further apart than this, in a's stored frame, does not meet.
    pub(crate) reach: f32,
    /// Whether pairs of nodes that are apart are noted.
    pub(crate) notes: bool,
    /// Whether compared pairs are noted.
    pub(crate) notes_leaves: bool,
    /// The least gap of any pair excluded.
    nearest: f32,
    /// The pairs that were excluded.
    pub(crate) excluded: &'a mut Vec<Bound>,
    /// The pairs whose points were compared, without a hit.
    pub(crate) compared: &'a mut Vec<NodePair>,
    pub(crate) gathers: &'a mut [ViewScratch; 2],
    pub(crate) tries: u32,
    /// The best contact so far.
    pub(crate) found: Option<(Contact, Evidence)>,
    /// The points of the first.
    pub(crate) met: Option<[usize; 2]>,
    /// Every contact, one of each pair of leaves that meets, if all are wanted.
    pub(crate) all: Option<&'a mut Vec<Contact>>,
    /// A crossing of discs that are not to be trusted, and why.
    pub(crate) doubt: Option<Reason>,
}

/// What a search writes into.
#[derive(Debug)]
pub(crate) struct Workspace<'a> {
    pub(crate) gathers: &'a mut [ViewScratch; 2],
    pub(crate) excluded: &'a mut Vec<Bound>,
    pub(crate) compared: &'a mut Vec<NodePair>,
    /// Contacts, if all are wanted.
    pub(crate) all: Option<&'a mut Vec<Contact>>,
}

impl<'a> Surfaces<'a> {
    /// `notes`: whether the pairs that were excluded or compared are wanted.
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

    /// Whether a disc of some points of b comes into the `ball` about the centre of `disc` of a, or that disc
    /// into one of their balls. A point with a ball has no disc here.
    pub(crate) fn comes_near_sparse(&self, disc: &Disc, ball: f32, mut points: Range<usize>) -> bool {
        let point =
            |disc: &Disc, ball: f32| Disc { radius: if ball > 0.0 { 0.0 } else { disc.radius }, ..*disc };
        // Within a margin of a ball is as good as within it.
        let reach = |ball: f32| if ball > 0.0 { ball + self.reach } else { 0.0 };
        points.any(|j| {
            let other = self.pair.disc_b(j);
            let ball_b = self.pair.b.ball(j) * self.pair.relative.scale();
            comes_within(reach(ball), disc.centre, &point(&other, ball_b))
                || comes_within(reach(ball_b), other.centre, &point(disc, ball))
        })
    }

    /// Discs of two leaves cross, those of points `i` and `j` first.
    pub(crate) fn crossed(&mut self, i: usize, j: usize) -> ControlFlow<()> {
        let contact = self.pair.shared_chord(i, j);
        self.hit(contact, i, j)
    }

    /// The surfaces meet at `contact`, to first order, near points `i` and `j`.
    pub(crate) fn hit(&mut self, contact: Contact, i: usize, j: usize) -> ControlFlow<()> {
        self.tries += 1;
        self.met.get_or_insert([i, j]);
        let certified = if self.is_settled() { None } else { self.refine(&contact, i, j) };
        let enough = self.detail == Detail::Verdict || certified.is_some() || self.tries >= TRIES;
        let flow = self.record(contact, certified);
        if enough { flow } else { ControlFlow::Continue(()) }
    }

    /// Takes `contact` down, and what `certified` makes of it. Goes on where all are wanted.
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

    /// Whether no witness is looked for, or no more.
    pub(crate) fn is_settled(&self) -> bool {
        self.detail == Detail::Verdict
            || self.tries > TRIES
            || self.found.is_some_and(|(_, evidence)| evidence == Evidence::Certified)
    }

    /// Whether a place where both functions vanish would verify a crossing of discs.
    pub(crate) fn verifies(&self) -> bool {
        self.pair.views.into_iter().all(Placed::verifies)
    }

    /// A verified point on both surfaces near `contact`.
    fn refine(&mut self, contact: &Contact, i: usize, j: usize) -> Option<Contact> {
        let [va, vb] = self.pair.views;
        if !self.verifies() {
            return None;
        }
        let [scratch_a, scratch_b] = &mut *self.gathers;
        let scale = vb.placed().scale() / va.placed().scale();
        let radius = f64::from(self.pair.a.radii[i]).max(f64::from(self.pair.b.radii[j]) * scale);
        let start = contact.point;
        let meter = &mut self.pair.meter;
        let meeting = meet(start, |x| {
            if meter.go_on().is_break() {
                return None;
            }
            meter.evaluated(2);
            Some([va.evaluate_near(i, x, scratch_a), vb.evaluate_near(j, x, scratch_b)])
        })?;
        let moved = (Vector3::from(meeting.point) - Vector3::from(contact.point)).norm();
        let nearby = NEARBY * radius * va.placed().scale();
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

/// Whether some place of `disc` is within `radius` of `p`, which is more than zero.
fn comes_within(radius: f32, p: [f32; 3], disc: &Disc) -> bool {
    let d = Vector3::from(p) - Vector3::from(disc.centre);
    let height = d.dot(&Vector3::from(disc.normal));
    let beside = (d.norm_squared() - height * height).max(0.0).sqrt() - disc.radius;
    radius > 0.0 && height * height + beside.max(0.0).powi(2) <= radius * radius
}

/// A search that goes by boxes alone.
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

/// A search that notes what it excludes.
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
    /// Whether any pair of leaves that meets is as good as another: then the likeliest come first.
    pub(crate) fn wants_any(&self) -> bool {
        // Within a margin boxes that overlap most are beside each other rather than near, and fewer witnesses
        // verify there.
        self.all.is_none() && self.margin == 0.0
    }

    #[inline]
    pub(crate) fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
    }

    /// Notes a pair whose boxes are apart, if that is wanted. The nearest comes last.
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

    /// Counts two leaves, by their numbers, whose points are compared now.
    #[inline]
    pub(crate) fn begin_leaves(&mut self, leaves: [usize; 2]) {
        let (a, b) = (self.pair.a.leaves, self.pair.b.leaves);
        self.pair.meter.leaf_pair(a.points(leaves[0]).len(), b.points(leaves[1]).len());
        if self.notes_leaves {
            self.compared.push(self.pair.leaves(leaves));
        }
    }

    /// The points of two leaves, by their numbers.
    pub(crate) fn leaf_pair(&mut self, leaves: [usize; 2]) -> ControlFlow<()> {
        self.begin_leaves(leaves);
        self.compare_leaves(leaves, true)
    }
}
