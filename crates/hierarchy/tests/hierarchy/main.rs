//! The hierarchy: everything is one program, which links once.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

mod apart;
mod coverings;
mod enclosures;
mod kinds;
mod levels;
mod metric;
mod survey;
mod twin;
