//! A map on disk: a folder with an index and a compressed file a slice, identical slices once.
//!
//! A slice's file is named after the checksum of what it holds.

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

/// Why a map is not saved or loaded.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StoreError {
    /// The index cannot be read, or is not what it should be.
    #[error("{}", of_map(.0, &["prepare"]))]
    Open(#[from] OpenError),
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// No folder can be made there, or it cannot be looked into.
    #[error("{}: cannot {verb} the folder ({cause}); check the path and its permissions", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What was being done.
        verb: &'static str,
        /// What the operating system said.
        cause: io::Error,
    },
    /// A folder that somebody else writes into.
    #[error("{}: another build is writing into this folder; wait until it is done, or name another folder", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// A folder of something else.
    #[error("{}: the folder holds other files and no slice map; name a new folder", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
    },
    /// An index that no map has.
    #[error("{}: is damaged: {what}; build the slices again", path.display())]
    Index {
        /// Its file.
        path: PathBuf,
        /// What is wrong with it.
        what: &'static str,
    },
    /// The file of a slice holds another image than the index names.
    #[error("slice {slice}: {}: does not hold this slice; build the slices again", path.display())]
    Image {
        /// Which slice.
        slice: u32,
        /// Its file.
        path: PathBuf,
    },
    /// The file of a slice cannot be used.
    #[error("slice {slice}: {}", of_map(cause, &["prepare", "check the path"]))]
    Slice {
        /// Which slice.
        slice: u32,
        /// Why.
        cause: OpenError,
    },
    /// Slices that differ and would have one file.
    #[error(
        "different slices have the checksum {checksum:016x}, so the map is not saved; choose another size of pixels"
    )]
    Alike {
        /// Of both.
        checksum: u64,
    },
    /// A map of which slices are missing is not saved.
    #[error("slice {slice} is not loaded, so the map is not saved")]
    Incomplete {
        /// Which.
        slice: u32,
    },
    /// Nobody can walk.
    #[error(transparent)]
    Walk(#[from] WalkError),
}

/// What is wrong with a file of a map. Containers only know of scans, which are prepared again: `unfit` are
/// remedies that do not serve.
fn of_map(cause: &OpenError, unfit: &[&str]) -> String {
    let what = match &cause.fault {
        ContainerFault::NotAContainer { .. } => "is no file of a slice map".to_owned(),
        fault => match fault.to_string().rsplit_once("; ") {
            Some((what, remedy)) if unfit.iter().any(|word| remedy.contains(word)) => what.to_owned(),
            _ => return cause.to_string(),
        },
    };
    let path = cause.path.as_ref().map(|path| path.display().to_string()).unwrap_or_default();
    format!("{path}: {what}; build the slices again")
}

/// The file of the slice with this checksum.
pub(crate) fn image_name(checksum: u64) -> String {
    format!("{checksum:016x}.nms")
}

/// Loads the slice with this checksum from a folder.
pub(crate) fn load(folder: &Path, slice: u32, checksum: u64, grid: &Grid) -> Result<Slice, StoreError> {
    let path = folder.join(image_name(checksum));
    let failed = |cause| StoreError::Slice { slice, cause };
    // The checksum of the image tells all that those of the file would.
    let file = File::read(&path, Check::Structure).map_err(failed)?;
    file.expect(IMAGE.0, IMAGE.1..=IMAGE.1).map_err(failed)?;
    let bytes = file.array::<u8>(PIXELS, 0).map_err(failed)?;
    let [width, height, _] = grid.counts;
    let image = decode(&bytes, [width, height]);
    image.filter(|image| image.checksum() == checksum).ok_or(StoreError::Image { slice, path })
}

/// A map in a folder, of which the index is read and every slice is loaded when it is wanted.
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
    /// When there is none, or it is damaged.
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
            return Err(StoreError::Index { path, what: "its lattice is none" });
        }
        if checksums.len() != grid.counts[2] as usize {
            return Err(StoreError::Index { path, what: "it names another number of slices than it has" });
        }
        Ok(Self { folder: folder.to_owned(), index, checksums: checksums.as_ref().into() })
    }

    /// Where pixels and slices lie.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.index.grid
    }

    /// What the map was made of.
    #[must_use]
    pub fn about(&self) -> &About {
        &self.index.about
    }

    /// Checksums of the slices, lowest first; equal ones have one file.
    #[must_use]
    pub fn checksums(&self) -> &[u64] {
        &self.checksums
    }

    /// How many slices differ.
    #[must_use]
    pub fn distinct(&self) -> usize {
        self.firsts().len()
    }

    /// Checksums and the lowest slice that has each.
    fn firsts(&self) -> BTreeMap<u64, u32> {
        (0..self.grid().counts[2]).rev().map(|s| (self.checksums[s as usize], s)).collect()
    }

    /// Bytes of all files that are there.
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
    /// Names the file that is missing or damaged.
    ///
    /// # Panics
    /// When there is no such slice.
    pub fn load(&self, slice: u32) -> Result<Slice, StoreError> {
        load(&self.folder, slice, self.checksums[slice as usize], self.grid())
    }

    /// The whole map in memory, and what could not be loaded of it, lowest first, a file once: those slices
    /// are missing, the others serve.
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

    /// The map without any slice.
    pub(crate) fn unloaded(&self) -> SliceMap {
        SliceMap::unloaded(self.index)
    }
}
