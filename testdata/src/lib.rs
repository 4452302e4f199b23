#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

pub mod oracle;

pub mod shapes;

pub mod pairs;

pub mod cuts;

pub mod arbitrary;
pub mod dragon;
pub mod files;
pub mod house;
pub mod instructions;
pub mod matrices;
pub mod scanner;
pub mod scenes;
