//! One image: which pixels hold something, how high, and whether it is an obstacle.

use std::ops::{Range, RangeInclusive};

use bytemuck::cast_slice;
use xxhash_rust::xxh3::Xxh3;

use crate::bits::{Bits, filled_of_eight};

/// A layer of voxels. A pixel takes 1¾ bytes, whatever it holds; the bits of a row take whole words of 64.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Slice {
    width: u32,
    height: u32,
    occupied: Bits,
    /// Tiles with something in them.
    tiles: Bits,
    /// Set only where occupied.
    obstacle: Bits,
    /// Level of the highest point plus one, 0 where nothing is.
    tops: Vec<u8>,
    /// Level of the lowest point, divided by 16, in half a byte a pixel; 0 where nothing is.
    bottoms: Vec<u8>,
    checksum: u64,
}

/// What a pixel holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Content {
    /// Level of the highest point.
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

/// Sixty-four pixels side by side; beyond the end of a row nothing is.
#[derive(Debug)]
pub(crate) struct Word {
    /// As in a slice.
    pub(crate) tops: [u8; 64],
    pub(crate) bottoms: [u8; 32],
    pub(crate) obstacles: u64,
}

impl Word {
    /// Whether exactly these pixels have tops, and none but them is an obstacle.
    #[inline]
    pub(crate) fn is_sound(&self, occupied: u64) -> bool {
        let eights = self.tops.as_chunks().0.iter().map(|eight| filled_of_eight(*eight));
        let filled = (0..).zip(eights).fold(0, |bits, (i, eight)| bits | eight << (8 * i));
        filled == occupied && self.obstacles & !occupied == 0
    }
}

/// A slice that is being filled.
#[derive(Debug)]
pub(crate) struct Canvas(Slice);

impl Canvas {
    pub(crate) fn new(width: u32, height: u32) -> Self {
        let rows = height as usize;
        Self(Slice {
            width,
            height,
            occupied: Bits::new(width, height),
            tiles: Bits::of_tiles(width, height),
            obstacle: Bits::new(width, height),
            tops: vec![0; width as usize * rows],
            bottoms: vec![0; halves(width as usize) * rows],
            checksum: 0,
        })
    }

    /// Sets an empty pixel.
    #[inline]
    pub(crate) fn set(&mut self, column: usize, row: usize, content: Content) {
        let Self(slice) = self;
        let width = slice.width as usize;
        slice.occupied.set(column, row);
        slice.tiles.set_tile(column, row);
        if content.is_obstacle {
            slice.obstacle.set(column, row);
        }
        slice.tops[row * width + column] = content.top + 1;
        slice.bottoms[row * halves(width) + column / 2] |=
            (content.bottom / Content::STEP) << (4 * (column % 2));
    }

    /// Sets the `word`-th 64 pixels of a row, all empty, of which those of `occupied` hold something.
    #[inline]
    pub(crate) fn set_word(&mut self, word: usize, row: usize, occupied: u64, pixels: &Word) {
        let Self(slice) = self;
        slice.occupied.set_word(word, row, occupied);
        slice.tiles.set_tiles(word, row, occupied);
        slice.obstacle.set_word(word, row, pixels.obstacles);
        let [tops, bottoms] = slice.places(word, row);
        let (tops, bottoms) = (&mut slice.tops[tops], &mut slice.bottoms[bottoms]);
        tops.copy_from_slice(&pixels.tops[..tops.len()]);
        bottoms.copy_from_slice(&pixels.bottoms[..bottoms.len()]);
    }

    /// The slice.
    pub(crate) fn finish(self) -> Slice {
        let Self(mut slice) = self;
        slice.checksum = slice.hash();
        slice
    }
}

impl Slice {
    /// Of what is there alone: most of a slice is empty. Words side by side with something in them are taken
    /// together.
    fn hash(&self) -> u64 {
        let mut hash = Xxh3::new();
        hash.update(cast_slice(&[self.width, self.height]));
        hash.update(cast_slice(self.occupied.words()));
        let width = self.width as usize;
        for row in 0..self.height {
            let (tops, bottoms) = (row as usize * width, row as usize * halves(width));
            let mut word = 0;
            for run in self.occupied.row(row).chunk_by(|a, b| (*a != 0) == (*b != 0)) {
                let words = word..word + run.len();
                word = words.end;
                if run[0] != 0 {
                    let (from, to) = (64 * words.start, width.min(64 * words.end));
                    hash.update(&self.tops[tops + from..tops + to]);
                    hash.update(&self.bottoms[bottoms + from / 2..bottoms + to.div_ceil(2)]);
                    hash.update(cast_slice(&self.obstacle.row(row)[words]));
                }
            }
        }
        hash.digest()
    }

    /// Where the `word`-th 64 pixels of a row are among tops and bottoms.
    #[inline]
    fn places(&self, word: usize, row: usize) -> [Range<usize>; 2] {
        let width = self.width as usize;
        let (from, to) = (64 * word, width.min(64 * word + 64));
        let (tops, bottoms) = (row * width, row * halves(width));
        [tops + from..tops + to, bottoms + from / 2..bottoms + to.div_ceil(2)]
    }

    /// The `word`-th 64 pixels of a row.
    pub(crate) fn word(&self, word: usize, row: usize) -> Word {
        let [tops, bottoms] = self.places(word, row);
        let (tops, bottoms) = (&self.tops[tops], &self.bottoms[bottoms]);
        let row = u32::try_from(row).unwrap_or(u32::MAX);
        let mut pixels = Word { tops: [0; 64], bottoms: [0; 32], obstacles: self.obstacle.row(row)[word] };
        pixels.tops[..tops.len()].copy_from_slice(tops);
        pixels.bottoms[..bottoms.len()].copy_from_slice(bottoms);
        pixels
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
        Self::bytes_of(self.width, self.height)
    }

    /// Bytes that an image of this size takes.
    pub(crate) fn bytes_of(width: u32, height: u32) -> usize {
        let bits = 2 * Bits::bytes_of(width, height) + Bits::bytes_of_tiles(width, height);
        (width as usize + halves(width as usize)) * height as usize + bits
    }

    /// How many pixels hold something, and how many of them are obstacles.
    #[must_use]
    pub fn counts(&self) -> [u64; 2] {
        [self.occupied.count_all(), self.obstacle.count_all()]
    }

    /// What a pixel holds; none if nothing is there.
    ///
    /// # Panics
    /// When there is no such pixel.
    #[inline]
    #[must_use]
    pub fn pixel(&self, column: u32, row: u32) -> Option<Content> {
        let is_obstacle = self.obstacle.is_set(column, row);
        let (column, row) = (column as usize, row as usize);
        let top = self.tops[row * self.width as usize + column].checked_sub(1)?;
        let half = self.bottoms[row * halves(self.width as usize) + column / 2] >> (4 * (column % 2)) & 15;
        Some(Content { top, bottom: half * Content::STEP, is_obstacle })
    }

    /// The image as the paper encodes it, red green blue a pixel, the last row first: red is the height in
    /// the slice, green is full where something is, blue is full for obstacles and a tenth for floor; black
    /// is empty (S4, Fig. 2).
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

    /// Which pixels hold something.
    pub(crate) fn occupied(&self) -> &Bits {
        &self.occupied
    }

    /// Whether anything is in these pixels, which are on the image.
    #[inline]
    pub(crate) fn any(&self, columns: &RangeInclusive<u32>, rows: &RangeInclusive<u32>) -> bool {
        self.tiles.any_tile(columns, rows) && self.occupied.any(columns, rows)
    }

    /// How many of these pixels, which are on the image, hold something, and how many are obstacles.
    pub(crate) fn count(&self, columns: &RangeInclusive<u32>, rows: &RangeInclusive<u32>) -> [u64; 2] {
        if !self.tiles.any_tile(columns, rows) {
            return [0; 2];
        }
        [&self.occupied, &self.obstacle].map(|bits| bits.count(columns, rows))
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
        self.obstacle.is_set(column, row)
    }

    /// Whether any of these pixels of a row, on the image, is an obstacle.
    #[inline]
    pub(crate) fn any_obstacle(&self, columns: &RangeInclusive<u32>, row: u32) -> bool {
        self.obstacle.any(columns, &(row..=row))
    }
}

/// Bytes of a row of half bytes.
const fn halves(width: usize) -> usize {
    width.div_ceil(2)
}
