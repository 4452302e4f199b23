//! The voxels of a slice while a map is built.

use std::ops::Range;

use nearmiss_store::{Room, Stage, WorkError};

/// Number of blocks that are sorted before they are added to the map. The map does not depend on
/// it.
pub(crate) const BLOCKS: usize = 16;

/// Cells of a part of a slice: few enough for a cache, so that one large floor keeps several
/// threads busy.
pub(crate) const PART: usize = 1 << 16;

/// The levels of a voxel: 255 minus the lowest level in the high byte, the highest level plus one
/// in the low byte; 0 if empty. Both bytes only grow, and zeroed memory is a map without points.
pub(crate) type Cell = u16;

/// The voxels of a slice.
#[derive(Debug)]
pub(crate) struct Layer {
    /// A cell for each pixel.
    cells: Room<Cell>,
    /// A bit for each cell, set if it is occupied; most are not.
    filled: Room<u64>,
}

impl Layer {
    /// Creates the layer of slice `s`: empty, or with the data that an earlier run left in the
    /// workspace.
    pub(crate) fn new(stage: &Stage<'_>, s: u32, area: usize) -> Result<Self, WorkError> {
        let cells = stage.room(&format!("cells-{s}"), area)?;
        let filled = stage.room(&format!("bits-{s}"), area.div_ceil(64))?;
        Ok(Self { cells, filled })
    }

    /// Creates a layer without cells.
    pub(crate) fn empty() -> Self {
        Self { cells: Vec::new().into(), filled: Vec::new().into() }
    }

    /// Returns the bytes of a layer of this many pixels.
    pub(crate) fn bytes_of(area: usize) -> usize {
        size_of::<Self>() + area * size_of::<Cell>() + area.div_ceil(64) * size_of::<u64>()
    }

    /// Returns a read-only view of its cells.
    pub(crate) fn seen(&self) -> Seen<'_> {
        Seen { cells: &self.cells, filled: &self.filled }
    }

    /// Splits the layer into parts of [`PART`] cells, with their bits.
    pub(crate) fn parts(&mut self) -> Vec<Part<'_>> {
        let parts = self.cells.chunks_mut(PART).zip(self.filled.chunks_mut(PART / 64));
        parts.map(|(cells, filled)| Part { cells, filled }).collect()
    }
}

/// A read-only view of the cells of a layer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen<'a> {
    cells: &'a [Cell],
    filled: &'a [u64],
}

impl<'a> Seen<'a> {
    /// Returns the occupied cells in a range.
    pub(crate) fn filled(self, range: Range<usize>) -> impl Iterator<Item = usize> + use<'a> {
        let words = range.start / 64..range.end.div_ceil(64);
        let bits = words.flat_map(move |i| {
            let next = |left: u64| Some(left).filter(|left| *left != 0);
            let bits = std::iter::successors(next(self.filled[i]), move |left| next(left & (left - 1)));
            bits.map(move |left| 64 * i + left.trailing_zeros() as usize)
        });
        bits.filter(move |i| range.contains(i))
    }

    /// Returns `true` if a cell is occupied.
    #[inline]
    pub(crate) fn is_filled(self, i: usize) -> bool {
        self.filled[i / 64] >> (i % 64) & 1 == 1
    }

    /// Returns the lowest and the highest level of a cell; `None` if it is empty. Empty cells need
    /// only their bit, and the bits of a layer fit a cache.
    #[inline]
    pub(crate) fn span(self, i: usize) -> Option<[i32; 2]> {
        let seen = || self.cells[i];
        self.is_filled(i).then(seen).map(|seen| [255 - i32::from(seen >> 8), i32::from(seen & 0xff) - 1])
    }
}

/// A part of a layer.
pub(crate) struct Part<'a> {
    cells: &'a mut [Cell],
    filled: &'a mut [u64],
}

impl Part<'_> {
    /// Adds a point at this level to a cell.
    #[inline]
    pub(crate) fn see(&mut self, cell: u16, level: u8) {
        let (cell, [low, high]) = (usize::from(cell), [u16::from(255 - level), u16::from(level) + 1]);
        let seen = &mut self.cells[cell];
        *seen = (*seen >> 8).max(low) << 8 | (*seen & 0xff).max(high);
        self.filled[cell / 64] |= 1 << (cell % 64);
    }
}
