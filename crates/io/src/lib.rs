#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod glance;
mod read;
mod recognise;
mod rows;

mod error;
mod format;
mod sink;

#[cfg(feature = "e57")]
mod e57;
#[cfg(feature = "gltf")]
mod gltf;
mod las;
mod npy;
mod obj;
mod off;
mod pcd;
mod ply;
mod point_cloud2;
mod stl;
mod xyz;

mod pieces;

mod columns;
#[cfg(any(feature = "e57", feature = "gltf", feature = "laz"))]
mod guard;
mod input;
mod points;
mod scalar;
mod selection;
mod text;

mod out;
mod write;

pub use error::{At, Fault, Foreign, Item, Place, ReadError};
pub use format::{Format, UnknownFormatName};
pub use glance::{Glance, glance};
pub use out::{OutError, OutputFormat, PointWriter, ScaleOffset, Survey, UnknownOutputFormat};
pub use pieces::{Pieces, PointPieces, read_in_pieces, read_watched};
pub use point_cloud2::{Invalid, PointCloud2, PointCloud2Error, PointCloud2View, PointColumn, PointField};
pub use points::Points;
pub use read::{format_of, read, read_bytes, read_mesh, read_mesh_bytes};
pub use sink::Model;
pub use write::{Column, PlyError, PlyPoints};
