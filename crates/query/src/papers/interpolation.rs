//! Interpolation search (Klein & Zachmann 2005, §4).

mod flat;
mod leaves;
mod partners;
mod refine;
mod root;
mod scratch;
mod side;
mod sides;
mod survey;
mod volume;

pub(crate) use scratch::InterpolationScratch;
