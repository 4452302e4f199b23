//! Rigid motions of two things: the proof that a whole motion is free, and the search for its first
//! impact (`docs/theory/motions.md`).

pub(crate) mod advance;
pub(crate) mod answer;
pub(crate) mod course;
pub(crate) mod impact;
pub(crate) mod interval;
pub(crate) mod plan;
pub(crate) mod scans;
pub(crate) mod solids;
pub(crate) mod step;
pub(crate) mod travel;
