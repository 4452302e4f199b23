#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

// In reading order: where things lie, one image, from points to a map.
mod grid;
mod up;

mod bits;
mod slice;

mod build;
mod error;
mod finish;
mod layer;
mod map;
mod options;

// What is asked of it.
mod object;
mod query;

mod response;
mod route;
mod walk;

// On disk, and from there as it is needed.
mod cache;
mod encode;
mod store;
mod target;

pub use build::SliceBuilder;
pub use cache::{CacheCounts, CacheOptions, SliceCache};
pub use error::SliceError;
pub use grid::{Block, Grid, LEVELS};
pub use map::{About, SliceMap, Unloaded};
pub use object::ObjectError;
pub use options::{Obstacle, Pixel, SliceOptions, SlicePlan};
pub use query::{Floor, Occupancy};
pub use response::{Back, Response, Slide};
pub use route::{Building, Ended, Route};
pub use slice::{Content, Slice};
pub use store::{SliceFolder, StoreError};
pub use target::SliceTarget;
pub use up::{UnknownAxis, Up};
pub use walk::{Avatar, AvatarOptions, Step, WalkError, Walker, step_each};
