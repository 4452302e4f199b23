//! `Room`: a large writable array, in memory or in a file.

use std::fmt;
use std::ops::{Deref, DerefMut};

use bytemuck::Pod;

use crate::array::Array;
#[cfg(feature = "mmap")]
use crate::bytes::Bytes;
#[cfg(feature = "mmap")]
use crate::own_map::OwnMap;
use crate::work_error::WorkError;

/// A writable array of a [`Workspace`](crate::Workspace).
///
/// Derefs to `[T]`. Each deref of an array in a file checks bounds and alignment again. Take the
/// slice once, outside the loop.
pub struct Room<T> {
    backing: Backing<T>,
}

enum Backing<T> {
    Memory(Vec<T>),
    #[cfg(feature = "mmap")]
    File {
        map: OwnMap,
        len: usize,
    },
}

impl<T: Pod> Room<T> {
    pub(crate) fn in_memory(len: usize) -> Result<Self, WorkError> {
        let elements = bytemuck::allocation::try_zeroed_vec(len);
        let refused = |()| WorkError::memory(len.saturating_mul(size_of::<T>()));
        elements.map(Self::from).map_err(refused)
    }

    #[cfg(feature = "mmap")]
    pub(crate) fn in_file(map: OwnMap, len: usize) -> Self {
        Self { backing: Backing::File { map, len } }
    }

    /// Shortens the array to its first `len` elements.
    pub fn truncate(&mut self, len: usize) {
        match &mut self.backing {
            Backing::Memory(elements) => elements.truncate(len),
            #[cfg(feature = "mmap")]
            Backing::File { len: own, .. } => *own = len.min(*own),
        }
    }
}

impl<T: Pod> Deref for Room<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        match &self.backing {
            Backing::Memory(elements) => elements,
            #[cfg(feature = "mmap")]
            Backing::File { map, len } => &bytemuck::cast_slice(map.bytes())[..*len],
        }
    }
}

impl<T: Pod> DerefMut for Room<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.backing {
            Backing::Memory(elements) => elements,
            #[cfg(feature = "mmap")]
            Backing::File { map, len } => &mut bytemuck::cast_slice_mut(map.bytes_mut())[..*len],
        }
    }
}

impl<T: Pod> From<Vec<T>> for Room<T> {
    fn from(elements: Vec<T>) -> Self {
        Self { backing: Backing::Memory(elements) }
    }
}

impl<T: Pod> From<Room<T>> for Array<T> {
    fn from(room: Room<T>) -> Self {
        match room.backing {
            Backing::Memory(elements) => elements.into(),
            #[cfg(feature = "mmap")]
            Backing::File { map, len } => Self::in_place(Bytes::own(map), 0..len * size_of::<T>()),
        }
    }
}

/// Shows the number of elements, but not the elements: there may be millions.
impl<T: Pod> fmt::Debug for Room<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Room").field("len", &self.len()).finish_non_exhaustive()
    }
}
