//! The map: slices over a lattice, those that are equal kept once.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::options::{MOST_SHARE, Obstacle};
use crate::slice::Slice;
use crate::{Block, Grid};

/// Slices of a building, lowest first. Equal ones share their memory; those that are not loaded are missing.
///
/// A clone costs a reference count a slice.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceMap {
    index: Index,
    slices: Vec<Option<Arc<Slice>>>,
}

/// What is known of a map without any of its slices.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Index {
    pub(crate) grid: Grid,
    pub(crate) about: About,
}

/// What a map was made of.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The rule as it was asked for.
    pub rule: Obstacle,
    /// ε: a voxel whose points span more than ε σ is an obstacle.
    pub share: f64,
    /// How far points of a level floor spread upwards within a pixel, as far as ε allows for it: as given, or
    /// estimated, which is 0 where nothing could be told; and 0 where the rule is ε itself.
    pub noise: f64,
    /// How many points are in it.
    pub points: u64,
    /// How many points were left out ([`SliceBuilder::counts`](crate::SliceBuilder::counts)).
    pub left_out: u64,
}

impl About {
    /// Whether the noise was estimated from the points.
    #[must_use]
    pub fn is_noise_estimated(&self) -> bool {
        matches!(self.rule, Obstacle::Slope { noise: None, .. })
    }

    /// Whether the noise is so great that ε does not allow for all of it ([`Obstacle::Slope`]).
    #[must_use]
    pub fn is_noise_capped(&self) -> bool {
        self.is_noise_estimated() && self.noise > 0.0 && self.share >= MOST_SHARE
    }
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
    pub(crate) fn of_slices(index: Index, slices: Vec<Slice>) -> Self {
        let mut known: BTreeMap<u64, Arc<Slice>> = BTreeMap::new();
        let slices = slices.into_iter().map(|slice| {
            let slice = Arc::new(slice);
            let first = known.entry(slice.checksum()).or_insert_with(|| Arc::clone(&slice));
            Some(if **first == *slice { Arc::clone(first) } else { slice })
        });
        Self { index, slices: slices.collect() }
    }

    /// A map none of whose slices is loaded.
    pub(crate) fn unloaded(index: Index) -> Self {
        Self { index, slices: vec![None; index.grid.counts[2] as usize] }
    }

    pub(crate) fn index(&self) -> &Index {
        &self.index
    }

    /// Puts a slice in its place, or takes it out.
    pub(crate) fn put(&mut self, slice: u32, image: Option<Arc<Slice>>) {
        self.slices[slice as usize] = image;
    }

    /// Where pixels and slices lie.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.index.grid
    }

    /// What it was made of.
    #[must_use]
    pub fn about(&self) -> &About {
        &self.index.about
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
