//! Crossings of the tangent discs of two leaves: sixteen discs of a against sixteen of b, in b's
//! frame.
//!
//! Most discs of a leaf are too far from the other's box, and most of the rest are near only a few
//! discs there. So all points of a are moved into b's frame at once and compared with the box. Each
//! remaining point is compared with all points of b, whose positions are already in lanes. Normals
//! are compared only for near points.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16};
use nearmiss_hierarchy::{LeafBlock, Leaves, Relative, THICKNESS};
use nearmiss_lanes::wide::{bits, product, squared};

use crate::leaf::crossing::{Disc, crossing};

const WIDTH: usize = LeafBlock::WIDTH;

/// Points of a leaf as tangent discs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Discs<'a> {
    pub(crate) block: &'a LeafBlock,
    /// The number of lanes in use, from the first.
    pub(crate) count: usize,
}

impl<'a> Discs<'a> {
    /// The block that contains point `i`, and the point's lane.
    pub(crate) fn about(leaves: &Leaves<'a>, i: usize) -> (Self, usize) {
        let (block, first, count) = leaves.block_with(i);
        (Self { block, count }, i - first)
    }

    /// The disc in a lane.
    pub(crate) fn disc(&self, lane: usize) -> Disc {
        let block = self.block;
        Disc { centre: block.position(lane), normal: block.normal(lane), radius: block.disc(lane) }
    }

    /// The lanes in use, as a bit mask.
    #[inline]
    fn lanes(&self) -> u32 {
        (1 << self.count) - 1
    }
}

/// Discs of a and b, and their relative pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LeafPair<'a> {
    pub(crate) a: Discs<'a>,
    pub(crate) b: Discs<'a>,
    /// The radii of balls about the points of a, in addition to their discs.
    pub(crate) balls: Option<[f32; WIDTH]>,
    /// The amount by which the discs and balls of a are enlarged, in a's frame.
    pub(crate) reach: f32,
    pub(crate) relative: &'a Relative,
}

/// A point of a that reaches b's box, and the discs of b that cross its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Near {
    pub(crate) lane: usize,
    /// Lanes of b, as a bit mask.
    pub(crate) crossings: u32,
}

impl LeafPair<'_> {
    /// Returns the first point among `lanes`, a bit mask, that crosses a disc or, if `each`, that
    /// reaches the box at all. The result does not depend on `level`.
    #[inline]
    pub(crate) fn next(&self, level: Level, lanes: u32, each: bool) -> Option<Near> {
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || self.next_by(simd, lanes, each),
        ))
    }

    /// Returns `true` if the discs in two lanes cross, with the same result as [`Self::next`].
    pub(crate) fn cross_alone(&self, lane_a: usize, lane_b: usize) -> bool {
        let disc = self.a.disc(lane_a);
        let moved = Disc {
            centre: self.relative.point_back(disc.centre),
            normal: self.relative.direction_back(disc.normal),
            radius: disc.radius * self.relative.scale_back(),
        };
        crossing(&moved, &self.b.disc(lane_b))
    }

    #[inline(always)]
    fn next_by<S: Simd>(&self, simd: S, lanes: u32, each: bool) -> Option<Near> {
        let centres = self.relative.points_back(&self.a.block.positions(simd));
        let mut candidates = self.near_box(simd, &centres) & self.a.lanes() & lanes;
        if candidates == 0 {
            return None;
        }
        let [x, y, z] = [centres[0].to_array(), centres[1].to_array(), centres[2].to_array()];
        let per_scale = self.relative.scale_back();
        let [px, py, pz] = self.b.block.positions(simd);
        let radii = self.b.block.discs(simd);
        // Branches on nearness are hard to predict, so all lanes are tested before any branch.
        let mut nears = [0_u32; WIDTH];
        let mut left = candidates;
        while left != 0 {
            let lane = left.trailing_zeros() as usize & (WIDTH - 1);
            let d = [px - x[lane], py - y[lane], pz - z[lane]];
            let reach = radii + self.a.block.disc(lane) * per_scale;
            let near: mask32x16<S> = squared(d).simd_le(reach * reach);
            nears[lane] = bits(near) & self.b.lanes();
            candidates &= !(u32::from(nears[lane] == 0 && !each) << lane);
            left &= left - 1;
        }
        while candidates != 0 {
            let lane = candidates.trailing_zeros() as usize & (WIDTH - 1);
            candidates &= candidates - 1;
            let mut crossings = 0;
            if nears[lane] != 0 {
                let d = [-(px - x[lane]), -(py - y[lane]), -(pz - z[lane])];
                let radius = self.a.block.disc(lane) * per_scale;
                let normal = self.relative.direction_back(self.a.block.normal(lane));
                let of_b = self.b.block.normals(simd);
                let crossing = cross(simd, (&d, squared(d)), (normal, radius), (&of_b, radii));
                crossings = nears[lane] & bits(crossing);
            }
            if each || crossings != 0 {
                return Some(Near { lane, crossings });
            }
        }
        None
    }

    /// The points of a, at `centres` in b's frame, that reach b's box.
    #[inline(always)]
    fn near_box<S: Simd>(&self, simd: S, centres: &[f32x16<S>; 3]) -> u32 {
        let mut own = self.a.block.discs(simd);
        if let Some(balls) = &self.balls {
            own = own.max(f32x16::load_array_ref(simd, balls));
        }
        near_box(simd, self.b.block, centres, (own + self.reach) * self.relative.scale_back())
    }
}

/// The lanes of balls, given in a leaf's frame, that reach its box, as a bit mask.
#[inline(always)]
pub(crate) fn near_box<S: Simd>(
    simd: S,
    leaf: &LeafBlock,
    centres: &[f32x16<S>; 3],
    radii: f32x16<S>,
) -> u32 {
    let LeafBlock { centre, half, axes, .. } = leaf;
    let d = [centres[0] - centre[0], centres[1] - centre[1], centres[2] - centre[2]];
    let mut beyond_sq = f32x16::splat(simd, 0.0);
    for k in 0..3 {
        let [ax, ay, az] = axes[k];
        let along = (d[0] * ax + d[1] * ay + d[2] * az).abs();
        let beyond = (along - half[k]).max(0.0);
        beyond_sq += beyond * beyond;
    }
    bits(beyond_sq.simd_le(radii * radii))
}

/// The test of [`crossing`](crate::crossing()) in lanes: a disc of a against discs of b whose
/// centres are `d` away.
#[inline(always)]
fn cross<S: Simd>(
    simd: S,
    (d, d_sq): (&[f32x16<S>; 3], f32x16<S>),
    ([nx, ny, nz], radius): ([f32; 3], f32),
    (normals, radii): (&[f32x16<S>; 3], f32x16<S>),
) -> mask32x16<S> {
    let zero = f32x16::simd_from(simd, 0.0);
    let u = d[0] * nx + d[1] * ny + d[2] * nz;
    let v = product(*d, *normals);
    let c = normals[0] * nx + normals[1] * ny + normals[2] * nz;
    let g = -(c * c) + 1.0;
    let chord_a = g * (radius * radius) - v * v;
    let chord_b = radii * radii * g - u * u;
    let apart = d_sq * g - (u * u + v * v - c * 2.0 * u * v);
    let both = chord_a.max(zero).sqrt() * chord_b.max(zero).sqrt();
    let chords: mask32x16<S> = chord_a.min(chord_b).simd_ge(zero);
    let meet: mask32x16<S> = apart.simd_le(chord_a + chord_b + both * 2.0);
    let thin: mask32x16<S> = u.abs().max(v.abs()).simd_le(radii.min(radius) * THICKNESS);
    (chords & meet) | thin
}

#[cfg(test)]
mod tests {
    use nearmiss_geometry::Pose;
    use nearmiss_hierarchy::OrientedBox;
    use nearmiss_testdata::arbitrary::{point_in, rng, unit_vector};
    use nearmiss_testdata::instructions::levels;
    use rand::RngExt;

    use super::*;

    /// Some discs about the origin, in one block.
    struct Leaf {
        bounds: OrientedBox,
        block: LeafBlock,
        count: usize,
    }

    #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
    fn single(v: [f64; 3]) -> [f32; 3] {
        v.map(|c| c as f32)
    }

    impl Leaf {
        fn new(rng: &mut impl rand::Rng, count: usize, flat: bool) -> Self {
            let bounds = OrientedBox {
                centre: [0.0; 3],
                half: [0.9, 0.8, if flat { 0.05 } else { 0.7 }],
                axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                reach: 1.0,
            };
            let mut block = LeafBlock::new(&bounds);
            for (lane, number) in (0..16_u8).enumerate().take(count) {
                let [x, y, z] = single(point_in(rng, 1.0));
                let position = [x, y, if flat { 0.01 * z } else { z }];
                let normal = if flat { [0.0, 0.0, 1.0] } else { single(unit_vector(rng)) };
                block.set(lane, position, normal, 0.2 + 0.02 * f32::from(number));
            }
            Self { bounds, block, count }
        }

        fn discs(&self) -> Discs<'_> {
            Discs { block: &self.block, count: self.count }
        }
    }

    /// The points that reach the box and their crossings, computed one by one.
    fn one_by_one(test: &LeafPair<'_>, a: &Leaf, b: &Leaf) -> Vec<Near> {
        let back = test.relative.scale_back();
        let lanes = |leaf: &Leaf| 0..leaf.count;
        let [tx, ty, tz] = test.relative.point([0.0; 3]);
        let near = |lane: usize| {
            let disc = a.discs().disc(lane);
            let [x, y, z] = disc.centre;
            let moved = Disc {
                centre: test.relative.direction_back([x - tx, y - ty, z - tz]).map(|c| c * back),
                normal: test.relative.direction_back(disc.normal),
                radius: disc.radius * back,
            };
            let ball = test.balls.map_or(0.0, |balls| balls[lane]);
            let reach = (a.block.disc(lane).max(ball) + test.reach) * back;
            let crosses = |&j: &usize| crossing(&moved, &b.discs().disc(j));
            let crossings = lanes(b).filter(crosses).fold(0, |bits, j| bits | 1 << j);
            (b.bounds.distance_sq(moved.centre) <= reach * reach).then_some(Near { lane, crossings })
        };
        lanes(a).filter_map(near).collect()
    }

    #[test]
    fn lanes_find_what_one_by_one_is_found() {
        let rng = &mut rng(17);
        let (mut reached, mut crossed, mut missed) = (0, 0, 0);
        for round in 0..4000_usize {
            let flat = round % 3 == 0;
            let (a, b) = (Leaf::new(rng, 1 + round % 16, flat), Leaf::new(rng, 1 + (round / 16) % 16, flat));
            let axis = unit_vector(rng);
            let angle = if flat { 1e-3 } else { 2.0 };
            let scale = [1.0, 0.5, 3.0][round % 3];
            let shift = point_in(rng, if flat { 0.2 } else { 2.5 });
            let pose = Pose::from_axis_angle(axis, angle).with_scale(scale).with_translation(shift);
            let relative = Relative::new(&pose, 8.0);
            let test = LeafPair {
                a: a.discs(),
                b: b.discs(),
                balls: (round % 2 == 0).then(|| std::array::from_fn(|_| rng.random_range(0.0..0.5))),
                reach: 0.01,
                relative: &relative,
            };
            let expected = one_by_one(&test, &a, &b);
            for level in levels() {
                for each in [true, false] {
                    let (mut found, mut lanes) = (Vec::new(), u32::MAX);
                    while let Some(near) = test.next(level, lanes, each) {
                        lanes = u32::MAX << 1 << near.lane;
                        found.push(near);
                    }
                    let wanted = expected.iter().filter(|near| each || near.crossings != 0);
                    assert!(found.iter().eq(wanted), "round {round}, {level:?}: {found:?} for {expected:?}");
                }
            }
            for near in &expected {
                let alone = (0..b.count).filter(|&j| test.cross_alone(near.lane, j));
                assert_eq!(alone.fold(0, |bits, j| bits | 1 << j), near.crossings, "round {round}, {near:?}");
            }
            reached += expected.len();
            crossed += expected.iter().filter(|near| near.crossings != 0).count();
            missed += a.count - expected.len();
        }
        assert!(reached > 5000 && crossed > 1000 && missed > 5000, "{reached} {crossed} {missed}");
    }
}
