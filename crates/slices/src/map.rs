//! The map: slices over a lattice, equal ones stored once.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::options::{MOST_SHARE, Obstacle};
use crate::slice::Slice;
use crate::{Block, Grid};

/// The slices of a building, lowest first. Equal slices share their memory; slices that are not
/// loaded are missing.
///
/// A clone costs one reference count a slice.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceMap {
    index: Index,
    slices: Vec<Option<Arc<Slice>>>,
}

/// The data of a map without its slices.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Index {
    pub(crate) grid: Grid,
    pub(crate) about: About,
}

/// The origin of a map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The rule as given.
    pub rule: Obstacle,
    /// ε: a voxel whose points span more than ε σ is an obstacle.
    pub share: f64,
    /// Noise: the height that the points of a level floor span within a pixel, limited to what ε
    /// allows for. Given or estimated; 0 if it could not be estimated, or if ε was given directly.
    pub noise: f64,
    /// The number of points.
    pub points: u64,
    /// The number of points that were left out
    /// ([`SliceBuilder::counts`](crate::SliceBuilder::counts)).
    pub left_out: u64,
}

impl About {
    /// Returns `true` if the noise was estimated from the points.
    #[must_use]
    pub fn is_noise_estimated(&self) -> bool {
        matches!(self.rule, Obstacle::Slope { noise: None, .. })
    }

    /// Returns `true` if the noise is so great that ε does not allow for all of it
    /// ([`Obstacle::Slope`]).
    #[must_use]
    pub fn is_noise_capped(&self) -> bool {
        self.is_noise_estimated() && self.noise > 0.0 && self.share >= MOST_SHARE
    }
}

/// A required slice is not loaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("expected slice {slice} to be loaded, got a map without it; load it first")]
pub struct Unloaded {
    /// The slice, counted from the lowest.
    pub slice: u32,
}

impl SliceMap {
    /// Creates a map of all slices; equal ones share memory.
    pub(crate) fn of_slices(index: Index, slices: Vec<Slice>) -> Self {
        let mut known: BTreeMap<u64, Arc<Slice>> = BTreeMap::new();
        let slices = slices.into_iter().map(|slice| {
            let slice = Arc::new(slice);
            let first = known.entry(slice.checksum()).or_insert_with(|| Arc::clone(&slice));
            Some(if **first == *slice { Arc::clone(first) } else { slice })
        });
        Self { index, slices: slices.collect() }
    }

    /// Creates a map without loaded slices.
    pub(crate) fn unloaded(index: Index) -> Self {
        Self { index, slices: vec![None; index.grid.counts[2] as usize] }
    }

    pub(crate) fn index(&self) -> &Index {
        &self.index
    }

    /// Sets a slice, or removes it.
    pub(crate) fn put(&mut self, slice: u32, image: Option<Arc<Slice>>) {
        self.slices[slice as usize] = image;
    }

    /// Returns the grid of pixels and slices.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.index.grid
    }

    /// Returns its origin: the rule, noise and number of points.
    #[must_use]
    pub fn about(&self) -> &About {
        &self.index.about
    }

    /// Returns all slices, lowest first; `None` for those not loaded.
    #[must_use]
    pub fn slices(&self) -> &[Option<Arc<Slice>>] {
        &self.slices
    }

    /// Returns a slice.
    ///
    /// # Errors
    /// If the slice is not loaded.
    ///
    /// # Panics
    /// If there is no such slice.
    #[inline]
    pub fn slice(&self, slice: u32) -> Result<&Arc<Slice>, Unloaded> {
        self.slices[slice as usize].as_ref().ok_or(Unloaded { slice })
    }

    /// Returns the number of distinct loaded slices.
    #[must_use]
    pub fn distinct(&self) -> usize {
        let mut known: Vec<*const Slice> = self.slices.iter().flatten().map(Arc::as_ptr).collect();
        known.sort_unstable();
        known.dedup();
        known.len()
    }

    /// Returns the bytes of the loaded slices.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.distinct() * self.slices.iter().flatten().map(|slice| slice.bytes()).max().unwrap_or(0)
    }

    /// Returns the slices of a block, lowest first, each with `true` if it is the same as the one
    /// before.
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
