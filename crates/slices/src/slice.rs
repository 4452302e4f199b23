//! One image: which pixels hold something, how high, and whether it is an obstacle.

use std::ops::RangeInclusive;

use bytemuck::cast_slice;
use xxhash_rust::xxh3::Xxh3;

use crate::bits::Bits;

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
            bottoms: vec![0; halves(width) * rows],
            checksum: 0,
        })
    }

    /// Sets an empty pixel.
    #[inline]
    pub(crate) fn set(&mut self, column: usize, row: usize, content: Content) {
        self.0.occupied.set(column, row);
        self.0.tiles.set_tile(column, row);
        self.fill(column, row, content);
    }

    /// Says which of eight empty pixels, from a multiple of eight on, hold something; what, is for [`Canvas::fill`].
    #[inline]
    pub(crate) fn mark_eight(&mut self, column: usize, row: usize, bits: u8) {
        self.0.occupied.set_eight(column, row, bits);
        self.0.tiles.set_tile(column, row);
    }

    /// Fills a pixel that is said to hold something.
    #[inline]
    pub(crate) fn fill(&mut self, column: usize, row: usize, content: Content) {
        let Self(slice) = self;
        if content.is_obstacle {
            slice.obstacle.set(column, row);
        }
        slice.tops[row * slice.width as usize + column] = content.top + 1;
        slice.bottoms[row * halves(slice.width) + column / 2] |=
            (content.bottom / Content::STEP) << (4 * (column % 2));
    }

    /// The slice.
    pub(crate) fn finish(self) -> Slice {
        let Self(mut slice) = self;
        slice.checksum = slice.hash();
        slice
    }
}

impl Slice {
    /// Of what is there alone: most of a slice is empty.
    fn hash(&self) -> u64 {
        let mut hash = Xxh3::new();
        hash.update(cast_slice(&[self.width, self.height]));
        hash.update(cast_slice(self.occupied.words()));
        let width = self.width as usize;
        for row in 0..self.height {
            let (tops, bottoms) = (row as usize * width, row as usize * halves(self.width));
            let words = self.occupied.row(row).iter().zip(self.obstacle.row(row)).enumerate();
            for (i, (_, obstacle)) in words.filter(|(_, (occupied, _))| **occupied != 0) {
                let (from, to) = (64 * i, width.min(64 * i + 64));
                hash.update(&self.tops[tops + from..tops + to]);
                hash.update(&self.bottoms[bottoms + from / 2..bottoms + to.div_ceil(2)]);
                hash.update(&obstacle.to_le_bytes());
            }
        }
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
        let bits: usize = [&self.occupied, &self.tiles, &self.obstacle].map(Bits::bytes).iter().sum();
        self.tops.len() + self.bottoms.len() + bits
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
        let half = self.bottoms[row * halves(self.width) + column / 2] >> (4 * (column % 2)) & 15;
        Some(Content { top, bottom: half * Content::STEP, is_obstacle })
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
const fn halves(width: u32) -> usize {
    (width as usize).div_ceil(2)
}
