//! `Array`: elements backed by a `Vec` or by the bytes of a file.

use std::fmt;
use std::ops::{Deref, Range};
use std::ptr::NonNull;
use std::sync::Arc;

use bytemuck::Pod;

use crate::bytes::Bytes;

/// A read-only array of plain-old-data elements, backed by a `Vec` or by the bytes of a container.
///
/// Derefs to `[T]`, at the cost of two loads. Cloning increments a reference count and copies nothing.
/// To change the values of one clone, use [`Array::to_mut`], which copies shared elements first.
pub struct Array<T> {
    /// The elements, which `backing` keeps alive and in place.
    elements: NonNull<[T]>,
    backing: Backing<T>,
}

enum Backing<T> {
    Owned(Arc<Vec<T>>),
    InPlace(Bytes),
}

// SAFETY: an array is a shared reference to its elements together with the backing, both of which may be
// sent to and shared with other threads. `elements` is written through only by `to_mut`, which borrows
// the array mutably and owns the backing alone.
#[expect(unsafe_code, reason = "a pointer to elements that the same struct keeps alive")]
unsafe impl<T: Send + Sync> Send for Array<T> {}
// SAFETY: as above.
#[expect(unsafe_code, reason = "a pointer to elements that the same struct keeps alive")]
unsafe impl<T: Send + Sync> Sync for Array<T> {}

impl<T: Pod> Array<T> {
    /// Creates an array of the elements in `range` of `bytes`: in place if the address is aligned
    /// for `T`, otherwise as a copy.
    ///
    /// The length of `range` must be a multiple of the size of `T`; the caller has compared element
    /// sizes.
    pub(crate) fn in_place(bytes: Bytes, range: Range<usize>) -> Self {
        let raw = &bytes.as_slice()[range];
        match bytemuck::try_cast_slice::<u8, T>(raw) {
            Ok(elements) => Self { elements: NonNull::from(elements), backing: Backing::InPlace(bytes) },
            Err(_) => bytemuck::pod_collect_to_vec(raw).into(),
        }
    }

    /// Returns `true` if the elements are bytes of a container, without memory of their own.
    #[must_use]
    pub fn is_in_place(&self) -> bool {
        matches!(self.backing, Backing::InPlace(_))
    }

    /// Converts the array to a `Vec`, without a copy if this is the only clone and is backed by a
    /// `Vec`.
    #[must_use]
    pub fn into_vec(self) -> Vec<T> {
        match self.backing {
            Backing::Owned(elements) => Arc::unwrap_or_clone(elements),
            Backing::InPlace(_) => self.to_vec(),
        }
    }

    /// Returns the elements for writing. They are copied first if they are in a file or shared with
    /// another clone, so the file and other clones keep their values.
    pub fn to_mut(&mut self) -> &mut [T] {
        if self.is_in_place() {
            *self = self.to_vec().into();
        }
        match &mut self.backing {
            Backing::Owned(elements) => {
                let elements = Arc::make_mut(elements);
                self.elements = pointer_to(elements);
                elements
            }
            Backing::InPlace(_) => &mut [],
        }
    }
}

/// Returns a pointer to the elements, which stays valid until the vector is changed or dropped.
#[expect(clippy::ptr_arg, reason = "the pointer of the vector is meant, not that of a slice of it")]
fn pointer_to<T>(elements: &Vec<T>) -> NonNull<[T]> {
    // From the vector's own pointer rather than a slice, so that a write through the vector leaves it
    // valid.
    let start = NonNull::new(elements.as_ptr().cast_mut()).unwrap_or(NonNull::dangling());
    NonNull::slice_from_raw_parts(start, elements.len())
}

impl<T> Deref for Array<T> {
    type Target = [T];

    #[inline]
    #[expect(unsafe_code, reason = "a pointer to elements that the same struct keeps alive")]
    fn deref(&self) -> &[T] {
        // SAFETY: `elements` points to initialised elements of the vector or the bytes of `backing`.
        // Neither moves or changes its content: a vector is behind an `Arc`, and only `to_mut` writes
        // to it, which sets `elements` anew and holds the array borrowed; bytes are never written.
        unsafe { self.elements.as_ref() }
    }
}

impl<T> Clone for Array<T> {
    fn clone(&self) -> Self {
        let backing = match &self.backing {
            Backing::Owned(elements) => Backing::Owned(Arc::clone(elements)),
            Backing::InPlace(bytes) => Backing::InPlace(bytes.clone()),
        };
        Self { elements: self.elements, backing }
    }
}

impl<T> Default for Array<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T> From<Vec<T>> for Array<T> {
    fn from(elements: Vec<T>) -> Self {
        Self { elements: pointer_to(&elements), backing: Backing::Owned(Arc::new(elements)) }
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
    fn elements_outlive_the_array_they_came_from() {
        for array in [Array::from(vec![5_u32; 16]), Array::in_place(given(vec![5; 64]), 0..64)] {
            let mut clone = array.clone();
            let moved = Box::new(array);
            let first = moved[0];
            drop(moved);
            assert_eq!(*clone, [first; 16]);
            clone.to_mut()[3] = 1;
            let again = clone.clone();
            clone.to_mut()[3] = 2;
            assert_eq!((again[3], clone[3]), (1, 2));
        }
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
