//! The discs and balls that a shape may touch, each with an upper bound on the depth there.

use std::ops::ControlFlow;

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, mask32x16};
use nearmiss_hierarchy::{LeafBlock, THICKNESS};
use nearmiss_lanes::wide::{Bits, along, bits, product};

use crate::ask::options::Semantics;
use crate::solid::candidates::{CandidateBlock, CandidateBlocks, CandidateLanes};
use crate::solid::depths::LaneDiscs;
use crate::solid::descent::{LeafSearch, Near};
use crate::solid::elements::{Element, Elements, Measured};
use crate::solid::sides::Sides;

/// Two contacts of a manifold are at least this far apart, in local radii.
pub(crate) const SPREAD: f32 = 0.5;

/// The error of a component of a stored normal.
const NORMAL: f32 = 1e-4;

/// The search for candidates.
pub(crate) struct Gather<'s, 'a> {
    pub(crate) near: Near<'s, 'a>,
    pub(crate) sides: &'s Sides,
    pub(crate) found: &'s mut CandidateBlocks,
}

/// The points of a block of a leaf that may touch, and on which side of them the shape is, as bits.
struct Turned {
    lanes: u32,
    /// The lanes whose disc is turned, and those that the shape is behind of.
    turned: u32,
    behind: u32,
    /// The lanes in which single precision does not tell the side.
    unsure: u32,
}

impl Turned {
    /// Decides in double precision where it has to.
    fn settle(&mut self, elements: &Elements<'_>, sides: &Sides, first: usize) {
        if elements.semantics == Semantics::Surface {
            for lane in Bits(self.lanes).filter(|lane| elements.is_doubtful(first + lane)) {
                self.lanes &= !(1 << lane);
            }
        }
        let open = if sides.has_contacts() { self.lanes } else { self.lanes & self.unsure };
        for lane in Bits(open) {
            let i = first + lane;
            if let Element::Disc(disc) = elements.element(i) {
                let (sign, is_behind) = sides.of(&disc, f64::from(elements.arrays.radii[i]));
                let set = |bits: u32, is_set: bool| bits & !(1 << lane) | u32::from(is_set) << lane;
                (self.turned, self.behind) = (set(self.turned, sign < 0.0), set(self.behind, is_behind));
            }
        }
    }
}

impl Gather<'_, '_> {
    #[inline(always)]
    fn block<S: Simd>(&mut self, simd: S, leaf: usize, part: (&LeafBlock, usize, usize)) {
        let (block, first, count) = part;
        let Near { elements, solid, lane_box, most, .. } = self.near;
        let parts = elements.parts(simd, leaf, part, false);
        let Measured { distances, tilt, .. } = Measured::new(simd, &lane_box, block);
        let gaps = distances.parts(simd, parts.radii, parts.radii * THICKNESS, parts.discs) - tilt;
        let lanes = Elements::lanes_within(simd, (&gaps.to_array(), count), most);
        if lanes == 0 {
            return;
        }
        elements.arrays.prefetch_points(first);
        let (positions, normals) = (block.positions(simd), block.normals(simd));
        let [cx, cy, cz] = lane_box.centre;
        let d = [positions[0] - cx, positions[1] - cy, positions[2] - cz];
        #[expect(clippy::cast_possible_truncation, reason = "near the plane the side is decided in double")]
        let (inside, radius) = (
            [0, 1, 2].map(|k| (self.sides.inside[k] - solid.centre[k]) as f32),
            (solid.radius as f32).next_up(),
        );
        let heights = along(normals, inside) - product(d, normals);
        let none = f32x16::splat(simd, f32::INFINITY);
        // The point that tells the side may be far outside the shape. A ball has no sides.
        let doubt = tilt + NORMAL * inside.iter().map(|x| x.abs()).sum::<f32>();
        let discs = lanes & bits(parts.discs);
        let (is_sure, is_below): (mask32x16<S>, mask32x16<S>) =
            (heights.abs().simd_gt(doubt), heights.simd_lt(0.0));
        let (unsure, below) = (discs & !bits(is_sure), discs & bits(is_below));
        let (turned, behind) = if self.sides.is_oriented { (0, below) } else { (below, 0) };
        let mut turned = Turned { lanes, turned, behind, unsure };
        turned.settle(elements, self.sides, first);
        let is_turned = mask32x16::from_bitmask(simd, u64::from(turned.turned));
        let [x, y, z] = normals;
        let out = [is_turned.select(-x, x), is_turned.select(-y, y), is_turned.select(-z, z)];
        let of_discs = LaneDiscs { centres: d, out, radii: parts.radii, slack: tilt };
        let of_discs = lane_box.depths(simd, &of_discs, radius);
        let is_in: mask32x16<S> = distances.from_point.simd_le(tilt);
        let of_balls = is_in.select(none, parts.radii + radius - distances.from_point + tilt);
        let depths = parts.discs.select(of_discs, of_balls);
        let borders = elements.borders(first, turned.lanes & bits(parts.discs));
        let is_border = mask32x16::from_bitmask(simd, u64::from(borders));
        // Beside a border, the depth is along the way to the border.
        let depths = is_border.select(depths.max(radius - gaps), depths);
        #[expect(clippy::cast_possible_truncation, reason = "depths are rounded more")]
        let least = (parts.radii * -THICKNESS).min(-elements.margin as f32);
        let is_missed: mask32x16<S> = depths.simd_lt(least);
        let missed = turned.lanes & bits(is_missed);
        let Turned { lanes, turned, behind, .. } = turned;
        let lanes = CandidateLanes { found: lanes & !missed, missed, turned, behind, borders, discs };
        let apart = elements.local_radii(simd, first, count) * SPREAD;
        let centres = elements.positions(first, count);
        self.found.push(CandidateBlock::new(first, lanes, (centres, out), [depths, apart]));
    }
}

impl<'s, 'a> LeafSearch<'s, 'a> for Gather<'s, 'a> {
    #[inline(always)]
    fn near(&self) -> &Near<'s, 'a> {
        &self.near
    }

    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, number: usize, _: f32) -> ControlFlow<()> {
        let elements = self.near.elements;
        for part in elements.arrays.leaves.blocks(number) {
            self.block(simd, number, part);
        }
        ControlFlow::Continue(())
    }
}
