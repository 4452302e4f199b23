//! The places of a shape at up to eight points at once.

use fearless_simd::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f64x8};
use nearmiss_hierarchy::PointKind;
use nearmiss_lanes::lane::dot;
use nearmiss_lanes::wide::Bits;

use crate::leaf::disc_triangle::FlatDisc;
use crate::solid::core::Solid;
use crate::solid::discs::{Discs, Over};
use crate::solid::elements::Elements;
use crate::solid::place::{Deepest, Place, is_closed, over_discs, place_at, within};

/// The number of places that are computed at once.
pub(crate) const LANES: usize = 8;

/// From so many discs on, lanes are faster than one disc after the other: eight in lanes take about as long
/// as two or three alone.
const FEWEST: usize = 3;

/// Eight discs.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct DiscBlock {
    centres: [[f64; LANES]; 3],
    /// The stored normals, in the direction in which the shape moves out.
    normals: [[f64; LANES]; 3],
    radii: [f64; LANES],
}

/// The deepest places of a shape over eight discs.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct OverBlock {
    points: [[f64; LANES]; 3],
    /// The unit normals of the discs.
    out: [[f64; LANES]; 3],
    depths: [f64; LANES],
    apart: [f64; LANES],
    /// The lanes of the discs that the shape is over, as bits, and of those that the core is beside.
    over: u32,
    beside: u32,
}

/// Computes the places of a shape at up to eight points, which are given with the signs of their normals.
/// Calls `each` with the number of a point and its place. A place has the same bits as that of [`place_at`].
pub(crate) fn places_at(
    elements: &Elements<'_>,
    solid: &Solid<'_>,
    level: Level,
    points: &[(usize, f64)],
    mut each: impl FnMut(usize, Option<Place>),
) {
    let zeros = [[0.0; LANES]; 3];
    let mut block = DiscBlock { centres: zeros, normals: zeros, radii: [0.0; LANES] };
    let (mut discs, mut first) = (0, None);
    let in_lanes = if is_closed(solid) { points } else { &[] };
    for (lane, &(i, sign)) in in_lanes.iter().enumerate() {
        if elements.is_disc(i) && elements.placed.scan().kind(i) != PointKind::Edge {
            block.put(lane, elements, (i, sign));
            discs |= 1_u32 << lane;
            first.get_or_insert((i, sign));
        }
    }
    let found = first.filter(|_| discs.count_ones() as usize >= FEWEST).map(|disc| {
        for lane in Bits(!discs & ((1 << LANES) - 1)) {
            block.put(lane, elements, disc);
        }
        dispatch!(level, simd => simd.vectorize(
            #[inline(always)]
            || block.over(simd, solid),
        ))
    });
    for (lane, &(i, sign)) in points.iter().enumerate() {
        let place = match &found {
            Some(found) if discs >> lane & 1 == 1 => found.place(elements, solid, (lane, i)),
            _ => place_at(elements, solid, i, sign),
        };
        each(lane, place);
    }
}

impl DiscBlock {
    fn put(&mut self, lane: usize, elements: &Elements<'_>, (i, sign): (usize, f64)) {
        let (centre, normal) = (elements.arrays.position(i), elements.arrays.normals[i]);
        for k in 0..3 {
            self.centres[k][lane] = f64::from(centre[k]);
            self.normals[k][lane] = f64::from(normal[k]) * sign;
        }
        self.radii[lane] = f64::from(elements.arrays.discs.get(i));
    }

    #[inline(always)]
    fn over<S: Simd>(&self, simd: S, solid: &Solid<'_>) -> OverBlock {
        let load = |row: &[f64; LANES]| f64x8::load_array_ref(simd, row);
        let [x, y, z] = &self.normals;
        let [x, y, z] = [load(x), load(y), load(z)];
        let length = dot([x, y, z], [x, y, z]).sqrt();
        let out = [x / length, y / length, z / length];
        let [a, b, c] = &self.centres;
        let discs = Discs { centre: [load(a), load(b), load(c)], out, radius: load(&self.radii) };
        let Over { is_over, on_disc, depth, is_beside, apart } = over_discs(solid, &discs);
        let [a, b, c] = on_disc;
        let [x, y, z] = out;
        #[expect(clippy::cast_possible_truncation, reason = "eight bits")]
        OverBlock {
            points: [a.to_array(), b.to_array(), c.to_array()],
            out: [x.to_array(), y.to_array(), z.to_array()],
            depths: depth.to_array(),
            apart: apart.to_array(),
            over: is_over.to_bitmask() as u32,
            beside: is_beside.to_bitmask() as u32,
        }
    }
}

impl OverBlock {
    /// The place in a lane, which is that of point `i`.
    fn place(&self, elements: &Elements<'_>, solid: &Solid<'_>, (lane, i): (usize, usize)) -> Option<Place> {
        if self.over >> lane & 1 == 0 {
            return None;
        }
        let [point, normal] = [&self.points, &self.out].map(|rows| [0, 1, 2].map(|k| rows[k][lane]).into());
        let place = Place { point, normal, depth: self.depths[lane] };
        let is_beside = self.beside >> lane & 1 == 1;
        let found = Deepest { place, is_beside, apart: self.apart[lane] };
        let radius = f64::from(elements.arrays.discs.get(i));
        let disc = FlatDisc { centre: elements.position(i), normal, radius };
        let most = solid.radius + elements.margin.max(disc.thickness());
        within(solid, &disc, found, (most, elements.margin))
    }
}
