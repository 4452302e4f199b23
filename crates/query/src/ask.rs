//! The options and answers of queries, as plain values.

pub(crate) mod answer;
pub(crate) mod budget;
pub(crate) mod interpolation;
pub(crate) mod occupancy;
pub(crate) mod options;
