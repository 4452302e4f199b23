//! A slice in few bytes: which pixels hold something, and what those hold, compressed.
//!
//! Four bytes, the number of occupied pixels; then, as one LZ4 block, a bit a pixel (row by row, each from a byte of its own); of every
//! occupied pixel a byte, half of which is its bottom in steps of 16 levels, counted from that of its top, and a bit of which says
//! whether it is an obstacle; and a byte for its top, as the difference to that of the occupied pixel before.

use crate::slice::{Canvas, Content, Slice};

/// The bit of an obstacle.
const OBSTACLE: u8 = 16;

/// The bytes of a slice.
pub(crate) fn encode(slice: &Slice) -> Vec<u8> {
    let row_bytes = (slice.width() as usize).div_ceil(8);
    let mut raw = Vec::with_capacity(row_bytes * slice.height() as usize);
    let (mut kinds, mut steps) = (Vec::new(), Vec::new());
    let mut before = 0_u8;
    for row in 0..slice.height() {
        let words = slice.occupied().row(row);
        raw.extend(words.iter().flat_map(|word| word.to_le_bytes()).take(row_bytes));
        for column in columns(words) {
            let Some(Content { top, bottom, is_obstacle }) = slice.pixel(column, row) else { continue };
            let depth = (top / Content::STEP).wrapping_sub(bottom / Content::STEP);
            kinds.push(depth % OBSTACLE + OBSTACLE * u8::from(is_obstacle));
            steps.push(top.wrapping_sub(before));
            before = top;
        }
    }
    let count = u32::try_from(steps.len()).unwrap_or(u32::MAX);
    raw.extend(kinds);
    raw.extend(steps);
    let mut bytes = count.to_le_bytes().to_vec();
    bytes.extend(lz4_flex::block::compress(&raw));
    bytes
}

/// Which columns are set in the words of a row.
fn columns(words: &[u64]) -> impl Iterator<Item = u32> {
    (0_u32..).zip(words).flat_map(|(i, word)| {
        let next = |left: u64| Some(left).filter(|left| *left != 0);
        let bits = std::iter::successors(next(*word), move |left| next(left & (left - 1)));
        bits.map(move |left| 64 * i + left.trailing_zeros())
    })
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
    let length = row_bytes * rows + 2 * count;
    let raw = lz4_flex::block::decompress(packed, length).ok().filter(|raw| raw.len() == length)?;
    let (bits, rest) = raw.split_at(row_bytes * rows);
    let (kinds, steps) = rest.split_at(count);
    let mut pixels = kinds.iter().zip(steps);
    let mut canvas = Canvas::new(width, height);
    let mut top = 0_u8;
    for (row, bits) in bits.chunks_exact(row_bytes.max(1)).enumerate() {
        for (i, &byte) in bits.iter().enumerate().filter(|(_, byte)| **byte != 0) {
            canvas.mark_eight(8 * i, row, byte);
            let mut left = byte;
            while left != 0 {
                let column = 8 * i + left.trailing_zeros() as usize;
                left &= left - 1;
                let (kind, step) = pixels.next()?;
                top = top.wrapping_add(*step);
                let bottom = (top / Content::STEP).wrapping_sub(kind % OBSTACLE) % 16 * Content::STEP;
                if column >= columns || top == u8::MAX {
                    return None;
                }
                canvas.fill(column, row, Content { top, bottom, is_obstacle: kind & OBSTACLE != 0 });
            }
        }
    }
    pixels.next().is_none().then(|| canvas.finish())
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
        let mut canvas = Canvas::new(width, height);
        for row in 0..height as usize {
            for column in 0..width as usize {
                let [top, bottom] = [0, 1].map(|_| u8::try_from(random() % 255).unwrap());
                let content = Content { top, bottom, is_obstacle: random() % 2 == 0 };
                if random() % 3 == 0 {
                    canvas.set(column, row, content);
                }
            }
        }
        canvas.finish()
    }

    #[test]
    fn slices_come_back_whole() {
        for size in [[1, 1], [7, 3], [64, 2], [65, 5], [200, 100]] {
            let given = slice(size[0], size[1]);
            assert_eq!(decode(&encode(&given), size), Some(given), "{size:?}");
        }
        let empty = Canvas::new(700, 700).finish();
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
                // A few bits of LZ4 say nothing.
                let other = decode(&damaged, size).filter(|other| *other != given);
                others += usize::from(other.is_some());
                assert!(other.is_none_or(|other| other.checksum() != given.checksum()), "byte {i}");
            }
        }
        assert!(others > 100, "only {others} kinds of damage reach the checksum");
        assert!(decode(&bytes, [64, 5]).is_none() && decode(&bytes, [0, 0]).is_none());
    }
}
