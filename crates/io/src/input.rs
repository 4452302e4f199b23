//! Bytes of a file, on disk or in memory.

use std::fs::File;
use std::io::{self, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use crate::error::{Broken, ReadError};

/// The bytes of a file, on disk or in memory.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Input<'a> {
    /// On disk.
    File(&'a File),
    /// In memory.
    Memory(&'a [u8]),
}

/// A reader of an [`Input`].
#[derive(Debug)]
pub(crate) enum Reader<'a> {
    File(&'a File),
    Memory(Cursor<&'a [u8]>),
}

impl<'a> Input<'a> {
    /// Returns the number of bytes.
    pub(crate) fn length(self) -> io::Result<u64> {
        match self {
            Self::File(file) => file.metadata().map(|about| about.len()),
            Self::Memory(bytes) => Ok(bytes.len() as u64),
        }
    }

    /// Returns a reader that starts at this byte.
    pub(crate) fn reader(self, start: u64) -> io::Result<Reader<'a>> {
        let mut reader = match self {
            Self::File(file) => Reader::File(file),
            Self::Memory(bytes) => Reader::Memory(Cursor::new(bytes)),
        };
        reader.seek(SeekFrom::Start(start))?;
        Ok(reader)
    }

    /// Reads at most `most` bytes from the start.
    pub(crate) fn head(self, most: usize) -> io::Result<Vec<u8>> {
        let mut head = Vec::new();
        self.reader(0)?.take(most as u64).read_to_end(&mut head)?;
        Ok(head)
    }
}

impl Read for Reader<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::File(file) => file.read(into),
            Self::Memory(bytes) => bytes.read(into),
        }
    }
}

impl Seek for Reader<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match self {
            Self::File(file) => file.seek(to),
            Self::Memory(bytes) => bytes.seek(to),
        }
    }
}

/// Error of reading an [`Input`].
#[derive(Debug)]
pub(crate) enum Stop {
    /// The content violates its format.
    Broken(Broken),
    /// The operating system reported an error.
    Io(io::Error),
}

impl Stop {
    /// Adds the name of the file.
    pub(crate) fn of(self, path: &Path) -> ReadError {
        match self {
            Self::Broken(broken) => broken.of(path),
            Self::Io(cause) => ReadError::Io { path: path.into(), cause },
        }
    }
}

impl From<Broken> for Stop {
    fn from(broken: Broken) -> Self {
        Self::Broken(broken)
    }
}

impl From<io::Error> for Stop {
    fn from(cause: io::Error) -> Self {
        Self::Io(cause)
    }
}
