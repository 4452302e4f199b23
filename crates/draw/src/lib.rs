#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

pub mod canvas;
pub mod font;
pub mod legend;
pub mod marks;
pub mod picture;
