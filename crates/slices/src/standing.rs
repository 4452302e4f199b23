//! Search for places where an avatar can stand.

use std::fmt;
use std::ops::RangeInclusive;

use nearmiss_geometry::Aabb;
use thiserror::Error;

use crate::avatar::Avatar;
use crate::grid::LEVELS;
use crate::lattice::StepGrid;
use crate::map::{SliceMap, Unloaded};
use crate::query::Floor;
use crate::walk::Walker;
use crate::walk_error::WalkError;

/// The searched places are a pixel apart, or this fraction of the base if that is more.
const COARSE: f64 = 32.0;

/// A place where an avatar can stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// The place of the feet, in the caller's coordinates.
    pub position: [f64; 3],
    /// Its distance from the given place.
    pub distance: f64,
}

/// The reason why an avatar cannot stand at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Misplaced {
    /// The base is outside the map.
    OffMap,
    /// An obstacle is in the box of the avatar.
    Obstacle,
    /// Something that is no obstacle is in the box, such as a ceiling or the top of a table.
    LowCeiling,
    /// Nothing within a climb of the feet carries the avatar.
    Airborne,
}

impl fmt::Display for Misplaced {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OffMap => "is outside the map",
            Self::Obstacle => "is inside an obstacle",
            Self::LowCeiling => "is under a ceiling that is too low, or inside a level object",
            Self::Airborne => "is in the air",
        })
    }
}

/// The reason why a walk cannot start at a place.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum StartError {
    /// The avatar cannot stand there.
    #[error("{place:?} {cause}; {}", told(nearest.as_ref()))]
    Misplaced {
        /// The given place, in the caller's coordinates.
        place: [f64; 3],
        /// The reason.
        cause: Misplaced,
        /// The nearest place where the avatar can stand; `None` if the map has no such place.
        nearest: Option<Standing>,
    },
    /// The place is not finite, or a slice is not loaded.
    #[error(transparent)]
    Walk(#[from] WalkError),
}

impl From<Unloaded> for StartError {
    fn from(cause: Unloaded) -> Self {
        Self::Walk(cause.into())
    }
}

fn told(nearest: Option<&Standing>) -> String {
    match nearest {
        Some(Standing { position, distance }) => {
            format!("nearest place to stand: {position:?}, {distance} away")
        }
        None => "the map has no place where this avatar can stand; give a smaller avatar".into(),
    }
}

impl Avatar {
    /// Puts the avatar's feet at a place of the caller's coordinates, as [`Walker::new`] does, but
    /// only where something supports it within a climb of that height.
    ///
    /// # Errors
    /// If there is no free space, no support, or no map at the place; the error names the nearest
    /// place where the avatar can stand ([`Avatar::nearest_standing`]). Also if the place is not
    /// finite or a slice is not loaded.
    pub fn placed(&self, map: &SliceMap, place: [f64; 3]) -> Result<Walker, StartError> {
        let cause = match Walker::new(*self, map, place) {
            Ok(walker) if !walker.is_falling() => return Ok(walker),
            Ok(_) if self.is_off(map, place) => Misplaced::OffMap,
            Ok(_) => Misplaced::Airborne,
            Err(WalkError::Blocked { .. }) => {
                // Anything below a climb can be stepped on, so it does not count.
                let up = map.grid().up;
                let Aabb { min, max } = self.bounds(map.grid(), place);
                let [[x, y, z], [u, v, w]] = [min, max].map(|corner| up.to_map(corner));
                let (feet, head) = (z.min(w), z.max(w));
                let low = [x, y, (feet + self.options().climb).min(head)];
                let body = Aabb::of([low, [u, v, head]].map(|corner| up.from_map(corner)));
                let is_obstacle = map.query(&body, Floor::Max)?.obstacle;
                if is_obstacle { Misplaced::Obstacle } else { Misplaced::LowCeiling }
            }
            Err(other) => return Err(other.into()),
        };
        Err(StartError::Misplaced { place, cause, nearest: self.nearest_standing(map, place)? })
    }

    /// Finds the place nearest to `near`, in the caller's coordinates, where the avatar can stand;
    /// `None` if the map has no such place.
    ///
    /// Searches all heights of `near` itself and of the places of a [`StepGrid`] ring by ring,
    /// until no further ring can be nearer. The spacing of the places is a pixel; for bases wider
    /// than 64 pixels it is a 32nd of their lesser side, in whole pixels. An avatar can stand at a
    /// place if a walker that is put there stays there ([`Walker::new`]). Takes microseconds for
    /// each place that is nearer than the result; seconds for a large map with no result.
    ///
    /// # Errors
    /// If `near` is not finite, or a slice is not loaded.
    pub fn nearest_standing(&self, map: &SliceMap, near: [f64; 3]) -> Result<Option<Standing>, WalkError> {
        if !near.iter().all(|x| x.is_finite()) {
            return Err(WalkError::NotFinite { index: 0 });
        }
        let grid = map.grid();
        let [x, y, z] = grid.up.to_map(near);
        let spacing = grid.pixel
            * (self.options().base[0].min(self.options().base[1]) / COARSE / grid.pixel).floor().max(1.0);
        let lattice = StepGrid::new(grid, self, spacing);
        let mut best: Option<([f64; 3], f64)> = None;
        let mut heights = Vec::new();
        let mut look = |place: [f64; 2], best: &mut Option<([f64; 3], f64)>| {
            let across = (place[0] - x).hypot(place[1] - y);
            if best.is_some_and(|(_, least)| across >= least) {
                return Ok(());
            }
            self.standing_heights(map, place, &mut heights)?;
            for &height in &heights {
                let distance = across.hypot(height - z);
                if best.is_none_or(|(_, least)| distance < least) {
                    *best = Some(([place[0], place[1], height], distance));
                }
            }
            Ok::<(), WalkError>(())
        };
        look([x, y], &mut best)?;
        let centre = lattice.nearest([x, y]);
        let [cx, cy] = lattice.place(centre);
        let off = (cx - x).hypot(cy - y);
        let last = lattice.counts.map(|count| u32::try_from(count - 1).unwrap_or(u32::MAX));
        let rings = (0..2).map(|k| centre[k].max(last[k] - centre[k])).max().unwrap_or(0);
        for ring in 0..=rings {
            // `inner` is the distance of the ring from the centre, which is `near` rounded to the
            // lattice and clamped to the map. If `near` is outside, the way from the centre to
            // `near` leads away from all places, so the squares of the distances add up.
            let inner = (f64::from(ring) - 1.0).max(0.0) * spacing;
            let least = if off > spacing { inner.hypot(off - spacing) } else { inner };
            if best.is_some_and(|(_, found)| least >= found) {
                break;
            }
            for cell in cells_of_ring(centre, ring, last) {
                look(lattice.place(cell), &mut best)?;
            }
        }
        Ok(best.map(|(place, distance)| Standing { position: grid.up.from_map(place), distance }))
    }

    /// Collects the heights at which the avatar can stand at a horizontal place, lowest first, all
    /// in the map's coordinates.
    pub(crate) fn standing_heights(
        &self,
        map: &SliceMap,
        place: [f64; 2],
        heights: &mut Vec<f64>,
    ) -> Result<(), WalkError> {
        heights.clear();
        let grid = map.grid();
        let Some([columns, rows]) = self.base(map, place) else { return Ok(()) };
        let climb = self.options().climb;
        let mut above: Option<f64> = None;
        for s in (0..grid.counts[2]).rev() {
            let slice = map.slice(s)?;
            if !slice.any(&columns, &rows) {
                continue;
            }
            let mut tops = [false; LEVELS as usize];
            for row in rows.clone() {
                let filled = slice.row(&columns, row).iter().filter_map(|top| top.checked_sub(1));
                filled.for_each(|top| tops[usize::from(top)] = true);
            }
            for level in (0..=254_u8).rev().filter(|level| tops[usize::from(*level)]) {
                let height = grid.height(s, level);
                // A surface within a climb below another supports nothing: the walker climbs the
                // upper one.
                let is_clear = above.is_none_or(|above| above - height > 0.999 * climb);
                above = Some(height);
                if is_clear && self.rests(map, [place[0], place[1], height])? {
                    heights.push(height);
                }
            }
        }
        heights.reverse();
        Ok(())
    }

    /// Returns `true` if a walker that is put at this place of the map's coordinates stays there.
    pub(crate) fn rests(&self, map: &SliceMap, place: [f64; 3]) -> Result<bool, Unloaded> {
        match Walker::new(*self, map, map.grid().up.from_map(place)) {
            Ok(walker) => Ok(!walker.is_falling() && walker.feet().to_bits() == place[2].to_bits()),
            Err(WalkError::Unloaded(cause)) => Err(cause),
            Err(_) => Ok(false),
        }
    }

    /// Returns the columns and rows under the base at a horizontal place, in the map's coordinates.
    fn base(&self, map: &SliceMap, place: [f64; 2]) -> Option<[RangeInclusive<u32>; 2]> {
        let half = map.grid().up.across(self.options().base).map(|side| 0.5 * side);
        let range = |k: usize| map.grid().range(k, [place[k] - half[k], place[k] + half[k]]);
        Some([range(0)?, range(1)?])
    }

    fn is_off(&self, map: &SliceMap, place: [f64; 3]) -> bool {
        let grid = map.grid();
        let [x, y, z] = grid.up.to_map(place);
        let climb = self.options().climb;
        let is_beside = self.base(map, [x, y]).is_none();
        is_beside || grid.range(2, [z - climb, z + self.options().height]).is_none()
    }
}

/// Returns the cells at Chebyshev distance `ring` from a centre, from 0 to `last`, row by row.
fn cells_of_ring([column, row]: [u32; 2], ring: u32, last: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    let range = |centre: u32, last: u32| centre.saturating_sub(ring)..=centre.saturating_add(ring).min(last);
    let (columns, rows) = (range(column, last[0]), range(row, last[1]));
    rows.flat_map(move |y| {
        let is_end = y.abs_diff(row) == ring;
        let sides = [column.checked_sub(ring), column.checked_add(ring)].map(|x| x.filter(|x| *x <= last[0]));
        let sides = sides.into_iter().flatten().take(if is_end || ring == 0 { 0 } else { 2 });
        let all = columns.clone().take(if is_end { usize::MAX } else { 0 });
        all.chain(sides).map(move |x| [x, y])
    })
}
