//! The avatar: a box with a height that it climbs at once and a length of step.

use nearmiss_geometry::Aabb;
use serde::{Deserialize, Serialize};

use crate::Grid;
use crate::walk_error::WalkError;

/// Who walks: lengths in the caller's units. Plain numbers, checked by [`Avatar::new`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct AvatarOptions {
    /// Of the box, along the two axes across in the caller's order. Default: 0.4 each.
    pub base: [f64; 2],
    /// Of the box. Default: 1.6: on stairs a box stands on the highest step under it, a quarter of a metre
    /// higher than whoever it stands for.
    pub height: f64,
    /// How far it climbs at once, and falls in a step. Default: 0.35, two steps of a staircase.
    pub climb: f64,
    /// How far it moves in a step, at most the lesser side of its base: then bases at both ends meet, and it
    /// steps over nothing. Default: 0.05.
    pub step: f64,
}

impl Default for AvatarOptions {
    fn default() -> Self {
        Self { base: [0.4; 2], height: 1.6, climb: 0.35, step: 0.05 }
    }
}

impl AvatarOptions {
    /// The same avatar with a box of this base and height.
    #[must_use]
    pub const fn with_box(self, base: [f64; 2], height: f64) -> Self {
        Self { base, height, ..self }
    }

    /// The same avatar that climbs so far.
    #[must_use]
    pub const fn with_climb(self, climb: f64) -> Self {
        Self { climb, ..self }
    }

    /// The same avatar with steps of this length.
    #[must_use]
    pub const fn with_step(self, step: f64) -> Self {
        Self { step, ..self }
    }
}

/// Somebody with a size that makes sense.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Avatar {
    options: AvatarOptions,
}

impl Avatar {
    /// Checks the lengths.
    ///
    /// # Errors
    /// Names the one that makes no sense.
    pub fn new(options: &AvatarOptions) -> Result<Self, WalkError> {
        let AvatarOptions { base: [width, depth], height, climb, step } = *options;
        let all = [
            ("an avatar's width", width),
            ("an avatar's depth", depth),
            ("an avatar's height", height),
            ("a climb", climb),
            ("a step", step),
        ];
        for (what, length) in all {
            if !(length > 0.0 && length.is_finite()) {
                return Err(WalkError::Length { what, length });
            }
        }
        if climb >= height {
            return Err(WalkError::Climb { height, climb });
        }
        Ok(Self { options: *options })
    }

    /// Its lengths.
    #[must_use]
    pub fn options(&self) -> &AvatarOptions {
        &self.options
    }

    /// The greatest number of pixels of a map that lie under its base.
    pub(crate) fn most_pixels(&self, grid: &Grid) -> u64 {
        let base = grid.up.across(self.options.base);
        let along = |k: usize| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
            let pixels = (base[k] / grid.pixel) as u64;
            pixels.saturating_add(2).min(u64::from(grid.counts[k]))
        };
        along(0) * along(1)
    }

    /// How far it moves in a step, and what makes it so.
    pub(crate) fn stride(&self) -> (&'static str, f64) {
        let AvatarOptions { base: [width, depth], step, .. } = self.options;
        let base = width.min(depth);
        if step <= base { ("a step", step) } else { ("an avatar's base", base) }
    }

    /// Its box, in the caller's coordinates, when its feet stand on this place.
    #[must_use]
    pub fn bounds(&self, grid: &Grid, feet: [f64; 3]) -> Aabb {
        let [x, y, z] = grid.up.to_map(feet);
        let [w, d] = grid.up.across(self.options.base).map(|side| 0.5 * side);
        let corners = [[x - w, y - d, z], [x + w, y + d, z + self.options.height]];
        Aabb::of(corners.map(|corner| grid.up.from_map(corner)))
    }

    /// The greatest number of slices that a step can need.
    #[must_use]
    pub fn slices(&self, grid: &Grid) -> u32 {
        // Down as far as it falls, up from the greatest climb to the head, and both ends.
        let AvatarOptions { height, climb, .. } = self.options;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
        let slices = ((height + 2.0 * climb) / grid.slice_height).ceil() as u32;
        slices.saturating_add(1).min(grid.counts[2])
    }
}
