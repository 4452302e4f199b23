//! Replacing a file in one step, and clearing away what killed writers left.
//!
//! Every writer holds an exclusive lock on its temporary file from just after its creation until it has its
//! final name; the system lets go of the lock when the process ends, however it ends. So a file with our
//! pattern that can be locked has no living writer. Between creating and locking lies a moment in which
//! another process might take a new file for litter: hence a writer, once it has the lock, looks whether the
//! name is still there, and otherwise begins anew.

use std::ffi::{OsStr, OsString};
use std::fs::{self, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{WriteError, WriteStep};

/// Stands between the target's name and the random part.
const INFIX: &str = ".tmp-";

/// Random letters and digits in a temporary name: long enough that nobody else's file looks like it.
const RANDOM: usize = 12;

/// Attempts at a temporary file; each fails only if another process cleared it away within microseconds.
const ATTEMPTS: usize = 16;

/// As [`replace_file`], for writers that fail with the system's errors alone.
pub(crate) fn replace(
    path: &Path,
    write: impl FnOnce(&mut fs::File) -> io::Result<()>,
) -> Result<(), WriteError> {
    let failed = |source| WriteError::Io { path: Some(path.to_owned()), step: WriteStep::Write, source };
    replace_file(path, |file| write(file).map_err(failed))
}

/// Replaces the file at `path` by what `write` writes, or leaves everything as it was; hands on what `write`
/// returns.
///
/// The content is written beside the target and put in its place in one step, once it is on the disk. A link
/// stays a link; permissions of a replaced file are kept. What writers of this target left that were killed
/// is removed first, where the file system knows locks.
///
/// # Errors
/// Those of `write`, [`WriteError::NotAFile`] for folders and devices, and [`WriteError::Io`] with the step
/// that failed.
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
    // From here on the temporary file is removed when dropped, also if `write` panics.
    let mut temporary = create_locked(folder, name).map_err(failed(WriteStep::Create))?;
    let told = write(temporary.as_file_mut())?;
    if let Some(permissions) = previous {
        // Not every file system has permissions to keep; the bytes matter more.
        let _ = temporary.as_file().set_permissions(permissions);
    }
    temporary.as_file().sync_all().map_err(failed(WriteStep::Sync))?;
    temporary.persist(&target).map_err(|refused| failed(WriteStep::Rename)(refused.error))?;
    sync_folder(folder);
    Ok(told)
}

/// The file that a link leads to, so that the link outlives the replacement; anything else as it is.
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

/// A new file beside the target that no other process will take for litter.
fn create_locked(folder: &Path, name: &OsStr) -> io::Result<NamedTempFile> {
    let prefix = prefix(name);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).rand_bytes(RANDOM);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // What any program asks for when it creates a file; the umask takes its share.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    for _ in 0..ATTEMPTS {
        let file = builder.tempfile_in(folder)?;
        // An error other than "held by someone" means that there are no locks here, and nobody clears litter
        // then.
        let ours = !matches!(file.as_file().try_lock(), Err(TryLockError::WouldBlock));
        if ours && file.path().try_exists()? {
            return Ok(file);
        }
    }
    Err(io::ErrorKind::ResourceBusy.into())
}

/// Removes what killed writers of this very target left. Never fails: litter does no harm but to the eye and
/// the disk.
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
    // For writing, because network file systems grant an exclusive lock only then.
    let Ok(file) = fs::OpenOptions::new().write(true).open(path) else {
        return;
    };
    if file.try_lock().is_ok() {
        // Removed while the lock is held. Should it fail, the next save tries again.
        let _ = fs::remove_file(path);
    }
}

/// Makes the new name itself survive a loss of power. The replacement has happened, and some file systems
/// cannot sync a folder, so a failure is not reported.
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
