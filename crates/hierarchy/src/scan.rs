//! A prepared scan: its construction, and the queries about it alone.

pub(crate) mod anew;
pub(crate) mod apart;
pub(crate) mod arrays;
pub(crate) mod build;
pub(crate) mod cells;
pub(crate) mod clearance;
pub(crate) mod closing;
pub(crate) mod data;
pub(crate) mod deform_error;
pub(crate) mod deforming;
pub(crate) mod evaluate;
pub(crate) mod identity;
pub(crate) mod intake;
pub(crate) mod levels;
pub(crate) mod metric;
pub(crate) mod nearest;
pub(crate) mod options;
pub(crate) mod ordered;
pub(crate) mod organised;
pub(crate) mod outline;
mod part;
pub(crate) mod points;
pub(crate) mod prepare;
pub(crate) mod refit;
pub(crate) mod sampling;
pub(crate) mod share;
pub(crate) mod survey;
