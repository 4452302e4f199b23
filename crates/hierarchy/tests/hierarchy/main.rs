//! Tests of the hierarchy, as one program that is linked once.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod apart;
mod cells;
mod coverings;
mod deforming;
mod enclosures;
mod kinds;
mod levels;
mod metric;
mod parts;
mod survey;
mod twin;
