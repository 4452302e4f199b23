//! The reasons why a walk is refused.

use thiserror::Error;

use crate::map::Unloaded;

/// Why nobody walks.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WalkError {
    /// A length that is none.
    #[error("{what} of {length} is none; give a length above 0")]
    Length {
        /// Which.
        what: &'static str,
        /// As given.
        length: f64,
    },
    /// A length so short that a walk would not end while anybody waits.
    #[error(
        "with {what} of {length} the route may take {steps:e} steps, more than 2^32; give a greater length"
    )]
    TooShort {
        /// Which.
        what: &'static str,
        /// As given.
        length: f64,
        /// How many.
        steps: f64,
    },
    /// An avatar that climbs over its own head.
    #[error("an avatar {height} high cannot climb {climb}; give less than its height")]
    Climb {
        /// Of the avatar.
        height: f64,
        /// As given.
        climb: f64,
    },
    /// A place that is not finite.
    #[error("point {index} of the route has a coordinate that is not finite")]
    NotFinite {
        /// Which, the start being 0.
        index: usize,
    },
    /// A place so far off the map that a walk would not end while anybody waits.
    #[error("point {index} of the route is {away:.2e} off the map; give one on it")]
    FarOff {
        /// Which, the start being 0.
        index: usize,
        /// How far, along an axis.
        away: f64,
    },
    /// Nobody can stand there.
    #[error(
        "the start {place:?} is inside an obstacle or too low under a ceiling; start elsewhere, or with a smaller avatar"
    )]
    Blocked {
        /// As given.
        place: [f64; 3],
    },
    /// A search over more places than memory is meant to hold.
    #[error("expected at most {limit} places to search, got more with steps of {step}; give a longer step")]
    TooManyPlaces {
        /// The greatest number of places.
        limit: usize,
        /// The length of a step.
        step: f64,
    },
    /// A search that would not end while anybody waits.
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
    /// A slice that is needed is not loaded.
    #[error(transparent)]
    Unloaded(#[from] Unloaded),
}
