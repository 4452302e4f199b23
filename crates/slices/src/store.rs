//! A map on disk: a folder with an index and a compressed file a slice, identical slices once.
//!
//! A slice's file is named after the checksum of what it holds. So a map that is written over another never changes a file that the other's
//! index names: slices come first, then the index replaces the old one in one step, then files that
//! it does not name go.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nearmiss_store::{Check, File, OpenError, WriteError, Writer};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::encode::{decode, encode};
use crate::map::{About, SliceMap};
use crate::parallel::map_each;
use crate::slice::Slice;
use crate::{Grid, WalkError};

/// Kinds and versions of both files.
const INDEX: ([u8; 4], u32) = (*b"SLIX", 1);
const IMAGE: ([u8; 4], u32) = (*b"SLIM", 1);

/// Sections: checksums of all slices in the index, the image in a slice's file.
const CHECKSUMS: [u8; 4] = *b"SUMS";
const PIXELS: [u8; 4] = *b"PIXL";

/// Name of the index.
const INDEX_NAME: &str = "index.nms";

/// Ending of a slice's file.
const ENDING: &str = "nms";

/// Why a map is not saved or loaded.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StoreError {
    /// A file cannot be read, or is not what it should be.
    #[error(transparent)]
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
    #[error("slice {slice}: {cause}")]
    Slice {
        /// Which slice.
        slice: u32,
        /// Why.
        cause: OpenError,
    },
    /// A map of which slices are missing is not saved.
    #[error("slice {slice} is not loaded, so the map is not saved")]
    Incomplete {
        /// Which.
        slice: u32,
    },
    /// A slice is waited for that nobody loads any more.
    #[error("slice {slice} was not loaded: its thread has ended")]
    Loader {
        /// Which.
        slice: u32,
    },
    /// Nobody can walk.
    #[error(transparent)]
    Walk(#[from] WalkError),
}

/// What the index says beside the checksums.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Index {
    grid: Grid,
    share: f64,
    noise: f64,
    points: u64,
}

impl SliceMap {
    /// Writes the map into a folder, which is made, is empty, or holds another map, which it replaces. Tells the bytes of all files.
    ///
    /// # Errors
    /// When the folder holds other files, or something cannot be written; a map that was there before is then whole. Or when slices are
    /// missing.
    pub fn save(&self, folder: &Path) -> Result<u64, StoreError> {
        prepare(folder)?;
        let mut checksums = Vec::with_capacity(self.slices().len());
        let mut distinct: BTreeMap<u64, &Slice> = BTreeMap::new();
        for (slice, image) in (0..).zip(self.slices()) {
            let image = image.as_ref().ok_or(StoreError::Incomplete { slice })?;
            checksums.push(image.checksum());
            distinct.insert(image.checksum(), image);
        }
        let images: Vec<&Slice> = distinct.into_values().collect();
        let written = map_each(images.len(), |i| write_image(folder, images[i]));
        let mut bytes = 0;
        for length in written {
            bytes += length?;
        }
        let About { share, noise, points } = *self.about();
        let mut writer = Writer::new(INDEX.0, INDEX.1);
        let index = Index { grid: *self.grid(), share, noise, points };
        writer.metadata(&index)?.section(CHECKSUMS, 0, &checksums)?;
        bytes += writer.save(folder.join(INDEX_NAME))?;
        clear(folder, &checksums);
        Ok(bytes)
    }
}

/// Makes the folder, or checks that it may be written to.
fn prepare(folder: &Path) -> Result<(), StoreError> {
    let failed = |verb| move |cause| StoreError::Folder { path: folder.to_owned(), verb, cause };
    fs::create_dir_all(folder).map_err(failed("make"))?;
    let is_ours = folder.join(INDEX_NAME).is_file();
    let entries = fs::read_dir(folder).map_err(failed("read"))?;
    // Images without an index are what a build left that was killed.
    let mut others = entries.flatten().filter(|entry| !is_image_name(&entry.file_name().to_string_lossy()));
    if !is_ours && others.next().is_some() {
        return Err(StoreError::Foreign { path: folder.to_owned() });
    }
    Ok(())
}

fn write_image(folder: &Path, image: &Slice) -> Result<u64, WriteError> {
    let path = image_path(folder, image.checksum());
    let bytes = encode(image);
    let mut writer = Writer::new(IMAGE.0, IMAGE.1);
    writer.section(PIXELS, 0, &bytes)?;
    writer.save(path)
}

fn image_path(folder: &Path, checksum: u64) -> PathBuf {
    folder.join(format!("{checksum:016x}.{ENDING}"))
}

/// Whether a file of this name is one of ours, or what is left of writing one.
fn is_image_name(name: &str) -> bool {
    let stem = name.split('.').next().unwrap_or_default();
    let is_number = stem.len() == 16 && stem.bytes().all(|b| b.is_ascii_hexdigit());
    let ending = name.get(stem.len() + 1..).unwrap_or_default();
    (is_number || stem == "index") && ending.starts_with(ENDING)
}

/// Removes images that the index does not name; what cannot be removed does no harm.
fn clear(folder: &Path, checksums: &[u64]) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_image = name.strip_suffix(&format!(".{ENDING}")).is_some_and(|stem| stem.len() == 16);
        let named = name.get(..16).and_then(|stem| u64::from_str_radix(stem, 16).ok());
        if is_image && named.is_some_and(|checksum| !checksums.contains(&checksum)) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// A map in a folder, of which the index is read and every slice is loaded when it is wanted.
#[derive(Debug, Clone)]
pub struct SliceFolder {
    folder: PathBuf,
    grid: Grid,
    about: About,
    checksums: Arc<[u64]>,
}

impl SliceFolder {
    /// Reads the index.
    ///
    /// # Errors
    /// When there is none, or it is damaged.
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        let path = folder.join(INDEX_NAME);
        let file = File::read(&path, Check::Full)?;
        file.expect(INDEX.0, INDEX.1..=INDEX.1)?;
        let Index { grid, share, noise, points } = file.metadata()?;
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
        let about = About { share, noise, points };
        Ok(Self { folder: folder.to_owned(), grid, about, checksums: checksums.as_ref().into() })
    }

    /// Where pixels and slices lie.
    #[must_use]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// What the map was made of.
    #[must_use]
    pub fn about(&self) -> &About {
        &self.about
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
        (0..self.grid.counts[2]).rev().map(|s| (self.checksums[s as usize], s)).collect()
    }

    /// Bytes of all files that are there.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let length = |path: &Path| fs::metadata(path).map_or(0, |about| about.len());
        let images = self.firsts().into_keys().map(|checksum| length(&image_path(&self.folder, checksum)));
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
        let checksum = self.checksums[slice as usize];
        let path = image_path(&self.folder, checksum);
        let failed = |cause| StoreError::Slice { slice, cause };
        // The checksum of the image tells all that those of the file would.
        let file = File::read(&path, Check::Structure).map_err(failed)?;
        file.expect(IMAGE.0, IMAGE.1..=IMAGE.1).map_err(failed)?;
        let bytes = file.array::<u8>(PIXELS, 0).map_err(failed)?;
        let image = decode(&bytes, [self.grid.counts[0], self.grid.counts[1]]);
        image.filter(|image| image.checksum() == checksum).ok_or(StoreError::Image { slice, path })
    }

    /// The whole map in memory, and what could not be loaded of it: those slices are missing, the others serve.
    #[must_use]
    pub fn load_all(&self) -> (SliceMap, Vec<StoreError>) {
        let firsts: Vec<(u64, u32)> = self.firsts().into_iter().collect();
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
        SliceMap::unloaded(self.grid, self.about)
    }
}
