//! Regression checks: answers and instruction counts, compared with those on record.
//!
//! A record holds the answers and instruction counts of a release, which need not be true. It
//! reveals unintended changes. `verify answers` and `verify counts` are its programs; the tests
//! compare the answers to the shipped cases too.

pub mod answers;
pub mod cases;
pub mod counts;
