//! A slice in few bytes: which pixels hold something, and what those hold, compressed.
//!
//! Four bytes, the number of occupied pixels; then, as one LZ4 block, a bit a pixel (row by row, each from a byte of its own), a bit
//! an occupied pixel for obstacles, and a byte each for its top, as the difference to that of the occupied pixel before.

use crate::slice::{Slice, words};

/// The bytes of a slice.
pub(crate) fn encode(slice: &Slice) -> Vec<u8> {
    let (width, tops) = (slice.width() as usize, slice.tops());
    let row_bytes = width.div_ceil(8);
    let mut raw = vec![0_u8; row_bytes * slice.height() as usize];
    let mut obstacles = Vec::new();
    let mut steps = Vec::new();
    let (mut before, mut count) = (0_u8, 0_u32);
    for (row, tops) in (0..slice.height()).zip(tops.chunks_exact(width.max(1))) {
        for (column, &top) in (0..slice.width()).zip(tops).filter(|(_, top)| **top != 0) {
            raw[row as usize * row_bytes + column as usize / 8] |= 1 << (column % 8);
            if count.is_multiple_of(8) {
                obstacles.push(0);
            }
            if let Some(byte) = obstacles.last_mut() {
                *byte |= u8::from(slice.is_obstacle(column, row)) << (count % 8);
            }
            steps.push(top.wrapping_sub(before));
            (before, count) = (top, count + 1);
        }
    }
    raw.extend(obstacles);
    raw.extend(steps);
    let mut bytes = count.to_le_bytes().to_vec();
    bytes.extend(lz4_flex::block::compress(&raw));
    bytes
}

/// The slice of this size that these bytes are; none if they are those of no slice.
pub(crate) fn decode(bytes: &[u8], [width, height]: [u32; 2]) -> Option<Slice> {
    let (count, packed) = bytes.split_first_chunk()?;
    let count = u32::from_le_bytes(*count) as usize;
    let (columns, rows) = (width as usize, height as usize);
    let row_bytes = columns.div_ceil(8);
    if count > columns * rows {
        return None;
    }
    let bits = row_bytes * rows;
    let length = bits + count.div_ceil(8) + count;
    let raw = lz4_flex::block::decompress(packed, length).ok().filter(|raw| raw.len() == length)?;
    let (bits, rest) = raw.split_at(bits);
    let (obstacles, steps) = rest.split_at(count.div_ceil(8));
    let mut tops = vec![0_u8; columns * rows];
    let mut obstacle = vec![0_u64; words(width) * rows];
    let mut filled = Filled { steps, obstacles, taken: 0, before: 0 };
    for (row, bits) in bits.chunks_exact(row_bytes.max(1)).enumerate() {
        let tops = &mut tops[row * columns..(row + 1) * columns];
        let words = &mut obstacle[row * words(width)..(row + 1) * words(width)];
        for (i, &byte) in bits.iter().enumerate().filter(|(_, byte)| **byte != 0) {
            let mut left = byte;
            while left != 0 {
                let column = 8 * i + left.trailing_zeros() as usize;
                left &= left - 1;
                let (top, is_obstacle) = filled.next()?;
                *tops.get_mut(column)? = top;
                words[column / 64] |= u64::from(is_obstacle) << (column % 64);
            }
        }
    }
    let is_whole = filled.taken == count && tops.iter().filter(|top| **top != 0).count() == count;
    is_whole.then(|| Slice::new(width, height, tops, obstacle))
}

/// Occupied pixels, one after the other.
struct Filled<'a> {
    steps: &'a [u8],
    obstacles: &'a [u8],
    taken: usize,
    before: u8,
}

impl Iterator for Filled<'_> {
    type Item = (u8, bool);

    #[inline]
    fn next(&mut self) -> Option<(u8, bool)> {
        let step = *self.steps.get(self.taken)?;
        let is_obstacle = self.obstacles[self.taken / 8] >> (self.taken % 8) & 1 == 1;
        self.before = self.before.wrapping_add(step);
        self.taken += 1;
        Some((self.before, is_obstacle))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of many kinds: rows that end within a word, floors, lone pixels, all that a top can be.
    fn slice(width: u32, height: u32) -> Slice {
        let mut state = 7_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state >> 8
        };
        let mut tops = Vec::new();
        let mut obstacle = vec![0; words(width) * height as usize];
        for row in 0..height {
            for column in 0..width {
                let top = if random() % 3 == 0 { u8::try_from(random() % 256).unwrap() } else { 0 };
                tops.push(top);
                if top != 0 && random() % 2 == 0 {
                    obstacle[row as usize * words(width) + column as usize / 64] |= 1_u64 << (column % 64);
                }
            }
        }
        Slice::new(width, height, tops, obstacle)
    }

    #[test]
    fn slices_come_back_whole() {
        for size in [[1, 1], [7, 3], [64, 2], [65, 5], [200, 100]] {
            let given = slice(size[0], size[1]);
            assert_eq!(decode(&encode(&given), size), Some(given), "{size:?}");
        }
        let empty = Slice::new(700, 700, vec![0; 490_000], vec![0; 700 * words(700)]);
        let bytes = encode(&empty);
        assert!(bytes.len() < 400, "{} bytes of nothing", bytes.len());
        assert_eq!(decode(&bytes, [700, 700]), Some(empty));
    }

    #[test]
    fn what_is_no_slice_is_none_or_another_and_never_a_panic() {
        let size = [65, 5];
        let given = slice(65, 5);
        let bytes = encode(&given);
        let mut others = 0;
        for i in 0..bytes.len() {
            assert!(decode(&bytes[..i], size).is_none(), "cut at {i}");
            for flip in [1, 0x80, 0xff] {
                let mut damaged = bytes.clone();
                damaged[i] ^= flip;
                let other = decode(&damaged, size);
                assert_ne!(other.as_ref(), Some(&given), "byte {i}");
                others += usize::from(other.is_some_and(|other| other.checksum() == given.checksum()));
            }
        }
        assert_eq!(others, 0, "damage that a checksum does not tell");
        assert!(decode(&bytes, [64, 5]).is_none() && decode(&bytes, [0, 0]).is_none());
    }
}
