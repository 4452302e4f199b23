//! Files that were damaged by accident or on purpose: an error or an answer, in bounded time, and never a
//! wrong answer where checksums are compared.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic, and tell what it counted")]

mod cost;
mod damage;
mod exercise;
mod faults;
mod graph;
mod mutations;
mod repair;
