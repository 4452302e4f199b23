//! An avatar in a building: steps of fixed length, climbing and falling.
//!
//! In Anjos et al. 2012, §3.1, occupied pixels stop the avatar unless it can climb them; after a
//! collision it goes back, so it is always at a valid place; its height is that of the floor under
//! its base. Here everything that is low enough to climb supports the avatar, floor or not, but a
//! climb counts from the last floor. So a slope that is too steep cannot be climbed, however short
//! the steps.

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

/// The result of a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Step {
    /// The place of the feet, in the caller's coordinates.
    pub position: [f64; 3],
    /// `true` if something was in the way.
    pub blocked: bool,
    /// `true` if it fell, or is about to fall.
    pub falling: bool,
    /// The lowest and the highest slice that the avatar spans, clamped to the map.
    pub slices: [u32; 2],
}

/// An avatar somewhere in a building.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Walker {
    avatar: Avatar,
    /// The place of the feet, in the map's coordinates.
    place: [f64; 3],
    /// Height of the last floor under the feet, from which a climb counts; never above the feet.
    footing: f64,
    falling: bool,
}

/// Least progress of a step, as a share of its length; less counts as no progress.
const LEAST_GAIN: f64 = 1e-3;

/// The surroundings of a place.
struct Look {
    /// `true` if the avatar can neither climb nor pass under something there.
    blocked: bool,
    /// Height of the surface that would support the avatar.
    support: Option<f64>,
    /// Height of the highest floor.
    floor: Option<f64>,
}

impl Walker {
    /// Puts an avatar's feet at a place of the caller's coordinates: on a surface at most a climb
    /// below or above, otherwise it begins to fall.
    ///
    /// # Errors
    /// If the place is not finite or blocked, or a slice is not loaded.
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

    /// Returns the slices of the map that [`Walker::new`] needs at `start`.
    #[must_use]
    pub fn needs_at(avatar: &Avatar, grid: &Grid, start: [f64; 3]) -> Option<RangeInclusive<u32>> {
        let place = grid.up.to_map(start);
        Self { avatar: *avatar, place, footing: place[2], falling: false }.needs(grid)
    }

    /// The place of the feet, in the caller's coordinates.
    #[must_use]
    pub fn position(&self, grid: &Grid) -> [f64; 3] {
        grid.up.from_map(self.place)
    }

    /// Creates a walker in a state of another walker of the same avatar.
    pub(crate) fn resumed(avatar: Avatar, place: [f64; 3], footing: f64) -> Self {
        Self { avatar, place, footing, falling: false }
    }

    /// Returns the avatar.
    #[must_use]
    pub fn avatar(&self) -> &Avatar {
        &self.avatar
    }

    /// The place of the feet, in the map's coordinates.
    pub(crate) fn place(&self) -> [f64; 3] {
        self.place
    }

    /// Returns the height of the last floor under the feet, in the map's coordinates.
    pub(crate) fn footing(&self) -> f64 {
        self.footing
    }

    /// Returns the height of the feet, in the map's coordinates.
    pub(crate) fn feet(&self) -> f64 {
        self.place[2]
    }

    /// Returns the distance that it falls in a step.
    pub(crate) fn climb(&self) -> f64 {
        self.avatar.options().climb
    }

    /// Returns `true` if nothing supports it.
    #[must_use]
    pub fn is_falling(&self) -> bool {
        self.falling
    }

    /// Returns `true` if the step from `before` made so little progress that the walker is as good
    /// as stuck, and neither state is falling. Along a wall, only the part of a step along the wall
    /// counts, and steps become ever shorter.
    pub(crate) fn creeps(&self, before: &Self) -> bool {
        let way = [0, 1, 2].map(|k| self.place[k] - before.place[k]);
        let gained = way.iter().map(|x| x * x).sum::<f64>().sqrt();
        !self.falling && !before.falling && gained < LEAST_GAIN * self.avatar.stride().1
    }

    /// Returns `true` if it is at this place, given as two horizontal coordinates in the caller's
    /// order.
    #[must_use]
    pub fn is_at(&self, grid: &Grid, target: [f64; 2]) -> bool {
        [self.place[0], self.place[1]] == grid.up.across(target)
    }

    /// Returns the slices of the map that the next step needs.
    #[must_use]
    pub fn needs(&self, grid: &Grid) -> Option<RangeInclusive<u32>> {
        let AvatarOptions { height, climb, .. } = *self.avatar.options();
        grid.range(2, [self.place[2] - climb, self.footing + climb + height])
    }

    /// Takes one step towards a place, given as two horizontal coordinates in the caller's order. A
    /// falling walker takes one step down instead.
    ///
    /// If something is in the way, `response` chooses the places to try instead. If they are
    /// blocked too, or the place is not finite, the walker stays.
    ///
    /// # Errors
    /// If a required slice is not loaded; then the walker stays where it was.
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
        // The tolerance keeps rounding from leaving a last step without length.
        if length <= step * (1.0 + 1e-9) {
            return target;
        }
        [0, 1].map(|k| self.place[k] + way[k] / length * step)
    }

    /// Moves to a place unless it is blocked. Returns `true` if it moved.
    fn stand(&mut self, map: &SliceMap, place: [f64; 2]) -> Result<bool, Unloaded> {
        let climb = self.avatar.options().climb;
        let look = self.look(map, place, [self.place[2] - climb, self.footing + climb])?;
        if look.blocked {
            return Ok(false);
        }
        let height = look.support.unwrap_or(self.place[2]);
        let footing = look.floor.unwrap_or(self.footing).min(height);
        // A surface too high above the floor below it could never be left again.
        if look.support.is_some() && height > footing + climb {
            return Ok(false);
        }
        self.place = [place[0], place[1], height];
        self.falling = look.support.is_none();
        self.footing = footing;
        Ok(true)
    }

    /// Falls by a climb, or onto the first surface within it.
    fn fall(&mut self, map: &SliceMap) -> Result<(), Unloaded> {
        let [x, y, z] = self.place;
        let below = z - self.avatar.options().climb;
        let look = self.look(map, [x, y], [below, z])?;
        self.place[2] = look.support.unwrap_or(below);
        self.falling = look.support.is_none();
        self.footing = self.place[2];
        Ok(())
    }

    /// Examines a place. Surfaces within `reach`, a range of heights, would support the avatar.
    fn look(&self, map: &SliceMap, [x, y]: [f64; 2], reach: [f64; 2]) -> Result<Look, Unloaded> {
        let grid = map.grid();
        let [w, d] = grid.up.across(self.avatar.options().base).map(|side| 0.5 * side);
        let nothing = Look { blocked: false, support: None, floor: None };
        let ranges = (grid.range(0, [x - w, x + w]), grid.range(1, [y - d, y + d]));
        let (Some(columns), Some(rows)) = ranges else { return Ok(nothing) };
        let [least, most] = reach.map(|height| grid.level_at(height));
        let last = i64::from(grid.counts[2]) - 1;
        let (mut found, mut is_over) = (nothing, false);
        // From the highest slice that can be climbed downwards, until a floor is found. The lowest
        // level of the range is excluded.
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
        // Things above the range of climbing, also in the slice where it ends.
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

/// Returns `true` if any of these pixels has its top above level `over` and its bottom at most at
/// `level`. A ceiling above the head does not count.
fn reaches(slice: &Slice, [columns, rows]: [&RangeInclusive<u32>; 2], [over, level]: [i64; 2]) -> bool {
    rows.clone().any(|row| {
        let mut contents = columns.clone().filter_map(|column| slice.pixel(column, row));
        contents.any(|content| i64::from(content.top) > over && i64::from(content.bottom) <= level)
    })
}

/// Levels of a slice that would support the avatar.
struct Span {
    from: i64,
    to: i64,
}

impl Span {
    /// Returns whether any top of a row is above the span, and the greatest top within it, as a
    /// level.
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

    /// Returns the greatest top within the span among some pixels of a row.
    fn greatest_where(&self, tops: &[u8], mut is_wanted: impl FnMut(usize) -> bool) -> Option<u8> {
        let tops = tops.iter().enumerate().filter(|&(i, &top)| top > 0 && is_wanted(i));
        let levels = tops.map(|(_, top)| top - 1);
        levels.filter(|level| (self.from..=self.to).contains(&i64::from(*level))).max()
    }
}

fn to_u32(i: usize) -> u32 {
    u32::try_from(i).unwrap_or(u32::MAX)
}

/// Takes a step of every walker towards its own target, on all cores with the feature `rayon`. The
/// result does not depend on the number of threads.
///
/// # Panics
/// If the numbers of walkers, targets and steps differ.
pub fn step_each(
    map: &SliceMap,
    walkers: &mut [Walker],
    targets: &[[f64; 2]],
    response: &dyn Response,
    steps: &mut [Result<Step, Unloaded>],
) {
    assert!(
        walkers.len() == targets.len() && walkers.len() == steps.len(),
        "expected a target and a step for each walker"
    );
    change_both(walkers, steps, CHUNK, |i, walker, step| *step = walker.step(map, targets[i], response));
}
