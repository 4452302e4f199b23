//! A pair of placed scans and the questions about it.

use std::time::Duration;

use fearless_simd::Level;
use nearmiss_surface::Evaluation;

use crate::ask::answer::{Answer, Contacts, ManifoldPoint};
use crate::ask::budget::Budget;
use crate::ask::options::CollidePlan;
use crate::contact::certificate::Proof;
use crate::contact::collide::{Asked, ContactScratch, Outputs};
use crate::contact::hint::PairHint;
use crate::curve::{CurvePlan, CurveScratch, Curves};
use crate::distance::{Distance, DistancePlan};
use crate::mesh::pair::MeshScratch;
use crate::motion::advance::MotionScratch;
use crate::pair::placed::Placed;
use crate::papers::PapersScratch;
use crate::penetration::answer::{Interior, Penetration};
use crate::penetration::scans::{PenetrationScratch, penetration};
use crate::solid::scratch::SolidScratch;

/// Working memory of queries, one per thread. Reuse it: a query does not allocate once its scratch
/// is warm.
///
/// A scratch serves every kind of question about any scans. It holds no answers and never changes
/// one.
#[derive(Debug, Clone)]
pub struct Scratch {
    pub(crate) contact: ContactScratch,
    papers: PapersScratch,
    pub(crate) distance: crate::distance::Frontier,
    curve: CurveScratch,
    meshes: MeshScratch,
    pub(crate) motion: MotionScratch,
    pub(crate) solid: SolidScratch,
    pub(crate) penetration: PenetrationScratch,
}

impl Default for Scratch {
    fn default() -> Self {
        Self::by_level(Level::new())
    }
}

impl Scratch {
    /// A scratch whose queries run with the SIMD instructions of `level` instead of the best
    /// available ones, for comparisons. Answers do not depend on it.
    #[must_use]
    pub fn by_level(level: Level) -> Self {
        Self {
            contact: ContactScratch::new(level),
            papers: PapersScratch::default(),
            distance: crate::distance::Frontier::default(),
            curve: CurveScratch::default(),
            meshes: MeshScratch::by_level(level),
            motion: MotionScratch::default(),
            solid: SolidScratch::default(),
            penetration: PenetrationScratch::default(),
        }
    }

    /// Returns the working memory of queries about two meshes, for example in a batch
    /// ([`each`](crate::each)).
    pub fn meshes(&mut self) -> &mut MeshScratch {
        &mut self.meshes
    }

    /// Returns the SIMD instruction set that queries use.
    pub(crate) fn level(&self) -> Level {
        self.contact.level
    }

    /// Returns the longest interval between two clock reads in the last collision query with a
    /// deadline; zero without a deadline. A query overruns its deadline by about this much at most.
    #[must_use]
    pub fn longest_stretch(&self) -> Duration {
        self.contact.longest_stretch
    }
}

impl Placed<'_> {
    /// Evaluates the implicit function at `x`, all in world coordinates, with the kernel of the
    /// scan's [metric](nearmiss_hierarchy::PointHierarchy::metric). The signs of f and of the
    /// normal follow the oriented normals if the scan has them.
    pub fn evaluate(&self, x: [f64; 3], scratch: &mut Scratch) -> Evaluation {
        let [gather, _] = &mut scratch.contact.gathers;
        self.evaluate_with(x, gather)
    }
}

/// Two placed scans and the budget of each question about them.
///
/// The questions are methods: [`collide`](Self::collide), [`distance`](Self::distance) and
/// [`curves`](Self::curves). A collision query can produce more than its answer: request a
/// [`manifold`](Self::manifold), all [`contacts`](Self::contacts) or a [`proof`](Self::proof), and
/// reuse what the last query found ([`hinted`](Self::hinted)), in any combination.
///
/// ```
/// use nearmiss_geometry::{PointCloud, Pose};
/// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
/// use nearmiss_query::{
///     CollideOptions, CollidePlan, DistanceOptions, DistancePlan, Pair, PairHint, Prepared, Scratch,
/// };
///
/// let points: Vec<[f32; 3]> =
///     (0..2500_u16).map(|i| [f32::from(i % 50) * 0.02, f32::from(i / 50) * 0.02, 0.0]).collect();
/// let square = PointHierarchy::build(&PointCloud::from_positions(&points)?, &BuildOptions::default())?;
/// let plan = CollidePlan::new(&CollideOptions::default(), &square, &square)?;
/// let (mut scratch, mut hint, mut manifold) = (Scratch::default(), PairHint::default(), Vec::new());
///
/// // An upright square is lowered onto a lying one.
/// let upright = Pose::from_axis_angle([1.0, 0.0, 0.0], 1.5);
/// let lowered = |step: i32| {
///     let pose = upright.with_translation([0.3, 0.5, 0.06 - 0.01 * f64::from(step)]);
///     Pair::new(square.at(&Pose::IDENTITY), square.at(&pose))
/// };
/// let steps_until = (0..20).take_while(|&step| {
///     let answer = lowered(step).hinted(&mut hint).manifold(&mut manifold).collide(&plan, &mut scratch);
///     answer.verdict.is_separated()
/// });
/// let touches_at = steps_until.count();
/// assert_eq!(touches_at, 5);
/// assert!(manifold.len() > 1, "it touches along an edge");
///
/// let plan = DistancePlan::new(&DistanceOptions::default(), &square, &square)?;
/// let distance = lowered(0).distance(&plan, &mut scratch);
/// assert!(distance.lower <= 0.06 && 0.04 <= distance.upper);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Pair<'a> {
    scans: [Placed<'a>; 2],
    pub(crate) budget: Budget,
}

impl<'a> Pair<'a> {
    /// A pair with an unlimited budget.
    #[inline]
    #[must_use]
    pub fn new(a: Placed<'a>, b: Placed<'a>) -> Self {
        Self { scans: [a, b], budget: Budget::UNLIMITED }
    }

    /// The same pair with this budget for each question.
    #[inline]
    #[must_use]
    pub fn within(self, budget: &Budget) -> Self {
        Self { budget: *budget, ..self }
    }

    /// Both scans.
    #[must_use]
    pub fn scans(&self) -> &[Placed<'a>; 2] {
        &self.scans
    }

    /// Decides whether the scans meet, with the meaning of `plan`.
    ///
    /// Does not allocate once `scratch` is warm. Deterministic: a question without a deadline
    /// always has the same answer.
    #[inline]
    pub fn collide(&self, plan: &CollidePlan, scratch: &mut Scratch) -> Answer {
        self.question().collide(plan, scratch)
    }

    /// A question that starts from what the last one found; see [`Question::hinted`].
    #[inline]
    #[must_use]
    pub fn hinted<'q>(&'q self, hint: &'q mut PairHint) -> Question<'q> {
        self.question().hinted(hint)
    }

    /// A question that also produces a contact manifold; see [`Question::manifold`].
    #[inline]
    #[must_use]
    pub fn manifold<'q>(&'q self, points: &'q mut Vec<ManifoldPoint>) -> Question<'q> {
        self.question().manifold(points)
    }

    /// A question that also produces all contacts; see [`Question::contacts`].
    #[inline]
    #[must_use]
    pub fn contacts<'q>(&'q self, contacts: &'q mut Contacts) -> Question<'q> {
        self.question().contacts(contacts)
    }

    /// A question that also produces a proof of separation; see [`Question::proof`].
    #[inline]
    #[must_use]
    pub fn proof<'q>(&'q self, proof: &'q mut Proof) -> Question<'q> {
        self.question().proof(proof)
    }

    /// Bounds the distance of the scans: lower ≤ distance ≤ upper. Both bounds are valid whenever
    /// the budget ends the search.
    ///
    /// With [`Semantics::Thickened`](crate::Semantics::Thickened) the distance is that of the two
    /// nearest points less both radii, and both bounds equal it once the search is complete. With
    /// surfaces, `lower` is proven by enclosures (docs/theory/certificates.md): it is a few
    /// sampling radii less than the distance, and 0 for scans of the geodesic metric. `upper` is
    /// the distance of two points on the surfaces near the two nearest samples. Surfaces that
    /// [`collide`](Self::collide) have distance 0.
    ///
    /// Ignores the resolution of the budget. Does not allocate once `scratch` is warm. Takes 0.1 to
    /// 0.2 ms for separated scans of 100,000 points and 10 µs for surfaces that meet
    /// (benches/record). Thickened scans that interpenetrate cost a comparison of every pair of
    /// leaves that overlap.
    pub fn distance(&self, plan: &DistancePlan, scratch: &mut Scratch) -> Distance {
        let Scratch { distance: open, contact, .. } = scratch;
        crate::distance::distance(self.scans.each_ref(), [0, 0], plan, &self.budget, (open, contact)).0
    }

    /// Bounds the penetration of the scans: how far b must at least be shifted, in any direction, to be
    /// separate from a. Separate means that [`collide`](Self::collide) separates them, with the meaning and
    /// the margin of `plan`, and that no part of one is inside the other one if that is
    /// [solid](Interior::Solid).
    ///
    /// Both bounds are valid whenever the budget ends the search. The upper one comes from a shift that was
    /// tested, and is a local minimum: a shorter shift may exist in a direction that was not tried. The lower
    /// one comes from a place that is common to both scans: one inside both, or a measured point of one
    /// inside the other. So it is 0 if neither scan is solid, except for thickened points. Distances from
    /// surfaces are proven; rays decide which places are inside (docs/theory/penetration.md).
    ///
    /// The method, order and coverings of the plan and the resolution of the budget are ignored. Costs some
    /// 200 to 500 boolean queries. Does not allocate once `scratch` is warm.
    ///
    /// ```
    /// use nearmiss_geometry::{PointCloud, Pose};
    /// use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
    /// use nearmiss_query::{CollideOptions, CollidePlan, Interior, Pair, Prepared, Scratch};
    ///
    /// // A scanned ball of radius 0.5 that is 0.1 deep in a scanned floor.
    /// let golden = 2.399_963_f64;
    /// let ball: Vec<[f64; 3]> = (0..4000_u32)
    ///     .map(|i| {
    ///         let (z, turn) = (1.0 - f64::from(2 * i + 1) / 4000.0, golden * f64::from(i));
    ///         let across = (1.0 - z * z).sqrt();
    ///         [0.5 * across * turn.cos(), 0.5 * across * turn.sin(), 0.5 * z]
    ///     })
    ///     .collect();
    /// let floor: Vec<[f64; 3]> =
    ///     (0..6400_u32).map(|i| [f64::from(i % 80) * 0.025, f64::from(i / 80) * 0.025, 0.0]).collect();
    /// let options = BuildOptions::default();
    /// let floor = PointHierarchy::build(&PointCloud::from_positions(&floor)?, &options)?;
    /// let ball = PointHierarchy::build(&PointCloud::from_positions(&ball)?, &options)?;
    ///
    /// let plan = CollidePlan::new(&CollideOptions::default(), &floor, &ball)?;
    /// let pair = Pair::new(floor.at(&Pose::IDENTITY), ball.at(&Pose::from_translation([1.0, 1.0, 0.4])));
    /// let interiors = [Interior::Hollow, Interior::Solid];
    /// let found = pair.penetration(&plan, interiors, &mut Scratch::default());
    /// assert!(found.lower > 0.08 && found.lower <= 0.1 && (found.upper - 0.1).abs() < 0.02, "{found:?}");
    /// assert!(found.direction[2] > 0.99, "up: {found:?}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn penetration(
        &self,
        plan: &CollidePlan,
        interiors: [Interior; 2],
        scratch: &mut Scratch,
    ) -> Penetration {
        let Scratch { contact, solid, penetration: own, .. } = scratch;
        let working = (contact, &mut solid.crossings);
        penetration(self.scans.each_ref(), (plan, interiors), &self.budget, working, own)
    }

    /// Traces the curves in which the two surfaces intersect and writes them to `found`, as far as
    /// the budget lasts.
    ///
    /// At each point both |f| are within the tolerance. A chord deviates from its curve by at most
    /// 1/40 of the spacing, or of two sampling radii if that is less. By default that is 0.05 radii
    /// where curves are as smooth as arcs; on a rough scan one chord in a hundred deviates by 0.06
    /// to 0.16 radii. The curve of the true surfaces may differ by the bias of both surfaces, h²H/2
    /// each, divided by the sine of their angle.
    ///
    /// Every curve on which the discs of two leaves cross is found. A curve that is shorter than a
    /// leaf and within a sampling radius of another curve may be mistaken for that one. Swapping
    /// the scans gives the same curves with other points on them. Scans of the geodesic metric need
    /// [their graph](Placed::with_graph).
    ///
    /// Costs as much as [all contacts](Self::contacts) plus three pairs of evaluations per sampling
    /// radius of length. Does not allocate once `found` and `scratch` are warm.
    pub fn curves(&self, plan: &CurvePlan, found: &mut Curves, scratch: &mut Scratch) {
        let beside = (&mut scratch.contact, &mut scratch.curve);
        crate::curve::curves(self.scans.each_ref(), plan, &self.budget, found, beside);
    }

    /// Starts a question about the pair, to which outputs can be added one by one.
    #[inline]
    #[must_use]
    pub fn question(&self) -> Question<'_> {
        Question { pair: self, outputs: Outputs::default() }
    }
}

/// A collision query under construction: a pair and the outputs wanted beside the answer.
#[derive(Debug)]
pub struct Question<'q> {
    pair: &'q Pair<'q>,
    outputs: Outputs<'q>,
}

impl<'q> Question<'q> {
    /// Starts from `hint`, which stores where the scans met or what separated them, and updates it.
    ///
    /// A hint pays off when poses change little between queries: a step of a tenth of a sampling
    /// radius takes a fraction of a query. It never changes a verdict, except one that a budget
    /// cuts short. Evidence may differ: a certified gap may be smaller than without a hint, and
    /// about one separation in a thousand is certified with a hint and estimated without, or the
    /// reverse.
    ///
    /// Combined with [all contacts](Self::contacts), a hint speeds up only separations; combined
    /// with a [proof](Self::proof), only contacts. The methods of the papers ignore hints
    /// ([`Method::Sampling`](crate::Method), [`Method::Interpolation`](crate::Method), orders by
    /// sides, coverings, resolutions).
    #[inline]
    #[must_use]
    pub fn hinted(mut self, hint: &'q mut PairHint) -> Self {
        self.outputs.hint = Some(hint);
        self
    }

    /// Writes up to eight contact points to `points`, for a physics solver. The first is the deepest; each
    /// of the others is the candidate furthest from all earlier ones. Leaves `points` empty unless the
    /// scans meet.
    #[inline]
    #[must_use]
    pub fn manifold(mut self, points: &'q mut Vec<ManifoldPoint>) -> Self {
        self.outputs.manifold = Some(points);
        self
    }

    /// Continues after the first contact and writes one contact per pair of intersecting leaves to
    /// `contacts`, accurate to first order. The contact of the answer is the first certified one of
    /// the first few, or else the first. Without this output, a query stops at any contact and may
    /// report another one.
    ///
    /// Costs a descent to all intersecting leaves. Does not allocate once `contacts` is warm.
    #[inline]
    #[must_use]
    pub fn contacts(mut self, contacts: &'q mut Contacts) -> Self {
        self.outputs.contacts = Some(contacts);
        self
    }

    /// Writes the node pairs that prove a certified separation of surfaces or obstacles to `proof`.
    /// Leaves it empty after any other answer.
    #[inline]
    #[must_use]
    pub fn proof(mut self, proof: &'q mut Proof) -> Self {
        self.outputs.proof = Some(proof);
        self
    }

    /// Decides whether the scans meet; see [`Pair::collide`].
    pub fn collide(self, plan: &CollidePlan, scratch: &mut Scratch) -> Answer {
        let Self { pair: Pair { scans, budget }, outputs } = self;
        let asked = Asked { scans: scans.each_ref(), plan, budget };
        let Scratch { contact, papers, .. } = scratch;
        if plan.is_of_papers(budget) {
            crate::papers::collide(asked, (contact, papers), outputs)
        } else {
            crate::contact::collide::collide(asked, contact, outputs)
        }
    }
}
