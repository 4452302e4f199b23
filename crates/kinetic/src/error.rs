//! `KineticError`: the reasons why a plan, a change or a file is rejected.

use nearmiss_store::OpenError;
use thiserror::Error;

/// Error of a kinetic tree or a flight plan.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum KineticError {
    /// A number that is NaN, infinite or too large.
    #[error("expected a {what} of finite numbers up to {limit:e}, got {value}")]
    Number {
        /// Name of the quantity.
        what: &'static str,
        /// The number.
        value: f64,
        /// The greatest magnitude allowed.
        limit: f64,
    },
    /// A time before the clock of the tree.
    #[error(
        "expected a time not before {clock} s, got {time} s; the clock of a kinetic tree only goes forward"
    )]
    Past {
        /// The time given, in seconds.
        time: f64,
        /// The time of the clock, in seconds.
        clock: f64,
    },
    /// Two trees whose clocks differ.
    #[error("expected two trees at the same time, got {a} s and {b} s; advance the earlier one first")]
    Clocks {
        /// The clock of the first tree, in seconds.
        a: f64,
        /// The clock of the second tree, in seconds.
        b: f64,
    },
    /// A leg of a plan that does not start after the leg before it.
    #[error("expected a leg that starts after {after} s, got {start} s; append legs in the order of time")]
    LegOrder {
        /// Start of the leg before, in seconds.
        after: f64,
        /// Start of the rejected leg, in seconds.
        start: f64,
    },
    /// A polyline without places, or with as many times as there are no places.
    #[error("expected as many times as places, at least one, got {times} times and {places} places")]
    Polyline {
        /// Number of times.
        times: usize,
        /// Number of places.
        places: usize,
    },
    /// A point that the tree does not have.
    #[error("expected the index of a point of the tree, got {point}")]
    NoSuchPoint {
        /// The index given.
        point: u32,
    },
    /// A primitive that the tree does not have.
    #[error("expected the index of a primitive of the tree, got {primitive}")]
    NoSuchPrimitive {
        /// The index given.
        primitive: u32,
    },
    /// A point that a primitive still uses.
    #[error("expected a point that no primitive uses, got {point}; remove primitive {primitive} first")]
    InUse {
        /// The point.
        point: u32,
        /// A primitive that uses it.
        primitive: u32,
    },
    /// A primitive with too few or too many points.
    #[error("expected 1 to {most} points in a primitive, got {found}")]
    Arity {
        /// Number of points given.
        found: usize,
        /// The most points that a primitive of this tree can have.
        most: usize,
    },
    /// More points or primitives than 32 bits can number.
    #[error("expected fewer than 2^31 points and primitives, got more; use several trees")]
    TooMany,
    /// A file that cannot be opened, or lacks a section.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A file whose sections contradict each other.
    #[error("expected a consistent kinetic tree, got an invalid {what} (index {index}); save the tree again")]
    Damaged {
        /// Name of the value.
        what: &'static str,
        /// Index of its point, primitive, node or leaf.
        index: usize,
    },
}
