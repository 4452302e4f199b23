//! One image: which pixels hold something, how high, and whether it is an obstacle.

use std::ops::RangeInclusive;

use bytemuck::cast_slice;
use xxhash_rust::xxh3::Xxh3;

/// A layer of voxels. A pixel takes 1¾ bytes, whatever it holds.
///
/// Bits of a row begin at a word of their own, so that a run of pixels is tested 64 at a time.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Slice {
    width: u32,
    height: u32,
    /// A bit a pixel.
    occupied: Vec<u64>,
    /// A bit a pixel, set only where occupied.
    obstacle: Vec<u64>,
    /// Level of the highest point plus one, 0 where nothing is.
    tops: Vec<u8>,
    /// Level of the lowest point, divided by 16, in half a byte a pixel; 0 where nothing is.
    bottoms: Vec<u8>,
    checksum: u64,
}

/// What a pixel holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Content {
    /// Level of the highest point; 254 where a floor goes on in the next slice.
    pub top: u8,
    /// A level that no point is below, at most 15 below the lowest point.
    pub bottom: u8,
    /// Whether it is an obstacle.
    pub is_obstacle: bool,
}

impl Content {
    /// Levels that one step of a bottom spans.
    pub(crate) const STEP: u8 = 16;
}

/// A slice that is being filled.
#[derive(Debug)]
pub(crate) struct Canvas {
    width: u32,
    height: u32,
    tops: Vec<u8>,
    bottoms: Vec<u8>,
    obstacle: Vec<u64>,
}

impl Canvas {
    pub(crate) fn new(width: u32, height: u32) -> Self {
        let rows = height as usize;
        Self {
            width,
            height,
            tops: vec![0; width as usize * rows],
            bottoms: vec![0; halves(width) * rows],
            obstacle: vec![0; words(width) * rows],
        }
    }

    /// Sets an empty pixel.
    #[inline]
    pub(crate) fn set(&mut self, column: usize, row: usize, content: Content) {
        self.tops[row * self.width as usize + column] = content.top + 1;
        self.bottoms[row * halves(self.width) + column / 2] |=
            content.bottom / Content::STEP << (4 * (column % 2));
        self.obstacle[row * words(self.width) + column / 64] |=
            u64::from(content.is_obstacle) << (column % 64);
    }

    /// The slice; what has a top is occupied.
    pub(crate) fn finish(self) -> Slice {
        let Self { width, height, tops, bottoms, obstacle } = self;
        let mut occupied = vec![0_u64; obstacle.len()];
        if width > 0 {
            let rows = occupied.chunks_exact_mut(words(width));
            for (row, bits) in tops.chunks_exact(width as usize).zip(rows) {
                for (pixels, word) in row.chunks(64).zip(bits) {
                    *word = bits_of(pixels);
                }
            }
        }
        let mut slice = Slice { width, height, occupied, obstacle, tops, bottoms, checksum: 0 };
        slice.checksum = slice.hash();
        slice
    }
}

impl Slice {
    fn hash(&self) -> u64 {
        let mut hash = Xxh3::new();
        hash.update(cast_slice(&[self.width, self.height]));
        hash.update(&self.tops);
        hash.update(&self.bottoms);
        hash.update(cast_slice(&self.obstacle));
        hash.digest()
    }

    /// Columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// xxh3-64 of all it holds: two slices of one checksum are the same image.
    #[must_use]
    pub fn checksum(&self) -> u64 {
        self.checksum
    }

    /// Bytes in memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.tops.len() + self.bottoms.len() + 8 * (self.occupied.len() + self.obstacle.len())
    }

    /// How many pixels hold something, and how many of them are obstacles.
    #[must_use]
    pub fn counts(&self) -> [u64; 2] {
        [&self.occupied, &self.obstacle]
            .map(|bits| bits.iter().map(|word| u64::from(word.count_ones())).sum())
    }

    /// What a pixel holds; none if nothing is there.
    ///
    /// # Panics
    /// When there is no such pixel.
    #[inline]
    #[must_use]
    pub fn pixel(&self, column: u32, row: u32) -> Option<Content> {
        let (column, row) = (column as usize, row as usize);
        let top = self.tops[row * self.width as usize + column].checked_sub(1)?;
        let half = self.bottoms[row * halves(self.width) + column / 2] >> (4 * (column % 2)) & 15;
        let word = self.obstacle[row * words(self.width) + column / 64];
        Some(Content { top, bottom: half * Content::STEP, is_obstacle: word >> (column % 64) & 1 == 1 })
    }

    /// The image as the paper encodes it, red green blue a pixel, the last row first: red is the height in the slice, green is full
    /// where something is, blue is full for obstacles and a tenth for floor; black is empty (S4, Fig. 2).
    #[must_use]
    pub fn rgb(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(3 * self.tops.len());
        for row in (0..self.height).rev() {
            for column in 0..self.width {
                bytes.extend(match self.pixel(column, row) {
                    Some(found) => [found.top, 255, if found.is_obstacle { 255 } else { 26 }],
                    None => [0; 3],
                });
            }
        }
        bytes
    }

    pub(crate) fn tops(&self) -> &[u8] {
        &self.tops
    }

    /// Whether anything is in these pixels, which are on the image.
    #[inline]
    pub(crate) fn any(&self, columns: &RangeInclusive<u32>, rows: &RangeInclusive<u32>) -> bool {
        let mask = Mask::new(columns, self.width);
        mask.rows(&self.occupied, rows).any(|row| mask.any(row))
    }

    /// How many of these pixels, which are on the image, hold something, and how many are obstacles.
    pub(crate) fn count(&self, columns: &RangeInclusive<u32>, rows: &RangeInclusive<u32>) -> [u64; 2] {
        let mask = Mask::new(columns, self.width);
        [&self.occupied, &self.obstacle].map(|bits| mask.rows(bits, rows).map(|row| mask.count(row)).sum())
    }

    /// Tops of a run of pixels of a row.
    #[inline]
    pub(crate) fn row(&self, columns: &RangeInclusive<u32>, row: u32) -> &[u8] {
        let first = row as usize * self.width as usize;
        &self.tops[first + *columns.start() as usize..=first + *columns.end() as usize]
    }

    /// Whether a pixel of this row is an obstacle.
    #[inline]
    pub(crate) fn is_obstacle(&self, column: u32, row: u32) -> bool {
        let word = row as usize * words(self.width) + column as usize / 64;
        self.obstacle[word] >> (column % 64) & 1 == 1
    }

    /// Whether a pixel of the row, on the image, is an obstacle.
    #[inline]
    pub(crate) fn any_obstacle(&self, columns: &RangeInclusive<u32>, row: u32) -> bool {
        let mask = Mask::new(columns, self.width);
        mask.rows(&self.obstacle, &(row..=row)).any(|row| mask.any(row))
    }
}

/// Bytes of a row of half bytes.
const fn halves(width: u32) -> usize {
    (width as usize).div_ceil(2)
}

/// Words of a row of bits.
const fn words(width: u32) -> usize {
    (width as usize).div_ceil(64)
}

/// A bit for each of at most 64 pixels that has a top.
fn bits_of(pixels: &[u8]) -> u64 {
    pixels.iter().rev().fold(0, |word, &top| word << 1 | u64::from(top != 0))
}

/// A run of columns as words and the bits of the first and the last that belong to it.
struct Mask {
    words: RangeInclusive<usize>,
    first: u64,
    last: u64,
    stride: usize,
}

impl Mask {
    #[inline]
    fn new(columns: &RangeInclusive<u32>, width: u32) -> Self {
        let (from, to) = (*columns.start(), *columns.end());
        Self {
            words: from as usize / 64..=to as usize / 64,
            first: u64::MAX << (from % 64),
            last: u64::MAX >> (63 - to % 64),
            stride: words(width),
        }
    }

    /// The words of each of these rows.
    #[inline]
    fn rows<'a>(
        &self,
        bits: &'a [u64],
        rows: &RangeInclusive<u32>,
    ) -> impl Iterator<Item = &'a [u64]> + use<'a> {
        let block = &bits[*rows.start() as usize * self.stride..(*rows.end() as usize + 1) * self.stride];
        let words = self.words.clone();
        block.chunks_exact(self.stride).map(move |row| &row[words.clone()])
    }

    #[inline]
    fn any(&self, row: &[u64]) -> bool {
        match row {
            [word] => word & self.first & self.last != 0,
            [first, middle @ .., last] => {
                first & self.first != 0 || last & self.last != 0 || middle.iter().any(|word| *word != 0)
            }
            [] => false,
        }
    }

    fn count(&self, row: &[u64]) -> u64 {
        let ones = |word: u64| u64::from(word.count_ones());
        match row {
            [word] => ones(word & self.first & self.last),
            [first, middle @ .., last] => {
                ones(first & self.first)
                    + ones(last & self.last)
                    + middle.iter().map(|word| ones(*word)).sum::<u64>()
            }
            [] => 0,
        }
    }
}
