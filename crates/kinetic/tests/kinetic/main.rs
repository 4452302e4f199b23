//! Tests of the kinetic tree, in one program so that they link once.

mod model;

mod contacts;
mod degenerate;
mod queries;
mod saved;
mod twin;
