//! Output files, which are written whole or not at all.

use std::ffi::OsString;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use nearmiss::store::replace_file;
use nearmiss_draw::picture::Picture;

use crate::error::CliError;

/// Fails if no file can be written at `path`. Called before the work whose result goes there.
pub(crate) fn check(path: &Path) -> Result<(), CliError> {
    let unsuitable =
        |what: &str| Err(CliError::UnsuitableFile { path: path.to_owned(), what: what.to_owned() });
    if is_stdout(path) {
        return unsuitable("expected a file to write to, got standard output; name a file");
    }
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => {
            return unsuitable("expected a file to write to, got a folder; name a file in it");
        }
        Ok(there) if !there.is_file() => {
            return unsuitable(
                "expected a regular file to write to, got a device or pipe; name a regular file",
            );
        }
        _ => {}
    }
    if path.file_name().is_none() {
        return unsuitable("expected a file to write to, got a path without a file name; name a file");
    }
    let folder = folder(path);
    if folder.is_dir() {
        Ok(())
    } else {
        unsuitable(&format!("there is no folder {}; create it first", folder.display()))
    }
}

/// As [`check`], and fails if the file would replace one of `inputs`.
pub(crate) fn check_apart(path: &Path, inputs: &[&Path]) -> Result<(), CliError> {
    check(path)?;
    let Ok(target) = path.canonicalize() else { return Ok(()) };
    match inputs.iter().find(|i| i.canonicalize().is_ok_and(|i| i == target)) {
        Some(input) => Err(CliError::Usage(format!(
            "{}: the output would replace the input {}; name another file",
            path.display(),
            input.display()
        ))),
        None => Ok(()),
    }
}

/// Returns `true` if both paths name the same file, which need not exist.
pub(crate) fn is_same(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| {
        path.canonicalize().or_else(|_| {
            let folder = folder(path).canonicalize()?;
            Ok::<_, io::Error>(folder.join(path.file_name().unwrap_or_default()))
        })
    };
    matches!((place(a), place(b)), (Ok(a), Ok(b)) if a == b)
}

/// Replaces the file at `path` by what `write` writes, and returns the result of `write`. After an
/// error, the old file is unchanged.
pub(crate) fn replace<T>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&fs::File>) -> Result<T, CliError>,
) -> Result<T, CliError> {
    check(path)?;
    replace_file(path, |file| {
        let mut out = BufWriter::with_capacity(1 << 16, &*file);
        let told = write(&mut out)?;
        out.flush().map_err(CliError::writing(path))?;
        Ok(told)
    })
}

/// As [`replace`], if there is a path; otherwise calls `write` without a file.
pub(crate) fn replace_if_any<T>(
    path: Option<&Path>,
    write: impl for<'w> FnOnce(Option<&'w mut (dyn Write + 'w)>) -> Result<T, CliError>,
) -> Result<T, CliError> {
    match path {
        Some(path) => replace(path, |out| write(Some(out))),
        None => write(None),
    }
}

/// As [`replace`], for functions that fail with I/O errors only.
pub(crate) fn replace_plain(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&fs::File>) -> io::Result<()>,
) -> Result<(), CliError> {
    replace(path, |out| write(out).map_err(CliError::writing(path)))
}

/// Writes a picture as PNG. If that fails, no partial file is left.
///
/// # Errors
/// If the file cannot be written.
pub fn save_picture(picture: &Picture, path: &Path) -> Result<(), CliError> {
    replace_plain(path, |out| picture.encode(out))
}

/// As [`replace_plain`], but writes to standard output if `path` is `-`.
pub(crate) fn replace_or_print(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), CliError> {
    if !is_stdout(path) {
        return replace_plain(path, |out| write(out));
    }
    let mut out = BufWriter::with_capacity(1 << 16, io::stdout().lock());
    write(&mut out).and_then(|()| out.flush()).map_err(CliError::Stdout)
}

/// Returns `true` for `-`, which stands for standard output.
pub(crate) fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}

fn folder(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Returns the folder next to `output` in which work on disk is done.
pub(crate) fn work_folder(output: &Path) -> PathBuf {
    let mut name = output.file_name().map(OsString::from).unwrap_or_default();
    name.push(".work");
    output.with_file_name(name)
}
