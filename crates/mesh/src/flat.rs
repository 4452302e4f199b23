//! Common points of triangles in one plane, and of triangles without area.

use std::cmp::Ordering;

use crate::orientation::{PlaneSides, area_sign, line_weights, plane_weights, volume_sign, weighted};
use crate::triangle::Corners;

/// The convex hull of the corners of a triangle: a triangle, a segment or a point. Unused corners
/// repeat the last one.
#[derive(Debug, Clone, Copy)]
struct Hull {
    corners: Corners,
    count: usize,
}

impl Hull {
    fn new(triangle: &Corners) -> Self {
        if has_area(triangle) {
            return Self { corners: *triangle, count: 3 };
        }
        // Points on a line come in lexicographic order along it.
        let mut corners = *triangle;
        corners.sort_by(lexicographic);
        let [low, _, high] = corners;
        let count = if lexicographic(&low, &high).is_eq() { 1 } else { 2 };
        Self { corners: [low, high, high], count }
    }

    fn corners(&self) -> &[[f64; 3]] {
        &self.corners[..self.count]
    }
}

fn lexicographic(a: &[f64; 3], b: &[f64; 3]) -> Ordering {
    // Adding 0 turns -0 into 0, which is equal but ordered differently.
    let compare = |k: usize| (a[k] + 0.0).total_cmp(&(b[k] + 0.0));
    compare(0).then_with(|| compare(1)).then_with(|| compare(2))
}

/// A point without one of its coordinates.
fn projected(p: [f64; 3], axis: usize) -> [f64; 2] {
    [p[(axis + 1) % 3], p[(axis + 2) % 3]]
}

/// An axis along which the points, if they are not collinear, project to a triangle with area.
fn axis_with_area(points: &Corners) -> Option<usize> {
    (0..3).find(|&axis| {
        let [a, b, c] = points.map(|p| projected(p, axis));
        area_sign(a, b, c).is_ne()
    })
}

/// Returns `true` if the area of the triangle is, exactly, greater than 0.
pub(crate) fn has_area(triangle: &Corners) -> bool {
    axis_with_area(triangle).is_some()
}

/// Returns `true` if the triangles share a point. At least one has no area, or both lie in one
/// plane.
pub(crate) fn meet(a: &Corners, b: &Corners) -> bool {
    first_common(a, b).is_some()
}

/// The two corners farthest apart of what the triangles have in common, and the mean of all its
/// corners.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FlatContact {
    pub(crate) ends: [[f64; 3]; 2],
    pub(crate) mean: [f64; 3],
}

pub(crate) fn contact(a: &Corners, b: &Corners) -> Option<FlatContact> {
    let mut common: Vec<[f64; 3]> = Vec::new();
    visit_common(a, b, &mut |p| {
        if !common.contains(&p) {
            common.push(p);
        }
        true
    });
    let first = *common.first()?;
    let mut ends = [first; 2];
    let mut widest = 0.0;
    for (i, &p) in common.iter().enumerate() {
        for &q in &common[..i] {
            // The box is compared, which cannot overflow where a square would.
            let width = (0..3).map(|k| (p[k] * 0.5 - q[k] * 0.5).abs()).fold(0.0, f64::max);
            if width > widest {
                (widest, ends) = (width, [q, p]);
            }
        }
    }
    let share = 1.0 / common.len() as f64;
    let mean = [0, 1, 2].map(|k| common.iter().map(|p| p[k] * share).sum());
    Some(FlatContact { ends, mean })
}

fn first_common(a: &Corners, b: &Corners) -> Option<[f64; 3]> {
    let mut first = None;
    visit_common(a, b, &mut |p| {
        first = Some(p);
        false
    });
    first
}

/// Calls `each` with every corner of what the triangles have in common until it returns `false`.
fn visit_common(a: &Corners, b: &Corners, each: &mut impl FnMut([f64; 3]) -> bool) {
    let (a, b) = (Hull::new(a), Hull::new(b));
    let (large, small) = if a.count >= b.count { (a, b) } else { (b, a) };
    let axis = if large.count == 3 {
        let plane = PlaneSides::new(&large.corners);
        let [from, to, _] = small.corners.map(|p| plane.side(p));
        if small.count < 3 && (from.is_ne() || to.is_ne()) {
            if from != to && pierces(&large, &small) {
                let [from, to, _] = small.corners;
                each(weighted(from, to, plane_weights(&large.corners, from, to)));
            }
            return;
        }
        axis_with_area(&large.corners)
    } else {
        let ([a, b, _], [c, d, _]) = (large.corners, small.corners);
        if volume_sign(a, b, c, d).is_ne() {
            return;
        }
        // Without an axis all four lie on a line, where any axis will do.
        axis_with_area(&[a, b, c])
            .or_else(|| axis_with_area(&[a, b, d]))
            .or_else(|| axis_with_area(&[a, c, d]))
    };
    Projection::new(&large, &small, axis.unwrap_or(0)).visit(each);
}

/// Returns `true` if a segment meets the triangle. The segment must not lie in the plane of the
/// triangle, and its ends must not both be strictly on one side of that plane.
fn pierces(triangle: &Hull, segment: &Hull) -> bool {
    let [from, to, _] = segment.corners;
    let [a, b, c] = triangle.corners;
    let turns = [[a, b], [b, c], [c, a]].map(|[p, q]| volume_sign(from, to, p, q));
    turns.iter().all(|t| t.is_ge()) || turns.iter().all(|t| t.is_le())
}

/// Two convex polygons in a coordinate plane, with the side of each corner of one with respect to
/// each edge of the other: `Greater` is inside, for triangles.
struct Projection<'a> {
    hulls: [&'a Hull; 2],
    flat: [[[f64; 2]; 3]; 2],
    /// By polygon, edge, and corner of the other polygon.
    sides: [[[Ordering; 3]; 3]; 2],
}

impl<'a> Projection<'a> {
    fn new(a: &'a Hull, b: &'a Hull, axis: usize) -> Self {
        let hulls = [a, b];
        let flat = hulls.map(|hull| hull.corners.map(|p| projected(p, axis)));
        let sides = [0, 1].map(|i| {
            let (count, own, other) = (hulls[i].count, flat[i], flat[1 - i]);
            let clockwise = count == 3 && area_sign(own[0], own[1], own[2]).is_lt();
            [0, 1, 2].map(|edge| {
                let [from, to] = [own[edge % count], own[(edge + 1) % count]];
                other.map(|p| {
                    let side = area_sign(from, to, p);
                    if clockwise { side.reverse() } else { side }
                })
            })
        });
        Self { hulls, flat, sides }
    }

    fn visit(&self, each: &mut impl FnMut([f64; 3]) -> bool) {
        for i in 0..2 {
            for (at, &p) in self.hulls[i].corners().iter().enumerate() {
                if self.contains(1 - i, at, p) && !each(p) {
                    return;
                }
            }
        }
        let [of_first, of_second] = self.sides;
        // A segment is one edge.
        let edges = self.hulls.map(|hull| if hull.count == 2 { 1 } else { hull.count });
        for e in 0..edges[0] {
            for f in 0..edges[1] {
                let next = |i: usize, count: usize| (i + 1) % count;
                let (e_to, f_to) = (next(e, self.hulls[0].count), next(f, self.hulls[1].count));
                let crossed = |from: Ordering, to: Ordering| from.is_ne() && from == to.reverse();
                if crossed(of_first[e][f], of_first[e][f_to]) && crossed(of_second[f][e], of_second[f][e_to])
                {
                    let line = [self.flat[1][f], self.flat[1][f_to]];
                    let weights = line_weights(line, self.flat[0][e], self.flat[0][e_to]);
                    let [from, to] = [e, e_to].map(|k| self.hulls[0].corners[k]);
                    if !each(weighted(from, to, weights)) {
                        return;
                    }
                }
            }
        }
    }

    /// Returns `true` if polygon `i` contains corner `at` of the other, which is `p`.
    fn contains(&self, i: usize, at: usize, p: [f64; 3]) -> bool {
        let hull = self.hulls[i];
        let inside = (0..hull.count).all(|edge| self.sides[i][edge][at].is_ge());
        let [low, high, _] = hull.corners;
        match hull.count {
            3 => inside,
            2 => inside && lexicographic(&low, &p).is_le() && lexicographic(&p, &high).is_le(),
            _ => lexicographic(&low, &p).is_eq(),
        }
    }
}
