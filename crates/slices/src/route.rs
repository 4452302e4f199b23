//! Walking along a route, with the slices of each step loaded on demand.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::avatar::Avatar;
use crate::map::{SliceMap, Unloaded};
use crate::walk::{Step, Walker};
use crate::walk_error::WalkError;
use crate::{Grid, Response};

/// A source of slices: a whole map, or a cache over a folder.
pub trait Building {
    /// The error of loading a slice.
    type Error: From<WalkError>;

    /// Returns the grid of pixels and slices.
    fn grid(&self) -> &Grid;

    /// Returns the map with these slices loaded, for an avatar whose feet are at this height of the
    /// map's coordinates.
    ///
    /// # Errors
    /// If a slice cannot be loaded.
    fn with_slices(&mut self, slices: RangeInclusive<u32>, feet: f64) -> Result<&SliceMap, Self::Error>;
}

impl Building for &SliceMap {
    type Error = WalkError;

    fn grid(&self) -> &Grid {
        SliceMap::grid(self)
    }

    fn with_slices(&mut self, slices: RangeInclusive<u32>, _feet: f64) -> Result<&SliceMap, WalkError> {
        for s in slices {
            self.slice(s)?;
        }
        Ok(self)
    }
}

/// A start and the points to walk to in turn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Route {
    /// The start of the feet, in the caller's coordinates.
    pub start: [f64; 3],
    /// The points to walk to, as two horizontal coordinates in the caller's order.
    pub points: Vec<[f64; 2]>,
}

/// The end of a walk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// The avatar reached the last point.
    Arrived,
    /// The avatar stopped before this point.
    Stuck {
        /// The point, counted from 0.
        point: usize,
    },
    /// The avatar fell below the map on its way to this point, or from its start if there are no
    /// points (0).
    LeftMap {
        /// The point, counted from 0.
        point: usize,
    },
}

impl Route {
    /// Checks that all places are finite.
    ///
    /// # Errors
    /// If a place is not finite; the error names the first one.
    pub fn check(&self) -> Result<(), WalkError> {
        if !self.start.iter().all(|x| x.is_finite()) {
            return Err(WalkError::NotFinite { index: 0 });
        }
        match self.points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            Some(i) => Err(WalkError::NotFinite { index: i + 1 }),
            None => Ok(()),
        }
    }

    /// Checks that a walk and a fall end in reasonable time.
    fn check_steps(&self, grid: &Grid, avatar: &Avatar) -> Result<(), WalkError> {
        let places = || std::iter::once(self.start_across(grid)).chain(self.points.iter().copied());
        let ways =
            places().zip(&self.points).map(|(from, to)| (to[0] - from[0]).abs() + (to[1] - from[1]).abs());
        let (what, length) = avatar.stride();
        let steps = ways.sum::<f64>() / length;
        if steps > MOST_STEPS {
            #[expect(clippy::cast_precision_loss, reason = "a bound")]
            let on_map = self.points.len() as f64 * (width(grid, 0) + width(grid, 1));
            // If as many points on the map would do, the distance is at fault, not the step.
            let far = places().map(|place| off(grid, place)).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
            return Err(match far.filter(|_| on_map / length <= MOST_STEPS) {
                Some((index, away)) => WalkError::FarOff { index, away },
                None => WalkError::TooShort { what, length, steps },
            });
        }
        let (what, length) = ("a climb", avatar.options().climb);
        let steps = f64::from(grid.counts[2]) * grid.slice_height / length;
        if steps > MOST_STEPS { Err(WalkError::TooShort { what, length, steps }) } else { Ok(()) }
    }

    /// Returns the start as two horizontal coordinates in the caller's order.
    fn start_across(&self, grid: &Grid) -> [f64; 2] {
        let [u, v, _] = grid.up.to_map(self.start);
        // `across` is its own inverse.
        grid.up.across([u, v])
    }

    /// Walks straight from point to point of the route until the walk ends. Passes the building and
    /// every step to `each`.
    ///
    /// # Errors
    /// As for [`Route::stand`] and [`Route::follow`].
    pub fn walk<B: Building>(
        &self,
        building: &mut B,
        avatar: &Avatar,
        response: &dyn Response,
        each: impl FnMut(&B, &Step) -> Result<(), B::Error>,
    ) -> Result<Ended, B::Error> {
        let walker = self.stand(building, avatar)?;
        self.follow(building, walker, response, each)
    }

    /// Puts an avatar at the start, as [`Walker::new`] does. A fall from above the map begins at
    /// its top.
    ///
    /// # Errors
    /// If a place is not finite or far off the map, the start is blocked, steps or climb are so
    /// short that there would be more than 2^32 steps, or a slice cannot be loaded.
    pub fn stand<B: Building>(&self, building: &mut B, avatar: &Avatar) -> Result<Walker, B::Error> {
        self.check()?;
        let grid = building.grid();
        self.check_steps(grid, avatar)?;
        let mut start = grid.up.to_map(self.start);
        let top = grid.origin[2] + f64::from(grid.counts[2]) * grid.slice_height + avatar.options().climb;
        start[2] = start[2].min(top);
        let (feet, start) = (start[2], grid.up.from_map(start));
        let needs = Walker::needs_at(avatar, grid, start);
        let map = building.with_slices(needs.unwrap_or(NONE), feet)?;
        Ok(Walker::new(*avatar, map, start)?)
    }

    /// Walks on from the start ([`Route::stand`]), straight from point to point, until the walk
    /// ends. Without points, it falls to the floor below. Passes the building and every step to
    /// `each`.
    ///
    /// Every step except a fall comes nearer to the next point, so the walk ends.
    ///
    /// # Errors
    /// If a slice cannot be loaded, or `each` fails.
    pub fn follow<B: Building, E: From<B::Error>>(
        &self,
        building: &mut B,
        mut walker: Walker,
        response: &dyn Response,
        mut each: impl FnMut(&B, &Step) -> Result<(), E>,
    ) -> Result<Ended, E> {
        let start = [self.start_across(building.grid())];
        let targets = if self.points.is_empty() { &start } else { &self.points[..] };
        for (point, target) in targets.iter().enumerate() {
            loop {
                if walker.is_at(building.grid(), *target) && !walker.is_falling() {
                    break;
                }
                let needs = walker.needs(building.grid());
                let map = building.with_slices(needs.unwrap_or(NONE), walker.feet())?;
                let before = walker;
                let step = walker.step(map, *target, response).map_err(unloaded::<B::Error>)?;
                each(building, &step)?;
                // Checked first: far below the map, a fall is too small to change the height.
                if walker.feet() < building.grid().origin[2] - walker.climb() {
                    return Ok(Ended::LeftMap { point });
                }
                let is_there = walker.is_at(building.grid(), *target);
                if walker == before || (walker.creeps(&before) && !is_there) {
                    return Ok(Ended::Stuck { point });
                }
            }
        }
        Ok(Ended::Arrived)
    }
}

/// Returns the width of the map along a horizontal axis.
fn width(grid: &Grid, axis: usize) -> f64 {
    f64::from(grid.counts[axis]) * grid.pixel
}

/// Returns how far a place is off the map along an axis. The place is given as two horizontal
/// coordinates in the caller's order.
fn off(grid: &Grid, place: [f64; 2]) -> f64 {
    let place = grid.up.across(place);
    let low = |k: usize| grid.origin[k];
    let beyond = |k: usize| (low(k) - place[k]).max(place[k] - (low(k) + width(grid, k)));
    beyond(0).max(beyond(1)).max(0.0)
}

/// Greatest number of steps of a walk, some hours of work.
const MOST_STEPS: f64 = 4_294_967_296.0;

/// No slices.
#[expect(clippy::reversed_empty_ranges, reason = "that is what makes it empty")]
const NONE: RangeInclusive<u32> = 1..=0;

fn unloaded<E: From<WalkError>>(cause: Unloaded) -> E {
    E::from(cause.into())
}
