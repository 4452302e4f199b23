//! `Semantics::Surface`: the tangent discs of one scan against those of the other.
//!
//! Boxes hold the discs of their points, so a pair of disjoint boxes hides no crossing, and the descent finds
//! a crossing exactly if there is one. Discs of points on lines and of lone ones are not to be trusted: where only
//! they cross, or the other scan comes within a local radius of such a point, the answer stays open. Where two discs cross, Newton's method looks for a point on both
//! implicit surfaces; it adds a witness and certainty, and does not overrule: the weighted fit rounds off tips
//! and ends early at borders, where discs of points still tell (docs/decisions).

use std::ops::ControlFlow;

use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{GatherScratch, Node, NodePair, PointKind, Split, Visitor};
use nearmiss_surface::meet;

use crate::certify::{Excluded, distinct};
use crate::crossing::{Disc, Lanes};
use crate::options::{CollideOptions, Detail};
use crate::posed::Posed;
use crate::verdict::{Contact, Evidence, Reason};

/// A witness is tried for in so many pairs of leaves before the first crossing stands as estimated.
const TRIES: u32 = 4;

/// Newton's steps hardly ever lead further than this from the crossing, in local radii.
const NEWTON: f64 = 1.0;

/// A verified point further than this from the crossing, in the greater of the two local radii, is some other place.
const NEARBY: f64 = 4.0;

/// As near each other as discs are wide, in the lesser local radius, points say enough by themselves, however their
/// discs lie.
const NEAR: f32 = 0.65;

/// Where surfaces cross, samples of either are within some 0.6 local radii of the place, and nearer than this to each
/// other, in the greater radius. Discs reach up to 1.3; those that stand upright, as noise on thin plates makes them,
/// would bridge a gap of that width.
const FAR: f32 = 0.9;

/// The search for a crossing.
#[derive(Debug)]
pub(crate) struct Surfaces<'a> {
    pub(crate) pair: Posed<'a>,
    pub(crate) detail: Detail,
    /// Surfaces nearer than this, in the world, meet.
    pub(crate) margin: f64,
    /// What is further apart than this, in a's stored frame, does not meet.
    pub(crate) reach: f32,
    /// Whether separations are to be proven.
    certify: bool,
    /// The least gap of any pair excluded.
    nearest: f32,
    /// The pairs that were excluded, to be proven apart.
    pub(crate) excluded: &'a mut Vec<Excluded>,
    lanes: &'a mut Lanes,
    pub(crate) gathers: &'a mut [GatherScratch; 2],
    tries: u32,
    /// The best contact so far.
    pub(crate) found: Option<(Contact, Evidence)>,
    /// A crossing of discs that are not to be trusted, and why.
    pub(crate) doubt: Option<Reason>,
}

impl<'a> Surfaces<'a> {
    pub(crate) fn new(
        pair: Posed<'a>,
        options: &CollideOptions,
        lanes: &'a mut Lanes,
        gathers: &'a mut [GatherScratch; 2],
        excluded: &'a mut Vec<Excluded>,
    ) -> Self {
        excluded.clear();
        let reach = pair.stored(options.margin);
        Self {
            pair,
            detail: options.detail,
            margin: options.margin,
            reach,
            certify: options.certifies(),
            nearest: f32::INFINITY,
            excluded,
            lanes,
            gathers,
            tries: 0,
            found: None,
            doubt: None,
        }
    }

    fn disc_a(&self, i: usize) -> Disc {
        Disc {
            centre: self.pair.a.positions[i],
            normal: self.pair.a.normals[i],
            radius: self.pair.a.discs[i],
        }
    }

    pub(crate) fn disc_b(&self, j: usize) -> Disc {
        Disc {
            centre: self.pair.relative.point(self.pair.b.positions[j]),
            normal: self.pair.relative.direction(self.pair.b.normals[j]),
            radius: self.pair.b.discs[j] * self.pair.relative.scale(),
        }
    }

    /// Puts the discs of a leaf of b into the lanes. Returns whether any point there is sparse.
    fn fill(&mut self, node: &Node) -> bool {
        let mut sparse = false;
        for (lane, j) in node.points().enumerate() {
            let disc = self.disc_b(j);
            self.lanes.set(lane, &disc);
            sparse |= self.pair.b.ball(j) > 0.0;
        }
        self.lanes.close(node.count as usize);
        sparse
    }

    /// Whether a disc of leaf `node` of b comes into the `ball` about the centre of `disc` of a, or that disc into
    /// one of its balls. A point with a ball has no disc here.
    fn comes_near_sparse(&self, disc: &Disc, ball: f32, node: &Node) -> bool {
        let point =
            |disc: &Disc, ball: f32| Disc { radius: if ball > 0.0 { 0.0 } else { disc.radius }, ..*disc };
        // Within a margin of a ball is as good as within it.
        let reach = |ball: f32| if ball > 0.0 { ball + self.reach } else { 0.0 };
        node.points().any(|j| {
            let other = self.disc_b(j);
            let ball_b = self.pair.b.ball(j) * self.pair.relative.scale();
            comes_within(reach(ball), disc.centre, &point(&other, ball_b))
                || comes_within(reach(ball_b), other.centre, &point(disc, ball))
        })
    }

    /// Discs of two leaves cross, those of points `i` and `j` first.
    fn crossed(&mut self, i: usize, j: usize) -> ControlFlow<()> {
        let contact = self.estimate(i, j);
        if self.detail == Detail::Verdict {
            self.found = Some((contact, Evidence::Estimated));
            return ControlFlow::Break(());
        }
        self.tries += 1;
        if let Some(contact) = self.refine(&contact, i, j) {
            self.found = Some((contact, Evidence::Certified));
            return ControlFlow::Break(());
        }
        self.found.get_or_insert((contact, Evidence::Estimated));
        // Other crossings of the same leaves would fail likewise.
        if self.tries >= TRIES { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Why a crossing of the discs of points `i` and `j` says little, if it does.
    pub(crate) fn doubt_about(&self, i: usize, j: usize) -> Option<Reason> {
        match self.pair.views[0].scan().kind(i).max(self.pair.views[1].scan().kind(j)) {
            PointKind::Surface | PointKind::Border => None,
            PointKind::Line | PointKind::Isolated => Some(Reason::Undersampled),
            _ => {
                let (distance, [ra, rb]) = self.points(i, j);
                (distance > NEAR * ra.min(rb)).then_some(Reason::Ambiguous)
            }
        }
    }

    /// The distance of two points, and their local radii, in a's stored frame.
    fn points(&self, i: usize, j: usize) -> (f32, [f32; 2]) {
        let q = self.pair.relative.point(self.pair.b.positions[j]);
        let distance = (Vector3::from(self.pair.a.positions[i]) - Vector3::from(q)).norm();
        (distance, [self.pair.a.radii[i], self.pair.b.radii[j] * self.pair.relative.scale()])
    }

    /// The middle of what the chords of two crossing discs share, in the world.
    fn estimate(&self, i: usize, j: usize) -> Contact {
        let [va, vb] = self.pair.views;
        let [pa, pb] = [va.point(i), vb.point(j)].map(Vector3::from);
        let na = Vector3::from(va.placed().rotate(self.pair.a.normals[i].map(f64::from)));
        let nb = Vector3::from(vb.placed().rotate(self.pair.b.normals[j].map(f64::from)));
        let middle = 0.5 * (pa + pb);
        let (fa, fb) = (na.dot(&(pa - middle)), nb.dot(&(pb - middle)));
        let c = na.dot(&nb);
        let gram = 1.0 - c * c;
        let step = if gram < 1e-3 {
            0.5 * (fa * na + fb * nb)
        } else {
            ((fa - c * fb) * na + (fb - c * fa) * nb) / gram
        };
        let radii = [
            f64::from(self.pair.a.discs[i]) * va.placed().scale(),
            f64::from(self.pair.b.discs[j]) * vb.placed().scale(),
        ];
        let place = middle + step;
        // Along the common line each chord is an interval; for parallel planes the place is as good as any.
        let along = na.cross(&nb).try_normalize(0.03).map_or_else(Vector3::zeros, |line| {
            let chord = |p: Vector3<f64>, radius: f64| {
                let t = line.dot(&(p - place));
                let half = (radius * radius - (p - place - t * line).norm_squared()).max(0.0).sqrt();
                (t - half, t + half)
            };
            let ((a0, a1), (b0, b1)) = (chord(pa, radii[0]), chord(pb, radii[1]));
            line * (0.5 * (a0.max(b0) + a1.min(b1)))
        });
        Contact {
            point: (place + along).into(),
            normals: Some([na.into(), nb.into()]),
            residual: nb.dot(&(pa - pb)).abs().max(na.dot(&(pa - pb)).abs()),
            sources: [va.scan().id(i), vb.scan().id(j)],
        }
    }

    /// A verified point on both surfaces near `contact`.
    fn refine(&mut self, contact: &Contact, i: usize, j: usize) -> Option<Contact> {
        let [va, vb] = self.pair.views;
        let [scratch_a, scratch_b] = &mut *self.gathers;
        let scale = vb.placed().scale() / va.placed().scale();
        let radius = f64::from(self.pair.a.radii[i]).max(f64::from(self.pair.b.radii[j]) * scale);
        let (in_a, in_b) = (NEWTON * radius, NEWTON * radius / scale);
        let start = contact.point;
        let mut near_a = va.scan().vicinity(va.placed().apply_inverse(start), in_a, scratch_a);
        let mut near_b = vb.scan().vicinity(vb.placed().apply_inverse(start), in_b, scratch_b);
        let meeting = meet(start, |x| {
            let at_a = va.in_world(near_a.evaluate(va.placed().apply_inverse(x)));
            [at_a, vb.in_world(near_b.evaluate(vb.placed().apply_inverse(x)))]
        });
        self.pair.meter.spent.evaluations += 2 * u64::from(meeting.rounds);
        let moved = (Vector3::from(meeting.point) - Vector3::from(contact.point)).norm();
        let nearby = NEARBY * radius * va.placed().scale();
        (meeting.verified && moved <= nearby).then(|| Contact {
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

impl Visitor for Surfaces<'_> {
    #[inline]
    fn admit(&mut self, a: [NodeId; 2], b: [NodeId; 2], count: u8) -> [Option<f32>; 4] {
        let [p, q, r, s] = self.pair.gaps(a, b, count);
        let reach = self.reach;
        let admit = |gap: f32| if gap > reach { None } else { Some(-gap) };
        let admitted = [admit(p), admit(q), admit(r), admit(s)];
        if self.certify {
            let distinct = distinct(a, b);
            let mask = [0, 1, 2, 3].map(|i| distinct[i] && admitted[i].is_none());
            if mask.contains(&true) {
                let gaps = [p, q, r, s];
                let least = (0..4).filter(|&i| mask[i]).fold(f32::INFINITY, |least, i| least.min(gaps[i]));
                self.excluded.push(Excluded { a, b, mask });
                // The nearest come last.
                if least < self.nearest {
                    self.nearest = least;
                } else {
                    let last = self.excluded.len() - 1;
                    self.excluded.swap(last, last.saturating_sub(1));
                }
            }
        }
        admitted
    }

    #[inline]
    fn split(&self, pair: NodePair) -> Split {
        self.pair.split(pair)
    }

    #[inline]
    fn go_on(&mut self) -> ControlFlow<()> {
        self.pair.meter.go_on()
    }

    fn leaves(&mut self, pair: NodePair) -> ControlFlow<()> {
        let (node_a, node_b) = (self.pair.a.nodes[pair.a.index()], self.pair.b.nodes[pair.b.index()]);
        self.pair.meter.leaf_pair(node_a.count, node_b.count);
        // Most discs of one leaf are out of reach of all of the other.
        let bounds = self.pair.relative.moved(&self.pair.b.boxes[pair.b.index()]);
        let (mut ready, mut sparse) = (false, false);
        for i in node_a.points() {
            let disc = self.disc_a(i);
            let ball = self.pair.a.ball(i);
            let reach = disc.radius.max(ball) + self.reach;
            if bounds.distance_sq(disc.centre) > reach * reach {
                continue;
            }
            if !ready {
                sparse = self.fill(&node_b);
                ready = true;
            }
            let is_open = self.doubt == Some(Reason::Undersampled);
            if (ball > 0.0 || sparse) && !is_open && self.comes_near_sparse(&disc, ball, &node_b) {
                self.doubt = Some(Reason::Undersampled);
            }
            let mut bits = self.lanes.crossings(&disc);
            while bits != 0 {
                let j = node_b.first as usize + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let (distance, [ra, rb]) = self.points(i, j);
                if distance > FAR * ra.max(rb) {
                    continue;
                }
                match self.doubt_about(i, j) {
                    Some(reason) => _ = self.doubt.get_or_insert(reason),
                    None => return self.crossed(i, j),
                }
            }
            if self.margin > 0.0 {
                self.near_discs(i, &disc, &node_b)?;
            }
        }
        ControlFlow::Continue(())
    }
}
