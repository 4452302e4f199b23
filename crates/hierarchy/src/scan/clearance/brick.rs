//! Bricks: the places of a cube near the obstacle.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, i32x16, mask32x16};
use nearmiss_lanes::vector::{dot, sub};

use crate::bounds::boxes::OrientedBox;
use crate::point::kind::{SLAB, THICKNESS};
use crate::point::leaf_block::WIDTH;
use crate::scan::arrays::ScanArrays;
use crate::scan::clearance::direction::Direction;

/// The number of places along each edge of a cube.
pub(crate) const SIDE: usize = 3;

/// The number of places in a brick.
const PLACES: usize = SIDE * SIDE * SIDE;

/// The number of vectors of places; lanes after the last place repeat it.
const VECTORS: usize = PLACES.div_ceil(WIDTH);

/// The maximum number of leaves that a brick lists: as many as fill a line of the cache.
pub(crate) const MOST_LEAVES: usize = 9;

/// The entry after the last leaf.
const NO_LEAF: u32 = u32::MAX;

/// The code of a place for which no point is named.
const NO_POINT: u8 = u8::MAX;

/// The places of a cube, and the leaves near it. Two lines of the cache, the first of which decides most
/// questions.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(128))]
pub(crate) struct Brick {
    /// The distances of the places from discs and balls, in steps.
    discs: [u8; PLACES],
    /// The directions of the places from what is nearest.
    directions: [Direction; PLACES],
    /// The maximum by which the obstacle is nearer, in steps.
    nearer: u8,
    /// All leaves that are not listed are at least this far from the centre of the cube, in steps.
    pub(crate) listed: u8,
    leaves: [u32; MOST_LEAVES],
    /// The points that are nearest to the places: the place of a leaf in the list, times 16, and the number
    /// in the leaf.
    nearest: [u8; PLACES],
}

impl Brick {
    /// Returns the distances of a place in steps, from discs and balls and from the obstacle.
    #[inline(always)]
    pub(crate) fn distances(&self, place: usize) -> [i32; 2] {
        let discs = i32::from(self.discs[place]);
        [discs, discs - i32::from(self.nearer)]
    }

    /// Returns the direction of a place from the disc or ball that is nearest.
    #[inline(always)]
    pub(crate) fn direction(&self, place: usize) -> Option<[f32; 3]> {
        self.directions[place].vector()
    }

    /// Returns the leaf and the number in it of the point whose disc or ball is nearest to the centre of a
    /// place.
    #[inline(always)]
    pub(crate) fn nearest(&self, place: usize) -> Option<(usize, usize)> {
        let code = usize::from(self.nearest[place]);
        let leaf = self.leaves.get(code / WIDTH)?;
        Some((*leaf as usize, code % WIDTH))
    }

    /// Returns the listed leaves.
    #[inline(always)]
    pub(crate) fn leaves(&self) -> &[u32] {
        let count = self.leaves.iter().position(|&leaf| leaf == NO_LEAF).unwrap_or(MOST_LEAVES);
        &self.leaves[..count]
    }
}

/// The parts of one point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Item {
    position: [f32; 3],
    normal: [f32; 3],
    is_disc: bool,
    /// The radius of the disc or ball.
    radius: f32,
    /// The radius about the point that contains the obstacle near it.
    reach: f32,
    /// The thickness of the disc, and of the volume that contains the obstacle, to either side.
    thick: f32,
    slab: f32,
}

impl Item {
    pub(crate) fn new(scan: &ScanArrays<'_>, i: usize) -> Self {
        let (position, normal, reach) = (scan.position(i), scan.normals[i], scan.obstacle_reach(i));
        if !scan.is_on_sheet(i) {
            return Self { position, normal, is_disc: false, radius: reach, reach, thick: 0.0, slab: 0.0 };
        }
        let radius = scan.discs.get(i);
        let (thick, slab) = (THICKNESS * radius, SLAB * scan.radii[i]);
        Self { position, normal, is_disc: true, radius, reach, thick, slab }
    }

    /// The vector to a place from the nearest point of the disc, or from the centre of the ball.
    fn away(&self, place: [f32; 3]) -> [f32; 3] {
        let away = sub(place, self.position);
        if !self.is_disc {
            return away;
        }
        let height = dot(away, self.normal);
        let beside = [0, 1, 2].map(|k| away[k] - height * self.normal[k]);
        let length = dot(beside, beside).sqrt();
        let beyond = if length > self.radius { 1.0 - self.radius / length } else { 0.0 };
        [0, 1, 2].map(|k| height * self.normal[k] + beyond * beside[k])
    }
}

/// The search for the parts that are nearest to the places of a cube.
#[derive(Debug, Clone)]
pub(crate) struct Places {
    /// The greatest distance of interest, and the rounding error of a distance.
    most: f32,
    lost: f32,
    /// Half the diagonal between the outermost places.
    half: f32,
    centre: [f32; 3],
    places: [[[f32; WIDTH]; 3]; VECTORS],
    /// The squared distances from discs without their thickness and from balls.
    discs: [[f32; WIDTH]; VECTORS],
    /// Likewise from greater discs that contain the obstacle but for half its thickness.
    obstacle: [[f32; WIDTH]; VECTORS],
    nearest: [[i32; WIDTH]; VECTORS],
    /// The greatest distance of a place from a disc or ball so far.
    furthest: f32,
    /// The greatest thicknesses so far.
    thick: f32,
    slab: f32,
}

impl Places {
    /// The places of a cube, for distances up to the greatest of interest. `lost` is the rounding error of a
    /// distance.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "counted in `lost`")]
    pub(crate) fn new(centre: [f64; 3], edge: f64, (most, lost): (f32, f32)) -> Self {
        let mut places = [[[0.0; WIDTH]; 3]; VECTORS];
        for (vector, places) in places.iter_mut().enumerate() {
            for lane in 0..WIDTH {
                let place = (vector * WIDTH + lane).min(PLACES - 1);
                let steps = [place / (SIDE * SIDE), place / SIDE % SIDE, place % SIDE];
                for k in 0..3 {
                    let along = (steps[k] as f64 + 0.5) / SIDE as f64 - 0.5;
                    places[k][lane] = (centre[k] + along * edge) as f32;
                }
            }
        }
        let apart = edge * (SIDE - 1) as f64 / SIDE as f64;
        let most_sq = [[most * most; WIDTH]; VECTORS];
        Self {
            most,
            lost,
            half: (0.867 * apart) as f32,
            centre: centre.map(|c| c as f32),
            places,
            discs: most_sq,
            obstacle: most_sq,
            nearest: [[-1; WIDTH]; VECTORS],
            furthest: most,
            thick: 0.0,
            slab: 0.0,
        }
    }

    /// The distance from the centre beyond which nothing is nearer to any place.
    #[inline(always)]
    pub(crate) fn within(&self) -> f32 {
        self.half + self.furthest + 2.0 * self.lost
    }

    /// Returns `false` if no place is nearer to a leaf with this enclosure than to what it was compared with.
    #[inline(always)]
    pub(crate) fn may_be_near<S: Simd>(&self, simd: S, bounds: &OrientedBox) -> bool {
        let mut any = false;
        for vector in 0..VECTORS {
            let best = f32x16::load_array_ref(simd, &self.discs[vector]).sqrt() + 2.0 * self.lost;
            let near: mask32x16<S> = distances_sq(simd, bounds, &self.places[vector]).simd_le(best * best);
            any |= near.any_true();
        }
        any
    }

    /// Compares all places with the parts of the points of a leaf, given the leaf's place in a list.
    #[inline(always)]
    pub(crate) fn compare<S: Simd>(&mut self, simd: S, items: &[Item], slot: usize) {
        let within = self.within();
        for (number, item) in items.iter().enumerate() {
            let away = sub(item.position, self.centre);
            let most = within + item.reach;
            if dot(away, away) <= most * most {
                let is_named = slot < MOST_LEAVES && number < WIDTH;
                let code = if is_named { slot * WIDTH + number } else { usize::from(NO_POINT) };
                #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "below 256")]
                let code = code as i32;
                self.compare_item(simd, item, code);
            }
            // Also of a disc that is left out: with its thickness it may be nearer than the furthest one.
            (self.thick, self.slab) = (self.thick.max(item.thick), self.slab.max(item.slab));
        }
        // No iterator over functions: it may be compiled without the instruction set of the caller.
        let mut furthest = f32x16::load_array_ref(simd, &self.discs[0]);
        for own in &self.discs[1..] {
            furthest = furthest.max(f32x16::load_array_ref(simd, own));
        }
        let mut most = 0.0_f32;
        for own in furthest.to_array() {
            most = most.max(own);
        }
        self.furthest = most.sqrt();
    }

    #[inline(always)]
    fn compare_item<S: Simd>(&mut self, simd: S, item: &Item, code: i32) {
        let zero = f32x16::splat(simd, 0.0);
        for vector in 0..VECTORS {
            let [x, y, z] = &self.places[vector];
            let dx = f32x16::load_array_ref(simd, x) - item.position[0];
            let dy = f32x16::load_array_ref(simd, y) - item.position[1];
            let dz = f32x16::load_array_ref(simd, z) - item.position[2];
            let square = dx * dx + dy * dy + dz * dz;
            let (own, outer) = if item.is_disc {
                let height = dx * item.normal[0] + dy * item.normal[1] + dz * item.normal[2];
                let height_sq = height * height;
                let beside = (square - height_sq).max(zero).sqrt();
                let beyond = (beside - item.radius).max(zero);
                let outside = (beside - item.reach).max(zero);
                (beyond * beyond + height_sq, outside * outside + height_sq)
            } else {
                let beyond = (square.sqrt() - item.radius).max(zero);
                (beyond * beyond, beyond * beyond)
            };
            let best = f32x16::load_array_ref(simd, &self.discs[vector]);
            let nearer: mask32x16<S> = own.simd_lt(best);
            let nearest = i32x16::load_array_ref(simd, &self.nearest[vector]);
            simd.select_i32x16(nearer, i32x16::splat(simd, code), nearest)
                .store_array(&mut self.nearest[vector]);
            own.min(best).store_array(&mut self.discs[vector]);
            let best = f32x16::load_array_ref(simd, &self.obstacle[vector]);
            outer.min(best).store_array(&mut self.obstacle[vector]);
        }
    }

    /// The brick of the cube, with the first of these leaves, each with the parts of its points. All others
    /// are as far from its centre as `listed` tells first, at most the second distance.
    pub(crate) fn brick<'i>(
        &self,
        leaves: impl Iterator<Item = (u32, &'i [Item])>,
        listed: (f32, f32),
    ) -> Brick {
        let steps = |distance: f32, most: f32| in_steps(distance, (most, 255.0), self.lost);
        let mut brick = Brick {
            discs: [0; PLACES],
            directions: [Direction::NONE; PLACES],
            nearer: 0,
            listed: steps(listed.0, listed.1),
            leaves: [NO_LEAF; MOST_LEAVES],
            nearest: [NO_POINT; PLACES],
        };
        let mut items: [&[Item]; MOST_LEAVES] = [&[]; MOST_LEAVES];
        for ((slot, items), (leaf, own)) in brick.leaves.iter_mut().zip(&mut items).zip(leaves) {
            (*slot, *items) = (leaf, own);
        }
        for place in 0..PLACES {
            let (vector, lane) = (place / WIDTH, place % WIDTH);
            let [discs, obstacle] = [(&self.discs, self.thick), (&self.obstacle, self.slab)]
                .map(|(squares, thick)| steps(squares[vector][lane].sqrt() - thick, self.most));
            brick.discs[place] = discs;
            brick.nearer = brick.nearer.max(discs.saturating_sub(obstacle));
            let Ok(code) = u8::try_from(self.nearest[vector][lane]) else { continue };
            brick.nearest[place] = code;
            let (slot, number) = (usize::from(code) / WIDTH, usize::from(code) % WIDTH);
            if let Some(item) = items.get(slot).and_then(|items| items.get(number)) {
                let [x, y, z] = &self.places[vector];
                brick.directions[place] = Direction::of(item.away([x[lane], y[lane], z[lane]]));
            }
        }
        brick
    }
}

/// The squared distances of sixteen places from a box.
#[inline(always)]
pub(crate) fn distances_sq<S: Simd>(
    simd: S,
    bounds: &OrientedBox,
    [x, y, z]: &[[f32; WIDTH]; 3],
) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let dx = f32x16::load_array_ref(simd, x) - bounds.centre[0];
    let dy = f32x16::load_array_ref(simd, y) - bounds.centre[1];
    let dz = f32x16::load_array_ref(simd, z) - bounds.centre[2];
    let mut square = zero;
    for k in 0..3 {
        let [ax, ay, az] = bounds.axes[k];
        let beyond = ((dx * ax + dy * ay + dz * az).abs() - bounds.half[k]).max(zero);
        square += beyond * beyond;
    }
    square
}

/// Returns a lower bound of a distance in steps. The greatest distance has this number of steps. `lost` is
/// the rounding error of the distance.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded down, saturates")]
pub(crate) fn in_steps(distance: f32, (most, steps): (f32, f32), lost: f32) -> u8 {
    ((distance - lost).max(0.0) * (steps / most) * (1.0 - 1e-6)) as u8
}
