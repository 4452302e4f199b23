//! Lower bounds on the distance of a shape from nodes and points, several at a time, in single
//! precision.
//!
//! For nodes, the shape is represented by the box about its core. Along the axes of either box the gap of two
//! boxes is that of two intervals; the three gaps along orthogonal axes combine to a distance. The distances
//! of points from a truncated cone are exact, and those from a hull are bounded by planes.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x4, f32x16, mask32x16};
use nearmiss_hierarchy::NodeBounds;
use nearmiss_lanes::wide::{Vectors, along, product, squared};

use crate::solid::core::{LaneCore, Solid};

/// Rounding of distances, relative to all coordinates: as that of boxes in a relative pose.
const ROUNDING: f64 = 8e-6;

/// Coordinates beyond this have squares near the end of single precision.
const FARTHEST: f64 = 1e15;

/// An upper bound on the error of the square of a sine, as normals in steps are not of unit length.
const SINE_SQ: f32 = 5e-4;

/// Steps towards the nearest point of a hull.
const STEPS: u32 = 4;

/// The error of the square of a slope.
pub(crate) const LEVEL: f32 = 1e-4;

impl LaneCore<'_> {
    /// Upper bounds on how far the core extends from the centre of its box along unit vectors, up to
    /// rounding.
    #[inline(always)]
    pub(crate) fn extents<S: Simd>(&self, simd: S, ways: Vectors<S>) -> f32x16<S> {
        match *self {
            Self::Box => f32x16::splat(simd, f32::INFINITY),
            Self::Round { axis, half, radii } => {
                let rise = along(ways, axis);
                let slope = ((1.0 - rise * rise).max(0.0) + LEVEL).sqrt();
                (slope * radii[0] - rise * half).max(slope * radii[1] + rise * half)
            }
            Self::Corners(corners) => {
                let mut most = f32x16::splat(simd, f32::NEG_INFINITY);
                for &corner in corners {
                    most = most.max(along(ways, corner));
                }
                most
            }
        }
    }
}

/// The box about the core of a shape, and what is known of the core itself, in single precision.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneBox<'c> {
    pub(crate) core: LaneCore<'c>,
    pub(crate) centre: [f32; 3],
    pub(crate) axes: [[f32; 3]; 3],
    pub(crate) half: [f32; 3],
    is_point: bool,
    /// `true` if the core is a point or a segment along the first axis.
    pub(crate) is_segment: bool,
    /// `false` if coordinates are out of the range of single precision: then nothing is pruned.
    pub(crate) is_near: bool,
    /// The error of a distance.
    pub(crate) slack: f32,
}

impl<'c> LaneBox<'c> {
    /// The box of a shape near a scan whose coordinates are at most `far`, and its core.
    #[expect(clippy::cast_possible_truncation, reason = "counted in `slack`")]
    pub(crate) fn new(solid: &Solid<'_>, far: f64, core: LaneCore<'c>) -> Self {
        let far = far + solid.centre.amax() + solid.half.sum() + solid.radius;
        let single = |v: [f64; 3]| [v[0] as f32, v[1] as f32, v[2] as f32];
        Self {
            core,
            centre: single(solid.centre.into()),
            axes: solid.axes.map(|axis| single(axis.into())),
            half: single(solid.half.into()),
            is_point: solid.is_point(),
            is_segment: solid.is_segment(),
            is_near: far < FARTHEST,
            slack: (ROUNDING * far) as f32,
        }
    }

    /// The distance from the centre to a corner.
    #[inline(always)]
    pub(crate) fn reach(&self) -> f32 {
        let [x, y, z] = self.half;
        x + y + z
    }

    /// Lower bounds, up to the slack, on the squared distances of the core from four nodes: from
    /// their boxes or, if `grown`, from their enclosures.
    #[inline(always)]
    pub(crate) fn of_nodes<S: Simd>(&self, simd: S, nodes: &NodeBounds<f32x4<S>>, grown: bool) -> f32x4<S> {
        let zero = f32x4::splat(simd, 0.0);
        if !self.is_near {
            return zero;
        }
        let [cx, cy, cz] = self.centre;
        let d = [nodes.centre[0] - cx, nodes.centre[1] - cy, nodes.centre[2] - cz];
        // A segment has a length along its first axis only.
        let lengths = if self.is_segment { 1 } else { 3 };
        let mut sum = zero;
        let mut outer = [zero; 3];
        for k in 0..3 {
            let [ax, ay, az] = nodes.axes[k];
            let at = product([ax, ay, az], d);
            let half = nodes.half[k];
            let (low, high) = if grown { (half + nodes.low[k], half + nodes.high[k]) } else { (half, half) };
            let mut reach = zero;
            if !self.is_point {
                let widest = low.max(high);
                for j in 0..lengths {
                    let [x, y, z] = self.axes[j];
                    let cosine = (ax * x + ay * y + az * z).abs();
                    reach += cosine * self.half[j];
                    outer[j] += cosine * widest;
                }
            }
            let beyond = (at - low).max(-at - high) - reach;
            let beyond = beyond.max(0.0);
            sum += beyond * beyond;
        }
        if self.is_point {
            return sum;
        }
        let mut other = zero;
        for j in 0..lengths {
            let [x, y, z] = self.axes[j];
            let at = (d[0] * x + d[1] * y + d[2] * z).abs();
            let beyond = (at - outer[j] - self.half[j]).max(0.0);
            other += beyond * beyond;
        }
        sum.max(other)
    }

    /// Lower bounds, up to the slack, on the distances of the core from points and their planes.
    #[inline(always)]
    pub(crate) fn of_points<S: Simd>(
        &self,
        simd: S,
        points: &Vectors<S>,
        normals: &Vectors<S>,
    ) -> Distances<S> {
        let zero = f32x16::splat(simd, 0.0);
        if !self.is_near {
            return Distances { from_point: zero, from_plane: zero, beside: zero, sine: zero };
        }
        let [cx, cy, cz] = self.centre;
        let d = [points[0] - cx, points[1] - cy, points[2] - cz];
        let signed = product(d, *normals);
        let height = signed.abs();
        if self.is_point {
            let square = squared(d);
            let beside = (square - height * height).max(0.0).sqrt();
            let sine = f32x16::splat(simd, 1.0);
            return Distances { from_point: square.sqrt(), from_plane: height, beside, sine };
        }
        let (mut sum, mut reach, mut rise) = (zero, zero, zero);
        let mut way = [zero; 3];
        for j in 0..3 {
            let axis = self.axes[j];
            let (at, slope) = (along(d, axis), along(*normals, axis));
            let beyond = (at.abs() - self.half[j]).max(0.0);
            sum += beyond * beyond;
            reach += slope.abs() * self.half[j];
            let beyond = beyond.copysign(at);
            rise += beyond * slope;
            if let LaneCore::Corners(_) = self.core {
                way = [way[0] + beyond * axis[0], way[1] + beyond * axis[1], way[2] + beyond * axis[2]];
            }
        }
        let mut from_point = sum.sqrt();
        if let LaneCore::Round { axis, half, radii } = self.core {
            (sum, rise) = of_round(simd, (&d, normals), (axis, half, radii));
            from_point = sum.sqrt();
        }
        if let LaneCore::Corners(corners) = self.core {
            // From the box to the point or, within the box, from its centre.
            let is_within: mask32x16<S> = sum.simd_le(0.0);
            for k in 0..3 {
                way[k] = is_within.select(d[k], way[k]);
            }
            let (apart, way) = of_corners(simd, &d, way, corners);
            (sum, rise) = (f32x16::splat(simd, 1.0), product(way, *normals));
            from_point = from_point.max(apart);
        }
        let from_plane = if let LaneCore::Box = self.core {
            height - reach
        } else {
            let sign = f32x16::splat(simd, 1.0).copysign(signed);
            let [x, y, z] = *normals;
            height - self.core.extents(simd, [x * sign, y * sign, z * sign]).min(reach)
        };
        let sine_sq = (sum - rise * rise).max(0.0) / sum.max(f32::MIN_POSITIVE) + SINE_SQ;
        let from_plane = from_plane.max(0.0);
        Distances { from_point, from_plane, beside: zero, sine: sine_sq.sqrt().min(1.0) }
    }
}

/// Lower bounds on the distances of a hull of corners from points, and the unit normals of the planes that
/// prove them. Corners and points are relative to the same place.
///
/// `way` leads roughly from the hull to each point. Steps of Frank & Wolfe (1956) move a place of the hull
/// towards the nearest one.
#[inline(always)]
fn of_corners<S: Simd>(
    simd: S,
    d: &Vectors<S>,
    mut way: Vectors<S>,
    corners: &[[f32; 3]],
) -> (f32x16<S>, Vectors<S>) {
    let zero = f32x16::splat(simd, 0.0);
    let mut most = f32x16::splat(simd, f32::NEG_INFINITY);
    let mut best = way;
    for round in 0..STEPS {
        let mut reach = f32x16::splat(simd, f32::NEG_INFINITY);
        let mut furthest = [zero; 3];
        for &corner in corners {
            let own = along(way, corner);
            let is_further: mask32x16<S> = own.simd_gt(reach);
            reach = own.max(reach);
            for k in 0..3 {
                furthest[k] = is_further.select(f32x16::splat(simd, corner[k]), furthest[k]);
            }
        }
        let square = squared(way);
        let per_unit = 1.0 / square.sqrt().max(f32::MIN_POSITIVE);
        let apart = (product(way, *d) - reach) * per_unit;
        let is_more: mask32x16<S> = apart.simd_gt(most);
        most = apart.max(most);
        // From the corner to the point, and from there to the way.
        let next = [d[0] - furthest[0], d[1] - furthest[1], d[2] - furthest[2]];
        let change = [way[0] - next[0], way[1] - next[1], way[2] - next[2]];
        let share = product(way, change) / squared(change).max(f32::MIN_POSITIVE);
        let share = if round == 0 { f32x16::splat(simd, 1.0) } else { share.max(zero).min(1.0) };
        for k in 0..3 {
            best[k] = is_more.select(way[k] * per_unit, best[k]);
            way[k] -= share * change[k];
        }
    }
    (most, best)
}

/// The squared distances of a truncated cone, given by its axis, half its height and the radii below and
/// above, from points relative to its centre; and the ways to them along the normals.
#[inline(always)]
fn of_round<S: Simd>(
    simd: S,
    (d, normals): (&Vectors<S>, &Vectors<S>),
    (axis, half, [below, above]): ([f32; 3], f32, [f32; 2]),
) -> (f32x16<S>, f32x16<S>) {
    let zero = f32x16::splat(simd, 0.0);
    let at = along(*d, axis);
    let [x, y, z] = *d;
    let across = [x - at * axis[0], y - at * axis[1], z - at * axis[2]];
    let beside = squared(across).sqrt();
    // To the slanted side, and to both lids.
    let (low, high) = (at + half, at - half);
    let side = [above - below, 2.0 * half];
    let square = (side[0] * side[0] + side[1] * side[1]).max(f32::MIN_POSITIVE);
    let share = (((beside - below) * side[0] + low * side[1]) * (1.0 / square)).max(0.0).min(1.0);
    let mut out = beside - below - share * side[0];
    let mut up = low - share * side[1];
    let mut least = out * out + up * up;
    for (radius, up_lid) in [(below, low), (above, high)] {
        let out_lid = (beside - radius).max(0.0);
        let own = out_lid * out_lid + up_lid * up_lid;
        let is_less: mask32x16<S> = own.simd_lt(least);
        (out, up) = (is_less.select(out_lid, out), is_less.select(up_lid, up));
        least = own.min(least);
    }
    let beyond_side = (beside - below) * side[1] - low * side[0];
    // The slanted side of a flat core is a point or level, and bounds nothing.
    let beyond_rim = beside - below.max(above);
    let is_in: mask32x16<S> = beyond_side.max(beyond_rim).max(-low).max(high).simd_le(0.0);
    let rise = out * product(across, *normals) / beside.max(f32::MIN_POSITIVE) + up * along(*normals, axis);
    (is_in.select(zero, least), is_in.select(zero, rise))
}

/// Distances of a core from points and the planes through them.
#[derive(Clone, Copy)]
pub(crate) struct Distances<S: Simd> {
    pub(crate) from_point: f32x16<S>,
    pub(crate) from_plane: f32x16<S>,
    /// The distance from the axis of each plane's normal; zero unless the core is a point.
    beside: f32x16<S>,
    /// The sine of the angle between each normal and the way from the core to the point; 1 if the core is a
    /// point.
    sine: f32x16<S>,
}

impl<S: Simd> Distances<S> {
    /// The distances from balls and, where `are_discs`, from all within `thick` of discs.
    #[inline(always)]
    pub(crate) fn parts(
        &self,
        simd: S,
        radii: f32x16<S>,
        thick: f32x16<S>,
        are_discs: mask32x16<S>,
    ) -> f32x16<S> {
        let of_balls = self.from_point - radii;
        let out = (self.beside - radii).max(f32x16::splat(simd, 0.0));
        let of_discs = of_balls.max((self.from_plane * self.from_plane + out * out).sqrt());
        are_discs.select(of_discs.max(self.across(radii)) - thick, of_balls)
    }

    /// The distances from balls and, where `are_discs`, from their parts within `thick` of a plane.
    #[inline(always)]
    pub(crate) fn cells(
        &self,
        simd: S,
        radii: f32x16<S>,
        thick: f32x16<S>,
        are_discs: mask32x16<S>,
    ) -> f32x16<S> {
        let zero = f32x16::splat(simd, 0.0);
        let of_balls = self.from_point - radii;
        let (up, out) = ((self.from_plane - thick).max(zero), (self.beside - radii).max(zero));
        let of_discs = of_balls.max((up * up + out * out).sqrt());
        are_discs.select(of_discs.max(self.across(radii) - thick), of_balls)
    }

    /// The distances of discs: the core is beyond the plane across the way to the point, and a disc reaches
    /// this far towards it.
    #[inline(always)]
    fn across(&self, radii: f32x16<S>) -> f32x16<S> {
        self.from_point - radii * self.sine
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;
    use nearmiss_geometry::Pose;
    use nearmiss_geometry::nalgebra::Vector3;
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation, unit_vector};
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::*;
    use crate::leaf::disc_triangle::FlatDisc;
    use crate::solid::shape::Shape;

    type Vector = Vector3<f64>;

    /// Bounds never exceed the distances of points and discs, and those of closed cores are the distances.
    #[test]
    fn distances_of_cores_are_bounded_closely_by_any_instructions() {
        const KINDS: usize = 6;
        /// The error of a bound in single precision.
        const ERROR: f64 = 1e-5;
        let rng = &mut rng(11);
        let (mut apart, mut of_points, mut of_discs) = ([0_u32; KINDS], [0.0; KINDS], [0.0; KINDS]);
        for round in 0..300 {
            let kind = round % KINDS;
            let turn = if round % 5 == 0 { Pose::IDENTITY } else { rotation(rng) };
            let pose = turn.with_translation(point_in(rng, 1.0));
            let points: Vec<[f64; 3]> = (0..7).map(|_| pose.apply(point_in(rng, 0.5))).collect();
            // Flat ones and poles as well.
            let half: [f64; 3] =
                [0, 1, 2].map(|_| rng.random_range(0.0..0.6) * f64::from(rng.random_range(0..5_u8).min(1)));
            let shape = match kind {
                0 => Shape::Capsule { ends: [points[0], points[1]], radius: 0.0 },
                1 => Shape::Box { pose, half, radius: 0.0 },
                2 => Shape::Cylinder { pose, half_height: half[0], radius: half[1], rounding: 0.0 },
                3 => Shape::Cone { pose, half_height: half[0], radius: half[1], rounding: 0.0 },
                4 => Shape::Triangle { points: [points[0], points[1], points[2]], radius: 0.0 },
                _ => Shape::Hull { points: &points, radius: 0.0 },
            };
            let solid = Solid::new(&shape, &Pose::IDENTITY).unwrap();
            let mut corners = Vec::new();
            let lane_box = LaneBox::new(&solid, 2.0, solid.lane_core(&mut corners));
            // On the axis of a cone, and in the plane across it, as well.
            let discs: [FlatDisc; 16] = [(); 16].map(|()| {
                let mut off = Vector::from(point_in(rng, 1.5)) * f64::from(rng.random_range(0..3_u8)) * 0.5;
                if rng.random_range(0..4) == 0 {
                    off -= solid.axes[1] * off.dot(&solid.axes[1]);
                }
                let along =
                    solid.axes[1] * rng.random_range(-1.0..1.0) * f64::from(rng.random_range(0..2_u8));
                let normal = Vector::from(unit_vector(rng));
                FlatDisc { centre: solid.centre + off + along, normal, radius: rng.random_range(0.0..0.4) }
            });
            for level in levels() {
                let [from_points, from_discs] = dispatch!(level, simd => {
                    let each = |of: &dyn Fn(&FlatDisc) -> f64| {
                        #[expect(clippy::cast_possible_truncation, reason = "single precision")]
                        f32x16::load_array(simd, discs.each_ref().map(|disc| of(disc) as f32))
                    };
                    let centres = [0, 1, 2].map(|k| each(&|disc| disc.centre[k]));
                    let normals = [0, 1, 2].map(|k| each(&|disc| disc.normal[k]));
                    let found = lane_box.of_points(simd, &centres, &normals);
                    let (radii, none) = (each(&|disc| disc.radius), f32x16::splat(simd, 0.0));
                    let all = mask32x16::from_bitmask(simd, 0xffff);
                    [found.from_point.to_array(), found.parts(simd, radii, none, all).to_array()]
                });
                for (lane, disc) in discs.iter().enumerate() {
                    let distance = solid.distance(&disc.centre);
                    let gap = solid.gap(disc, f64::INFINITY).distance;
                    let [by_point, by_disc] = [from_points, from_discs].map(|of| f64::from(of[lane]));
                    let what = || format!("{shape:?} {disc:?}");
                    assert!(by_point <= distance + ERROR, "{by_point}, {distance} away: {}", what());
                    assert!(by_disc <= gap + ERROR, "{by_disc}, {gap} away: {}", what());
                    if kind < 4 {
                        assert!(by_point >= distance - ERROR, "{by_point}, {distance} away: {}", what());
                    }
                    apart[kind] += u32::from(gap > 0.0);
                    of_points[kind] += distance - by_point;
                    of_discs[kind] += (gap - by_disc.max(0.0)) / disc.radius.max(0.1);
                }
            }
        }
        let mean = |sums: [f64; KINDS]| [0, 1, 2, 3, 4, 5].map(|kind| sums[kind] / f64::from(apart[kind]));
        let (of_points, of_discs) = (mean(of_points), mean(of_discs));
        assert!(of_points[4] < 0.05 && of_points[5] < 0.15, "{of_points:?} short of distances");
        assert!(of_discs.iter().all(|&mean| mean < 0.2), "{of_discs:?} disc radii short of distances");
        assert!(apart.iter().all(|&count| count > 500), "{apart:?} apart");
    }
}
