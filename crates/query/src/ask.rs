//! What is asked and answered: values alone.

pub(crate) mod answer;
pub(crate) mod budget;
pub(crate) mod interpolation;
pub(crate) mod occupancy;
pub(crate) mod options;
