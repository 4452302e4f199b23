//! Bitmaps with one bit a pixel, or one bit a tile of pixels.

use std::ops::RangeInclusive;

/// Side of a tile in pixels; a power of two of at least eight, so that the pixels of a byte share a
/// tile. An avatar's base meets three by three tiles, and the bits of all tiles of a map fit a
/// cache.
const TILE: u32 = 8;

/// A bitmap of a rectangle. Each row starts at a new word, so a run of pixels is tested 64 at a
/// time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Bits {
    words: Vec<u64>,
    stride: usize,
}

impl Bits {
    /// Creates a bitmap with no bit set.
    pub(crate) fn new(width: u32, height: u32) -> Self {
        let stride = (width as usize).div_ceil(64);
        Self { words: vec![0; stride * height as usize], stride }
    }

    /// Returns the bytes of a bitmap of this many pixels.
    pub(crate) fn bytes_of(width: u32, height: u32) -> usize {
        8 * (width as usize).div_ceil(64) * height as usize
    }

    /// Returns the bytes of a bitmap of the tiles of this many pixels.
    pub(crate) fn bytes_of_tiles(width: u32, height: u32) -> usize {
        Self::bytes_of(width.div_ceil(TILE), height.div_ceil(TILE))
    }

    /// Creates a bitmap of the tiles of this many pixels.
    pub(crate) fn of_tiles(width: u32, height: u32) -> Self {
        Self::new(width.div_ceil(TILE), height.div_ceil(TILE))
    }

    #[inline]
    pub(crate) fn set(&mut self, column: usize, row: usize) {
        self.words[row * self.stride + column / 64] |= 1 << (column % 64);
    }

    /// Sets the tile of a pixel.
    #[inline]
    pub(crate) fn set_tile(&mut self, column: usize, row: usize) {
        self.set(column / TILE as usize, row / TILE as usize);
    }

    /// Sets the bits of `bits` in the `word`-th 64 bits of a row.
    #[inline]
    pub(crate) fn set_word(&mut self, word: usize, row: usize, bits: u64) {
        self.words[row * self.stride + word] |= bits;
    }

    /// Sets the tiles of the pixels of `bits` in the `word`-th 64 pixels of a row.
    #[inline]
    pub(crate) fn set_tiles(&mut self, word: usize, row: usize, bits: u64) {
        let tiles = filled_of_eight(bits.to_le_bytes());
        // A word has eight tiles, so they never cross the end of a word of tiles.
        let first = word * 64 / TILE as usize;
        self.words[row / TILE as usize * self.stride + first / 64] |= tiles << (first % 64);
    }

    #[inline]
    pub(crate) fn is_set(&self, column: u32, row: u32) -> bool {
        self.words[row as usize * self.stride + column as usize / 64] >> (column % 64) & 1 == 1
    }

    /// Returns all words, row by row.
    pub(crate) fn words(&self) -> &[u64] {
        &self.words
    }

    /// Returns the words of a row.
    #[inline]
    pub(crate) fn row(&self, row: u32) -> &[u64] {
        &self.words[row as usize * self.stride..(row as usize + 1) * self.stride]
    }

    /// Returns the number of set bits.
    pub(crate) fn count_all(&self) -> u64 {
        self.words.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// Returns `true` if any of these bits is set. They must be within the bitmap.
    #[inline]
    pub(crate) fn any(&self, columns: &RangeInclusive<u32>, rows: &RangeInclusive<u32>) -> bool {
        let (run, block) = (Run::new(columns), self.block(rows));
        block.chunks_exact(self.stride).any(|row| run.any(row))
    }

    /// Returns `true` if the tile of any of these pixels is set.
    #[inline]
    pub(crate) fn any_tile(&self, columns: &RangeInclusive<u32>, rows: &RangeInclusive<u32>) -> bool {
        let tiles = |range: &RangeInclusive<u32>| range.start() / TILE..=range.end() / TILE;
        self.any(&tiles(columns), &tiles(rows))
    }

    /// Returns the number of set bits among these. They must be within the bitmap.
    pub(crate) fn count(&self, columns: &RangeInclusive<u32>, rows: &RangeInclusive<u32>) -> u64 {
        let (run, block) = (Run::new(columns), self.block(rows));
        block
            .chunks_exact(self.stride)
            .map(|row| run.words(row).map(|word| u64::from(word.count_ones())).sum::<u64>())
            .sum()
    }

    fn block(&self, rows: &RangeInclusive<u32>) -> &[u64] {
        &self.words[*rows.start() as usize * self.stride..(*rows.end() as usize + 1) * self.stride]
    }
}

/// Returns one bit for each of eight bytes: set if the byte is not 0.
#[inline]
pub(crate) fn filled_of_eight(bytes: [u8; 8]) -> u64 {
    /// All bits but the highest of each byte.
    const LOW: u64 = 0x7f7f_7f7f_7f7f_7f7f;
    let bytes = u64::from_le_bytes(bytes);
    // The sum sets the highest bit of a byte if any of its other bits is set, and never carries
    // out.
    let filled = ((((bytes & LOW) + LOW) | bytes) & !LOW) >> 7;
    // Bit 8i times 2^(56 - 7i) is bit 56 + i; all other products are distinct bits below 56, or overflow.
    filled.wrapping_mul(0x0102_0408_1020_4080) >> 56
}

/// A run of columns: the words of a row, and masks for the first and the last.
#[derive(Debug, Clone)]
pub(crate) struct Run {
    first: usize,
    last: usize,
    from: u64,
    to: u64,
}

impl Run {
    #[inline]
    pub(crate) fn new(columns: &RangeInclusive<u32>) -> Self {
        let (from, to) = (*columns.start(), *columns.end());
        Self {
            first: from as usize / 64,
            last: to as usize / 64,
            from: u64::MAX << (from % 64),
            to: u64::MAX >> (63 - to % 64),
        }
    }

    /// Returns the indices of its words.
    pub(crate) fn range(&self) -> RangeInclusive<usize> {
        self.first..=self.last
    }

    /// Returns the mask of its bits in the `i`-th word of a row.
    #[inline]
    pub(crate) fn mask(&self, i: usize) -> u64 {
        let from = if i == self.first { self.from } else { u64::MAX };
        let to = if i == self.last { self.to } else { u64::MAX };
        from & to
    }

    /// Returns its words in a row of bits, masked.
    #[inline]
    fn words<'a>(&'a self, row: &'a [u64]) -> impl Iterator<Item = u64> + 'a {
        self.range().map(|i| row[i] & self.mask(i))
    }

    #[inline]
    fn any(&self, row: &[u64]) -> bool {
        if self.first == self.last {
            return row[self.first] & self.from & self.to != 0;
        }
        self.words(row).any(|word| word != 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_that_are_not_zero_are_found() {
        for set in 0..=u8::MAX {
            for filled in [1, 0x7f, 0x80, 0xff, set.max(1)] {
                let bytes = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| (set >> i & 1) * filled);
                assert_eq!(filled_of_eight(bytes), u64::from(set), "{bytes:?}");
            }
        }
    }

    #[test]
    fn runs_of_every_length_find_and_count_every_bit() {
        let (width, height) = (200_u32, 9_u32);
        let mut bits = Bits::new(width, height);
        let mut tiles = Bits::of_tiles(width, height);
        let is_set = |column: u32, row: u32| (column * 7 + row * 13).is_multiple_of(31);
        for row in 0..height {
            for column in (0..width).filter(|column| is_set(*column, row)) {
                bits.set(column as usize, row as usize);
                tiles.set_tile(column as usize, row as usize);
            }
        }
        let mut empty = 0;
        for from in 0..width {
            for to in from..width {
                for rows in [0..=0, 3..=3, 2..=4, 8..=8, 0..=8] {
                    let naive: u64 = rows
                        .clone()
                        .map(|row| (from..=to).map(|column| u64::from(is_set(column, row))).sum::<u64>())
                        .sum();
                    assert_eq!(bits.count(&(from..=to), &rows), naive, "{from} to {to}");
                    assert_eq!(bits.any(&(from..=to), &rows), naive > 0, "{from} to {to}");
                    assert!(tiles.any_tile(&(from..=to), &rows) || naive == 0, "{from} to {to}");
                    empty += u32::from(naive == 0);
                }
            }
        }
        assert!(empty > 3000, "{empty} empty runs");
        assert!(bits.is_set(31, 0) && !bits.is_set(30, 0));
    }
}
