//! Atomic replacement of a file, and removal of temporary files that killed writers left.
//!
//! Every writer locks its temporary file exclusively, from just after its creation until the final
//! rename. The system releases the lock when the process ends for any reason, so a temporary file
//! that can be locked has no running writer. Another process might remove a new file between its
//! creation and its locking. Therefore a writer that has the lock checks that the name still
//! exists, and otherwise starts again.

use std::ffi::{OsStr, OsString};
use std::fs::{self, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{WriteError, WriteStep};

/// The part of a temporary name between the target's name and the random part.
const INFIX: &str = ".tmp-";

/// Number of random letters and digits in a temporary name: enough that no unrelated file matches.
const RANDOM: usize = 12;

/// Number of attempts to create a temporary file. One fails only if another process removes the
/// file within microseconds.
const ATTEMPTS: usize = 16;

/// Like [`replace_file`], for writers that return I/O errors.
pub(crate) fn replace(
    path: &Path,
    write: impl FnOnce(&mut fs::File) -> io::Result<()>,
) -> Result<(), WriteError> {
    let failed = |source| WriteError::Io { path: Some(path.to_owned()), step: WriteStep::Write, source };
    replace_file(path, |file| write(file).map_err(failed))
}

/// Replaces the file at `path` by what `write` writes, or leaves the file as it was. Returns the
/// value that `write` returns.
///
/// The content is written to a temporary file beside the target, synced to the disk, and renamed to
/// the target in one step. A link stays a link. A replaced file keeps its permissions. Temporary
/// files of killed writers of the same target are removed first, if the file system supports locks.
///
/// # Errors
/// Returns the error of `write`, [`WriteError::NotAFile`] for folders and devices, or
/// [`WriteError::Io`] with the step that failed.
pub fn replace_file<T, E: From<WriteError>>(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut fs::File) -> Result<T, E>,
) -> Result<T, E> {
    let path = path.as_ref();
    let failed = |step| move |source| WriteError::Io { path: Some(path.to_owned()), step, source };

    let target = follow(path).map_err(failed(WriteStep::Inspect))?;
    let previous = match fs::metadata(&target) {
        Ok(previous) if previous.is_file() => Some(previous.permissions()),
        Ok(other) => {
            return Err(WriteError::NotAFile { path: path.to_owned(), directory: other.is_dir() }.into());
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => return Err(failed(WriteStep::Inspect)(error).into()),
    };
    let Some(name) = target.file_name() else {
        return Err(WriteError::NotAFile { path: path.to_owned(), directory: true }.into());
    };
    let folder = folder_of(&target);

    clear_litter(folder, name);
    // The temporary file is removed when dropped, also if `write` panics.
    let mut temporary = create_locked(folder, name).map_err(failed(WriteStep::Create))?;
    let told = write(temporary.as_file_mut())?;
    if let Some(permissions) = previous {
        // Ignored: some file systems have no permissions, and the content matters more.
        let _ = temporary.as_file().set_permissions(permissions);
    }
    temporary.as_file().sync_all().map_err(failed(WriteStep::Sync))?;
    temporary.persist(&target).map_err(|refused| failed(WriteStep::Rename)(refused.error))?;
    sync_folder(folder);
    Ok(told)
}

/// Returns the target of a link, so that the link survives the replacement, or else the path
/// itself.
fn follow(path: &Path) -> io::Result<PathBuf> {
    match fs::symlink_metadata(path) {
        Ok(entry) if entry.is_symlink() => fs::canonicalize(path),
        _ => Ok(path.to_owned()),
    }
}

fn folder_of(target: &Path) -> &Path {
    match target.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

fn prefix(name: &OsStr) -> OsString {
    let mut prefix = name.to_owned();
    prefix.push(INFIX);
    prefix
}

/// Creates and locks a temporary file beside the target, so that no other process removes it.
fn create_locked(folder: &Path, name: &OsStr) -> io::Result<NamedTempFile> {
    let prefix = prefix(name);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).rand_bytes(RANDOM);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The usual mode of new files, before the umask.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    for _ in 0..ATTEMPTS {
        let file = builder.tempfile_in(folder)?;
        // Any other error means that the file system has no locks. Then no process removes
        // temporary files.
        let ours = !matches!(file.as_file().try_lock(), Err(TryLockError::WouldBlock));
        if ours && file.path().try_exists()? {
            return Ok(file);
        }
    }
    Err(io::ErrorKind::ResourceBusy.into())
}

/// Removes temporary files that killed writers of this target left. Errors are ignored, since such
/// files only waste disk space.
fn clear_litter(folder: &Path, name: &OsStr) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let prefix = prefix(name);
    for entry in entries.flatten() {
        let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_file && is_temporary(&entry.file_name(), &prefix) {
            remove_if_abandoned(&entry.path());
        }
    }
}

fn is_temporary(candidate: &OsStr, prefix: &OsStr) -> bool {
    let random = candidate.as_encoded_bytes().strip_prefix(prefix.as_encoded_bytes());
    random.is_some_and(|random| random.len() == RANDOM && random.iter().all(u8::is_ascii_alphanumeric))
}

fn remove_if_abandoned(path: &Path) {
    // Opened for writing, as network file systems require for an exclusive lock.
    let Ok(file) = fs::OpenOptions::new().write(true).open(path) else {
        return;
    };
    if file.try_lock().is_ok() {
        // Removed while the lock is held. If this fails, the next save tries again.
        let _ = fs::remove_file(path);
    }
}

/// Syncs the folder, so that the new name survives a power failure. Errors are ignored: the file is
/// already replaced, and some file systems cannot sync a folder.
fn sync_folder(folder: &Path) {
    if cfg!(unix)
        && let Ok(folder) = fs::File::open(folder)
    {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
#[path = "atomic_tests.rs"]
mod tests;
