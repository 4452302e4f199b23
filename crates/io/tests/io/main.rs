//! Tests of readers and writers, with generated and real files.

mod errors;
mod expansion;
mod glances;
mod mutations;
mod pieces;
mod point_cloud2;
mod real_data;
mod round_trips;
mod writing;
