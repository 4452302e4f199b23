//! Errors of walking.

use thiserror::Error;

use crate::map::Unloaded;

/// The reason why a walk or a search is rejected.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WalkError {
    /// A length is not positive and finite.
    #[error("expected {what} above 0, got {length}")]
    Length {
        /// The name of the length.
        what: &'static str,
        /// The given value.
        length: f64,
    },
    /// A length is so short that a walk would take too long.
    #[error(
        "expected a route of at most 2^32 steps, got {steps:e} with {what} of {length}; give a greater length"
    )]
    TooShort {
        /// The name of the length.
        what: &'static str,
        /// The given value.
        length: f64,
        /// The number of steps.
        steps: f64,
    },
    /// The climb is not below the avatar's height.
    #[error("expected a climb below the avatar's height, {height}, got {climb}")]
    Climb {
        /// The avatar's height.
        height: f64,
        /// The given value.
        climb: f64,
    },
    /// A place is not finite.
    #[error("expected finite coordinates, got one that is not finite (point {index} of the route)")]
    NotFinite {
        /// The point, with the start as 0.
        index: usize,
    },
    /// A place is so far off the map that a walk would take too long.
    #[error("expected a point on the map, got one {away:.2e} off the map (point {index} of the route)")]
    FarOff {
        /// The point, with the start as 0.
        index: usize,
        /// Distance from the map along an axis.
        away: f64,
    },
    /// The start is blocked.
    #[error(
        "expected a free start, got {place:?}, inside an obstacle or under a ceiling that is too low; start elsewhere, or with a \
         smaller avatar"
    )]
    Blocked {
        /// The given value.
        place: [f64; 3],
    },
    /// The search has more places than memory should hold.
    #[error("expected at most {limit} places to search, got more with steps of {step}; give a longer step")]
    TooManyPlaces {
        /// The greatest number of places.
        limit: usize,
        /// The length of a step.
        step: f64,
    },
    /// The search would take too long.
    #[error(
        "expected a search of at most 2^36 pixels, got {places} places with {pixels} pixels under the base; give a \
         longer step or a smaller avatar"
    )]
    TooMuchWork {
        /// Places of the lattice.
        places: u64,
        /// Pixels of the map under a base.
        pixels: u64,
    },
    /// A required slice is not loaded.
    #[error(transparent)]
    Unloaded(#[from] Unloaded),
}
