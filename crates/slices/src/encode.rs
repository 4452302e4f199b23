//! Compressed encoding of a slice: its memory layout without the empty words of 64 pixels.
//!
//! Layout: four bytes with the number of occupied words, then one LZ4 block. The block holds one
//! bit a pixel, row by row, each row starting at a byte. After that it holds 64 tops of each
//! occupied word, then 32 bytes of bottoms of each, then 8 bytes of obstacle bits of each. Lanes
//! beyond the end of a row are zero. This layout needs no work per pixel, and LZ4 finds repetition
//! between rows.

use crate::slice::{Canvas, Slice, Word};

/// Bytes of a word: tops, bottoms, obstacles.
const WORD: usize = 64 + 32 + 8;

/// Greatest expansion of LZ4: each further byte of a match length adds this many bytes.
const LZ4_MOST: usize = 255;

/// Encodes a slice.
pub(crate) fn encode(slice: &Slice) -> Vec<u8> {
    let row_bytes = (slice.width() as usize).div_ceil(8);
    let (mut bits, mut tops, mut bottoms, mut obstacles) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for row in 0..slice.height() {
        let words = slice.occupied().row(row);
        bits.extend(words.iter().flat_map(|word| word.to_le_bytes()).take(row_bytes));
        for (i, _) in words.iter().enumerate().filter(|(_, word)| **word != 0) {
            let word = slice.word(i, row as usize);
            tops.extend(word.tops);
            bottoms.extend(word.bottoms);
            obstacles.extend(word.obstacles.to_le_bytes());
        }
    }
    let count = u32::try_from(tops.len() / 64).unwrap_or(u32::MAX);
    let mut bytes = count.to_le_bytes().to_vec();
    bytes.extend(lz4_flex::block::compress(&[bits, tops, bottoms, obstacles].concat()));
    bytes
}

/// Decodes a slice of this size. Returns `None` if the bytes are not a valid slice.
pub(crate) fn decode(bytes: &[u8], [width, height]: [u32; 2]) -> Option<Slice> {
    let (count, packed) = bytes.split_first_chunk()?;
    let count = u32::from_le_bytes(*count) as usize;
    let (columns, rows) = (width as usize, height as usize);
    let row_bytes = columns.div_ceil(8);
    if count > columns.div_ceil(64) * rows {
        return None;
    }
    let length = row_bytes * rows + WORD * count;
    // Rejected before memory is allocated.
    if length / LZ4_MOST > packed.len() {
        return None;
    }
    let raw = lz4_flex::block::decompress(packed, length).ok().filter(|raw| raw.len() == length)?;
    let (bits, rest) = raw.split_at(row_bytes * rows);
    let (tops, rest) = rest.split_at(64 * count);
    let (bottoms, obstacles) = rest.split_at(32 * count);
    let planes = tops.as_chunks::<64>().0.iter().zip(bottoms.as_chunks::<32>().0);
    let mut words = planes.zip(obstacles.as_chunks::<8>().0);
    let mut canvas = Canvas::new(width, height);
    for (row, bits) in bits.chunks_exact(row_bytes.max(1)).enumerate() {
        for (i, bytes) in bits.chunks(8).enumerate() {
            let mut occupied = [0; 8];
            occupied[..bytes.len()].copy_from_slice(bytes);
            let occupied = u64::from_le_bytes(occupied);
            if occupied == 0 {
                continue;
            }
            let ((tops, bottoms), obstacles) = words.next()?;
            let word = Word { tops: *tops, bottoms: *bottoms, obstacles: u64::from_le_bytes(*obstacles) };
            let end = 64 * (i + 1) - occupied.leading_zeros() as usize;
            if end > columns || !word.is_sound(occupied) {
                return None;
            }
            canvas.set_word(i, row, occupied, &word);
        }
    }
    words.next().is_none().then(|| canvas.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slice::Content;

    /// Random pixels, with rows that end within a word, and every possible top.
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
        let empty = Canvas::new(1 << 13, 1 << 10).finish();
        let bytes = encode(&empty);
        assert!(bytes.len() < (1 << 20) / 250, "{} bytes, near the least that LZ4 can do", bytes.len());
        assert_eq!(decode(&bytes, [1 << 13, 1 << 10]), Some(empty));
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
                // A few bits of LZ4 are unused.
                let other = decode(&damaged, size).filter(|other| *other != given);
                others += usize::from(other.is_some());
                assert!(other.is_none_or(|other| other.checksum() != given.checksum()), "byte {i}");
            }
        }
        assert!(others > 100, "only {others} kinds of damage reach the checksum");
        assert!(decode(&bytes, [64, 5]).is_none() && decode(&bytes, [0, 0]).is_none());
        // More memory than any machine has.
        assert!(decode(&[0xff; 1000], [u32::MAX; 2]).is_none());
    }
}
