//! An avatar in a building: steps of fixed length, up and down what it can climb, and falling.
//!
//! S4, §3.1: pixels that hold something stop the avatar, except those it can climb; where it collides it goes
//! back to where it was, so it always stands on a valid place; its height is that of the floor under its
//! base. Here, what is no higher than it can climb carries it, floor or not, but climbing counts from the
//! last floor: so a slope that is too steep is no way up, however short the steps.

use std::ops::RangeInclusive;

use nearmiss_lanes::parallel::change_both;
use serde::{Deserialize, Serialize};

use crate::grid::LEVELS;
use crate::map::{SliceMap, Unloaded};
use crate::slice::Slice;
use crate::walk_error::WalkError;
use crate::{Avatar, AvatarOptions, Grid, Response};

/// Levels of a slice.
const SLICE: i64 = LEVELS as i64;

/// Avatars that a thread takes at a time.
const CHUNK: usize = 64;

/// What became of a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// Where the feet are, in the caller's coordinates.
    pub position: [f64; 3],
    /// Whether something was in the way.
    pub blocked: bool,
    /// Whether it fell, or is about to.
    pub falling: bool,
    /// The lowest and the highest slice that the avatar spans, as far as they are on the map.
    pub slices: [u32; 2],
}

/// An avatar somewhere in a building.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walker {
    avatar: Avatar,
    /// Of the feet, in the map's coordinates.
    place: [f64; 3],
    /// Height of the last floor under them, from which climbing counts; never above them.
    footing: f64,
    falling: bool,
}

/// Steps that gain less, in steps, are none.
const LEAST_GAIN: f64 = 1e-3;

/// What is at a place.
struct Look {
    /// Something the avatar can neither climb nor pass under.
    blocked: bool,
    /// Height of what would carry it.
    support: Option<f64>,
    /// Height of the highest floor there.
    floor: Option<f64>,
}

impl Walker {
    /// Puts an avatar's feet at a place of the caller's coordinates: on what is there, at most as far below
    /// or above as it climbs; else it begins to fall.
    ///
    /// # Errors
    /// When the place is not finite, or there is no room; or a slice is not loaded.
    pub fn new(avatar: Avatar, map: &SliceMap, start: [f64; 3]) -> Result<Self, WalkError> {
        if !start.iter().all(|x| x.is_finite()) {
            return Err(WalkError::NotFinite { index: 0 });
        }
        let place = map.grid().up.to_map(start);
        let mut walker = Self { avatar, place, footing: place[2], falling: false };
        if walker.stand(map, [place[0], place[1]])? {
            Ok(walker)
        } else {
            Err(WalkError::Blocked { place: start })
        }
    }

    /// The slices that finding the place `start` needs, as far as they are on the map.
    #[must_use]
    pub fn needs_at(avatar: &Avatar, grid: &Grid, start: [f64; 3]) -> Option<RangeInclusive<u32>> {
        let place = grid.up.to_map(start);
        Self { avatar: *avatar, place, footing: place[2], falling: false }.needs(grid)
    }

    /// Where the feet are, in the caller's coordinates.
    #[must_use]
    pub fn position(&self, grid: &Grid) -> [f64; 3] {
        grid.up.from_map(self.place)
    }

    /// A walker that stands where another of the same avatar stood, on the same footing.
    pub(crate) fn resumed(avatar: Avatar, place: [f64; 3], footing: f64) -> Self {
        Self { avatar, place, footing, falling: false }
    }

    /// The avatar.
    #[must_use]
    pub fn avatar(&self) -> &Avatar {
        &self.avatar
    }

    /// The place of the feet, in the map's coordinates.
    pub(crate) fn place(&self) -> [f64; 3] {
        self.place
    }

    /// Height of the last floor under the feet, in the map's coordinates.
    pub(crate) fn footing(&self) -> f64 {
        self.footing
    }

    /// Height of the feet in the map's coordinates.
    pub(crate) fn feet(&self) -> f64 {
        self.place[2]
    }

    /// How far it falls in a step.
    pub(crate) fn climb(&self) -> f64 {
        self.avatar.options().climb
    }

    /// Whether it stands on nothing.
    #[must_use]
    pub fn is_falling(&self) -> bool {
        self.falling
    }

    /// Whether it got on so little since it was `before`, though it does not fall and is not there, that it
    /// is as good as stuck: along a wall, ever shorter steps of which only the part along it counts.
    pub(crate) fn creeps(&self, before: &Self) -> bool {
        let way = [0, 1, 2].map(|k| self.place[k] - before.place[k]);
        let gained = way.iter().map(|x| x * x).sum::<f64>().sqrt();
        !self.falling && !before.falling && gained < LEAST_GAIN * self.avatar.stride().1
    }

    /// Whether it is at this place, given as the two coordinates across in the caller's order.
    #[must_use]
    pub fn is_at(&self, grid: &Grid, target: [f64; 2]) -> bool {
        [self.place[0], self.place[1]] == grid.up.across(target)
    }

    /// The slices that the next step needs, as far as they are on the map.
    #[must_use]
    pub fn needs(&self, grid: &Grid) -> Option<RangeInclusive<u32>> {
        let AvatarOptions { height, climb, .. } = *self.avatar.options();
        grid.range(2, [self.place[2] - climb, self.footing + climb + height])
    }

    /// One step towards a place, given as the two coordinates across in the caller's order; or, while it
    /// falls, one step down.
    ///
    /// If something is in the way, `response` says where else it may go; if that does not serve either, it
    /// stays. So it does if the place is not finite.
    ///
    /// # Errors
    /// When a slice that is needed is not loaded; then it is where it was.
    pub fn step(
        &mut self,
        map: &SliceMap,
        target: [f64; 2],
        response: &dyn Response,
    ) -> Result<Step, Unloaded> {
        let mut blocked = false;
        let is_falling = self.falling;
        if is_falling {
            self.fall(map)?;
        } else {
            let from = [self.place[0], self.place[1]];
            let wanted = self.towards(map.grid().up.across(target));
            if wanted != from && !self.stand(map, wanted)? {
                blocked = true;
                for place in response.elsewhere(from, wanted).into_iter().flatten() {
                    if self.stand(map, place)? {
                        break;
                    }
                }
            }
        }
        Ok(self.told(map.grid(), blocked, is_falling || self.falling))
    }

    fn towards(&self, target: [f64; 2]) -> [f64; 2] {
        let way = [target[0] - self.place[0], target[1] - self.place[1]];
        let length = (way[0] * way[0] + way[1] * way[1]).sqrt();
        let (_, step) = self.avatar.stride();
        if !length.is_finite() {
            return [self.place[0], self.place[1]];
        }
        // Rounding never leaves a last step without length.
        if length <= step * (1.0 + 1e-9) {
            return target;
        }
        [0, 1].map(|k| self.place[k] + way[k] / length * step)
    }

    /// Goes to a place if there is room.
    fn stand(&mut self, map: &SliceMap, place: [f64; 2]) -> Result<bool, Unloaded> {
        let climb = self.avatar.options().climb;
        let look = self.look(map, place, [self.place[2] - climb, self.footing + climb])?;
        if look.blocked {
            return Ok(false);
        }
        let height = look.support.unwrap_or(self.place[2]);
        let footing = look.floor.unwrap_or(self.footing).min(height);
        // What is too high for the floor below it could never be left.
        if look.support.is_some() && height > footing + climb {
            return Ok(false);
        }
        self.place = [place[0], place[1], height];
        self.falling = look.support.is_none();
        self.footing = footing;
        Ok(true)
    }

    /// Down as far as it climbs, or onto what is there.
    fn fall(&mut self, map: &SliceMap) -> Result<(), Unloaded> {
        let [x, y, z] = self.place;
        let below = z - self.avatar.options().climb;
        let look = self.look(map, [x, y], [below, z])?;
        self.place[2] = look.support.unwrap_or(below);
        self.falling = look.support.is_none();
        self.footing = self.place[2];
        Ok(())
    }

    /// What is at a place, where what lies between two heights would carry the avatar.
    fn look(&self, map: &SliceMap, [x, y]: [f64; 2], reach: [f64; 2]) -> Result<Look, Unloaded> {
        let grid = map.grid();
        let [w, d] = grid.up.across(self.avatar.options().base).map(|side| 0.5 * side);
        let nothing = Look { blocked: false, support: None, floor: None };
        let ranges = (grid.range(0, [x - w, x + w]), grid.range(1, [y - d, y + d]));
        let (Some(columns), Some(rows)) = ranges else { return Ok(nothing) };
        let [least, most] = reach.map(|height| grid.level_at(height));
        let last = i64::from(grid.counts[2]) - 1;
        let (mut found, mut is_over) = (nothing, false);
        // From the highest that can be climbed downwards, until a floor is found.
        // The lowest level is below what carries.
        let carrying = (least + 1).div_euclid(SLICE).max(0)..=most.div_euclid(SLICE).min(last);
        for s in carrying.rev() {
            let s = u32::try_from(s).unwrap_or(0);
            let slice = map.slice(s)?;
            if !slice.any(&columns, &rows) {
                continue;
            }
            let [from, to] = [least + 1, most].map(|level| level - i64::from(s) * SLICE);
            let span = Span { from: from.max(0), to: to.min(SLICE - 1) };
            let (mut support, mut floor) = (None, None);
            for row in rows.clone() {
                let tops = slice.row(&columns, row);
                let (has_over, top) = span.greatest(tops);
                is_over |= has_over;
                support = support.max(top);
                if top > floor {
                    if slice.any_obstacle(&columns, row) {
                        let is_floor = |i: usize| !slice.is_obstacle(*columns.start() + to_u32(i), row);
                        floor = floor.max(span.greatest_where(tops, is_floor));
                    } else {
                        floor = top;
                    }
                }
            }
            let height = |level: u8| grid.height(s, level);
            found.support = found.support.or(support.map(height));
            found.floor = floor.map(height);
            if found.floor.is_some() {
                break;
            }
        }
        let head = found.support.unwrap_or(self.place[2]) + self.avatar.options().height;
        let crown = grid.level_at(head);
        // What is above all that can be climbed, be it in the slice where the climb ends.
        let lowest = most.div_euclid(SLICE) + i64::from(!is_over);
        for s in lowest.max(0)..=crown.div_euclid(SLICE).min(last) {
            let [over, below_head] = [most, crown].map(|level| level - s * SLICE);
            let slice = map.slice(u32::try_from(s).unwrap_or(0))?;
            if slice.any(&columns, &rows)
                && (below_head >= SLICE - 1 || reaches(slice, [&columns, &rows], [over, below_head]))
            {
                return Ok(Look { blocked: true, ..found });
            }
        }
        Ok(found)
    }

    fn told(&self, grid: &Grid, blocked: bool, falling: bool) -> Step {
        let head = self.place[2] + self.avatar.options().height;
        let last = i64::from(grid.counts[2]) - 1;
        let slices = [self.place[2], head].map(|height| {
            let slice = grid.slice_at(height).clamp(0, last);
            u32::try_from(slice).unwrap_or(0)
        });
        Step { position: self.position(grid), blocked, falling, slices }
    }
}

/// Whether anything in these pixels tops a level and begins at another or lower: a ceiling above the head
/// does not.
fn reaches(slice: &Slice, [columns, rows]: [&RangeInclusive<u32>; 2], [over, level]: [i64; 2]) -> bool {
    rows.clone().any(|row| {
        let mut contents = columns.clone().filter_map(|column| slice.pixel(column, row));
        contents.any(|content| i64::from(content.top) > over && i64::from(content.bottom) <= level)
    })
}

/// Levels of a slice that would carry the avatar.
struct Span {
    from: i64,
    to: i64,
}

impl Span {
    /// Whether any top is above, and the greatest top within, both of a row; as levels.
    #[inline]
    fn greatest(&self, tops: &[u8]) -> (bool, Option<u8>) {
        let [from, to] = [self.from, self.to].map(|level| u8::try_from(level + 1).unwrap_or(0));
        let mut greatest = 0;
        let mut most = 0;
        for &top in tops {
            most = most.max(top);
            greatest = greatest.max(if top <= to { top } else { 0 });
        }
        (most > to, if greatest >= from.max(1) { Some(greatest - 1) } else { None })
    }

    /// The greatest top within among some of a row.
    fn greatest_where(&self, tops: &[u8], mut is_wanted: impl FnMut(usize) -> bool) -> Option<u8> {
        let tops = tops.iter().enumerate().filter(|&(i, &top)| top > 0 && is_wanted(i));
        let levels = tops.map(|(_, top)| top - 1);
        levels.filter(|level| (self.from..=self.to).contains(&i64::from(*level))).max()
    }
}

fn to_u32(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}

/// A step of every walker towards its own target, on all cores with the feature `rayon`; the same on any
/// number of threads.
///
/// # Panics
/// When there are not as many targets and steps as walkers.
pub fn step_each(
    map: &SliceMap,
    walkers: &mut [Walker],
    targets: &[[f64; 2]],
    response: &dyn Response,
    steps: &mut [Result<Step, Unloaded>],
) {
    assert!(walkers.len() == targets.len() && walkers.len() == steps.len(), "a target and a step a walker");
    change_both(walkers, steps, CHUNK, |i, walker, step| *step = walker.step(map, targets[i], response));
}
