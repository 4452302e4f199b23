//! Where large arrays are made: in memory, or in files that are mapped, so that they may exceed it.
//!
//! Work of hours survives the end of its process: arrays that belong to a finished [`Stage`] are found again
//! by the next workspace of the same folder and key. All others are files without a name, which the system
//! removes with the process.

use std::ffi::OsStr;
use std::fs;
use std::io;
#[cfg(feature = "mmap")]
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bytemuck::Pod;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::metadata;
use crate::room::Room;
#[cfg(feature = "mmap")]
use crate::warden::Warden;
use crate::work_error::WorkError;

/// The file that holds the lock of a folder, and says what it is for.
const KEY: &str = "work.key";

/// What the files of arrays, and of what was said of finished stages, end in.
const ARRAY: &str = "room";
const DONE: &str = "done";

/// A place for large arrays: in memory, or in mapped files of a folder.
#[derive(Debug, Default)]
pub struct Workspace {
    folder: Option<Folder>,
    progress: Progress,
}

/// A folder whose lock is held.
#[derive(Debug)]
struct Folder {
    path: PathBuf,
    /// Whoever holds its lock owns the folder.
    key: fs::File,
    #[cfg(feature = "mmap")]
    warden: Warden,
}

/// How far work has come, as shares of the whole. Clones tell the same.
#[derive(Debug, Clone, Default)]
pub struct Progress {
    /// Millionths that are done.
    done: Arc<AtomicU64>,
}

impl Progress {
    /// The share that is done, from 0 to 1.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "at most a million")]
    pub fn share(&self) -> f64 {
        self.done.load(Ordering::Relaxed) as f64 * 1e-6
    }

    /// Says that so much of the whole is done.
    pub fn reach(&self, share: f64) {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to a million")]
        self.done.store((share.clamp(0.0, 1.0) * 1e6) as u64, Ordering::Relaxed);
    }
}

impl Workspace {
    /// One in memory.
    #[must_use]
    pub fn in_memory() -> Self {
        Self::default()
    }

    /// One in the folder `path`, which is made. Work that an ended process has left there is gone on with if
    /// its `key` is the same and the system was not started anew since, and removed otherwise.
    ///
    /// Of the arrays no more than about `resident` bytes stay in memory, where the system tells and heeds it
    /// (Linux).
    ///
    /// # Errors
    /// When the folder cannot be made or written, holds other files, or is another process's; without the
    /// feature `mmap`.
    pub fn in_folder(path: impl Into<PathBuf>, key: &str, resident: u64) -> Result<Self, WorkError> {
        let path = path.into();
        Folder::new(path, key, resident)
            .map(|folder| Self { folder: Some(folder), progress: Progress::default() })
    }

    /// Removes what an ended process has left in the folder `path`, if that is a workspace's and no living
    /// process's.
    pub fn clear(path: &Path) {
        if let Ok(key) = fs::File::options().read(true).open(path.join(KEY))
            && key.try_lock().is_ok()
        {
            remove(path, &key);
        }
    }

    /// Returns `true` if arrays are in memory.
    #[must_use]
    pub fn is_in_memory(&self) -> bool {
        self.folder.is_none()
    }

    /// How far the work has come, for whoever watches.
    #[must_use]
    pub fn progress(&self) -> &Progress {
        &self.progress
    }

    /// Room for `len` elements, all zero.
    ///
    /// # Errors
    /// When the disk is full, or the system gives no memory.
    pub fn room<T: Pod>(&self, len: usize) -> Result<Room<T>, WorkError> {
        match &self.folder {
            None => Room::in_memory(len),
            Some(folder) => folder.room(None, len),
        }
    }

    /// A stage of the work, which may be done already.
    #[must_use]
    pub fn stage(&self, name: &'static str) -> Stage<'_> {
        let done = self.folder.as_ref().and_then(|folder| fs::read(folder.file(name, DONE)).ok());
        Stage { work: self, name, done }
    }

    /// Ends the work: removes the folder. Arrays that are in use keep their content until they are dropped.
    pub fn remove(self) {
        if let Some(folder) = self.folder {
            remove(&folder.path, &folder.key);
        }
    }
}

/// A stage of work in a [`Workspace`], the arrays of which are kept once it is closed.
#[derive(Debug)]
pub struct Stage<'a> {
    work: &'a Workspace,
    name: &'static str,
    done: Option<Vec<u8>>,
}

impl Stage<'_> {
    /// What was said of the stage when it was closed, by a process that has ended maybe; `None` if it is
    /// still to be done.
    #[must_use]
    pub fn done<V: DeserializeOwned>(&self) -> Option<V> {
        metadata::decode(self.done.as_deref()?, 0).ok()
    }

    /// Room for `len` elements: with what the stage has put there if it is done, else all zero.
    ///
    /// # Errors
    /// When the disk is full, the system gives no memory, or what was there is gone.
    pub fn room<T: Pod>(&self, name: &str, len: usize) -> Result<Room<T>, WorkError> {
        match &self.work.folder {
            None => Room::in_memory(len),
            Some(folder) => {
                let path = folder.file(&format!("{}-{name}", self.name), ARRAY);
                folder.room(Some((&path, self.done.is_some())), len)
            }
        }
    }

    /// Makes `room` one of the arrays of the stage.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn keep<T: Pod>(&self, name: &str, room: Room<T>) -> Result<Room<T>, WorkError> {
        if self.work.is_in_memory() {
            return Ok(room);
        }
        let mut kept = self.room(name, room.len())?;
        kept.copy_from_slice(&room);
        Ok(kept)
    }

    /// Closes the stage: from now on its arrays are to be found again, and so is what is said of it.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn close(self, value: &impl Serialize) -> Result<(), WorkError> {
        let Some(folder) = &self.work.folder else { return Ok(()) };
        let (new, done) = (folder.file(self.name, "new"), folder.file(self.name, DONE));
        let encoded = metadata::encode(value).map_err(|cause| WorkError {
            path: done.clone(),
            step: "note what is done",
            kind: io::ErrorKind::InvalidData,
            cause: cause.to_string(),
        })?;
        let write = || fs::write(&new, encoded).and_then(|()| fs::rename(&new, &done));
        write().map_err(WorkError::new(&done, "note what is done"))
    }
}

impl Folder {
    #[cfg(not(feature = "mmap"))]
    fn new(path: PathBuf, _: &str, _: u64) -> Result<Self, WorkError> {
        let without = || io::Error::new(io::ErrorKind::Unsupported, "built without the feature `mmap`");
        Err(WorkError::new(&path, "work in a folder")(without()))
    }

    #[cfg(feature = "mmap")]
    fn new(path: PathBuf, key: &str, resident: u64) -> Result<Self, WorkError> {
        fs::create_dir_all(&path).map_err(WorkError::new(&path, "make the folder"))?;
        let place = path.join(KEY);
        let failed = |step| WorkError::new(&place, step);
        let mut options = fs::File::options();
        options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(&place).map_err(failed("open"))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(fs::TryLockError::WouldBlock) => {
                let used = io::Error::new(io::ErrorKind::WouldBlock, "another process works there");
                return Err(WorkError::new(&path, "use the folder")(used));
            }
            // A file system without locks: the folder is as much ours as can be known.
            Err(fs::TryLockError::Error(_)) => {}
        }
        let key = format!("{key}\n{}\n", boot());
        let mut before = String::new();
        let is_known = file.read_to_string(&mut before).is_ok() && before == key;
        if !is_known {
            clear_files(&path);
            let written = file.set_len(0).and_then(|()| {
                io::Seek::rewind(&mut file)?;
                file.write_all(key.as_bytes())
            });
            written.map_err(failed("write"))?;
        }
        Ok(Self { path, key: file, warden: Warden::new(resident) })
    }

    fn file(&self, name: &str, ending: &str) -> PathBuf {
        self.path.join(format!("{name}.{ending}"))
    }

    #[cfg(not(feature = "mmap"))]
    fn room<T: Pod>(&self, _: Option<(&Path, bool)>, len: usize) -> Result<Room<T>, WorkError> {
        Room::in_memory(len)
    }

    /// Room in a file: of this name, which is `kept` with its content or made anew, or without one.
    #[cfg(feature = "mmap")]
    fn room<T: Pod>(&self, name: Option<(&Path, bool)>, len: usize) -> Result<Room<T>, WorkError> {
        use crate::own_map::OwnMap;

        let Some(bytes) = len.checked_mul(size_of::<T>()).filter(|bytes| *bytes > 0) else {
            return Room::in_memory(len);
        };
        let bytes = bytes as u64;
        let at = |step| WorkError::new(name.map_or(&*self.path, |(path, _)| path), step);
        let mut options = fs::File::options();
        options.read(true).write(true);
        let file = match name {
            Some((path, true)) => {
                let file = options.open(path).map_err(at("open"))?;
                let length = file.metadata().map_err(at("open"))?.len();
                if length != bytes {
                    let cause = format!("expected {bytes} bytes, got {length}; remove the folder");
                    return Err(at("go on with")(io::Error::new(io::ErrorKind::InvalidData, cause)));
                }
                file
            }
            Some((path, false)) => options.create(true).truncate(true).open(path).map_err(at("create"))?,
            None => tempfile::tempfile_in(&self.path).map_err(at("create a file in"))?,
        };
        if !matches!(name, Some((_, true))) {
            claim(&file, bytes).map_err(at("claim space for"))?;
        }
        let map = OwnMap::new(&file).map_err(at("map"))?;
        self.warden.watch(map.tenant());
        Ok(Room::in_file(map, len))
    }
}

/// Lengthens a new file, so that writing to its map finds space: a disk that is full then would end the
/// process.
#[cfg(all(feature = "mmap", any(target_os = "linux", target_os = "android")))]
fn claim(file: &fs::File, bytes: u64) -> io::Result<()> {
    use rustix::fs::{FallocateFlags, fallocate};
    use rustix::io::Errno;

    match fallocate(file, FallocateFlags::empty(), 0, bytes) {
        Ok(()) => Ok(()),
        Err(Errno::OPNOTSUPP | Errno::NOSYS) => fill(file, bytes),
        Err(cause) => Err(cause.into()),
    }
}

#[cfg(all(feature = "mmap", not(any(target_os = "linux", target_os = "android"))))]
fn claim(file: &fs::File, bytes: u64) -> io::Result<()> {
    fill(file, bytes)
}

/// The same by zeros, where nothing else is possible.
#[cfg(feature = "mmap")]
fn fill(mut file: &fs::File, bytes: u64) -> io::Result<()> {
    io::copy(&mut io::repeat(0).take(bytes), &mut file).map(|_| ())
}

/// What differs after each start of the system: what was not yet on the disk is lost then.
#[cfg(feature = "mmap")]
fn boot() -> String {
    fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default()
}

/// Removes a workspace's folder, whose key is held.
fn remove(path: &Path, key: &fs::File) {
    clear_files(path);
    let _left = fs::remove_file(path.join(KEY));
    let _unlocked = key.unlock();
    // Stays if it holds anything else.
    let _left = fs::remove_dir(path);
}

/// Removes the files of a workspace but its key.
fn clear_files(path: &Path) {
    let ours =
        |name: &Path| name.extension().is_some_and(|e| e == ARRAY || e == DONE || e == OsStr::new("new"));
    let files = fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    for file in files.filter(|file| ours(file)) {
        let _left = fs::remove_file(file);
    }
}
