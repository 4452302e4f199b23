//! `Array`: elements backed by a `Vec` or by the bytes of a file.

use std::fmt;
use std::ops::{Deref, Range};
use std::sync::Arc;

use bytemuck::Pod;

use crate::bytes::Bytes;

/// A read-only array of plain-old-data elements, backed by a `Vec` or by the bytes of a container.
///
/// Derefs to `[T]`. Cloning increments a reference count and copies nothing. To change the values
/// of one clone, use [`Array::to_mut`], which copies shared elements first.
///
/// Each deref of an array in a file checks bounds and alignment again, which takes some
/// nanoseconds. Take the slice once, outside the loop.
pub struct Array<T> {
    backing: Backing<T>,
}

enum Backing<T> {
    Owned(Arc<Vec<T>>),
    /// A range whose address and length suit `T`.
    InPlace {
        bytes: Bytes,
        range: Range<usize>,
    },
}

impl<T: Pod> Array<T> {
    /// Creates an array of the elements in `range` of `bytes`: in place if the address is aligned
    /// for `T`, otherwise as a copy.
    ///
    /// The length of `range` must be a multiple of the size of `T`; the caller has compared element
    /// sizes.
    pub(crate) fn in_place(bytes: Bytes, range: Range<usize>) -> Self {
        let raw = &bytes.as_slice()[range.clone()];
        let backing = match bytemuck::try_cast_slice::<u8, T>(raw) {
            Ok(_) => Backing::InPlace { bytes, range },
            Err(_) => Backing::Owned(Arc::new(bytemuck::pod_collect_to_vec(raw))),
        };
        Self { backing }
    }

    /// Returns `true` if the elements are bytes of a container, without memory of their own.
    #[must_use]
    pub fn is_in_place(&self) -> bool {
        matches!(self.backing, Backing::InPlace { .. })
    }

    /// Converts the array to a `Vec`, without a copy if this is the only clone and is backed by a
    /// `Vec`.
    #[must_use]
    pub fn into_vec(self) -> Vec<T> {
        match self.backing {
            Backing::Owned(elements) => Arc::unwrap_or_clone(elements),
            Backing::InPlace { .. } => self.to_vec(),
        }
    }

    /// Returns the elements for writing. They are copied first if they are in a file or shared with
    /// another clone, so the file and other clones keep their values.
    pub fn to_mut(&mut self) -> &mut [T] {
        if self.is_in_place() {
            self.backing = Backing::Owned(Arc::new(self.to_vec()));
        }
        match &mut self.backing {
            Backing::Owned(elements) => Arc::make_mut(elements).as_mut_slice(),
            Backing::InPlace { .. } => &mut [],
        }
    }
}

impl<T: Pod> Deref for Array<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match &self.backing {
            Backing::Owned(elements) => elements,
            Backing::InPlace { bytes, range } => elements_of(bytes, range),
        }
    }
}

/// Returns the elements in a range of bytes. A function of its own, so that callers inline the
/// rest.
fn elements_of<'b, T: Pod>(bytes: &'b Bytes, range: &Range<usize>) -> &'b [T] {
    bytemuck::cast_slice(&bytes.as_slice()[range.clone()])
}

impl<T> Clone for Array<T> {
    fn clone(&self) -> Self {
        let backing = match &self.backing {
            Backing::Owned(elements) => Backing::Owned(Arc::clone(elements)),
            Backing::InPlace { bytes, range } => {
                Backing::InPlace { bytes: bytes.clone(), range: range.clone() }
            }
        };
        Self { backing }
    }
}

impl<T> Default for Array<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T> From<Vec<T>> for Array<T> {
    fn from(elements: Vec<T>) -> Self {
        Self { backing: Backing::Owned(Arc::new(elements)) }
    }
}

impl<T: Pod> AsRef<[T]> for Array<T> {
    fn as_ref(&self) -> &[T] {
        self
    }
}

impl<'a, T: Pod> IntoIterator for &'a Array<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<T: Pod + PartialEq> PartialEq for Array<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Pod + Eq> Eq for Array<T> {}

/// Shows the number of elements and their backing, but not the elements: there may be millions.
impl<T: Pod> fmt::Debug for Array<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Array")
            .field("len", &self.len())
            .field("in_place", &self.is_in_place())
            .finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn given(bytes: Vec<u8>) -> Bytes {
        bytes.into()
    }

    #[test]
    fn a_vec_goes_in_and_comes_out_without_a_copy() {
        let elements = vec![1_u32, 2, 3];
        let address = elements.as_ptr();
        let array = Array::from(elements);
        assert_eq!(*array, [1, 2, 3]);
        let elements = array.into_vec();
        assert_eq!(elements.as_ptr(), address);
    }

    #[test]
    fn writing_to_one_clone_leaves_the_others() {
        let mut changed = Array::from(vec![1_u32, 2, 3]);
        let kept = changed.clone();
        changed.to_mut()[1] = 9;
        assert_eq!(*changed, [1, 9, 3]);
        assert_eq!(*kept, [1, 2, 3]);

        let bytes = given(vec![7; 64]);
        let mut changed = Array::<u32>::in_place(bytes.clone(), 0..64);
        changed.to_mut()[0] = 0;
        assert!(!changed.is_in_place());
        assert_eq!(changed[..2], [0, 0x0707_0707]);
        assert_eq!(bytes.as_slice(), [7; 64]);
    }

    #[test]
    fn writing_again_to_the_only_clone_does_not_copy_again() {
        let mut array = Array::from(vec![1_u64; 8]);
        let address = array.as_ptr();
        array.to_mut()[0] = 2;
        assert_eq!(array.as_ptr(), address);
    }

    #[test]
    fn an_address_that_does_not_suit_the_element_is_copied() {
        let raw: Vec<u8> = (0..64).collect();
        let bytes = given(raw.clone());
        let expected: Vec<u32> =
            raw[1..61].chunks(4).map(|c| u32::from_le_bytes(c.try_into().unwrap())).collect();
        // One of four neighbouring offsets is aligned for a u32. All four must give the right
        // values.
        let in_place =
            (0..4).filter(|&shift| Array::<u32>::in_place(bytes.clone(), shift..60 + shift).is_in_place());
        assert_eq!(in_place.count(), 1);
        assert_eq!(*Array::<u32>::in_place(bytes, 1..61), *expected);
    }

    #[test]
    fn arrays_cross_threads() {
        fn shareable<S: Send + Sync>(_: &S) {}
        let array = Array::<f32>::in_place(given(vec![0; 64]), 0..64);
        shareable(&array);
        let clone = array.clone();
        let sum = std::thread::spawn(move || clone.iter().sum::<f32>()).join().unwrap();
        assert_eq!(sum, array.iter().sum());
        assert_eq!(format!("{array:?}"), "Array { len: 16, in_place: true, .. }");
        assert_eq!(Array::<f32>::default(), Array::from(Vec::new()));
    }
}
