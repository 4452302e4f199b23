//! The guard: answers and instruction counts on record, to compare those of today with.
//!
//! A record holds what a release answered and how many instructions it took, not what is true. It finds what
//! a change of the inside alters by mistake. `verify answers` and `verify counts` are its programs; the
//! answers to shipped cases are compared in the tests as well.

pub mod answers;
pub mod cases;
pub mod counts;
