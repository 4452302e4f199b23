//! The search for a place where a shape touches a scan.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd, f32x4};
use nearmiss_geometry::NodeId;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{PlaceVisitor, Siblings};
use nearmiss_lanes::wide::Bits;

use crate::ask::answer::{Evidence, Reason};
use crate::ask::options::{Detail, Semantics};
use crate::pair::placed::ViewScratch;
use crate::solid::answer::{ShapeAnswer, ShapeVerdict};
use crate::solid::core::Solid;
use crate::solid::descent::Near;
use crate::solid::elements::Elements;
use crate::solid::meeting::verified_in;

/// Discs at which a point of the surface in the shape is looked for.
const TRIES: usize = 8;

/// A disc or ball that touches the shape.
#[derive(Debug, Clone, Copy)]
struct Met {
    i: usize,
    /// A point of the disc or ball in the shape, or nearest to it.
    point: Vector3<f64>,
}

struct Touch<'s, 'a> {
    near: Near<'s, 'a>,
    detail: Detail,
    /// The first discs that touch.
    met: [Option<Met>; TRIES],
    count: usize,
    certified: Option<Met>,
    /// `true` if the shape is near a point about which nothing is known.
    undersampled: bool,
    /// `true` if an enclosure is within the margin.
    doubtful: bool,
}

/// Decides whether `solid` touches the scan.
pub(crate) fn touch(
    elements: &Elements<'_>,
    solid: Option<&Solid<'_>>,
    (level, scratch): (Level, &mut ViewScratch),
) -> ShapeAnswer {
    let Some(solid) = solid else {
        return ShapeAnswer { verdict: ShapeVerdict::Undecided(Reason::Shape), band: f64::INFINITY };
    };
    let separated = |evidence| ShapeAnswer {
        verdict: ShapeVerdict::Separated { evidence },
        band: elements.greatest_band(),
    };
    if let Some(grid) = elements.clear {
        let centre = solid.centre.into();
        if grid.clearance(centre) > elements.margin + solid.radius + solid.half.norm() {
            return separated(elements.of_separation(false));
        }
    }
    let detail = elements.detail;
    let mut near = Near::new(elements, solid, elements.certifies);
    near.limit(elements.margin);
    let (met, certified) = ([None; TRIES], None);
    let mut search = Touch { near, detail, met, count: 0, certified, undersampled: false, doubtful: false };
    // An early end means that the question is settled.
    if search.near_leaf(level).is_continue() {
        let starts = elements.starts(solid, elements.margin);
        if starts.is_empty() {
            return separated(elements.of_separation(false));
        }
        let _settled = near.descend(level, &starts, &mut search);
    }
    let touching = |met: Met, point, evidence| ShapeAnswer {
        verdict: ShapeVerdict::Touching { point, source: elements.placed.scan().id(met.i), evidence },
        band: elements.band(met.i),
    };
    if let Some(met) = search.certified {
        return touching(met, elements.in_world(&met.point), Evidence::Certified);
    }
    if let Some(first) = search.met[0] {
        if detail == Detail::Witness {
            for met in search.met.iter().flatten() {
                if let Some(point) = verified_in(elements, solid, (met.i, met.point), scratch) {
                    return touching(*met, point, Evidence::Certified);
                }
            }
        }
        return touching(first, elements.in_world(&first.point), Evidence::Estimated);
    }
    if search.undersampled {
        let verdict = ShapeVerdict::Undecided(Reason::Undersampled);
        return ShapeAnswer { verdict, band: elements.greatest_band() };
    }
    separated(elements.of_separation(search.doubtful))
}

impl Touch<'_, '_> {
    /// Compares the shape with the leaf that the grid names at its centre. Most shapes that touch are settled
    /// by it.
    #[inline]
    fn near_leaf(&mut self, level: Level) -> ControlFlow<()> {
        let Near { elements, solid, .. } = self.near;
        let leaf = elements.clear.and_then(|grid| grid.leaf(solid.centre.into()));
        let Some(leaf) = leaf else { return ControlFlow::Continue(()) };
        elements.arrays.tree.visit_leaf(level, leaf, self)?;
        // The leaf is visited again.
        (self.met, self.count, self.doubtful) = ([None; TRIES], 0, false);
        ControlFlow::Continue(())
    }

    /// Compares the shape with the part of a point.
    fn compare(&mut self, i: usize) -> ControlFlow<()> {
        let Near { elements, solid, .. } = self.near;
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
        if self.count < TRIES {
            self.met[self.count] = Some(met);
            self.count += 1;
        }
        if self.detail == Detail::Verdict {
            return ControlFlow::Break(());
        }
        self.hold(i)
    }

    /// Ends the search if a measured point is in the shape: points are part of the obstacle.
    fn hold(&mut self, i: usize) -> ControlFlow<()> {
        let Near { elements, solid, .. } = self.near;
        self.certified = elements.held(solid, i).map(|point| Met { i, point });
        if self.certified.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl PlaceVisitor for Touch<'_, '_> {
    #[inline(always)]
    fn most_sq(&self) -> f32 {
        self.near.most_sq
    }

    #[inline(always)]
    fn distances_sq<S: Simd>(&self, simd: S, node: NodeId, _: &Siblings, _: [f32; 3]) -> f32x4<S> {
        self.near.distances_sq(simd, &self.near.elements.arrays.tree, node)
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, number: usize) -> ControlFlow<()> {
        let elements = self.near.elements;
        if elements.certifies && elements.semantics == Semantics::Surface {
            self.doubtful = true;
        }
        for (block, first, count) in elements.arrays.leaves.blocks(number) {
            let gaps = elements.leaf_gaps(simd, &self.near.lane_box, (number, block, first, count));
            if self.near.solid.is_box() {
                let first_in = Bits(Elements::within(simd, (&gaps.points, count), self.near.most)).next();
                first_in.map_or(ControlFlow::Continue(()), |lane| self.hold(first + lane))?;
            }
            for lane in Bits(Elements::within(simd, (&gaps.elements, count), self.near.most)) {
                self.compare(first + lane)?;
            }
            if elements.certifies
                && elements.semantics == Semantics::Obstacle
                && !self.doubtful
                && self.count == 0
            {
                let within = elements.margin + self.near.solid.radius;
                for lane in Bits(Elements::within(simd, (&gaps.cells, count), self.near.most)) {
                    self.doubtful = !elements.is_cell_beyond(self.near.solid, first + lane, within);
                    if self.doubtful {
                        break;
                    }
                }
            }
        }
        ControlFlow::Continue(())
    }
}
