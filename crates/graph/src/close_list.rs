//! Compressed lists of close pairs, four bytes a pair.
//!
//! Points are in the order of the hierarchy's leaves, so most close points have indices near each
//! other. Two bytes hold the difference of the indices. Two more bytes hold the distance, rounded
//! to 14 significant bits (13 of them stored), with an exponent from a window of eight binades that
//! each list chooses. The relative error is at most 2⁻¹⁴ = 6.1e-5. The few pairs that do not fit
//! are stored separately, at full size.

use std::ops::Range;
use std::slice::Iter;

use bytemuck::{Pod, Zeroable};

/// A close point and its distance along the graph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Close {
    /// Index of the point.
    pub point: u32,
    /// Length of a shortest path from the point, with a relative error of at most 2⁻¹⁴.
    pub distance: f32,
}

/// A pair that does not fit into four bytes.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Beside {
    /// Index of the pair among all pairs.
    pub(crate) pair: u32,
    pub(crate) point: u32,
    pub(crate) distance: f32,
}

/// Offset that marks a pair stored separately.
pub(crate) const BESIDE: i16 = i16::MIN;

/// Number of low bits of a single-precision number that are dropped.
const DROPPED: u32 = 10;
/// Number of bits of its mantissa that are kept.
const KEPT: u32 = f32::MANTISSA_DIGITS - 1 - DROPPED;
/// Number of binades that a code can represent.
const BINADES: u32 = 1 << (16 - KEPT);
/// Exponents of the lowest binade: at least 1, so that all numbers are normal, and low enough that
/// all are finite.
const FLOORS: std::ops::RangeInclusive<u32> = 1..=255 - BINADES;

/// Returns the leading bits of a distance, rounded to nearest: exponent and mantissa.
#[inline]
fn leading(distance: f32) -> u32 {
    let bits = distance.to_bits();
    (bits >> DROPPED) + (bits >> (DROPPED - 1) & 1)
}

/// Returns a distance rounded as by packing. Distances stored separately are rounded too, so that
/// all stay in order.
pub(crate) fn kept(distance: f32) -> f32 {
    f32::from_bits(leading(distance) << DROPPED)
}

/// Returns the greatest value that a distance of at most `most` can have after packing.
pub(crate) fn rounded(most: f32) -> f32 {
    most.max(kept(most))
}

pub(crate) fn is_floor(floor: u8) -> bool {
    FLOORS.contains(&u32::from(floor))
}

/// Returns the floor, the exponent of the lowest binade, with which most distances of `list` fit.
/// Of several such floors, the highest is returned. `list` is sorted by distance and starts with 0.
pub(crate) fn floor(list: &[Close]) -> u8 {
    let exponent = |close: &Close| leading(close.distance) >> KEPT;
    let below = |top: u32| (top + 1).saturating_sub(BINADES).clamp(*FLOORS.start(), *FLOORS.end());
    let highest = below(list.last().map_or(0, exponent));
    let (mut first, mut best) = (0, (0, highest));
    // Almost always all distances fit.
    if list.get(1).is_some_and(|nearest| exponent(nearest) < highest) {
        for (k, close) in list.iter().enumerate() {
            let floor = below(exponent(close));
            while exponent(&list[first]) < floor && first < k {
                first += 1;
            }
            best = best.max((k - first, floor));
        }
    }
    u8::try_from(best.1).unwrap_or(u8::MAX)
}

/// Packs `close` for the list of point `own`: the difference of indices and the code of the
/// distance. If it does not fit, the difference is [`BESIDE`].
#[inline]
pub(crate) fn pack(own: u32, floor: u8, close: Close) -> (i16, u16) {
    // Modulo 2³², as unpacking adds modulo 2³².
    let difference = close.point.wrapping_sub(own).cast_signed();
    let code = leading(close.distance).wrapping_sub(u32::from(floor) << KEPT);
    #[expect(clippy::cast_possible_truncation, reason = "whether they fit is seen below")]
    let (offset, low) = (difference as i16, code as u16);
    let near = (i32::from(offset) == difference) & (offset != BESIDE);
    let coded = (u32::from(low) == code) & (low != 0);
    let at_none = close.distance == 0.0;
    let fits = near & (coded | at_none);
    (if fits { offset } else { BESIDE }, if fits & !at_none { low } else { 0 })
}

#[inline]
fn unpack(floor: u8, code: u16) -> f32 {
    let bits = ((u32::from(floor) << KEPT) + u32::from(code)) << DROPPED;
    f32::from_bits(if code == 0 { 0 } else { bits })
}

/// Returns the first position of `wanted`. Compares 16 offsets at a time.
fn position(offsets: &[i16], wanted: i16) -> Option<usize> {
    let (chunks, rest) = offsets.as_chunks::<16>();
    let is_in = |chunk: &[i16; 16]| chunk.iter().fold(false, |found, &offset| found | (offset == wanted));
    let (before, some) = match chunks.iter().position(is_in) {
        Some(k) => (16 * k, &chunks[k][..]),
        None => (16 * chunks.len(), rest),
    };
    Some(before + some.iter().position(|&offset| offset == wanted)?)
}

/// All lists, borrowed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lists<'a> {
    pub(crate) starts: &'a [u32],
    pub(crate) floors: &'a [u8],
    pub(crate) offsets: &'a [i16],
    pub(crate) codes: &'a [u16],
    pub(crate) beside: &'a [Beside],
}

impl<'a> Lists<'a> {
    fn range(&self, i: usize) -> Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    #[inline]
    pub(crate) fn of(&self, i: usize) -> CloseList<'a> {
        let range = self.range(i);
        CloseList {
            #[expect(clippy::cast_possible_truncation, reason = "points are numbered by 32 bits")]
            own: i as u32,
            floor: self.floors[i],
            end: self.starts[i + 1],
            offsets: self.offsets[range.clone()].iter(),
            codes: self.codes[range].iter(),
            beside: self.beside,
        }
    }

    /// Fills `closes` with the list of `i`, as [`Self::of`] would, but many at a time.
    pub(crate) fn read(&self, i: usize, closes: &mut Vec<Close>) {
        closes.clear();
        let list = self.of(i);
        let (own, floor, offsets) = (list.own, list.floor, list.offsets.as_slice());
        closes.extend(offsets.iter().zip(list.codes.as_slice()).map(|(&offset, &code)| Close {
            point: own.wrapping_add_signed(offset.into()),
            distance: unpack(floor, code),
        }));
        if position(offsets, BESIDE).is_some() {
            closes.clear();
            closes.extend(list);
        }
    }

    /// Returns the index among all pairs of the pair of `i` with `j`, and their distance.
    pub(crate) fn find(&self, i: u32, j: u32) -> Option<(usize, f32)> {
        let range = self.range(i as usize);
        let offsets = &self.offsets[range.clone()];
        let offset = i16::try_from(j.wrapping_sub(i).cast_signed()).ok().filter(|&offset| offset != BESIDE);
        if let Some(place) = offset.and_then(|offset| position(offsets, offset)) {
            let pair = range.start + place;
            return Some((pair, unpack(self.floors[i as usize], self.codes[pair])));
        }
        position(offsets, BESIDE)?;
        let first = self.beside.partition_point(|b| (b.pair as usize) < range.start);
        let of_list = self.beside[first..].iter().take_while(|b| (b.pair as usize) < range.end);
        let found = of_list.copied().find(|b| b.point == j)?;
        Some((found.pair as usize, found.distance))
    }
}

/// The close points of a point, nearest first.
#[derive(Debug, Clone)]
pub struct CloseList<'a> {
    own: u32,
    floor: u8,
    /// Index among all pairs of the end of the list.
    end: u32,
    offsets: Iter<'a, i16>,
    codes: Iter<'a, u16>,
    /// All pairs stored separately; after the first of this list was read, only those that follow
    /// it.
    beside: &'a [Beside],
}

impl CloseList<'_> {
    /// Returns the pair that is stored separately and precedes the last `left` pairs of the list.
    #[cold]
    fn stored_separately(&mut self, left: usize) -> Close {
        let pair = (self.end as usize).wrapping_sub(left + 1);
        let is_before = |beside: &Beside| (beside.pair as usize) < pair;
        // Except for the first, the next pair is at the front.
        if self.beside.first().is_some_and(is_before) {
            self.beside = &self.beside[self.beside.partition_point(is_before)..];
        }
        match self.beside.split_first() {
            Some((&Beside { pair: found, point, distance }, rest)) if found as usize == pair => {
                self.beside = rest;
                Close { point, distance }
            }
            // Happens with a forged file only: returns a point out of range at infinite distance.
            _ => Close { point: u32::MAX, distance: f32::INFINITY },
        }
    }
}

impl Iterator for CloseList<'_> {
    type Item = Close;

    #[inline]
    fn next(&mut self) -> Option<Close> {
        let (&offset, &code) = (self.offsets.next()?, self.codes.next()?);
        if offset == BESIDE {
            return Some(self.stored_separately(self.offsets.len()));
        }
        let point = self.own.wrapping_add_signed(offset.into());
        Some(Close { point, distance: unpack(self.floor, code) })
    }

    #[inline]
    fn size_hint(&self) -> (usize, Option<usize>) {
        self.offsets.size_hint()
    }
}

impl ExactSizeIterator for CloseList<'_> {}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(point: u32, distance: f32) -> Close {
        Close { point, distance }
    }

    #[test]
    fn what_fits_is_rounded_by_a_sixteen_thousandth_at_most() {
        for start in [1e-37_f32, 1e-9, 0.3, 1.0, 77.7, 1e30] {
            let floor = floor(&[close(0, 0.0), close(1, 200.0 * start)]);
            let (mut before, mut distance) = (0.0, start * 2.0);
            while distance < 200.0 * start {
                let (offset, code) = pack(7, floor, close(3, distance));
                let back = unpack(floor, code);
                assert_eq!(offset, -4);
                assert!((back - distance).abs() <= 6.104e-5 * distance, "{distance} comes back as {back}");
                assert!(back >= before, "order is kept: {before}, {back}");
                assert_eq!(pack(7, floor, close(3, back)), (offset, code), "twice is once");
                (before, distance) = (back, distance * 1.000_03);
            }
        }
        assert_eq!(pack(7, 100, close(7, 0.0)), (0, 0));
        assert_eq!(unpack(100, 0).to_bits(), 0);
    }

    #[test]
    fn what_does_not_fit_is_known() {
        let far = |point: u32| pack(40_000, 127, close(point, 1.5)) == (BESIDE, 0);
        assert!([40_000 + 32_767, 40_000 - 32_767].into_iter().all(|p| !far(p)), "as far as two bytes reach");
        assert!([40_000 + 32_768, 40_000 - 32_768, 0, u32::MAX].into_iter().all(far), "further");
        let lost = |floor: u8, distance: f32| pack(0, floor, close(1, distance)) == (BESIDE, 0);
        // The range is 1 to below 256, except for values that round to either end.
        assert!(!lost(127, 1.000_2) && lost(127, 1.000_01) && lost(127, 0.5));
        assert!(!lost(127, 255.98) && lost(127, 255.999) && lost(127, 256.0));
        assert!(lost(1, 1e-45) && lost(247, f32::MAX) && !lost(247, 3.4e38));
        assert!(lost(247, f32::NAN) && lost(1, -1.0) && lost(1, -f32::NAN), "no distance at all");
    }

    #[test]
    fn the_first_of_several_is_found() {
        for count in [0, 1, 15, 16, 17, 40, 64] {
            let offsets: Vec<i16> = (0..count).map(|k| k / 2).collect();
            for wanted in -1..=count {
                assert_eq!(position(&offsets, wanted), offsets.iter().position(|&o| o == wanted), "{wanted}");
            }
        }
    }

    #[test]
    fn every_code_of_a_floor_is_a_finite_distance_of_its_own() {
        for floor in [1, 2, 127, 247] {
            assert!(is_floor(floor));
            let distances: Vec<f32> = (0..=u16::MAX).map(|code| unpack(floor, code)).collect();
            assert!(distances.is_sorted_by(|a, b| a < b), "floor {floor}");
            assert!(distances[1] >= f32::MIN_POSITIVE && distances[65535].is_finite(), "floor {floor}");
        }
        assert!(!is_floor(0) && !is_floor(248) && !is_floor(255));
    }

    #[test]
    fn the_floor_is_where_most_fit() {
        let of = |distances: &[f32]| floor(&distances.iter().map(|&d| close(0, d)).collect::<Vec<_>>());
        assert_eq!(of(&[0.0]), 1);
        // 1 has exponent 127.
        assert_eq!(of(&[0.0, 0.5, 1.0]), 120);
        assert_eq!(of(&[0.0, 0.01, 0.02, 0.9, 0.95, 1.0]), 120, "all fit");
        assert_eq!(of(&[0.0, 1e-3, 1.1e-3, 1.2e-3, 1.0]), 110, "one that is far stands beside");
        assert_eq!(of(&[0.0, 1e-6, 1.0, 1.1, 1.2]), 120, "one that is near stands beside");
        assert_eq!(of(&[0.0, 1e-45, 1e-44]), 1);
        assert_eq!(of(&[0.0, f32::MAX]), 247);
    }
}
