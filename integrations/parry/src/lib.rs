#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

/// The example of the guide compiles and runs.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/rapier.md")]
struct Guide;

mod casts;
mod character;
mod character_options;
mod convert;
mod dispatcher;
mod manifolds;
mod mass;
mod obstacles;
mod parts;
mod question;
mod scan_shape;

pub use character::{Character, Stride};
pub use character_options::{CharacterError, CharacterOptions};
pub use convert::{from_pose, to_pose};
pub use dispatcher::ScanDispatcher;
pub use obstacles::Obstacle;
pub use scan_shape::ScanShape;
