#![doc = include_str!("../README.md")]

#[cfg(target_endian = "big")]
compile_error!(
    "nearmiss-store uses arrays in place from a little-endian file; big-endian targets are not supported"
);

// In reading order: the bytes on disk, their storage in memory, reading, writing.
mod header;
mod id;
mod section;

mod array;
mod bytes;
mod map;

mod file;
mod metadata;
mod sniff;

mod atomic;
mod writer;

#[cfg(feature = "mmap")]
mod own_map;
mod room;
#[cfg(feature = "mmap")]
mod warden;
mod work;
mod work_error;

mod error;
mod flaw;
mod words;

pub use array::Array;
pub use atomic::replace_file;
pub use bytes::Bytes;
pub use error::{ContainerFault, OpenError, WriteError, WriteStep};
pub use file::{Check, File};
pub use flaw::{Flaw, LoadError};
pub use header::LAYOUT;
pub use id::SectionId;
pub use metadata::METADATA_LIMIT;
pub use room::Room;
pub use section::Section;
pub use sniff::Looks;
pub use work::{Progress, Stage, Workspace};
pub use work_error::WorkError;
pub use writer::Writer;
