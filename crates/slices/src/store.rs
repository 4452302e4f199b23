//! A map on disk: a folder with an index and one compressed file for each distinct slice.
//!
//! The file of a slice is named after the checksum of its content.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nearmiss_lanes::parallel::map_each;
use nearmiss_store::{Check, ContainerFault, File, OpenError, WriteError};
use thiserror::Error;

use crate::encode::decode;
use crate::map::{About, Index, SliceMap};
use crate::slice::Slice;
use crate::{Grid, WalkError};

/// Kinds and versions of both files.
pub(crate) const INDEX: ([u8; 4], u32) = (*b"SLIX", 2);
pub(crate) const IMAGE: ([u8; 4], u32) = (*b"SLIM", 2);

/// Sections: checksums of all slices in the index, the image in a slice's file.
pub(crate) const CHECKSUMS: [u8; 4] = *b"SUMS";
pub(crate) const PIXELS: [u8; 4] = *b"PIXL";

/// Name of the index.
pub(crate) const INDEX_NAME: &str = "index.nms";

/// Errors of saving and loading a map.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The index cannot be read, or is not an index.
    #[error("{}", of_map(.0, &["prepare"]))]
    Open(#[from] OpenError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The folder cannot be made or read.
    #[error("{}: cannot {verb} the folder ({cause}); check the path and its permissions", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The failed operation.
        verb: &'static str,
        /// The error of the operating system.
        cause: io::Error,
    },
    /// Another process is writing into the folder.
    #[error("{}: another build is writing into this folder; wait until it is done, or name another folder", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// The folder holds other files.
    #[error("{}: expected a new or empty folder, or one with a slice map, got other files; name another folder", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
    },
    /// The index is invalid.
    #[error("{}: {what}; build the slices again", path.display())]
    Index {
        /// The file.
        path: PathBuf,
        /// The reason.
        what: &'static str,
    },
    /// The file of a slice holds another image than the index names.
    #[error("slice {slice}: {}: expected this slice, got another image; build the slices again", path.display())]
    Image {
        /// The slice, counted from the lowest.
        slice: u32,
        /// The file.
        path: PathBuf,
    },
    /// The file of a slice cannot be used.
    #[error("slice {slice}: {}", of_map(cause, &["prepare", "check the path"]))]
    Slice {
        /// The slice, counted from the lowest.
        slice: u32,
        /// The cause.
        cause: OpenError,
    },
    /// Different slices have the same checksum, so they would share a file.
    #[error(
        "expected different checksums of different slices, got {checksum:016x} twice; choose another pixel size"
    )]
    Alike {
        /// The checksum of both.
        checksum: u64,
    },
    /// The map to save lacks a slice.
    #[error("expected a map with all slices loaded, got one without slice {slice}")]
    Incomplete {
        /// The missing slice.
        slice: u32,
    },
    /// A walk fails.
    #[error(transparent)]
    Walk(#[from] WalkError),
}

/// Describes an error in a file of a map. The container errors suggest remedies for scans; remedies
/// with a word of `unsuitable` are replaced.
fn of_map(cause: &OpenError, unsuitable: &[&str]) -> String {
    let what = match &cause.fault {
        ContainerFault::NotAContainer { .. } => {
            "expected a file of a slice map, got another format".to_owned()
        }
        fault => match fault.to_string().rsplit_once("; ") {
            Some((what, remedy)) if unsuitable.iter().any(|word| remedy.contains(word)) => what.to_owned(),
            _ => return cause.to_string(),
        },
    };
    let path = cause.path.as_ref().map(|path| path.display().to_string()).unwrap_or_default();
    format!("{path}: {what}; build the slices again")
}

/// Returns the file name of the slice with this checksum.
pub(crate) fn image_name(checksum: u64) -> String {
    format!("{checksum:016x}.nms")
}

/// Loads the slice with this checksum from a folder.
pub(crate) fn load(folder: &Path, slice: u32, checksum: u64, grid: &Grid) -> Result<Slice, StoreError> {
    let path = folder.join(image_name(checksum));
    let failed = |cause| StoreError::Slice { slice, cause };
    // The checksum of the image makes the checksums of the file redundant.
    let file = File::read(&path, Check::Structure).map_err(failed)?;
    file.expect(IMAGE.0, IMAGE.1..=IMAGE.1).map_err(failed)?;
    let bytes = file.array::<u8>(PIXELS, 0).map_err(failed)?;
    let [width, height, _] = grid.counts;
    let image = decode(&bytes, [width, height]);
    image.filter(|image| image.checksum() == checksum).ok_or(StoreError::Image { slice, path })
}

/// A map in a folder: the index is in memory, slices are loaded on request.
#[derive(Debug, Clone)]
pub struct SliceFolder {
    folder: PathBuf,
    index: Index,
    checksums: Arc<[u64]>,
}

impl SliceFolder {
    /// Reads the index.
    ///
    /// # Errors
    /// If the index is missing or damaged.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self, StoreError> {
        let folder = folder.as_ref();
        let path = folder.join(INDEX_NAME);
        let file = File::read(&path, Check::Full)?;
        file.expect(INDEX.0, INDEX.1..=INDEX.1)?;
        let index: Index = file.metadata()?;
        let grid = index.grid;
        let checksums = file.array::<u64>(CHECKSUMS, 0)?;
        let sizes = [grid.pixel, grid.slice_height];
        let is_sound = sizes.iter().all(|size| *size > 0.0 && size.is_finite())
            && grid.origin.iter().all(|x| x.is_finite())
            && grid.counts.iter().all(|n| *n > 0)
            && u64::from(grid.counts[0]) * u64::from(grid.counts[1]) <= 1 << 31;
        if !is_sound {
            return Err(StoreError::Index {
                path,
                what: "expected a valid lattice, got sizes or counts out of range",
            });
        }
        if checksums.len() != grid.counts[2] as usize {
            return Err(StoreError::Index {
                path,
                what: "expected a checksum for each slice, got another number of checksums",
            });
        }
        Ok(Self { folder: folder.to_owned(), index, checksums: checksums.as_ref().into() })
    }

    /// Returns the grid of pixels and slices.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.index.grid
    }

    /// Returns the origin of the map: its rule, noise and number of points.
    #[must_use]
    pub fn about(&self) -> &About {
        &self.index.about
    }

    /// Returns the checksums of the slices, lowest first. Equal slices share a file.
    #[must_use]
    pub fn checksums(&self) -> &[u64] {
        &self.checksums
    }

    /// Returns the number of distinct slices.
    #[must_use]
    pub fn distinct(&self) -> usize {
        self.firsts().len()
    }

    /// Returns the distinct checksums, each with its lowest slice.
    fn firsts(&self) -> BTreeMap<u64, u32> {
        (0..self.grid().counts[2]).rev().map(|s| (self.checksums[s as usize], s)).collect()
    }

    /// Returns the bytes of all existing files of the map.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let length = |path: &Path| fs::metadata(path).map_or(0, |about| about.len());
        let images =
            self.firsts().into_keys().map(|checksum| length(&self.folder.join(image_name(checksum))));
        images.sum::<u64>() + length(&self.folder.join(INDEX_NAME))
    }

    /// Loads a slice, and checks that it is the one that was saved.
    ///
    /// # Errors
    /// If the file is missing or damaged; the error names it.
    ///
    /// # Panics
    /// If there is no such slice.
    pub fn load(&self, slice: u32) -> Result<Slice, StoreError> {
        load(&self.folder, slice, self.checksums[slice as usize], self.grid())
    }

    /// Loads the whole map. Returns it with the errors of the slices that could not be loaded,
    /// lowest first, one for each file. Those slices are missing from the map; the others are
    /// usable.
    #[must_use]
    pub fn load_all(&self) -> (SliceMap, Vec<StoreError>) {
        let mut firsts: Vec<(u64, u32)> = self.firsts().into_iter().collect();
        firsts.sort_unstable_by_key(|(_, slice)| *slice);
        let loaded = map_each(firsts.len(), |i| self.load(firsts[i].1));
        let mut images = BTreeMap::new();
        let mut faults = Vec::new();
        for ((checksum, _), image) in firsts.into_iter().zip(loaded) {
            match image {
                Ok(image) => _ = images.insert(checksum, Arc::new(image)),
                Err(fault) => faults.push(fault),
            }
        }
        let mut map = self.unloaded();
        for (s, checksum) in (0..).zip(&*self.checksums) {
            map.put(s, images.get(checksum).cloned());
        }
        (map, faults)
    }

    /// Returns the map without any slice.
    pub(crate) fn unloaded(&self) -> SliceMap {
        SliceMap::unloaded(self.index)
    }
}
