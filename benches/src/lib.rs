#![doc = include_str!("../README.md")]

pub mod anjos2012;
pub mod asked;
pub mod clock;
pub mod counting;
pub mod figures;
pub mod guard;
pub mod hulls;
pub mod in_scan;
pub mod klein2004;
pub mod machine;
pub mod object;
pub mod plot;
pub mod poses;
pub mod questions;
pub mod rivals;
pub mod sample;
pub mod scorer;
pub mod sweep;
pub mod truth;

/// The error type of the programs here.
pub type Failure = Box<dyn std::error::Error>;
