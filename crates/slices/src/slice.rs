//! The image of a slice: the occupied pixels, their heights, and the obstacles among them.

use std::ops::{Range, RangeInclusive};

use bytemuck::cast_slice;
use xxhash_rust::xxh3::Xxh3;

use crate::bits::{Bits, filled_of_eight};

/// A layer of voxels. A pixel takes 1¾ bytes, occupied or not; the bits of a row take whole words
/// of 64.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Slice {
    width: u32,
    height: u32,
    occupied: Bits,
    /// Tiles with an occupied pixel.
    tiles: Bits,
    /// Set only where occupied.
    obstacle: Bits,
    /// Level of the highest point plus one; 0 if empty.
    tops: Vec<u8>,
    /// Level of the lowest point divided by 16, in half a byte a pixel; 0 if empty.
    bottoms: Vec<u8>,
    checksum: u64,
}

/// The content of an occupied pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Content {
    /// Level of the highest point.
    pub top: u8,
    /// A lower bound of the levels of the points, at most 15 below the lowest point.
    pub bottom: u8,
    /// `true` if it is an obstacle.
    pub is_obstacle: bool,
}

impl Content {
    /// Resolution of a bottom, in levels.
    pub(crate) const STEP: u8 = 16;
}

/// Sixty-four adjacent pixels; pixels beyond the end of a row are empty.
#[derive(Debug)]
pub(crate) struct Word {
    /// Encoded as in a slice.
    pub(crate) tops: [u8; 64],
    pub(crate) bottoms: [u8; 32],
    pub(crate) obstacles: u64,
}

impl Word {
    /// Returns `true` if exactly the occupied pixels have tops, and no other pixel is an obstacle.
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

    /// Sets the `word`-th 64 pixels of a row, which must be empty. `occupied` are the occupied
    /// ones.
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

    /// Returns the slice.
    pub(crate) fn finish(self) -> Slice {
        let Self(mut slice) = self;
        slice.checksum = slice.hash();
        slice
    }
}

impl Slice {
    /// Hashes the occupied words alone, since most of a slice is empty. Adjacent occupied words are
    /// hashed together.
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

    /// Returns the ranges of the `word`-th 64 pixels of a row in `tops` and `bottoms`.
    #[inline]
    fn places(&self, word: usize, row: usize) -> [Range<usize>; 2] {
        let width = self.width as usize;
        let (from, to) = (64 * word, width.min(64 * word + 64));
        let (tops, bottoms) = (row * width, row * halves(width));
        [tops + from..tops + to, bottoms + from / 2..bottoms + to.div_ceil(2)]
    }

    /// Returns the `word`-th 64 pixels of a row.
    pub(crate) fn word(&self, word: usize, row: usize) -> Word {
        let [tops, bottoms] = self.places(word, row);
        let (tops, bottoms) = (&self.tops[tops], &self.bottoms[bottoms]);
        let row = u32::try_from(row).unwrap_or(u32::MAX);
        let mut pixels = Word { tops: [0; 64], bottoms: [0; 32], obstacles: self.obstacle.row(row)[word] };
        pixels.tops[..tops.len()].copy_from_slice(tops);
        pixels.bottoms[..bottoms.len()].copy_from_slice(bottoms);
        pixels
    }

    /// The number of columns.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// The number of rows.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The xxh3-64 checksum of the content, the same for equal images.
    #[must_use]
    pub fn checksum(&self) -> u64 {
        self.checksum
    }

    /// Returns the bytes in memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        Self::bytes_of(self.width, self.height)
    }

    /// Returns the bytes of an image of this size.
    pub(crate) fn bytes_of(width: u32, height: u32) -> usize {
        let bits = 2 * Bits::bytes_of(width, height) + Bits::bytes_of_tiles(width, height);
        (width as usize + halves(width as usize)) * height as usize + bits
    }

    /// Returns the number of occupied pixels, and of obstacles among them.
    #[must_use]
    pub fn counts(&self) -> [u64; 2] {
        [self.occupied.count_all(), self.obstacle.count_all()]
    }

    /// Returns the content of a pixel; `None` if it is empty.
    ///
    /// # Panics
    /// If there is no such pixel.
    #[inline]
    #[must_use]
    pub fn pixel(&self, column: u32, row: u32) -> Option<Content> {
        let is_obstacle = self.obstacle.is_set(column, row);
        let (column, row) = (column as usize, row as usize);
        let top = self.tops[row * self.width as usize + column].checked_sub(1)?;
        let half = self.bottoms[row * halves(self.width as usize) + column / 2] >> (4 * (column % 2)) & 15;
        Some(Content { top, bottom: half * Content::STEP, is_obstacle })
    }

    /// Returns the image as in Anjos et al. 2012, Fig. 2: red, green and blue bytes of each pixel,
    /// the last row first. Red is the height in the slice. Green is full in occupied pixels. Blue
    /// is full for obstacles and a tenth for floor. Empty pixels are black.
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

    /// Returns the bitmap of occupied pixels.
    pub(crate) fn occupied(&self) -> &Bits {
        &self.occupied
    }

    /// Returns `true` if any of these pixels is occupied. They must be on the image.
    #[inline]
    pub(crate) fn any(&self, columns: &RangeInclusive<u32>, rows: &RangeInclusive<u32>) -> bool {
        self.tiles.any_tile(columns, rows) && self.occupied.any(columns, rows)
    }

    /// Returns the number of occupied pixels among these, and of obstacles. They must be on the
    /// image.
    pub(crate) fn count(&self, columns: &RangeInclusive<u32>, rows: &RangeInclusive<u32>) -> [u64; 2] {
        if !self.tiles.any_tile(columns, rows) {
            return [0; 2];
        }
        [&self.occupied, &self.obstacle].map(|bits| bits.count(columns, rows))
    }

    /// Returns the tops of a run of pixels of a row.
    #[inline]
    pub(crate) fn row(&self, columns: &RangeInclusive<u32>, row: u32) -> &[u8] {
        let first = row as usize * self.width as usize;
        &self.tops[first + *columns.start() as usize..=first + *columns.end() as usize]
    }

    /// Returns `true` if a pixel is an obstacle.
    #[inline]
    pub(crate) fn is_obstacle(&self, column: u32, row: u32) -> bool {
        self.obstacle.is_set(column, row)
    }

    /// Returns `true` if any of these pixels of a row is an obstacle. They must be on the image.
    #[inline]
    pub(crate) fn any_obstacle(&self, columns: &RangeInclusive<u32>, row: u32) -> bool {
        self.obstacle.any(columns, &(row..=row))
    }
}

/// Returns the bytes of a row of half bytes.
const fn halves(width: usize) -> usize {
    width.div_ceil(2)
}
