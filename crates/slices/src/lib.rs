#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

// In reading order: the grid, one image, from points to a map.
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

// Queries and walks.
mod object;
mod query;

mod avatar;
mod response;
mod route;
mod walk;
mod walk_error;

// Places where an avatar can stand, reach and routes.
mod floors;
mod lattice;
mod reach;
mod shortest;
mod smooth;
mod standing;
mod steps;

// Maps on disk, and loading on demand.
mod cache;
mod encode;
mod store;
mod target;

pub use avatar::{Avatar, AvatarOptions};
pub use build::SliceBuilder;
pub use cache::{CacheCounts, CacheOptions, SliceCache};
pub use error::SliceError;
pub use floors::{Storey, storey_of};
pub use grid::{Block, Grid, LEVELS};
pub use lattice::StepGrid;
pub use map::{About, SliceMap, Unloaded};
pub use object::ObjectError;
pub use options::{Obstacle, Pixel, SliceOptions, SlicePlan};
pub use query::{Floor, Occupancy};
pub use reach::{Covered, Reach};
pub use response::{Back, Response, Slide};
pub use route::{Building, Ended, Route};
pub use shortest::{FoundRoute, RouteError};
pub use slice::{Content, Slice};
pub use standing::{Misplaced, Standing, StartError};
pub use store::{SliceFolder, StoreError};
pub use target::SliceTarget;
pub use up::{UnknownAxis, Up};
pub use walk::{Step, Walker, step_each};
pub use walk_error::WalkError;
