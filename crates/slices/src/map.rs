//! The map: slices over a lattice, those that are equal kept once.

use std::collections::BTreeMap;
use std::sync::Arc;

use thiserror::Error;

use crate::slice::Slice;
use crate::{Block, Grid};

/// Slices of a building, lowest first. Equal ones share their memory; those that are not loaded are missing.
///
/// A clone costs a reference count a slice.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceMap {
    grid: Grid,
    slices: Vec<Option<Arc<Slice>>>,
    about: About,
}

/// What a map was made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct About {
    /// ε: a voxel whose points span more than ε σ is an obstacle.
    pub share: f64,
    /// How far points of a level floor spread upwards within a pixel, estimated; 0 where nothing could be told.
    pub noise: f64,
    /// How many points are in it.
    pub points: u64,
}

/// A slice that would be needed is not there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("slice {slice} is needed and not loaded")]
pub struct Unloaded {
    /// Which, counted from the lowest.
    pub slice: u32,
}

impl SliceMap {
    /// A map of all its slices, equal ones joined.
    pub(crate) fn of_slices(grid: Grid, slices: Vec<Slice>, about: About) -> Self {
        let mut known: BTreeMap<u64, Arc<Slice>> = BTreeMap::new();
        let slices = slices.into_iter().map(|slice| {
            let slice = Arc::new(slice);
            let first = known.entry(slice.checksum()).or_insert_with(|| Arc::clone(&slice));
            Some(if **first == *slice { Arc::clone(first) } else { slice })
        });
        Self { grid, slices: slices.collect(), about }
    }

    /// A map none of whose slices is loaded.
    pub(crate) fn unloaded(grid: Grid, about: About) -> Self {
        Self { grid, slices: vec![None; grid.counts[2] as usize], about }
    }

    /// Puts a slice in its place, or takes it out.
    pub(crate) fn put(&mut self, slice: u32, image: Option<Arc<Slice>>) {
        self.slices[slice as usize] = image;
    }

    /// Where pixels and slices lie.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// What it was made of.
    #[must_use]
    pub fn about(&self) -> &About {
        &self.about
    }

    /// All slices, lowest first; missing ones are not loaded.
    #[must_use]
    pub fn slices(&self) -> &[Option<Arc<Slice>>] {
        &self.slices
    }

    /// One of them.
    ///
    /// # Errors
    /// When it is not loaded.
    ///
    /// # Panics
    /// When there is no such slice.
    #[inline]
    pub fn slice(&self, slice: u32) -> Result<&Arc<Slice>, Unloaded> {
        self.slices[slice as usize].as_ref().ok_or(Unloaded { slice })
    }

    /// How many of the loaded slices differ.
    #[must_use]
    pub fn distinct(&self) -> usize {
        let mut known: Vec<*const Slice> = self.slices.iter().flatten().map(Arc::as_ptr).collect();
        known.sort_unstable();
        known.dedup();
        known.len()
    }

    /// Bytes that the loaded slices take.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.distinct() * self.slices.iter().flatten().map(|slice| slice.bytes()).max().unwrap_or(0)
    }

    /// The slices of a block, lowest first, each with whether it is the same as the one before.
    #[inline]
    pub(crate) fn runs(&self, block: &Block) -> impl Iterator<Item = Result<(u32, &Slice, bool), Unloaded>> {
        let mut before: *const Slice = std::ptr::null();
        block.slices.clone().map(move |s| {
            let slice = self.slice(s)?;
            let again = std::ptr::eq(std::mem::replace(&mut before, Arc::as_ptr(slice)), Arc::as_ptr(slice));
            Ok((s, &**slice, again))
        })
    }
}
