//! Total order of floating-point numbers, and heap items ordered by distance.

use std::cmp::Ordering;

/// Returns the bits of `x`, reordered so that they compare as [`f32::total_cmp`] does.
///
/// ```
/// use nearmiss_lanes::order::{ascending, from_ascending};
///
/// assert!(ascending(-1.0) < ascending(0.5));
/// assert_eq!(from_ascending(ascending(-1.0)), -1.0);
/// ```
#[inline]
#[must_use]
pub const fn ascending(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

/// Returns the number whose [`ascending`] bits are `bits`.
#[inline]
#[must_use]
pub const fn from_ascending(bits: u32) -> f32 {
    f32::from_bits(if bits >> 31 == 0 { !bits } else { bits & !(1 << 31) })
}

/// An item and its distance. The nearest compares greatest, so that a max-heap pops it first. Among
/// items at the same distance, the least compares greatest.
#[derive(Debug, Clone, Copy)]
pub struct Near<T> {
    /// The distance of the item.
    pub distance: f32,
    /// The item.
    pub item: T,
}

impl<T: Ord> Ord for Near<T> {
    #[inline]
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then_with(|| other.item.cmp(&self.item))
    }
}

impl<T: Ord> PartialOrd for Near<T> {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T: Ord> PartialEq for Near<T> {
    #[inline]
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl<T: Ord> Eq for Near<T> {}

#[cfg(test)]
mod tests {
    use std::collections::BinaryHeap;

    use super::*;

    #[test]
    fn integers_are_in_the_order_of_numbers() {
        let numbers = [
            f32::NAN,
            f32::INFINITY,
            f32::MAX,
            1.0,
            1e-40,
            0.0,
            -0.0,
            -1e-40,
            -1.0,
            f32::NEG_INFINITY,
            -f32::NAN,
        ];
        for a in numbers {
            assert_eq!(from_ascending(ascending(a)).to_bits(), a.to_bits(), "{a}");
            for b in numbers {
                assert_eq!(ascending(a).cmp(&ascending(b)), a.total_cmp(&b), "{a} and {b}");
            }
        }
    }

    #[test]
    fn a_heap_gives_the_nearest_first_and_of_equals_the_least() {
        let near = |distance, item| Near { distance, item };
        let mut heap: BinaryHeap<_> = [near(1.0, 3), near(0.5, 9), near(0.5, 2), near(-1.0, 7)].into();
        let order: Vec<i32> = std::iter::from_fn(|| heap.pop()).map(|near| near.item).collect();
        assert_eq!(order, [7, 2, 9, 3]);
    }
}
