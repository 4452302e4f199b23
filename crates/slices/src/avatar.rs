//! The avatar: a box with a climb and a length of step.

use nearmiss_geometry::Aabb;
use serde::{Deserialize, Serialize};

use crate::Grid;
use crate::walk_error::WalkError;

/// Lengths of an avatar, in the caller's units. Plain numbers, checked by [`Avatar::new`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct AvatarOptions {
    /// Sides of the box along the two horizontal axes, in the caller's order. Default: 0.4 each.
    pub base: [f64; 2],
    /// Height of the box. Default: 1.6. On stairs a box stands on the highest step under it, a
    /// quarter of a metre higher than a person would, so the box is lower than a person.
    pub height: f64,
    /// The greatest height that it steps up at once, and the height that it falls in one step.
    /// Default: 0.35, two steps of a staircase.
    pub climb: f64,
    /// Distance that it moves in a step. It is limited to the lesser side of the base. So the bases
    /// before and after a step touch, and the avatar cannot pass over an obstacle. Default: 0.05.
    pub step: f64,
}

impl Default for AvatarOptions {
    fn default() -> Self {
        Self { base: [0.4; 2], height: 1.6, climb: 0.35, step: 0.05 }
    }
}

impl AvatarOptions {
    /// Sets the base and the height of the box.
    #[must_use]
    pub const fn with_box(self, base: [f64; 2], height: f64) -> Self {
        Self { base, height, ..self }
    }

    /// Sets the height of a climb.
    #[must_use]
    pub const fn with_climb(self, climb: f64) -> Self {
        Self { climb, ..self }
    }

    /// Sets the length of a step.
    #[must_use]
    pub const fn with_step(self, step: f64) -> Self {
        Self { step, ..self }
    }
}

/// A validated avatar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Avatar {
    options: AvatarOptions,
}

impl Avatar {
    /// Checks the lengths.
    ///
    /// # Errors
    /// If a length is not positive and finite, or the climb is not below the height; the error
    /// names the length.
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

    /// Returns its lengths.
    #[must_use]
    pub fn options(&self) -> &AvatarOptions {
        &self.options
    }

    /// Returns the greatest number of pixels of a map under its base.
    pub(crate) fn most_pixels(&self, grid: &Grid) -> u64 {
        let base = grid.up.across(self.options.base);
        let along = |k: usize| {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
            let pixels = (base[k] / grid.pixel) as u64;
            pixels.saturating_add(2).min(u64::from(grid.counts[k]))
        };
        along(0) * along(1)
    }

    /// Returns the distance that it moves in a step, and the name of the length that limits it.
    pub(crate) fn stride(&self) -> (&'static str, f64) {
        let AvatarOptions { base: [width, depth], step, .. } = self.options;
        let base = width.min(depth);
        if step <= base { ("a step", step) } else { ("an avatar's base", base) }
    }

    /// Returns its box when its feet are at this place, all in the caller's coordinates.
    #[must_use]
    pub fn bounds(&self, grid: &Grid, feet: [f64; 3]) -> Aabb {
        let [x, y, z] = grid.up.to_map(feet);
        let [w, d] = grid.up.across(self.options.base).map(|side| 0.5 * side);
        let corners = [[x - w, y - d, z], [x + w, y + d, z + self.options.height]];
        Aabb::of(corners.map(|corner| grid.up.from_map(corner)))
    }

    /// Returns the greatest number of slices that a step can need.
    #[must_use]
    pub fn slices(&self, grid: &Grid) -> u32 {
        // Down by a fall, up by the greatest climb to the head, and the slices of both ends.
        let AvatarOptions { height, climb, .. } = self.options;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates")]
        let slices = ((height + 2.0 * climb) / grid.slice_height).ceil() as u32;
        slices.saturating_add(1).min(grid.counts[2])
    }
}
