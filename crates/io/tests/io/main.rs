//! What readers and the writer promise, on made and on real files.

mod errors;
mod expansion;
mod glances;
mod mutations;
mod pieces;
mod real_data;
mod round_trips;
mod writing;
