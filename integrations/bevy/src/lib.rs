#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

/// The example of the guide compiles and runs.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/guide/bevy.md")]
struct Guide;

mod asset;
mod collider;
mod contact;
mod convert;
#[cfg(feature = "gizmos")]
mod gizmos;
mod plugin;
mod queries;

pub use asset::{ScanAsset, ScanLoadError, ScanLoader, ScanSettings};
pub use collider::{ScanCollider, ScanWorld};
pub use contact::{ContactPhase, ScanContact};
pub use convert::{pose_of, ray_of, sphere_of};
#[cfg(feature = "gizmos")]
pub use gizmos::{ScanGizmos, ScanGizmosPlugin};
pub use plugin::{ScanPlugin, ScanSystems};
pub use queries::Scans;
