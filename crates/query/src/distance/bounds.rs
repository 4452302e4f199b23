//! Lower bounds of how far oriented boxes in relative motion are apart, four of either scan at a time.
//!
//! Along the face normals alone boxes may come out two thirds nearer than they are: enough to tell whether they touch, too little to tell
//! how far off they are. So a box's centre is projected onto the other box and back (Cheney & Goldstein, "Proximity maps for
//! convex sets", Proc. AMS 10, 1959), and both are measured along the line between the two feet. Any line gives a lower bound; that
//! between the nearest places gives the distance.
//!
//! Single precision cannot tell the near parts of scans from their far ones where these are a million times as far from each other as
//! they are large. So the vector o between the centres of the two scans stays in double precision, and what is computed here is by how
//! much a pair of boxes is nearer or further than |o|: along a unit vector u, u·o = |o| (1 − |u − o/|o||² / 2), of which the
//! second part is small where |o| is great. Rounding is then a share of the scans' sizes, not of their distance.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x4, f32x16};
use nearmiss_geometry::Pose;
use nearmiss_geometry::nalgebra::{Matrix3, Vector3};
use nearmiss_hierarchy::{OrientedBox, SLACK};

use crate::view::ScanView;

/// Projections back and forth: after one of them the descent visits 0.5 % more pairs than with exact distances.
const ROUNDS: u32 = 1;

/// So many nodes of either scan are compared at once.
pub(crate) const FAN: usize = 4;

/// Some ten roundings of double precision.
const DOUBLE_ROUNDING: f64 = 2e-15;

/// The motion of b's stored frame into a's.
#[derive(Debug, Clone)]
pub(crate) struct Motion {
    level: Level,
    rotation: [[f32; 3]; 3],
    scale: f32,
    /// Where a place of b lies, less o.
    shift: [f32; 3],
    /// From the centre of a to that of b.
    offset: [f32; 3],
    direction: [f32; 3],
    distance: f64,
    /// What rounding may add to a bound, in a's stored frame.
    slack: f64,
    /// Length in the world of a unit of that.
    to_world: f64,
}

#[expect(clippy::cast_possible_truncation, reason = "slack covers the rounding")]
fn single(v: Vector3<f64>) -> [f32; 3] {
    v.map(|c| c as f32).into()
}

impl Motion {
    /// That of two views, whose relative pose is `pose`.
    #[expect(clippy::cast_possible_truncation, reason = "slack covers the rounding")]
    pub(crate) fn new(level: Level, [a, b]: [&ScanView<'_>; 2], pose: &Pose) -> Self {
        let [root_a, root_b] = [a, b].map(|view| &view.slices().boxes[0]);
        let [ca, cb] = [root_a, root_b].map(|root| Vector3::from(root.centre.map(f64::from)));
        let turned = pose.scale() * (pose.rotation() * cb);
        let offset = turned + Vector3::from(pose.translation()) - ca;
        let distance = offset.norm();
        let extent =
            ca.norm() + f64::from(root_a.radius()) + pose.scale() * (cb.norm() + f64::from(root_b.radius()));
        let to_world = a.placed().scale();
        // Places are told in the world, where both scans may be far from the origin, and rotations are such to rounding only.
        let far: f64 = [a, b].map(|view| Vector3::from(view.placed().translation()).norm()).iter().sum();
        let skew = [a, b].map(|view| {
            let rotation = view.placed().rotation();
            (rotation.tr_mul(rotation) - Matrix3::identity()).amax()
        });
        let of_doubles = (DOUBLE_ROUNDING + 4.0 * skew[0].max(skew[1])) * (extent + distance)
            + DOUBLE_ROUNDING * far / to_world;
        let row = |i: usize| single(pose.rotation().row(i).transpose());
        Self {
            level,
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

    /// The instructions that bounds are computed by: none depends on it.
    pub(crate) fn level(&self) -> Level {
        self.level
    }

    /// What a bound in a's stored frame proves of a distance in the world.
    pub(crate) fn proven(&self, bound: f64) -> f64 {
        ((bound - self.slack) * self.to_world * (1.0 - 4.0 * DOUBLE_ROUNDING)).max(0.0)
    }

    /// A bound in a's stored frame such that nothing is nearer than `distance` in the world to which a greater one belongs.
    pub(crate) fn bound_of(&self, distance: f64) -> f64 {
        distance / self.to_world * (1.0 + 4.0 * DOUBLE_ROUNDING) + self.slack
    }

    /// Lower bounds of the distances, in a's stored frame, of the boxes of `a` from those of `b`: that of `a[i]` and `b[j]` stands at
    /// 4 i + j. Zero where they may overlap, and for boxes that are no numbers.
    #[inline]
    pub(crate) fn distances(&self, a: [&OrientedBox; FAN], b: [&OrientedBox; FAN]) -> [f64; FAN * FAN] {
        let beyond = dispatch!(self.level, simd => simd.vectorize(
            #[inline(always)]
            || self.beyond(simd, a, b),
        ));
        let mut bounds = [0.0; FAN * FAN];
        for (bound, beyond) in bounds.iter_mut().zip(beyond) {
            let own = self.distance + f64::from(beyond);
            *bound = if own > 0.0 { own } else { 0.0 };
        }
        bounds
    }

    /// By how much the boxes are further apart than the centres of the scans.
    #[inline(always)]
    fn beyond<S: Simd>(&self, simd: S, a: [&OrientedBox; FAN], b: [&OrientedBox; FAN]) -> [f32; FAN * FAN] {
        let (a, b) = (Lanes::new(simd, a, false), Lanes::new(simd, b, true));
        let mut between = self.turned(&b.centre);
        let mut off = between;
        for k in 0..3 {
            between[k] = between[k] * self.scale + self.shift[k] - a.centre[k];
            off[k] = between[k] + self.offset[k];
        }
        let axes_b = [self.turned(&b.axes[0]), self.turned(&b.axes[1]), self.turned(&b.axes[2])];
        let half_b = [b.half[0] * self.scale, b.half[1] * self.scale, b.half[2] * self.scale];
        let zero = f32x16::simd_from(simd, 0.0);
        // All that feet need in terms of the axes: their cosines, and how far apart the centres are along them.
        let mut cosines = [[zero; 3]; 3];
        let (mut along_a, mut along_b) = ([zero; 3], [zero; 3]);
        for i in 0..3 {
            along_a[i] = product(&a.axes[i], &off);
            along_b[i] = product(&axes_b[i], &off);
            for j in 0..3 {
                cosines[i][j] = product(&a.axes[i], &axes_b[j]);
            }
        }
        // From the centre of b on.
        let mut seen = along_a;
        let mut foot_a = within(&seen, &a.half);
        for _ in 0..ROUNDS {
            let mut place = along_b;
            for j in 0..3 {
                place[j] = cosines[0][j] * foot_a[0] + cosines[1][j] * foot_a[1] + cosines[2][j] * foot_a[2]
                    - place[j];
            }
            let foot_b = within(&place, &half_b);
            for i in 0..3 {
                seen[i] = along_a[i] + product(&cosines[i], &foot_b);
            }
            foot_a = within(&seen, &a.half);
        }
        let mut line = [zero; 3];
        for i in 0..3 {
            let apart = seen[i] - foot_a[i];
            for k in 0..3 {
                line[k] += a.axes[i][k] * apart;
            }
        }
        let length = product(&line, &line).sqrt();
        for k in 0..3 {
            line[k] /= length;
        }
        let turn = [line[0] - self.direction[0], line[1] - self.direction[1], line[2] - self.direction[2]];
        #[expect(clippy::cast_possible_truncation, reason = "slack covers the rounding")]
        let mut beyond = product(&line, &between) - product(&turn, &turn) * (0.5 * self.distance) as f32;
        for k in 0..3 {
            beyond -= a.half[k] * product(&a.axes[k], &line).abs();
            beyond -= half_b[k] * product(&axes_b[k], &line).abs();
        }
        beyond.to_array()
    }

    #[inline(always)]
    fn turned<S: Simd>(&self, v: &[f32x16<S>; 3]) -> [f32x16<S>; 3] {
        let [x, y, z] = self.rotation;
        [
            v[0] * x[0] + v[1] * x[1] + v[2] * x[2],
            v[0] * y[0] + v[1] * y[1] + v[2] * y[2],
            v[0] * z[0] + v[1] * z[1] + v[2] * z[2],
        ]
    }
}

/// Sixteen boxes, a lane each.
struct Lanes<S: Simd> {
    centre: [f32x16<S>; 3],
    half: [f32x16<S>; 3],
    axes: [[f32x16<S>; 3]; 3],
}

impl<S: Simd> Lanes<S> {
    /// Four boxes: the first four times, then the second, and so on, or one after the other, four times. No closures: they
    /// would not be compiled for the instruction set.
    #[inline(always)]
    fn new(simd: S, [p, q, r, s]: [&OrientedBox; FAN], in_turn: bool) -> Self {
        let zero = f32x16::simd_from(simd, 0.0);
        let mut lanes = Self { centre: [zero; 3], half: [zero; 3], axes: [[zero; 3]; 3] };
        for k in 0..3 {
            let centre = [p.centre[k], q.centre[k], r.centre[k], s.centre[k]];
            lanes.centre[k] = four_times(simd, centre, in_turn);
            lanes.half[k] = four_times(simd, [p.half[k], q.half[k], r.half[k], s.half[k]], in_turn);
            for j in 0..3 {
                let axis = [p.axes[k][j], q.axes[k][j], r.axes[k][j], s.axes[k][j]];
                lanes.axes[k][j] = four_times(simd, axis, in_turn);
            }
        }
        lanes
    }
}

#[inline(always)]
fn four_times<S: Simd>(simd: S, values: [f32; FAN], in_turn: bool) -> f32x16<S> {
    if in_turn {
        let row = f32x4::simd_from(simd, values);
        let twice = row.combine(row);
        return twice.combine(twice);
    }
    let [p, q, r, s] = values;
    let (p, q) = (f32x4::simd_from(simd, p), f32x4::simd_from(simd, q));
    let (r, s) = (f32x4::simd_from(simd, r), f32x4::simd_from(simd, s));
    p.combine(q).combine(r.combine(s))
}

#[inline(always)]
fn product<S: Simd>(a: &[f32x16<S>; 3], b: &[f32x16<S>; 3]) -> f32x16<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The place of a box nearest to `place`, both along its axes.
#[inline(always)]
fn within<S: Simd>(place: &[f32x16<S>; 3], half: &[f32x16<S>; 3]) -> [f32x16<S>; 3] {
    [
        place[0].min(half[0]).max(-half[0]),
        place[1].min(half[1]).max(-half[1]),
        place[2].min(half[2]).max(-half[2]),
    ]
}

#[cfg(test)]
mod tests {
    use nearmiss_testdata::arbitrary::{point_in, rng, rotation};
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::*;

    /// The distance of two boxes: projections to and fro, ten thousand at most.
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

    /// The motion by `pose` between scans about their origins that reach as far as 4.
    fn motion(level: Level, pose: &Pose) -> Motion {
        let offset = Vector3::from(pose.translation());
        let row = |i: usize| single(pose.rotation().row(i).transpose());
        Motion {
            level,
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

    #[test]
    fn bounds_are_below_distances_and_near_them_by_any_instructions() {
        let rng = &mut rng(81);
        let (mut apart, mut share, mut worst) = (0.0, 0.0, 1.0_f64);
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
            let found = levels().into_iter().map(|level| {
                let motion = motion(level, &pose);
                (motion.distances(a.each_ref(), b.each_ref()), motion.slack)
            });
            let found: Vec<_> = found.collect();
            let (bounds, slack) = found[0];
            assert!(found.iter().all(|other| other.0 == bounds), "every level: {found:?}");
            for (lane, bound) in bounds.into_iter().enumerate() {
                let expected = distance(&a[lane / FAN], &b[lane % FAN], &pose);
                assert!(bound <= expected + slack, "{bound} for {expected}, round {round}, lane {lane}");
                if expected > 0.01 {
                    apart += 1.0;
                    share += bound / expected;
                    worst = worst.min(bound / expected);
                }
            }
        }
        assert!(apart > 5000.0 && share / apart > 0.97, "{share} of {apart}, at worst {worst}");
    }
}
