//! A lower bound of the penetration of a shape that lies on both sides of a surface.
//!
//! A shift that is shorter than the distance of a place of the shape from the surface leaves the place on its
//! side. If two places are on different sides, the shape crosses the surface until one of them arrives
//! there, unless the surface ends where the shape is. So a thin plate that stands in a wall has a bound about
//! as long as the way out, while every place in it is at most half its thickness deep.

use std::ops::ControlFlow;

use fearless_simd::{Level, Simd};
use nearmiss_geometry::Pose;

use crate::ask::budget::Budget;
use crate::ask::options::Semantics;
use crate::pair::placed::ViewScratch;
use crate::penetration::interior::{Working, crosses};
use crate::penetration::probe::Vector;
use crate::solid::core::Solid;
use crate::solid::descent::{LeafSearch, Near};
use crate::solid::distance::nearest;
use crate::solid::elements::Elements;
use crate::solid::shape::Shape;

/// The number of places of the shape that are compared at most.
pub(crate) const ENDS: usize = 24;

/// Searches for borders at most.
const BORDERS: usize = 16;

/// A place of the shape.
#[derive(Debug, Clone, Copy)]
struct End {
    place: Vector,
    /// A shift that is shorter leaves the place on its side of the surface.
    away: f64,
}

/// Returns a length such that the shape crosses the surface after every shorter shift; 0 if none is found.
/// The places that are compared are those of the shape that are furthest along some directions. Adds the
/// questions about the scan to `asked`. Breaks if the budget is spent.
pub(crate) fn across(
    elements: &Elements<'_>,
    solid: &Solid<'_>,
    ways: impl Iterator<Item = Vector>,
    (level, crossings, scratch): Working<'_>,
    (budget, asked): (&Budget, &mut u64),
) -> ControlFlow<(), f64> {
    let width = solid.width();
    if elements.semantics != Semantics::Obstacle || width <= 0.0 {
        return ControlFlow::Continue(0.0);
    }
    let mut flat = elements.flat();
    flat.certifies = true;
    let mut ends = [End { place: solid.inside, away: 0.0 }; ENDS];
    let mut count = 0;
    for way in ways.filter_map(|way| way.try_normalize(1e-9)).take(ENDS) {
        let place = solid.support(&way) + way * solid.radius;
        budget.go_on(*asked)?;
        *asked += 1;
        let Some(found) = nearest(&flat, &Solid::point(place), f64::INFINITY, (level, &mut scratch.corners))
        else {
            return ControlFlow::Continue(0.0);
        };
        // Towards the centre the shape becomes wider, until a hole is too small for it.
        let narrow = elements.hole(found.i) * (place - solid.inside).norm() / width;
        let away = found.lower - narrow;
        if away > 0.0 {
            ends[count] = End { place, away };
            count += 1;
        }
    }
    let ends = &mut ends[..count];
    ends.sort_by(|a, b| b.away.total_cmp(&a.away));
    let (mut best, mut borders) = (0.0_f64, 0);
    // The places that are on the other side than the first.
    let mut are_opposite = [false; ENDS];
    for n in 1..count {
        let q = ends[n];
        if q.away <= best {
            break;
        }
        budget.go_on(*asked)?;
        *asked += 1;
        let is_crossed = |p: &End, working: Working<'_>| crosses(elements, [&p.place, &q.place], working);
        are_opposite[n] = is_crossed(&ends[0], (level, &mut *crossings, &mut *scratch));
        for other in 0..if are_opposite[n] { n } else { 0 } {
            let p = ends[other];
            if q.away <= best || borders == BORDERS {
                break;
            }
            if are_opposite[other] {
                continue;
            }
            budget.go_on(*asked)?;
            (borders, *asked) = (borders + 1, *asked + 1);
            if other > 0 && !is_crossed(&p, (level, &mut *crossings, &mut *scratch)) {
                continue;
            }
            let between = [p.place, solid.inside, q.place].map(Into::into);
            best = best.max(up_to_border(elements, between, (q.away, best), (level, &mut *scratch)));
        }
    }
    ControlFlow::Continue(best)
}

/// The distance of a triangle from the nearest border of the surface, or `most` if that is less. May end the
/// search at `least`.
fn up_to_border(
    elements: &Elements<'_>,
    points: [[f64; 3]; 3],
    (most, least): (f64, f64),
    (level, scratch): (Level, &mut ViewScratch),
) -> f64 {
    let Some(solid) = Solid::new(&Shape::Triangle { points, radius: 0.0 }, &Pose::IDENTITY) else {
        return 0.0;
    };
    let mut near = Near::new(elements, &solid, true, &mut scratch.corners);
    near.limit(most);
    let mut search = Border { near, within: most, least };
    let _is_near = near.search(level, most, &mut search);
    search.within
}

/// The search for the nearest border.
struct Border<'s, 'a> {
    near: Near<'s, 'a>,
    within: f64,
    least: f64,
}

impl<'s, 'a> LeafSearch<'s, 'a> for Border<'s, 'a> {
    #[inline(always)]
    fn near(&self) -> &Near<'s, 'a> {
        &self.near
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, _: S, number: usize, _: f32) -> ControlFlow<()> {
        let Near { elements, solid, .. } = self.near;
        for i in elements.arrays.leaves.points(number) {
            // Next to a point that is no part of a sheet the surface may end.
            if elements.is_disc(i) && !elements.is_at_border(i) {
                continue;
            }
            let reach = f64::from(elements.arrays.obstacle_reach(i));
            let away = solid.distance_bound(&elements.position(i)) - reach;
            if away < self.within {
                self.within = away.max(0.0);
                self.near.limit(self.within);
                if self.within <= self.least {
                    return ControlFlow::Break(());
                }
            }
        }
        ControlFlow::Continue(())
    }
}
