#![doc = include_str!("../README.md")]
#![forbid(unsafe_code)]

mod glance;
mod read;
mod rows;

mod error;
mod format;
mod sink;

mod obj;
mod pcd;
mod ply;
mod xyz;

mod pieces;

mod columns;
mod scalar;
mod text;

mod write;

pub use error::{At, Fault, Foreign, Item, Place, ReadError};
pub use format::{Format, UnknownFormatName};
pub use glance::{Glance, glance};
pub use pieces::{Pieces, PointPieces, read_in_pieces};
pub use read::{read, read_bytes, read_mesh, read_mesh_bytes};
pub use sink::Model;
pub use write::{Column, PlyPoints, WriteError};
