//! Along a route, with whatever slices a step needs at hand.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

use crate::map::{SliceMap, Unloaded};
use crate::walk::{Avatar, Step, WalkError, Walker};
use crate::{Grid, Response};

/// Where slices come from: a whole map, or a cache over a folder.
pub trait Building {
    /// Why slices cannot be had.
    type Error: From<WalkError>;

    /// Where pixels and slices lie.
    fn grid(&self) -> &Grid;

    /// The map with these slices loaded, for an avatar whose feet are at this height of the map's coordinates.
    ///
    /// # Errors
    /// When one of them cannot be loaded.
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

/// Where somebody starts, and where to in turn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Route {
    /// Where the feet start, in the caller's coordinates.
    pub start: [f64; 3],
    /// Places to go to, by the two coordinates across in the caller's order.
    pub points: Vec<[f64; 2]>,
}

/// How a walk ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// At the last point.
    Arrived,
    /// Before this point, counted from 0, where nothing moved any more.
    Stuck {
        /// Which.
        point: usize,
    },
    /// It fell below the map on its way to this point.
    LeftMap {
        /// Which.
        point: usize,
    },
}

impl Route {
    /// Checks that all places are finite.
    ///
    /// # Errors
    /// Names the first that is not.
    pub fn check(&self) -> Result<(), WalkError> {
        if !self.start.iter().all(|x| x.is_finite()) {
            return Err(WalkError::NotFinite { index: 0 });
        }
        match self.points.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            Some(i) => Err(WalkError::NotFinite { index: i + 1 }),
            None => Ok(()),
        }
    }

    /// Walks along the route, straight from point to point, until it ends; hands out the building and every step.
    ///
    /// Every step but a fall comes nearer to the next point, so it ends.
    ///
    /// # Errors
    /// When a place is not finite, there is no room at the start, or a slice cannot be loaded; or what `each` ends it with.
    pub fn walk<B: Building>(
        &self,
        building: &mut B,
        avatar: &Avatar,
        response: &dyn Response,
        mut each: impl FnMut(&B, &Step) -> Result<(), B::Error>,
    ) -> Result<Ended, B::Error> {
        self.check()?;
        let grid = building.grid();
        let mut start = grid.up.to_map(self.start);
        // A fall from above the map begins where there may be something.
        let top = grid.origin[2] + f64::from(grid.counts[2]) * grid.slice_height + avatar.options().climb;
        start[2] = start[2].min(top);
        let (feet, start) = (start[2], grid.up.from_map(start));
        let needs = Walker::needs_at(avatar, grid, start);
        let map = building.with_slices(needs.unwrap_or(NONE), feet)?;
        let mut walker = Walker::new(*avatar, map, start)?;
        for (point, target) in self.points.iter().enumerate() {
            loop {
                if walker.is_at(building.grid(), *target) && !walker.is_falling() {
                    break;
                }
                let needs = walker.needs(building.grid());
                let map = building.with_slices(needs.unwrap_or(NONE), walker.feet())?;
                let before = walker;
                let step = walker.step(map, *target, response).map_err(unloaded)?;
                each(building, &step)?;
                let is_there = walker.is_at(building.grid(), *target);
                if walker == before || (walker.creeps(&before) && !is_there) {
                    return Ok(Ended::Stuck { point });
                }
                if walker.feet() < building.grid().origin[2] - avatar.options().climb {
                    return Ok(Ended::LeftMap { point });
                }
            }
        }
        Ok(Ended::Arrived)
    }
}

/// No slices.
#[expect(clippy::reversed_empty_ranges, reason = "that is what makes it empty")]
const NONE: RangeInclusive<u32> = 1..=0;

fn unloaded<E: From<WalkError>>(cause: Unloaded) -> E {
    E::from(cause.into())
}
