//! Two scans in relative motion, and what every search through them does with a pair of nodes.

use fearless_simd::Level;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_geometry::{NodeId, Pose};
use nearmiss_hierarchy::{Ball, NodePair, Part, Relative, SLACK, Slices, TreePair};

use crate::ask::options::{CollidePlan, Semantics};
use crate::pair::bounds::Bounds;
use crate::pair::meter::Meter;
use crate::pair::motion::Motion;
use crate::pair::placed::Placed;

/// Two views, their arrays, the motion between them, and what the search has cost.
#[derive(Debug)]
pub(crate) struct ScanPair<'a> {
    pub(crate) views: [&'a Placed<'a>; 2],
    pub(crate) a: &'a Slices<'a>,
    pub(crate) b: &'a Slices<'a>,
    pub(crate) relative: Relative,
    pub(crate) meter: Meter,
    /// What enclosures hold.
    pub(crate) part: Part,
    /// The instructions that it is looked at by: no result depends on them.
    pub(crate) level: Level,
}

impl<'a> ScanPair<'a> {
    pub(crate) fn new(
        views: [&'a Placed<'a>; 2],
        slices: [&'a Slices<'a>; 2],
        relative: Relative,
        meter: Meter,
        (level, part): (Level, Part),
    ) -> Self {
        let [a, b] = slices;
        Self { views, a, b, relative, meter, part, level }
    }

    /// Returns `true` if these are leaves, and not other nodes or none at all.
    pub(crate) fn are_leaves(&self, pair: NodePair) -> bool {
        let is_leaf = |scan: &Slices<'_>, id: NodeId| {
            let topology = scan.tree.topology();
            topology.has(id) && topology.is_leaf(id)
        };
        is_leaf(self.a, pair.a) && is_leaf(self.b, pair.b)
    }

    /// Which of two nodes are leaves.
    #[inline]
    pub(crate) fn which_are_leaves(&self, pair: NodePair) -> [bool; 2] {
        [self.a.tree.topology().is_leaf(pair.a), self.b.tree.topology().is_leaf(pair.b)]
    }

    /// The leaves with a point of either scan.
    pub(crate) fn leaves_of(&self, [i, j]: [usize; 2]) -> NodePair {
        NodePair { a: self.a.tree.topology().leaf_of(i), b: self.b.tree.topology().leaf_of(j) }
    }

    /// The numbers of two leaves.
    #[inline]
    pub(crate) fn numbers(&self, leaves: NodePair) -> [usize; 2] {
        [self.a.tree.topology().leaf_number(leaves.a), self.b.tree.topology().leaf_number(leaves.b)]
    }

    /// The leaves with these numbers.
    pub(crate) fn leaves(&self, [a, b]: [usize; 2]) -> NodePair {
        NodePair { a: self.a.tree.topology().leaf(a), b: self.b.tree.topology().leaf(b) }
    }

    /// The trees of both scans, whose boxes are near within `reach`, in a's stored frame.
    pub(crate) fn trees<'t>(&self, relative: &'t Relative, reach: f32) -> TreePair<'t>
    where
        'a: 't,
    {
        TreePair { a: &self.a.tree, b: &self.b.tree, relative, reach }
    }

    /// The trees of both scans, compared by how far they are apart.
    pub(crate) fn bounds<'t>(&self, motion: &'t Motion) -> Bounds<'t>
    where
        'a: 't,
    {
        Bounds { trees: [&self.a.tree, &self.b.tree], motion, part: self.part }
    }

    /// The band at two points, in the world: the greater of their local radii.
    pub(crate) fn band(&self, [i, j]: [usize; 2]) -> f64 {
        self.in_world([self.a.radii[i], self.b.radii[j]])
    }

    /// The band where the nearest places are of two nodes, in the world: the greatest local radius of any
    /// point of theirs.
    pub(crate) fn band_of(&self, nodes: NodePair) -> f64 {
        self.in_world([self.a.tree.reach(nodes.a), self.b.tree.reach(nodes.b)])
    }

    /// The greater of two lengths in the frames of the scans.
    fn in_world(&self, [of_a, of_b]: [f32; 2]) -> f64 {
        let [a, b] = self.views.map(|view| view.placed().scale());
        (f64::from(of_a) * a).max(f64::from(of_b) * b)
    }

    /// A length of the world in a's stored frame, and a little more: what rounding may take from a gap there.
    pub(crate) fn stored(&self, length: f64) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "grown by more than the rounding")]
        let length = (length / self.views[0].placed().scale()) as f32 * (1.0 + 1e-6);
        length + self.relative.slack()
    }

    /// The gap between the boxes of two nodes.
    pub(crate) fn gap(&mut self, pair: NodePair) -> f32 {
        self.meter.spent.node_pairs += 1;
        self.relative.gap(&self.a.tree.bounds(pair.a), &self.b.tree.bounds(pair.b))
    }

    /// The gap between the enclosures of two nodes.
    pub(crate) fn gap_of_enclosures(&self, pair: NodePair) -> f32 {
        let (a, b) = (self.a.tree.enclosure(self.part, pair.a), self.b.tree.enclosure(self.part, pair.b));
        self.relative.gap(&a, &b)
    }
}

/// From so many radii on the distance of balls is a good bound, and single precision less and less use.
const FAR_APART: f64 = 100.0;

/// Scans whose stored frames differ in scale by more than this are not compared in single precision.
const GREATEST_RATIO: f64 = (1_u64 << 60) as f64;

/// The motion of b's stored frame into a's, in double and in single precision. An error is the distance of
/// balls about the two scans if that is more than any contact reaches, or `None` for poses that are none.
pub(crate) fn relative(
    a: &Placed<'_>,
    b: &Placed<'_>,
    plan: &CollidePlan,
) -> Result<(Pose, Relative), Option<f64>> {
    let ratio = b.placed().scale() / a.placed().scale();
    if !(a.is_proper() && b.is_proper() && (1.0 / GREATEST_RATIO..=GREATEST_RATIO).contains(&ratio)) {
        return Err(None);
    }
    let about = |view: &Placed<'_>| match plan.options().semantics {
        Semantics::Obstacle => view.scan().outline().obstacle,
        Semantics::Surface => view.scan().outline().surface,
        Semantics::Thickened(_) => view.scan().outline().discs,
    };
    let own = about(a);
    let Balls { distance, radii: [ra, rb], gap, lost } = Balls::of([a, b], [own, about(b)]);
    if gap.is_nan() || gap == f64::INFINITY {
        return Err(None);
    }
    // A certificate has more to say, unless they are so far apart that balls say nearly all.
    if gap > plan.reach() && (!plan.options().certifies() || gap > FAR_APART * (ra + rb)) {
        return Err(Some(gap));
    }
    let pose = a.placed().inverse().after(b.placed());
    // Coordinates in a's stored frame: of its own points, and of b's.
    let extent = size(own.centre.into()) + (distance + ra + 2.0 * rb) / a.placed().scale();
    let shift = size(pose.translation().into());
    // The slack of the motion is a share of its reach.
    let lost = lost / a.placed().scale() / f64::from(SLACK);
    let relative = Relative::new(&pose, extent + shift + lost);
    Ok((pose, relative))
}

/// No less than the length, and sooner had.
fn size(v: Vector3<f64>) -> f64 {
    v.x.abs() + v.y.abs() + v.z.abs()
}

/// Balls about two scans in the world.
struct Balls {
    /// Of their middles.
    distance: f64,
    radii: [f64; 2],
    /// A lower bound of what is between them.
    gap: f64,
    /// What double precision loses of places far from the origin of the world.
    lost: f64,
}

impl Balls {
    /// `stored` in the frames of the scans.
    fn of([a, b]: [&Placed<'_>; 2], stored: [Ball; 2]) -> Self {
        let placed = |view: &Placed<'_>, ball: &Ball| {
            (Vector3::from(view.placed().apply(ball.centre)), ball.radius * view.placed().scale())
        };
        let ((ca, ra), (cb, rb)) = (placed(a, &stored[0]), placed(b, &stored[1]));
        let far = |view: &Placed<'_>| size(view.placed().translation().into());
        let lost = DOUBLE_ROUNDING * (far(a) + far(b) + size(ca) + size(cb));
        let distance = (ca - cb).norm();
        let gap = distance * (1.0 - 1e-6) - (ra + rb) * (1.0 + 1e-6) - lost;
        Self { distance, radii: [ra, rb], gap, lost }
    }
}

/// A lower bound of the distance of this part of two scans in the world: that of balls about them, which is
/// less than 0 where these overlap.
pub(crate) fn balls_apart([a, b]: [&Placed<'_>; 2], part: Part) -> f64 {
    let about = |view: &Placed<'_>| match part {
        Part::Obstacle => view.scan().outline().obstacle,
        Part::Surface => view.scan().outline().surface,
    };
    Balls::of([a, b], [about(a), about(b)]).gap
}

/// Of 2⁻⁵³ each: some ten roundings where poses are composed and applied.
const DOUBLE_ROUNDING: f64 = 2e-15;
