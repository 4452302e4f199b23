//! Lower bounds on the distance of oriented boxes under a relative pose, sixteen pairs at a time.
//!
//! The face normals alone underestimate the distance by up to two thirds. That suffices to decide
//! whether boxes touch, but not to measure their distance. So the centre of one box is projected
//! onto the other box and back (Cheney & Goldstein, "Proximity maps for convex sets", Proc. AMS 10,
//! 1959), and both boxes are measured along the line between the two feet. Every line gives a lower
//! bound; the line between the nearest points gives the distance.
//!
//! Single precision cannot distinguish the near parts of scans from their far parts if the distance
//! of the scans is a million times their size. So the vector o between the centres of the two scans
//! stays in double precision, and this module computes the excess of a pair's distance over |o|.
//! Along a unit vector u, u·o = |o| (1 − |u − o/|o||² / 2), where the second term is small if |o|
//! is large. The rounding error is then proportional to the sizes of the scans, not to their
//! distance.

use std::ops::{Add, Mul};

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::{Matrix3, Vector3};
use nearmiss_hierarchy::{NodeBounds, OrientedBox, SLACK};
use nearmiss_lanes::wide::{bits, product};

/// Projections back and forth. With one, the descent visits 0.5 % more pairs than with exact
/// distances.
const ROUNDS: u32 = 1;

/// The number of node pairs compared at once.
pub(crate) const LANES: usize = 16;

/// Lower bounds on the distances of sixteen node pairs, minus |o|, in a's stored frame. Equal to
/// [`RelativePose::least`] for volumes that may overlap and for NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gaps {
    pub(crate) boxes: [f32; LANES],
    pub(crate) enclosures: [f32; LANES],
    /// The lanes of pairs that are below one of the limits, as a bit mask.
    pub(crate) near: u32,
}

/// The limits below which a pair is near.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub(crate) boxes: f32,
    pub(crate) enclosures: f32,
}

impl Limits {
    /// Every pair is near.
    pub(crate) const NONE: Self = Self { boxes: f32::INFINITY, enclosures: f32::INFINITY };
}

/// About ten rounding errors in double precision.
const DOUBLE_ROUNDING: f64 = 2e-15;

/// b's pose in a's stored frame, prepared for [`Self::gaps`].
#[derive(Debug, Clone)]
pub(crate) struct RelativePose {
    rotation: [[f32; 3]; 3],
    pub(crate) scale: f32,
    /// The translation of b's points, minus o.
    shift: [f32; 3],
    /// The vector o from the centre of a to that of b.
    offset: [f32; 3],
    direction: [f32; 3],
    distance: f64,
    /// The rounding error of a bound, in a's stored frame.
    slack: f64,
    /// The length in the world of one unit of a's stored frame.
    to_world: f64,
}

#[expect(clippy::cast_possible_truncation, reason = "slack covers the rounding")]
fn single(v: Vector3<f64>) -> [f32; 3] {
    v.map(|c| c as f32).into()
}

impl RelativePose {
    /// Prepares the relative pose `pose` of two things with the boxes `roots`, whose stored frames
    /// are `placed` in the world.
    #[expect(clippy::cast_possible_truncation, reason = "slack covers the rounding")]
    pub(crate) fn new([root_a, root_b]: [&OrientedBox; 2], placed: [&Pose; 2], pose: &Pose) -> Self {
        let [ca, cb] = [root_a, root_b].map(|root| Vector3::from(root.centre.map(f64::from)));
        let turned = pose.scale() * (pose.rotation() * cb);
        let offset = turned + Vector3::from(pose.translation()) - ca;
        let distance = offset.norm();
        let extent =
            ca.norm() + f64::from(root_a.radius()) + pose.scale() * (cb.norm() + f64::from(root_b.radius()));
        let to_world = placed[0].scale();
        // Distances are claimed in the world, where both scans may be far from the origin and
        // rotation matrices are orthogonal only up to rounding.
        let far: f64 = placed.iter().map(|placed| Vector3::from(placed.translation()).norm()).sum();
        let skew = placed.map(|placed| {
            let rotation = placed.rotation();
            (rotation.tr_mul(rotation) - Matrix3::identity()).amax()
        });
        let of_doubles = (DOUBLE_ROUNDING + 4.0 * skew[0].max(skew[1])) * (extent + distance)
            + DOUBLE_ROUNDING * far / to_world;
        let row = |i: usize| single(pose.rotation().row(i).transpose());
        Self {
            rotation: [row(0), row(1), row(2)],
            scale: pose.scale() as f32,
            shift: single(ca - turned),
            offset: single(offset),
            direction: single(offset / if distance > 0.0 { distance } else { 1.0 }),
            distance,
            slack: 2.0 * f64::from(SLACK) * extent + of_doubles,
            to_world,
        }
    }

    /// Returns the world distance that `bound`, in a's stored frame, proves.
    pub(crate) fn proven(&self, bound: f64) -> f64 {
        ((bound - self.slack) * self.to_world * (1.0 - 4.0 * DOUBLE_ROUNDING)).max(0.0)
    }

    /// The inverse of [`Self::proven`]: pairs with a greater bound are at least `distance` apart in
    /// the world.
    pub(crate) fn bound_of(&self, distance: f64) -> f64 {
        distance / self.to_world * (1.0 + 4.0 * DOUBLE_ROUNDING) + self.slack
    }

    /// The bound on the distance, in a's stored frame, for the excess `beyond` over |o|. Never
    /// negative.
    pub(crate) fn bound(&self, beyond: f32) -> f64 {
        let own = self.distance + f64::from(beyond);
        if own > 0.0 { own } else { 0.0 }
    }

    /// The excess over |o| with this [`Self::bound`], rounded up.
    #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
    pub(crate) fn beyond(&self, bound: f64) -> f32 {
        ((bound - self.distance) as f32).next_up().next_up()
    }

    /// The gap, in a's stored frame, for the excess `beyond` over |o|. The distance in the world is
    /// at least this gap minus `slack`.
    #[expect(clippy::cast_possible_truncation, reason = "rounded down")]
    pub(crate) fn gap(&self, beyond: f32, slack: f32) -> f32 {
        ((self.distance + f64::from(beyond) - self.slack + f64::from(slack)) as f32).next_down()
    }

    /// The excess over |o| with this [`Self::gap`], rounded up.
    #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
    pub(crate) fn beyond_gap(&self, gap: f32, slack: f32) -> f32 {
        ((f64::from(gap) + self.slack - f64::from(slack) - self.distance) as f32).next_up().next_up()
    }

    /// The excess over |o| of a distance of at least `bound`, rounded down.
    #[expect(clippy::cast_possible_truncation, reason = "rounded down")]
    pub(crate) fn no_nearer(&self, bound: f64) -> f32 {
        ((bound - self.distance) as f32).next_down().next_down().max(self.least())
    }

    /// The smallest value of [`Self::gaps`], whose bound is 0.
    #[expect(clippy::cast_possible_truncation, reason = "rounded down")]
    pub(crate) fn least(&self) -> f32 {
        (-self.distance as f32).next_down().next_down()
    }

    /// The bounds of b in a's stored frame, with centres relative to o.
    #[inline(always)]
    pub(crate) fn moved<V: Copy + Add<Output = V> + Mul<f32, Output = V> + Add<f32, Output = V>>(
        &self,
        bounds: &NodeBounds<V>,
    ) -> NodeBounds<V> {
        let [x, y, z] = self.scaled(self.turned(&bounds.centre));
        NodeBounds {
            centre: [x + self.shift[0], y + self.shift[1], z + self.shift[2]],
            half: self.scaled(bounds.half),
            axes: [self.turned(&bounds.axes[0]), self.turned(&bounds.axes[1]), self.turned(&bounds.axes[2])],
            low: self.scaled(bounds.low),
            high: self.scaled(bounds.high),
        }
    }

    #[inline(always)]
    fn scaled<V: Mul<f32, Output = V>>(&self, [x, y, z]: [V; 3]) -> [V; 3] {
        [x * self.scale, y * self.scale, z * self.scale]
    }

    #[inline(always)]
    fn turned<V: Copy + Add<Output = V> + Mul<f32, Output = V>>(&self, v: &[V; 3]) -> [V; 3] {
        let [x, y, z] = self.rotation;
        [
            v[0] * x[0] + v[1] * x[1] + v[2] * x[2],
            v[0] * y[0] + v[1] * y[1] + v[2] * y[2],
            v[0] * z[0] + v[1] * z[1] + v[2] * z[2],
        ]
    }

    /// Computes the gaps of nodes of a and [moved](Self::moved) nodes of b, lane by lane.
    #[inline(always)]
    pub(crate) fn gaps<S: Simd>(
        &self,
        simd: S,
        a: &NodeBounds<f32x16<S>>,
        b: &NodeBounds<f32x16<S>>,
        limits: Limits,
    ) -> Gaps {
        // Unrolled by hand: loops would keep all values in memory.
        let [x, y, z] = self.offset;
        let between = [b.centre[0] - a.centre[0], b.centre[1] - a.centre[1], b.centre[2] - a.centre[2]];
        let off = [between[0] + x, between[1] + y, between[2] + z];
        // The projections need only the offset of the centres along the axes and the cosines
        // between the axes.
        let (along_a, along_b) = (in_terms_of(&a.axes, off), in_terms_of(&b.axes, off));
        let cosines = [
            in_terms_of(&b.axes, a.axes[0]),
            in_terms_of(&b.axes, a.axes[1]),
            in_terms_of(&b.axes, a.axes[2]),
        ];
        // Start from the centre of b.
        let mut seen = along_a;
        let mut foot_a = within(&seen, &a.half);
        for _ in 0..ROUNDS {
            let foot = combined(&cosines, &foot_a);
            let place = [foot[0] - along_b[0], foot[1] - along_b[1], foot[2] - along_b[2]];
            let foot = in_terms_of(&cosines, within(&place, &b.half));
            seen = [along_a[0] + foot[0], along_a[1] + foot[1], along_a[2] + foot[2]];
            foot_a = within(&seen, &a.half);
        }
        let apart = [seen[0] - foot_a[0], seen[1] - foot_a[1], seen[2] - foot_a[2]];
        let line = combined(&a.axes, &apart);
        let per_length = f32x16::splat(simd, 1.0) / product(line, line).sqrt();
        let line = [line[0] * per_length, line[1] * per_length, line[2] * per_length];
        let [x, y, z] = self.direction;
        let turn = [line[0] - x, line[1] - y, line[2] - z];
        #[expect(clippy::cast_possible_truncation, reason = "slack covers the rounding")]
        let boxes = product(line, between) - product(turn, turn) * (0.5 * self.distance) as f32;
        // Every direction gives a bound. The boxes' direction is nearly the best for the
        // enclosures.
        let (along_a, along_b) = (in_terms_of(&a.axes, line), in_terms_of(&b.axes, line));
        let mut reach = Reach { boxes, growth: f32x16::splat(simd, 0.0) };
        reach.add(
            simd,
            [along_a[0], along_b[0]],
            [a.half[0], b.half[0]],
            [a.low[0], a.high[0], b.low[0], b.high[0]],
        );
        reach.add(
            simd,
            [along_a[1], along_b[1]],
            [a.half[1], b.half[1]],
            [a.low[1], a.high[1], b.low[1], b.high[1]],
        );
        reach.add(
            simd,
            [along_a[2], along_b[2]],
            [a.half[2], b.half[2]],
            [a.low[2], a.high[2], b.low[2], b.high[2]],
        );
        let Reach { boxes, growth } = reach;
        let (least, enclosures) = (f32x16::splat(simd, self.least()), boxes - growth);
        let boxes = simd.select_f32x16(boxes.simd_gt(least), boxes, least);
        let enclosures = simd.select_f32x16(enclosures.simd_gt(least), enclosures, least);
        let near: mask32x16<S> = boxes.simd_lt(limits.boxes) | enclosures.simd_lt(limits.enclosures);
        Gaps { boxes: boxes.to_array(), enclosures: enclosures.to_array(), near: bits(near) }
    }
}

/// The gap of two boxes along a direction, and the amount by which their enclosures reduce it.
struct Reach<S: Simd> {
    boxes: f32x16<S>,
    growth: f32x16<S>,
}

impl<S: Simd> Reach<S> {
    /// Subtracts the extents along one axis of each box. `along`: cosines of the axes with the
    /// direction. `half`: half edge lengths. The rest: growth of the enclosures at the lower and
    /// upper end of each axis.
    #[inline(always)]
    fn add(
        &mut self,
        simd: S,
        along: [f32x16<S>; 2],
        half: [f32x16<S>; 2],
        [low_a, high_a, low_b, high_b]: [f32x16<S>; 4],
    ) {
        let shares = [along[0].abs(), along[1].abs()];
        self.boxes -= half[0] * shares[0];
        self.boxes -= half[1] * shares[1];
        // Towards each other: along the direction for a, against it for b.
        let towards_b = simd.select_f32x16(along[0].simd_gt(0.0), high_a, low_a);
        let towards_a = simd.select_f32x16(along[1].simd_gt(0.0), low_b, high_b);
        self.growth += towards_b * shares[0] + towards_a * shares[1];
    }
}

/// The components of vectors along three axes.
#[inline(always)]
fn in_terms_of<S: Simd>(axes: &[[f32x16<S>; 3]; 3], v: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
    [product(axes[0], v), product(axes[1], v), product(axes[2], v)]
}

/// The vectors with these components along three axes.
#[inline(always)]
fn combined<S: Simd>(axes: &[[f32x16<S>; 3]; 3], along: &[f32x16<S>; 3]) -> [f32x16<S>; 3] {
    let [u, v, w] = axes;
    let [x, y, z] = *along;
    [u[0] * x + v[0] * y + w[0] * z, u[1] * x + v[1] * y + w[1] * z, u[2] * x + v[2] * y + w[2] * z]
}

/// The point of a box nearest to `place`; both in coordinates along the box's axes.
#[inline(always)]
fn within<S: Simd>(place: &[f32x16<S>; 3], half: &[f32x16<S>; 3]) -> [f32x16<S>; 3] {
    [
        place[0].min(half[0]).max(-half[0]),
        place[1].min(half[1]).max(-half[1]),
        place[2].min(half[2]).max(-half[2]),
    ]
}

#[cfg(test)]
impl RelativePose {
    /// The relative pose `pose` of two scans centred at their origins, with all points within 4 of
    /// them.
    pub(crate) fn of_centred(pose: &Pose) -> Self {
        let offset = Vector3::from(pose.translation());
        let row = |i: usize| single(pose.rotation().row(i).transpose());
        Self {
            rotation: [row(0), row(1), row(2)],
            scale: single([pose.scale(); 3].into())[0],
            shift: [0.0; 3],
            offset: single(offset),
            direction: single(offset / offset.norm()),
            distance: offset.norm(),
            slack: 2.0 * f64::from(SLACK) * (4.0 + 4.0 * pose.scale()),
            to_world: 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{dispatch, f32x4};
    use nearmiss_hierarchy::{Growth, OrientedBox};
    use nearmiss_lanes::wide::{repeated, spread};
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation};
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::*;

    const FAN: usize = 4;

    /// The distance of two boxes by alternating projection, at most ten thousand rounds.
    fn distance(a: &OrientedBox, b: &OrientedBox, pose: &Pose) -> f64 {
        let onto = |of: &OrientedBox, p: [f64; 3]| {
            let centre = Vector3::from(of.centre.map(f64::from));
            let away = Vector3::from(p) - centre;
            let mut foot = centre;
            for k in 0..3 {
                let (axis, half) = (Vector3::from(of.axes[k].map(f64::from)), f64::from(of.half[k]));
                foot += axis * away.dot(&axis).clamp(-half, half);
            }
            <[f64; 3]>::from(foot)
        };
        let (mut x, mut last) = (a.centre.map(f64::from), f64::INFINITY);
        for _ in 0..10_000 {
            let y = pose.apply(onto(b, pose.apply_inverse(x)));
            x = onto(a, y);
            let distance = (Vector3::from(x) - Vector3::from(y)).norm();
            if distance > last - 1e-9 {
                break;
            }
            last = distance;
        }
        last
    }

    /// Growth by these lengths, rounded down to the upper halves of single-precision numbers.
    fn growth(lengths: [f32; 6]) -> Growth {
        bytemuck::cast(lengths.map(|length| u16::try_from(length.to_bits() >> 16).unwrap()))
    }

    /// Four boxes and their growth, one per lane.
    fn four<S: Simd>(simd: S, boxes: &[OrientedBox; FAN], growths: &[Growth; FAN]) -> NodeBounds<f32x4<S>> {
        let lanes = |of: &dyn Fn(usize) -> f32| f32x4::load_array(simd, [of(0), of(1), of(2), of(3)]);
        let length = |lane: usize, k: usize| {
            let halves: [u16; 6] = bytemuck::cast(growths[lane]);
            f32::from_bits(u32::from(halves[k]) << 16)
        };
        NodeBounds {
            centre: [0, 1, 2].map(|k| lanes(&|lane| boxes[lane].centre[k])),
            half: [0, 1, 2].map(|k| lanes(&|lane| boxes[lane].half[k])),
            axes: [0, 1, 2].map(|i| [0, 1, 2].map(|k| lanes(&|lane| boxes[lane].axes[i][k]))),
            low: [0, 1, 2].map(|k| lanes(&|lane| length(lane, k))),
            high: [0, 1, 2].map(|k| lanes(&|lane| length(lane, 3 + k))),
        }
    }

    #[test]
    fn bounds_are_below_distances_and_near_them_by_any_instructions() {
        let rng = &mut rng(81);
        let mut far = [(0.0, 0.0); 2];
        for round in 0..600 {
            let away = [2.0, 4.0, 20.0, 1e7][round % 4];
            let pose = rotation(rng).with_scale([1.0, 0.3][round % 2]).with_translation(point_in(rng, away));
            let mut boxes = || {
                [0; FAN].map(|_| {
                    let turn = rotation(rng);
                    let axis = |k: usize| single(turn.rotation().column(k).into_owned());
                    let flat = [1.0, 0.05][rng.random_range(0..2)];
                    let half = [rng.random_range(0.1..1.0), 0.3, 0.2 * flat];
                    OrientedBox {
                        centre: single(point_in(rng, 1.5).into()),
                        half: single(half.into()),
                        axes: [axis(0), axis(1), axis(2)],
                        reach: 0.1,
                    }
                })
            };
            let (a, b) = (boxes(), boxes());
            let mut growths = || [0; FAN].map(|_| growth([0; 6].map(|_| rng.random_range(0.0..0.2))));
            let (more_a, more_b) = (growths(), growths());
            let limits = Limits { boxes: 0.1, enclosures: -0.2 };
            let found = levels().into_iter().map(|level| {
                let relative_pose = RelativePose::of_centred(&pose);
                let gaps = dispatch!(level, simd => {
                    let (a, b) = (four(simd, &a, &more_a), four(simd, &b, &more_b));
                    relative_pose.gaps(simd, &a.map(spread), &relative_pose.moved(&b).map(repeated), limits)
                });
                (gaps, relative_pose)
            });
            let found: Vec<_> = found.collect();
            let (gaps, relative_pose) = &found[0];
            assert!(found.iter().all(|other| other.0 == *gaps), "every level: {found:?}");
            for lane in 0..LANES {
                let (boxes, enclosures) = (gaps.boxes[lane], gaps.enclosures[lane]);
                let is_near = boxes < limits.boxes || enclosures < limits.enclosures;
                assert_eq!(gaps.near >> lane & 1 == 1, is_near, "round {round}, lane {lane}");
                let (i, j) = (lane / FAN, lane % FAN);
                let grown = distance(&more_a[i].of(&a[i]), &more_b[j].of(&b[j]), &pose);
                let own = distance(&a[i], &b[j], &pose);
                for ((gap, expected), far) in [(boxes, own), (enclosures, grown)].into_iter().zip(&mut far) {
                    let bound = relative_pose.bound(gap);
                    let what = format!("{bound} for {expected}, round {round}, lane {lane}");
                    assert!(bound <= expected + relative_pose.slack, "{what}");
                    if expected > 0.01 {
                        *far = (far.0 + 1.0, far.1 + bound / expected);
                    }
                }
            }
        }
        let [boxes, enclosures] = far.map(|(count, share)| (count, share / count));
        assert!(boxes.0 > 5000.0 && boxes.1 > 0.97, "{boxes:?}");
        assert!(enclosures.0 > 5000.0 && enclosures.1 > 0.9, "{enclosures:?}");
    }
}
