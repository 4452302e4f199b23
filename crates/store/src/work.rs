//! Workspaces for large arrays: in memory, or in mapped files, which may exceed the memory.
//!
//! Long work survives the end of its process: the arrays of a finished [`Stage`] are reused by the
//! next workspace with the same folder and key. All other arrays are unnamed files, which the
//! system removes when the process ends.

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

/// Name of the file that carries the lock and the key of a folder.
const KEY: &str = "work.key";

/// File extensions of arrays and of finished stages.
const ARRAY: &str = "room";
const DONE: &str = "done";

/// An allocator of large arrays: in memory, or in mapped files of a folder.
#[derive(Debug, Default)]
pub struct Workspace {
    folder: Option<Folder>,
    progress: Progress,
}

/// A folder that this process has locked.
#[derive(Debug)]
struct Folder {
    path: PathBuf,
    /// The key file. The process that has locked it owns the folder.
    key: fs::File,
    #[cfg(feature = "mmap")]
    warden: Warden,
}

/// The progress of the work, as a share of the whole. Clones share one value.
#[derive(Debug, Clone, Default)]
pub struct Progress {
    /// Finished share, in millionths.
    done: Arc<AtomicU64>,
}

impl Progress {
    /// Returns the finished share, from 0 to 1.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "at most a million")]
    pub fn share(&self) -> f64 {
        self.done.load(Ordering::Relaxed) as f64 * 1e-6
    }

    /// Sets the finished share, from 0 to 1.
    pub fn reach(&self, share: f64) {
        self.done.store(millionths(share), Ordering::Relaxed);
    }

    /// Adds to the finished share. Threads may call it at the same time.
    pub fn add(&self, share: f64) {
        self.done.fetch_add(millionths(share), Ordering::Relaxed);
    }
}

/// Returns a share, from 0 to 1, in millionths.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to a million")]
fn millionths(share: f64) -> u64 {
    (share.clamp(0.0, 1.0) * 1e6) as u64
}

impl Workspace {
    /// Creates a workspace in memory.
    #[must_use]
    pub fn in_memory() -> Self {
        Self::default()
    }

    /// Creates a workspace in the folder `path`, which is created if needed.
    ///
    /// Work that an ended process left there is resumed if it has the same `key` and the system has
    /// not been restarted since. Otherwise it is removed. On Linux, about `resident` bytes of the
    /// arrays stay in memory at most.
    ///
    /// # Errors
    /// Fails if the folder cannot be created or written, if another process uses it, or without the
    /// feature `mmap`.
    pub fn in_folder(path: impl Into<PathBuf>, key: &str, resident: u64) -> Result<Self, WorkError> {
        let path = path.into();
        Folder::new(path, key, resident)
            .map(|folder| Self { folder: Some(folder), progress: Progress::default() })
    }

    /// Removes the work that an ended process left in the folder `path`. Does nothing if the folder
    /// is not a workspace, or if a running process uses it.
    pub fn clear(path: &Path) {
        if let Ok(key) = fs::File::options().read(true).open(path.join(KEY))
            && key.try_lock().is_ok()
        {
            remove(path, &key);
        }
    }

    /// Returns `true` if the arrays are in memory.
    #[must_use]
    pub fn is_in_memory(&self) -> bool {
        self.folder.is_none()
    }

    /// Returns the progress of the work.
    #[must_use]
    pub fn progress(&self) -> &Progress {
        &self.progress
    }

    /// Allocates an array of `len` elements, all zero.
    ///
    /// # Errors
    /// Fails if the disk is full or the system is out of memory.
    pub fn room<T: Pod>(&self, len: usize) -> Result<Room<T>, WorkError> {
        match &self.folder {
            None => Room::in_memory(len),
            Some(folder) => folder.room(None, len),
        }
    }

    /// Returns a stage of the work. An earlier process may have finished it.
    #[must_use]
    pub fn stage(&self, name: &'static str) -> Stage<'_> {
        let done = self.folder.as_ref().and_then(|folder| fs::read(folder.file(name, DONE)).ok());
        Stage { work: self, name, done }
    }

    /// Ends the work and removes the folder. Arrays in use keep their content until they are
    /// dropped.
    pub fn remove(self) {
        if let Some(folder) = self.folder {
            remove(&folder.path, &folder.key);
        }
    }
}

/// A stage of the work in a [`Workspace`]. Its arrays are kept once it is closed.
#[derive(Debug)]
pub struct Stage<'a> {
    work: &'a Workspace,
    name: &'static str,
    done: Option<Vec<u8>>,
}

impl Stage<'_> {
    /// Returns the value that the stage was closed with, possibly by an earlier process; `None` if
    /// the stage is unfinished.
    #[must_use]
    pub fn done<V: DeserializeOwned>(&self) -> Option<V> {
        metadata::decode(self.done.as_deref()?, 0).ok()
    }

    /// Allocates the array `name` of `len` elements: with its stored content if the stage is
    /// finished, otherwise all zero.
    ///
    /// # Errors
    /// Fails if the disk is full, the system is out of memory, or the stored array is missing or
    /// has another length.
    pub fn room<T: Pod>(&self, name: &str, len: usize) -> Result<Room<T>, WorkError> {
        match &self.work.folder {
            None => Room::in_memory(len),
            Some(folder) => {
                let path = folder.file(&format!("{}-{name}", self.name), ARRAY);
                folder.room(Some((&path, self.done.is_some())), len)
            }
        }
    }

    /// Copies `room` into the array `name` of the stage. In memory, returns `room` itself.
    ///
    /// # Errors
    /// Fails if the disk is full.
    pub fn keep<T: Pod>(&self, name: &str, room: Room<T>) -> Result<Room<T>, WorkError> {
        if self.work.is_in_memory() {
            return Ok(room);
        }
        let mut kept = self.room(name, room.len())?;
        kept.copy_from_slice(&room);
        Ok(kept)
    }

    /// Finishes the stage: later workspaces find its arrays and `value`.
    ///
    /// # Errors
    /// Fails if the folder cannot be written.
    pub fn close(self, value: &impl Serialize) -> Result<(), WorkError> {
        let Some(folder) = &self.work.folder else { return Ok(()) };
        let (new, done) = (folder.file(self.name, "new"), folder.file(self.name, DONE));
        let encoded = metadata::encode(value).map_err(|cause| WorkError {
            path: done.clone(),
            step: "record the finished stage",
            kind: io::ErrorKind::InvalidInput,
            cause: cause.to_string(),
        })?;
        let write = || fs::write(&new, encoded).and_then(|()| fs::rename(&new, &done));
        write().map_err(WorkError::new(&done, "record the finished stage"))
    }
}

impl Folder {
    #[cfg(not(feature = "mmap"))]
    fn new(path: PathBuf, _: &str, _: u64) -> Result<Self, WorkError> {
        let without = || io::Error::new(io::ErrorKind::Unsupported, "this build cannot map files");
        Err(WorkError::new(&path, "work in a folder")(without()))
    }

    #[cfg(feature = "mmap")]
    fn new(path: PathBuf, key: &str, resident: u64) -> Result<Self, WorkError> {
        fs::create_dir_all(&path).map_err(WorkError::new(&path, "create the folder"))?;
        let place = path.join(KEY);
        let failed = |step| WorkError::new(&place, step);
        let mut options = fs::File::options();
        options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(&place).map_err(failed("open the file"))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(fs::TryLockError::WouldBlock) => {
                let used = io::Error::new(io::ErrorKind::WouldBlock, "another process uses it");
                return Err(WorkError::new(&path, "lock the folder")(used));
            }
            // On a file system without locks, assume that the folder is free.
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
            written.map_err(failed("write the file"))?;
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

    /// Allocates an array in a file: an unnamed one, or one at a path. The flag keeps the content
    /// of that file instead of creating it anew.
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
                let file = options.open(path).map_err(at("open the file"))?;
                let length = file.metadata().map_err(at("open the file"))?.len();
                if length != bytes {
                    let cause = format!("expected {bytes} bytes, got {length}");
                    return Err(at("reuse the file")(io::Error::new(io::ErrorKind::InvalidData, cause)));
                }
                file
            }
            Some((path, false)) => {
                options.create(true).truncate(true).open(path).map_err(at("create the file"))?
            }
            None => tempfile::tempfile_in(&self.path).map_err(at("create a file in the folder"))?,
        };
        if !matches!(name, Some((_, true))) {
            claim(&file, bytes).map_err(at("allocate disk space"))?;
        }
        let map = OwnMap::new(&file).map_err(at("map the file"))?;
        self.warden.watch(map.tenant());
        Ok(Room::in_file(map, len))
    }
}

/// Allocates disk space for a new file. Without it, writing to the map of the file ends the process
/// when the disk is full.
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

/// Allocates disk space by writing zeros, where the system has no call for it.
#[cfg(feature = "mmap")]
fn fill(mut file: &fs::File, bytes: u64) -> io::Result<()> {
    io::copy(&mut io::repeat(0).take(bytes), &mut file).map(|_| ())
}

/// Returns an id of the current boot, as data that had not reached the disk are lost on a restart.
#[cfg(feature = "mmap")]
fn boot() -> String {
    fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default()
}

/// Removes the folder of a workspace. The caller has locked `key`.
fn remove(path: &Path, key: &fs::File) {
    clear_files(path);
    let _left = fs::remove_file(path.join(KEY));
    let _unlocked = key.unlock();
    // Fails, as intended, if the folder holds other files.
    let _left = fs::remove_dir(path);
}

/// Removes the files of a workspace, except its key.
fn clear_files(path: &Path) {
    let ours =
        |name: &Path| name.extension().is_some_and(|e| e == ARRAY || e == DONE || e == OsStr::new("new"));
    let files = fs::read_dir(path).into_iter().flatten().flatten().map(|entry| entry.path());
    for file in files.filter(|file| ours(file)) {
        let _left = fs::remove_file(file);
    }
}
