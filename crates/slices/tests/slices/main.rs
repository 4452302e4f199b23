//! Maps against their naive twin, in a generated house, on disk, and with bad input.
#![cfg(test)]

mod bad_input;
mod built;
mod house;
mod objects;
mod passages;
mod ramps;
mod reaching;
mod real;
mod stored;
mod storeys;
mod twin;
mod walking;
