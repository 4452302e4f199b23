//! The size and the abilities of a character.

use parry3d::math::{Real, Vector};
use thiserror::Error;

/// The size and the abilities of a [`Character`](crate::Character). Lengths are in the units of the
/// world; the defaults are those of a person in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CharacterOptions {
    /// The direction against gravity, of any length above zero. The y axis by default.
    pub up: Vector,
    /// The height. 1.8 by default.
    pub height: Real,
    /// The radius. 0.3 by default.
    pub radius: Real,
    /// The greatest height of a step that it climbs. 0.35 by default. Obstacles that are lower stop it
    /// nowhere, so it must be above the noise of the floor.
    pub step: Real,
    /// The greatest angle of the ground on which it stands, in radians. 45° by default.
    pub slope: Real,
    /// The greatest drop that it follows down, to stay on stairs and slopes. 0.35 by default.
    pub snap: Real,
    /// The gap that it keeps from walls and ceilings. 0.02 by default. It must be above the noise of
    /// walls.
    pub skin: Real,
}

impl Default for CharacterOptions {
    fn default() -> Self {
        Self {
            up: Vector::Y,
            height: 1.8,
            radius: 0.3,
            step: 0.35,
            slope: std::f32::consts::FRAC_PI_4,
            snap: 0.35,
            skin: 0.02,
        }
    }
}

/// Error of an invalid [`CharacterOptions`].
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum CharacterError {
    /// A number is out of range.
    #[error("{name} must be {expected}, got {got}")]
    Range {
        /// The name of the option.
        name: &'static str,
        /// The numbers that are allowed.
        expected: &'static str,
        /// The number.
        got: Real,
    },
    /// `up` has no direction.
    #[error("up must be a finite direction with a length above 0, got {got}")]
    Up {
        /// The direction.
        got: Vector,
    },
    /// The capsule above the height of a step would be higher than its height.
    #[error("height must be at least step + 2 radius = {least}, got {height}; lower the step or the radius")]
    Height {
        /// The height.
        height: Real,
        /// The least height.
        least: Real,
    },
    /// The place of the feet is not finite.
    #[error("expected finite coordinates of the feet, got {got}")]
    Feet {
        /// The place.
        got: Vector,
    },
}

impl CharacterOptions {
    /// The options with a unit vector up.
    ///
    /// # Errors
    /// Names the option that is out of range.
    pub(crate) fn checked(&self) -> Result<Self, CharacterError> {
        let Self { height, radius, step, slope, snap, skin, .. } = *self;
        let positive = "positive and finite";
        for (name, got) in [("height", height), ("radius", radius), ("step", step), ("skin", skin)] {
            if !(got > 0.0 && got.is_finite()) {
                return Err(CharacterError::Range { name, expected: positive, got });
            }
        }
        if !(snap >= 0.0 && snap.is_finite()) {
            return Err(CharacterError::Range { name: "snap", expected: "at least 0 and finite", got: snap });
        }
        if !(0.0..std::f32::consts::FRAC_PI_2).contains(&slope) {
            return Err(CharacterError::Range {
                name: "slope", expected: "from 0 to below π/2", got: slope
            });
        }
        let least = step + 2.0 * radius;
        if height < least {
            return Err(CharacterError::Height { height, least });
        }
        let up = self.up.try_normalize().ok_or(CharacterError::Up { got: self.up })?;
        Ok(Self { up, ..*self })
    }
}
