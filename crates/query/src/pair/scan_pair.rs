//! Two scans under a relative pose, and the operations on node pairs that all searches share.

use fearless_simd::Level;
use nearmiss_geometry::Pose;
use nearmiss_hierarchy::{NodePair, Part, Relative, ScanArrays, TreePair};

use crate::ask::options::{CollidePlan, Semantics};
use crate::pair::meter::Meter;
use crate::pair::placed::Placed;
use crate::pair::placed_balls::PlacedBalls;

/// Two placed scans, their arrays, the relative pose, and the cost of the search.
#[derive(Debug)]
pub(crate) struct ScanPair<'a> {
    pub(crate) views: [&'a Placed<'a>; 2],
    pub(crate) a: &'a ScanArrays<'a>,
    pub(crate) b: &'a ScanArrays<'a>,
    pub(crate) relative: Relative,
    pub(crate) meter: Meter,
    /// The part of each scan that the enclosures contain.
    pub(crate) part: Part,
    /// The SIMD instructions to use. Results do not depend on them.
    pub(crate) level: Level,
}

impl<'a> ScanPair<'a> {
    pub(crate) fn new(
        views: [&'a Placed<'a>; 2],
        arrays: [&'a ScanArrays<'a>; 2],
        relative: Relative,
        meter: Meter,
        (level, part): (Level, Part),
    ) -> Self {
        let [a, b] = arrays;
        Self { views, a, b, relative, meter, part, level }
    }

    /// The leaves that contain point `i` of a and point `j` of b.
    pub(crate) fn leaves_of(&self, [i, j]: [usize; 2]) -> NodePair {
        NodePair { a: self.a.tree.topology().leaf_of(i), b: self.b.tree.topology().leaf_of(j) }
    }

    /// The leaf numbers of two leaves.
    #[inline]
    pub(crate) fn numbers(&self, leaves: NodePair) -> [usize; 2] {
        [self.a.tree.topology().leaf_number(leaves.a), self.b.tree.topology().leaf_number(leaves.b)]
    }

    /// The leaves with these leaf numbers.
    pub(crate) fn leaves(&self, [a, b]: [usize; 2]) -> NodePair {
        NodePair { a: self.a.tree.topology().leaf(a), b: self.b.tree.topology().leaf(b) }
    }

    /// The trees of both scans, for a descent that prunes pairs whose boxes are further apart than
    /// `reach`, in a's stored frame.
    pub(crate) fn trees<'t>(&self, relative: &'t Relative, reach: f32) -> TreePair<'t>
    where
        'a: 't,
    {
        TreePair { a: &self.a.tree, b: &self.b.tree, relative, reach }
    }

    /// The band at two points, in the world: the greater of their local radii.
    pub(crate) fn band(&self, [i, j]: [usize; 2]) -> f64 {
        self.in_world([self.a.radii[i], self.b.radii[j]])
    }

    /// The band at the nearest points of two nodes, in the world: the greatest local radius of any
    /// of their points.
    pub(crate) fn band_of(&self, nodes: NodePair) -> f64 {
        self.in_world([self.a.tree.reach(nodes.a), self.b.tree.reach(nodes.b)])
    }

    /// The greater of two lengths given in the frames of the scans, in the world.
    fn in_world(&self, [of_a, of_b]: [f32; 2]) -> f64 {
        let [a, b] = self.views.map(|view| view.stored_to_world().scale());
        (f64::from(of_a) * a).max(f64::from(of_b) * b)
    }

    /// Converts a length from the world to a's stored frame, enlarged by the rounding error of a
    /// gap there.
    pub(crate) fn stored(&self, length: f64) -> f32 {
        #[expect(clippy::cast_possible_truncation, reason = "grown by more than the rounding")]
        let length = (length / self.views[0].stored_to_world().scale()) as f32 * (1.0 + 1e-6);
        length + self.relative.slack()
    }

    /// The gap of the boxes of two nodes.
    pub(crate) fn gap(&mut self, pair: NodePair) -> f32 {
        self.meter.spent.node_pairs += 1;
        self.relative.gap(&self.a.tree.bounds(pair.a), &self.b.tree.bounds(pair.b))
    }

    /// The gap of the enclosures of two nodes.
    pub(crate) fn gap_of_enclosures(&self, pair: NodePair) -> f32 {
        let (a, b) = (self.a.tree.enclosure(self.part, pair.a), self.b.tree.enclosure(self.part, pair.b));
        self.relative.gap(&a, &b)
    }
}

/// From this many radii on, the distance of the bounding balls is a good bound, and single
/// precision loses accuracy.
const FAR_APART: f64 = 100.0;

/// Returns b's pose in a's stored frame, in double and in single precision. Fails with the distance
/// of the scans' bounding balls if that exceeds the reach of the plan, or with `None` for invalid
/// poses.
pub(crate) fn relative(
    a: &Placed<'_>,
    b: &Placed<'_>,
    plan: &CollidePlan,
) -> Result<(Pose, Relative), Option<f64>> {
    let about = |view: &Placed<'_>| match plan.options().semantics {
        Semantics::Obstacle => view.scan().outline().obstacle,
        Semantics::Surface => view.scan().outline().surface,
        Semantics::Thickened(_) => view.scan().outline().discs,
    };
    let balls =
        PlacedBalls::of([a.stored_to_world(), b.stored_to_world()], [about(a), about(b)]).ok_or(None)?;
    // A certificate proves more than the balls, unless the scans are so far apart that balls give
    // nearly the whole distance.
    let gap = balls.gap;
    if gap > plan.reach()
        && (!plan.options().certifies() || gap > FAR_APART * (balls.radii[0] + balls.radii[1]))
    {
        return Err(Some(gap));
    }
    Ok(balls.relative())
}

/// A lower bound of the distance of this part of two scans in the world: the gap of their bounding
/// balls, negative if these overlap. NaN for invalid poses.
pub(crate) fn balls_apart([a, b]: [&Placed<'_>; 2], part: Part) -> f64 {
    let about = |view: &Placed<'_>| match part {
        Part::Obstacle => view.scan().outline().obstacle,
        Part::Surface => view.scan().outline().surface,
    };
    let placed = [a.stored_to_world(), b.stored_to_world()];
    PlacedBalls::of_comparable(placed, [about(a), about(b)]).map_or(f64::NAN, |balls| balls.gap)
}
