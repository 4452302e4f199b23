//! Writing a map into a folder, new or with another map.
//!
//! A new map never changes a file that the old index names. Slices are written first, then the
//! index replaces the old one in one step, then files that the new index does not name are removed.
//! Two writers at once would remove each other's slices, so a writer holds a lock on a file in the
//! folder.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use nearmiss_lanes::parallel::map_each;
use nearmiss_store::{Check, ContainerFault, File, WriteError, Writer};

use crate::build::SliceBuilder;
use crate::encode::encode;
use crate::map::Index;
use crate::slice::Slice;
use crate::store::{CHECKSUMS, IMAGE, INDEX, INDEX_NAME, PIXELS, SliceFolder, StoreError, image_name, load};
use crate::{Grid, SliceMap};

/// Name of the lock file, which exists only while the lock is held.
const LOCK_NAME: &str = "index.lock";

/// Attempts to take the lock; one fails only if another process finished within microseconds.
const ATTEMPTS: usize = 16;

/// The infix between the name of a file and the random suffix of its temporary file, and the length
/// of the suffix ([`Writer::save`]).
const TEMPORARY: (&str, usize) = (".tmp-", 12);

/// A locked folder that a map will be written into.
///
/// Folders that were made for it are removed if nothing is written. On a file system without locks,
/// other writers are not kept out.
#[derive(Debug)]
pub struct SliceTarget {
    folder: PathBuf,
    _lock: fs::File,
    /// Dropped after the lock.
    _made: Made,
}

impl SliceTarget {
    /// Makes the folder, or checks that it is empty or holds a map or the remains of one. Takes the
    /// lock.
    ///
    /// # Errors
    /// If the folder cannot be made or written to, holds other files and no map, or another process
    /// is writing there.
    pub fn new(folder: impl AsRef<Path>) -> Result<Self, StoreError> {
        let folder = folder.as_ref();
        let missing = folder.ancestors().take_while(|f| !f.as_os_str().is_empty() && !f.exists());
        let made = Made(missing.map(Path::to_owned).collect());
        fs::create_dir_all(folder).map_err(failed(folder, "make"))?;
        check(folder)?;
        Ok(Self { folder: folder.to_owned(), _lock: lock(folder)?, _made: made })
    }

    /// Writes the map, which replaces the old one. Returns the bytes of all files.
    ///
    /// # Errors
    /// If a file cannot be written, or slices are missing. Then the new files are removed, and an
    /// old map stays whole.
    pub fn save(self, map: &SliceMap) -> Result<u64, StoreError> {
        let images = (0..).zip(map.slices()).map(|(slice, image)| match image {
            Some(image) => Ok(&**image),
            None => Err(StoreError::Incomplete { slice }),
        });
        let images = images.collect::<Result<Vec<_>, _>>()?;
        self.write(map.index(), |saved| saved.add(&images))
    }

    /// Makes the map of a builder and writes each slice as it is made, so that the map need not fit
    /// into memory. The files are the same as those of [`save`](Self::save).
    ///
    /// # Errors
    /// As for [`save`](Self::save).
    pub fn build(self, builder: SliceBuilder) -> Result<u64, StoreError> {
        let (index, together) = (builder.index(), builder.together());
        self.write(&index, |saved| {
            builder.each(index, together, |slices| saved.add(&slices.iter().collect::<Vec<_>>()))
        })
    }

    /// Writes the slices that `add_all` adds, and then the index.
    fn write(
        &self,
        index: &Index,
        add_all: impl FnOnce(&mut Saved<'_>) -> Result<(), StoreError>,
    ) -> Result<u64, StoreError> {
        let before = SliceFolder::open(&self.folder);
        let before = before.as_ref().map_or(&[][..], SliceFolder::checksums);
        let mut saved = Saved {
            target: self,
            grid: &index.grid,
            sums: vec![],
            known: BTreeSet::new(),
            new: vec![],
            bytes: 0,
        };
        let written = add_all(&mut saved).and_then(|()| {
            let mut writer = Writer::new(INDEX.0, INDEX.1);
            writer.metadata(index)?.section(CHECKSUMS, 0, &saved.sums)?;
            Ok(saved.bytes + writer.save(self.folder.join(INDEX_NAME))?)
        });
        match written {
            Ok(_) => self.clear(before, &saved.known),
            // Files that cannot be removed do no harm, here and below.
            Err(_) => saved.new.iter().for_each(|path| _ = fs::remove_file(path)),
        }
        written
    }

    fn write_image(&self, image: &Slice) -> Result<u64, WriteError> {
        let bytes = encode(image);
        let mut writer = Writer::new(IMAGE.0, IMAGE.1);
        writer.section(PIXELS, 0, &bytes)?;
        writer.save(self.image_path(image.checksum()))
    }

    fn image_path(&self, checksum: u64) -> PathBuf {
        self.folder.join(image_name(checksum))
    }

    /// Removes the slices of the old map, and the files that killed writers left.
    fn clear(&self, before: &[u64], now: &BTreeSet<u64>) {
        let Ok(entries) = fs::read_dir(&self.folder) else { return };
        for entry in entries.flatten() {
            let (name, path) = (entry.file_name(), entry.path());
            let name = name.to_string_lossy();
            let is_old = checksum_of(&name).is_some_and(|checksum| {
                !now.contains(&checksum) && (before.contains(&checksum) || is_image(&path))
            });
            if is_old || is_temporary(&name) && is_abandoned(&path) {
                let _ = fs::remove_file(path);
            }
        }
    }
}

/// The slices of a map that are written already.
struct Saved<'a> {
    target: &'a SliceTarget,
    grid: &'a Grid,
    /// Checksums of all slices so far, lowest first.
    sums: Vec<u64>,
    /// The distinct checksums.
    known: BTreeSet<u64>,
    /// Files that did not exist before.
    new: Vec<PathBuf>,
    bytes: u64,
}

impl Saved<'_> {
    /// Writes the next slices, lowest first; equal ones once.
    fn add(&mut self, images: &[&Slice]) -> Result<(), StoreError> {
        let first = self.sums.len();
        self.sums.extend(images.iter().map(|image| image.checksum()));
        let sums = &self.sums[first..];
        let mut distinct = distinct(sums.iter().copied().zip(images.iter().copied()))?;
        for (slice, checksum) in (first..).zip(sums).filter(|(_, checksum)| self.known.contains(checksum)) {
            let Some(image) = distinct.remove(checksum) else { continue };
            let slice = u32::try_from(slice).unwrap_or(u32::MAX);
            if load(&self.target.folder, slice, *checksum, self.grid)? != *image {
                return Err(StoreError::Alike { checksum: *checksum });
            }
        }
        let paths = distinct.keys().map(|checksum| self.target.image_path(*checksum));
        self.new.extend(paths.filter(|path| !path.exists()));
        self.known.extend(distinct.keys());
        let images: Vec<&Slice> = distinct.into_values().collect();
        for length in map_each(images.len(), |i| self.target.write_image(images[i])) {
            self.bytes += length?;
        }
        Ok(())
    }
}

/// The file is removed while the lock is still held.
impl Drop for SliceTarget {
    fn drop(&mut self) {
        let _ = fs::remove_file(self.folder.join(LOCK_NAME));
    }
}

impl SliceMap {
    /// Writes the map into a folder, which may be missing, empty, or hold another map to replace.
    /// Returns the bytes of all files.
    ///
    /// # Errors
    /// As for [`SliceTarget::new`] and [`SliceTarget::save`].
    pub fn save(&self, folder: impl AsRef<Path>) -> Result<u64, StoreError> {
        let folder = folder.as_ref();
        SliceTarget::new(folder)?.save(self)
    }
}

/// Returns the distinct slices by their checksums.
fn distinct<'a>(
    images: impl Iterator<Item = (u64, &'a Slice)>,
) -> Result<BTreeMap<u64, &'a Slice>, StoreError> {
    let mut distinct = BTreeMap::new();
    for (checksum, image) in images {
        let first: &Slice = distinct.entry(checksum).or_insert(image);
        if !std::ptr::eq(first, image) && first != image {
            return Err(StoreError::Alike { checksum });
        }
    }
    Ok(distinct)
}

/// Folders that were made, deepest first; removed on drop if they are empty.
#[derive(Debug)]
struct Made(Vec<PathBuf>);

impl Drop for Made {
    fn drop(&mut self) {
        self.0.iter().for_each(|folder| _ = fs::remove_dir(folder));
    }
}

fn failed(folder: &Path, verb: &'static str) -> impl Fn(io::Error) -> StoreError {
    move |cause| StoreError::Folder { path: folder.to_owned(), verb, cause }
}

/// Checks that a map may be written into a folder. A damaged index still counts as a map. Without
/// an index, the folder may hold files that killed writers left.
fn check(folder: &Path) -> Result<(), StoreError> {
    let foreign = || StoreError::Foreign { path: folder.to_owned() };
    let index = File::read(folder.join(INDEX_NAME), Check::Structure);
    match index.and_then(|file| file.expect(INDEX.0, 0..=u32::MAX)).map_err(|error| error.fault) {
        Err(ContainerFault::Io { source }) if source.kind() == io::ErrorKind::NotFound => {}
        Err(
            ContainerFault::NotAFile { .. }
            | ContainerFault::NotAContainer { .. }
            | ContainerFault::Kind { .. },
        ) => {
            return Err(foreign());
        }
        _ => return Ok(()),
    }
    for entry in fs::read_dir(folder).map_err(failed(folder, "read"))?.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_ours = [LOCK_NAME, INDEX_NAME].contains(&&*name) || is_temporary(&name);
        if !is_ours && (checksum_of(&name).is_none() || !is_image(&entry.path())) {
            return Err(foreign());
        }
    }
    Ok(())
}

/// Takes the lock of a folder. The previous owner may have removed the file meanwhile.
fn lock(folder: &Path) -> Result<fs::File, StoreError> {
    let path = folder.join(LOCK_NAME);
    for _ in 0..ATTEMPTS {
        let file = fs::OpenOptions::new().create(true).truncate(false).write(true).open(&path);
        let file = file.map_err(failed(folder, "write into"))?;
        if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
            break;
        }
        if is_at(&file, &path) {
            return Ok(file);
        }
    }
    Err(StoreError::Busy { path: folder.to_owned() })
}

/// Returns `true` if an open file is the one at this path.
#[cfg(unix)]
fn is_at(file: &fs::File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |about: &fs::Metadata| (about.dev(), about.ino());
    matches!((&file.metadata(), &fs::metadata(path)), (Ok(a), Ok(b)) if id(a) == id(b))
}

/// Returns `true` if an open file is the one at this path.
#[cfg(not(unix))]
fn is_at(_file: &fs::File, path: &Path) -> bool {
    path.exists()
}

/// Returns the checksum of the slice in a file of this name.
fn checksum_of(name: &str) -> Option<u64> {
    let checksum = u64::from_str_radix(name.split('.').next()?, 16).ok()?;
    (image_name(checksum) == name).then_some(checksum)
}

/// Returns `true` if a file holds a slice, or no longer exists.
fn is_image(path: &Path) -> bool {
    match File::read(path, Check::Structure) {
        Ok(file) => file.kind() == IMAGE.0,
        Err(error) => {
            matches!(error.fault, ContainerFault::Io { source } if source.kind() == io::ErrorKind::NotFound)
        }
    }
}

/// Returns `true` if this is the name of a temporary file of a map.
fn is_temporary(name: &str) -> bool {
    let (infix, length) = TEMPORARY;
    name.rsplit_once(infix).is_some_and(|(target, random)| {
        let is_random = random.len() == length && random.bytes().all(|b| b.is_ascii_alphanumeric());
        is_random && (target == INDEX_NAME || checksum_of(target).is_some())
    })
}

/// Returns `true` if no process is writing a temporary file any more.
fn is_abandoned(path: &Path) -> bool {
    fs::OpenOptions::new().write(true).open(path).is_ok_and(|file| file.try_lock().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slice::Canvas;

    #[test]
    fn slices_of_one_checksum_are_one_only_if_they_are_equal() {
        let [a, b, c] = [3, 3, 4].map(|width| Canvas::new(width, 2).finish());
        let found = distinct([(7, &a), (9, &c), (7, &b), (7, &a)].into_iter()).unwrap();
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [(7, &a), (9, &c)]);
        let refused = distinct([(7, &a), (7, &c)].into_iter());
        assert!(matches!(refused, Err(StoreError::Alike { checksum: 7 })), "{refused:?}");
    }

    #[cfg(unix)]
    #[test]
    fn a_lock_on_a_file_that_is_gone_is_none() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join(LOCK_NAME);
        let file = fs::File::create(&path).unwrap();
        assert!(is_at(&file, &path));
        fs::remove_file(&path).unwrap();
        assert!(!is_at(&file, &path));
        fs::write(&path, b"").unwrap();
        assert!(!is_at(&file, &path), "another of the same name");
    }
}
