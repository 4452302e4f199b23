//! The search for a place where a shape touches a scan.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd};
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{Clearance, ClearanceGrid};
use nearmiss_lanes::id32;
use nearmiss_lanes::wide::Bits;

use crate::ask::answer::{Evidence, Reason};
use crate::ask::options::{Detail, Semantics};
use crate::pair::placed::ViewScratch;
use crate::solid::answer::{ShapeAnswer, ShapeVerdict};
use crate::solid::core::Solid;
use crate::solid::descent::{LeafSearch, Near};
use crate::solid::elements::Elements;
use crate::solid::meeting::verified_in;
use crate::solid::probe::{About, Probed, about, probe, probe_ball};
use crate::solid::shape::Shape;

/// Discs at which a point of the surface in the shape is looked for.
const TRIES: usize = 8;

/// A disc or ball that touches the shape.
#[derive(Debug, Clone, Copy)]
struct Met {
    i: usize,
    /// A point of the disc or ball in the shape, or nearest to it.
    point: Vector3<f64>,
}

/// The parts that a shape was found to touch.
#[derive(Debug, Clone, Copy)]
struct Findings {
    /// The first disc that touches.
    met: Option<Met>,
    /// The points of the next discs that touch.
    others: [u32; TRIES - 1],
    /// The number of all of these.
    count: usize,
    certified: Option<Met>,
    /// `true` if the shape is near a point about which nothing is known.
    undersampled: bool,
    /// `true` if an enclosure is within the margin.
    doubtful: bool,
}

struct Touch<'s, 'a> {
    near: Near<'s, 'a>,
    found: Findings,
}

/// Decides whether `shape` touches the scan.
#[inline]
pub(crate) fn touch_shape(
    elements: &Elements<'_>,
    shape: &Shape<'_>,
    working: (Level, &mut ViewScratch),
) -> ShapeAnswer {
    let told = about(elements, shape, elements.certifies);
    if told.is_some_and(|told| told.is_clear) {
        return separated(elements, false);
    }
    if let (Shape::Sphere { .. }, Some(told)) = (shape, &told) {
        return touch_ball(elements, told, working);
    }
    let solid = Solid::new(shape, elements.placed.stored_to_world());
    touch(elements, solid.as_ref(), told.map(|told| told.at), working)
}

/// Decides whether a ball touches the scan, given what the grid told about its centre.
fn touch_ball<'a>(
    elements: &Elements<'a>,
    told: &About<'a>,
    (level, scratch): (Level, &mut ViewScratch),
) -> ShapeAnswer {
    let Some(solid) = Solid::ball(told.ball) else { return invalid() };
    let mut found = Findings::NONE;
    match probe_ball(elements, &solid, (elements.certifies, told.at), |i| found.examine(elements, &solid, i))
    {
        Probed::Clear => separated(elements, false),
        Probed::Ended => found.answer(elements, &solid, scratch),
        Probed::Open(at) => search(elements, &solid, at, (level, scratch)),
    }
}

/// The answer about an invalid shape.
fn invalid() -> ShapeAnswer {
    ShapeAnswer { verdict: ShapeVerdict::Undecided(Reason::Shape), band: f64::INFINITY }
}

/// The answer about a shape that touches nothing, near which enclosures may be if `is_doubtful`.
fn separated(elements: &Elements<'_>, is_doubtful: bool) -> ShapeAnswer {
    let evidence = elements.of_separation(is_doubtful);
    ShapeAnswer { verdict: ShapeVerdict::Separated { evidence }, band: elements.greatest_band() }
}

/// Decides whether `solid` touches the scan, given what the grid told about the centre, if it was asked.
pub(crate) fn touch<'a>(
    elements: &Elements<'a>,
    solid: Option<&Solid<'_>>,
    told: Option<Clearance<'a>>,
    (level, scratch): (Level, &mut ViewScratch),
) -> ShapeAnswer {
    let Some(solid) = solid else { return invalid() };
    let mut found = Findings::NONE;
    match probe(elements, solid, (elements.certifies, told), |i| found.examine(elements, solid, i)) {
        Probed::Clear => separated(elements, false),
        Probed::Ended => found.answer(elements, solid, scratch),
        Probed::Open(at) => search(elements, solid, at, (level, scratch)),
    }
}

/// Compares `solid` with the points of all leaves near it, given what the grid told about the centre.
fn search(
    elements: &Elements<'_>,
    solid: &Solid<'_>,
    at: Option<(&ClearanceGrid, Clearance<'_>)>,
    (level, scratch): (Level, &mut ViewScratch),
) -> ShapeAnswer {
    let mut near = Near::new(elements, solid, elements.certifies, &mut scratch.corners);
    near.limit(elements.margin);
    let mut search = Touch { near, found: Findings::NONE };
    // An early end means that the question is settled.
    let _settled = near.search_at(level, at, elements.margin, &mut search);
    search.found.answer(elements, solid, scratch)
}

impl Findings {
    const NONE: Self = Self {
        met: None,
        others: [0; TRIES - 1],
        count: 0,
        certified: None,
        undersampled: false,
        doubtful: false,
    };

    /// Compares the shape with the part of a point, and with the point itself.
    fn examine(&mut self, elements: &Elements<'_>, solid: &Solid<'_>, i: usize) -> ControlFlow<()> {
        if solid.has_projection() {
            self.hold(elements, solid, i)?;
        }
        self.compare(elements, solid, i)
    }

    /// Compares the shape with the part of a point.
    fn compare(&mut self, elements: &Elements<'_>, solid: &Solid<'_>, i: usize) -> ControlFlow<()> {
        let Some(point) = elements.reached(solid, i) else { return ControlFlow::Continue(()) };
        if elements.is_doubtful(i) {
            self.undersampled = true;
            return ControlFlow::Continue(());
        }
        let met = Met { i, point };
        if !elements.is_disc(i) {
            self.certified = Some(met);
            return ControlFlow::Break(());
        }
        if self.count == 0 {
            self.met = Some(met);
        } else if self.count < TRIES {
            self.others[self.count - 1] = id32(i);
        }
        self.count += usize::from(self.count < TRIES);
        if elements.detail == Detail::Verdict {
            return ControlFlow::Break(());
        }
        self.hold(elements, solid, i)
    }

    /// Ends the search if a measured point is in the shape: points are part of the obstacle.
    fn hold(&mut self, elements: &Elements<'_>, solid: &Solid<'_>, i: usize) -> ControlFlow<()> {
        self.certified = elements.held(solid, i).map(|point| Met { i, point });
        if self.certified.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// The answer, given all that was found.
    fn answer(&self, elements: &Elements<'_>, solid: &Solid<'_>, scratch: &mut ViewScratch) -> ShapeAnswer {
        let touching = |met: Met, point, evidence| ShapeAnswer {
            verdict: ShapeVerdict::Touching { point, source: elements.placed.scan().id(met.i), evidence },
            band: elements.band(met.i),
        };
        if let Some(met) = self.certified {
            return touching(met, elements.in_world(&met.point), Evidence::Certified);
        }
        if let Some(first) = self.met {
            if elements.detail == Detail::Witness {
                let others = self.others[..self.count - 1].iter().filter_map(|&i| {
                    let i = i as usize;
                    elements.reached(solid, i).map(|point| Met { i, point })
                });
                for met in std::iter::once(first).chain(others) {
                    if let Some(point) = verified_in(elements, solid, (met.i, met.point), scratch) {
                        return touching(met, point, Evidence::Certified);
                    }
                }
            }
            return touching(first, elements.in_world(&first.point), Evidence::Estimated);
        }
        if self.undersampled {
            let verdict = ShapeVerdict::Undecided(Reason::Undersampled);
            return ShapeAnswer { verdict, band: elements.greatest_band() };
        }
        separated(elements, self.doubtful)
    }
}

impl<'s, 'a> LeafSearch<'s, 'a> for Touch<'s, 'a> {
    #[inline(always)]
    fn near(&self) -> &Near<'s, 'a> {
        &self.near
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, number: usize, _: f32) -> ControlFlow<()> {
        let Self { near: Near { elements, solid, lane_box, most, .. }, found } = self;
        let (solid, most) = (*solid, *most);
        if elements.certifies && elements.semantics == Semantics::Surface {
            found.doubtful = true;
        }
        for (block, first, count) in elements.arrays.leaves.blocks(number) {
            let gaps = elements.leaf_gaps(simd, lane_box, (number, block, first, count));
            if solid.is_closed_in_lanes() {
                let first_in = Bits(Elements::lanes_within(simd, (&gaps.points, count), most)).next();
                first_in
                    .map_or(ControlFlow::Continue(()), |lane| found.hold(elements, solid, first + lane))?;
            }
            for lane in Bits(Elements::lanes_within(simd, (&gaps.elements, count), most)) {
                found.compare(elements, solid, first + lane)?;
            }
            if elements.certifies
                && elements.semantics == Semantics::Obstacle
                && !found.doubtful
                && found.count == 0
            {
                let within = elements.margin + solid.radius;
                for lane in Bits(Elements::lanes_within(simd, (&gaps.cells, count), most)) {
                    found.doubtful = !elements.is_cell_beyond(solid, first + lane, within);
                    if found.doubtful {
                        break;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::{PointCloud, Pose};
    use nearmiss_hierarchy::{BuildOptions, PointHierarchy};
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
    use nearmiss_testdata::dragon::{Dragon, dragon_mesh};
    use rand::RngExt;

    use super::*;
    use crate::ask::options::CollideOptions;
    use crate::pair::placed::Placed;
    use crate::pair::shape_index::ShapeIndex;
    use crate::solid::plan::ShapePlan;

    #[test]
    fn balls_about_shapes_answer_as_their_cores() {
        let cloud = PointCloud::from_positions(dragon_mesh(Dragon::Points5k).unwrap().vertices()).unwrap();
        let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
        let index = ShapeIndex::new(&scan);
        let (r, level, scratch) = (scan.sampling_radius(), Level::new(), &mut ViewScratch::default());
        let rng = &mut rng(17);
        let (mut clear, mut met) = ([0; 5], [0; 5]);
        for round in 0..4000 {
            let options =
                if round % 2 == 0 { CollideOptions::default() } else { CollideOptions::estimated() };
            let plan = ShapePlan::new(&options.with_margin([0.0, 0.0, 0.5 * r][round % 3]), &scan).unwrap();
            let pose = rotation(rng).with_scale([1.0, 0.1, 3.0][round % 3]);
            let elements = Elements::new(Placed::new(&scan, &pose).with_shapes(&index), &plan);
            let (size, away) = (rng.random_range(0.1..2.0) * r * pose.scale(), 6.0 * r * pose.scale());
            let off = point_in(rng, away);
            let at = pose.apply(scan.arrays().position(rng.random_range(0..scan.len())).map(f64::from));
            let (centre, along) = ([0, 1, 2].map(|k| at[k] + off[k]), unit_vector(rng));
            let [low, high] = [-2.0, 2.0].map(|s| [0, 1, 2].map(|k| centre[k] + s * size * along[k]));
            let body = rotation(rng).with_translation(centre).with_scale(0.5);
            let shape = match round % 5 {
                0 => Shape::Sphere { centre, radius: size },
                1 => Shape::Capsule { ends: [low, high], radius: 0.5 * size },
                2 => Shape::Box { pose: body, half: [4.0, 2.0, 1.0].map(|h| h * size), radius: 0.2 * size },
                3 => Shape::Cylinder { pose: body, half_height: 3.0 * size, radius: size, rounding: 0.0 },
                _ => Shape::Cone { pose: body, half_height: 3.0 * size, radius: size, rounding: 0.1 * size },
            };
            let (_, [radius, beyond]) = shape.ball().unwrap();
            let solid = Solid::new(&shape, elements.placed.stored_to_world()).unwrap();
            let least = solid.radius + solid.half.max();
            assert!((radius + beyond) / pose.scale() >= least * (1.0 - 1e-12), "round {round}: {shape:?}");
            let found = touch_shape(&elements, &shape, (level, &mut *scratch));
            let expected = touch(&elements, Some(&solid), None, (level, &mut *scratch));
            assert_eq!(found, expected, "round {round}: {shape:?}");
            let told = about(&elements, &shape, elements.certifies);
            clear[round % 5] += usize::from(told.is_some_and(|told| told.is_clear));
            met[round % 5] += usize::from(found.verdict.is_touching());
        }
        assert!(clear.iter().chain(&met).all(|&count| count > 60), "{clear:?} clear, {met:?} touch");
        for shape in [
            Shape::Sphere { centre: [f64::NAN, 0.0, 0.0], radius: 1.0 },
            Shape::Sphere { centre: [9e9; 3], radius: -1.0 },
            Shape::Capsule { ends: [[9e9; 3], [f64::INFINITY; 3]], radius: 0.0 },
            Shape::Box { pose: Pose::from_translation([9e9; 3]), half: [1.0, f64::NAN, 1.0], radius: 0.0 },
        ] {
            let plan = ShapePlan::new(&CollideOptions::default(), &scan).unwrap();
            let elements = Elements::new(Placed::new(&scan, &Pose::IDENTITY).with_shapes(&index), &plan);
            let found = touch_shape(&elements, &shape, (level, &mut *scratch));
            assert_eq!(found.verdict, ShapeVerdict::Undecided(Reason::Shape), "{shape:?}");
        }
    }
}
