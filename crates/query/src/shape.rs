//! Convex shapes tested against the points of a scan.
//!
//! A shape touches a scan if it contains a point of it, for example when a robot made of spheres is
//! tested against a depth frame. Points are stored in blocks of sixteen, with bounds about the
//! blocks, about groups of sixteen blocks, and so on ([`nearmiss_index::BlockTree`]); the blocks
//! are those of the scan. A grid lists the blocks near small spheres ([`nearmiss_index::BlockGrid`]).

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd};
use nearmiss_geometry::PointId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{PlaceVisitor, ScanArrays};
use nearmiss_index::Skeleton;
use nearmiss_lanes::parallel::change_runs;

use crate::pair::placed::Placed;
use crate::pair::shape_index::ShapeIndex;
use crate::solid::core::Solid;
use crate::solid::shape::Shape;

/// The point of a scan nearest to a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearestPoint {
    /// The point, as the caller numbered it.
    pub source: PointId,
    /// The position of the point in the world.
    pub point: [f64; 3],
    /// The distance from the shape, in world units. Negative by up to the radius in a rounded shape:
    /// the radius less the distance from the core.
    pub gap: f64,
}

impl Placed<'_> {
    /// Returns `true` if a point of the scan is inside `shape` or on its boundary. Exact: the
    /// result equals that of testing each point in double precision in the stored frame of the scan
    /// ([`Skeleton::distance_sq`]). The distance from a hull or a shape of the caller's own comes
    /// from an iteration, with a relative error of about 1e-12.
    ///
    /// With [a shape index](Self::with_shapes) a small sphere compares about five blocks of points,
    /// and other shapes about ten groups of boxes (benches/record). Without one, the search
    /// descends the tree of the scan, which suits a few shapes, or a file of which little should be
    /// read. That search prunes with a ball about the shape, so a long capsule visits more nodes.
    /// Does not allocate.
    #[inline]
    #[must_use]
    pub fn touches(&self, shape: &Shape<'_>) -> bool {
        let Some(stored) = self.stored(shape) else { return false };
        match (self.shapes(), &stored) {
            (Some(index), Stored::Skeleton(skeleton, radius)) => {
                self.holds(index, (skeleton, *radius), near(index, skeleton, *radius))
            }
            _ => self.nearest_within(&stored, stored.radius(), true).is_some(),
        }
    }

    /// Returns the point nearest to `shape` within `reach` of it, in world units; among equally
    /// near ones the first in the order of the scan. Exact, and as costly as [`Self::touches`].
    /// Inside a sphere or capsule, the nearest point is the one nearest to the centre or the
    /// segment.
    #[must_use]
    pub fn nearest(&self, shape: &Shape<'_>, reach: f64) -> Option<NearestPoint> {
        let stored = self.stored(shape)?;
        let (radius, scale) = (stored.radius(), self.stored_to_world().scale());
        let reach = radius + reach / scale;
        // False for NaN.
        let is_reach = reach >= 0.0;
        let (i, distance_sq) = match (self.shapes(), &stored) {
            _ if !is_reach => None,
            (Some(index), Stored::Skeleton(skeleton, _)) => {
                index.tree(self.scan()).nearest_to(index.level, skeleton, reach)
            }
            _ => self.nearest_within(&stored, reach, false),
        }?;
        let gap = (distance_sq.sqrt() - radius) * scale;
        Some(NearestPoint { source: self.scan().id(i), point: self.point(i), gap })
    }

    /// Tests each of `shapes` on the threads of the current rayon pool: sets `answers[i]` to `true`
    /// if `shapes[i]` [touches](Self::touches) the scan. If the slices differ in length, the rest
    /// of the longer one is ignored.
    pub fn touch_each(&self, shapes: &[Shape<'_>], answers: &mut [bool]) {
        /// Shapes per task of a thread: about 50 µs of work.
        const AT_ONCE: usize = 1024;
        let count = shapes.len().min(answers.len());
        change_runs(&mut answers[..count], AT_ONCE, |task, answers| {
            self.touch_in_turn(&shapes[task * AT_ONCE..][..answers.len()], answers);
        });
    }

    fn touch_in_turn(&self, shapes: &[Shape<'_>], answers: &mut [bool]) {
        /// Shapes whose cells are looked up before the first of them is tested, so that the memory
        /// accesses overlap.
        const TOGETHER: usize = 16;
        let Some(index) = self.shapes() else {
            for (shape, answer) in shapes.iter().zip(answers) {
                *answer = self.touches(shape);
            }
            return;
        };
        let mut looked_up = [None; TOGETHER];
        for (shapes, answers) in shapes.chunks(TOGETHER).zip(answers.chunks_mut(TOGETHER)) {
            for (shape, looked_up) in shapes.iter().zip(&mut looked_up) {
                *looked_up = match self.stored(shape) {
                    Some(Stored::Skeleton(skeleton, radius)) => {
                        Some((skeleton, radius, near(index, &skeleton, radius)))
                    }
                    _ => None,
                };
            }
            for ((shape, looked_up), answer) in shapes.iter().zip(&looked_up).zip(answers) {
                *answer = match looked_up {
                    Some((skeleton, radius, near)) => self.holds(index, (skeleton, *radius), *near),
                    None => self.touches(shape),
                };
            }
        }
    }

    /// Returns `true` if a point is within `radius` of the skeleton. Tests only the blocks `near`,
    /// if they are known.
    #[inline]
    fn holds(&self, index: &ShapeIndex, (skeleton, radius): (&Skeleton, f64), near: Option<&[u32]>) -> bool {
        let tree = index.tree(self.scan());
        radius >= 0.0
            && match *skeleton {
                Skeleton::Point(centre) => tree.any_in_ball(index.level, near, centre, radius),
                _ => tree.any_within(index.level, skeleton, radius),
            }
    }

    /// Finds the point nearest to the core of a shape within `reach`, the first among equals, with its
    /// squared distance. With `any`, returns any point within reach.
    fn nearest_within(&self, stored: &Stored<'_>, reach: f64, any: bool) -> Option<(usize, f64)> {
        /// Coordinates beyond this have squares outside the range of single precision.
        const FARTHEST: f64 = 1e15;
        let (centre, radius) = stored.ball();
        let (middle, bounds) = (Vector3::from(centre), self.scan().root_box());
        let far = middle.amax() + f64::from(Vector3::from(bounds.centre).amax() + bounds.radius());
        // Too far away, single precision cannot tell the boxes apart: all of them are searched.
        let (place, radius) = if far > FARTHEST { ([0.0; 3], f64::INFINITY) } else { (centre, radius) };
        let arrays = self.scan().arrays();
        let mut search = Search {
            arrays: &arrays,
            stored,
            any,
            // Rounding error of the distance of a box in single precision.
            beyond: radius * (1.0 + 1e-9) + 4e-6 * far,
            best: (reach * reach, usize::MAX),
            most_sq: 0.0,
        };
        search.limit();
        #[expect(clippy::cast_possible_truncation, reason = "counted in `beyond`")]
        let place = place.map(|c| c as f32);
        // An early end means only that a point was found.
        let _ended = arrays.tree.descend_to(Level::new(), place, &mut search);
        let (distance_sq, i) = search.best;
        (i != usize::MAX).then_some((i, distance_sq))
    }

    /// Converts a shape to the stored frame of the scan; `None` if it is invalid.
    #[inline]
    fn stored<'s>(&'s self, shape: &Shape<'s>) -> Option<Stored<'s>> {
        let placed = self.stored_to_world();
        let radius = shape.rounding() / placed.scale();
        let skeleton = match *shape {
            Shape::Sphere { centre, .. } => Skeleton::Point(placed.apply_inverse(centre)),
            Shape::Capsule { ends, .. } => Skeleton::Segment(ends.map(|end| placed.apply_inverse(end))),
            Shape::Box { pose, half, .. } => {
                let per_scale = pose.scale() / placed.scale();
                let axis = |k: usize| {
                    let mut axis = [0.0; 3];
                    axis[k] = 1.0;
                    placed.rotate_inverse(pose.rotate(axis))
                };
                // This comparison is false for NaN, so that a NaN edge touches nothing.
                if !half.iter().all(|&h| h >= 0.0) {
                    return None;
                }
                Skeleton::Box {
                    centre: placed.apply_inverse(pose.translation()),
                    half: half.map(|h| h * per_scale),
                    axes: [axis(0), axis(1), axis(2)],
                }
            }
            _ => return Solid::new(shape, placed).map(Stored::Solid),
        };
        (radius >= 0.0).then_some(Stored::Skeleton(skeleton, radius))
    }
}

/// A shape in the stored frame of a scan.
#[derive(Clone, Copy)]
enum Stored<'a> {
    /// A shape that the index knows, and its radius.
    Skeleton(Skeleton, f64),
    Solid(Solid<'a>),
}

impl Stored<'_> {
    fn radius(&self) -> f64 {
        match self {
            Self::Skeleton(_, radius) => *radius,
            Self::Solid(solid) => solid.radius,
        }
    }

    /// The centre and the radius of a ball about the core.
    fn ball(&self) -> ([f64; 3], f64) {
        match self {
            Self::Skeleton(skeleton, _) => skeleton.ball(),
            Self::Solid(solid) => (solid.centre.into(), solid.half.norm()),
        }
    }

    /// The squared distance of a point from the core.
    #[inline]
    fn distance_sq(&self, p: [f64; 3]) -> f64 {
        match self {
            Self::Skeleton(skeleton, _) => skeleton.distance_sq(p),
            Self::Solid(solid) => solid.distance(&p.into()).powi(2),
        }
    }
}

/// Returns the blocks that may have a point within `radius` of a skeleton, if the grid covers that
/// radius.
#[inline]
fn near<'a>(index: &'a ShapeIndex, skeleton: &Skeleton, radius: f64) -> Option<&'a [u32]> {
    match *skeleton {
        Skeleton::Point(centre) => index.cells.near(centre, radius),
        _ => None,
    }
}

/// The search for the point nearest to a skeleton, which visits the boxes near a ball about it.
struct Search<'a> {
    arrays: &'a ScanArrays<'a>,
    stored: &'a Stored<'a>,
    /// `true` if any point within reach will do.
    any: bool,
    /// The greatest difference of a relevant box's distance from the centre of the ball and its
    /// distance from the skeleton.
    beyond: f64,
    /// The least squared distance so far and its point. Starts with the squared reach.
    best: (f64, usize),
    most_sq: f32,
}

impl Search<'_> {
    /// Updates the limit beyond which boxes cannot improve on the best point.
    #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
    fn limit(&mut self) {
        let most = ((self.best.0.sqrt() + self.beyond) as f32).next_up();
        self.most_sq = (most * most).next_up();
    }
}

impl PlaceVisitor for Search<'_> {
    fn most_sq(&self) -> f32 {
        self.most_sq
    }

    fn leaf<S: Simd>(&mut self, _: S, number: usize) -> ControlFlow<()> {
        for i in self.arrays.leaves.points(number) {
            let own = (self.stored.distance_sq(self.arrays.position(i).map(f64::from)), i);
            if own < self.best {
                self.best = own;
                self.limit();
                if self.any {
                    return ControlFlow::Break(());
                }
            }
        }
        ControlFlow::Continue(())
    }
}
