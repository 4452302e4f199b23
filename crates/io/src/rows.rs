//! Reading of rows in blocks, in binary or as text.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom};
use std::ops::ControlFlow;
use std::path::Path;

use crate::columns::{Holds, Row};
use crate::error::{Broken, Fault, ReadError};
use crate::points::Points;
use crate::sink::Sink;
use crate::text::{Line, Lines};

/// The layout of the rows of a file, from its header.
pub(crate) struct Layout {
    /// Offset of the first row in bytes, from the start of the file or from the end of its byte
    /// order mark.
    pub(crate) start: usize,
    pub(crate) encoding: Encoding,
    /// Name of a row in messages.
    pub(crate) element: Box<str>,
    /// Number of rows in the header, and the line that declares it.
    pub(crate) promised: Option<(u64, u64)>,
    /// The attributes of a row.
    pub(crate) holds: Holds,
    pub(crate) rows: Box<dyn Rows + Send + Sync>,
}

/// The encoding of rows.
#[derive(Clone, Copy)]
pub(crate) enum Encoding {
    /// Rows of `stride` bytes.
    Binary { stride: usize },
    /// Rows of one line. `number` is that of the line before the first row, and `end` is the byte
    /// that ends lines.
    Text { number: u64, end: u8 },
}

/// A parser of rows in either encoding. Slots of a row without a column keep their values.
pub(crate) trait Rows {
    /// Returns `true` unless the line is blank or a comment.
    fn is_row(&self, line: &Line<'_>) -> bool;
    /// Parses a line.
    fn line(&self, line: Line<'_>, row: &mut Row) -> Result<(), Fault>;
    /// Parses a record. Every record of the right length is valid.
    fn record(&self, bytes: &[u8], row: &mut Row);
}

impl Encoding {
    /// Returns the encoding of the remaining lines.
    pub(crate) fn of_text(lines: &Lines<'_>) -> Self {
        Self::Text { number: lines.number(), end: lines.end() }
    }
}

impl Layout {
    /// Checks that a file of this length contains all records of the header.
    pub(crate) fn check_length(&self, length: u64) -> Result<(), Broken> {
        let Encoding::Binary { stride } = self.encoding else { return Ok(()) };
        let present = length.saturating_sub(self.start as u64) / stride as u64;
        self.check_count(present)
    }

    /// Reads all records of a file in memory.
    pub(crate) fn whole(&self, bytes: &[u8]) -> Result<Sink, Broken> {
        self.check_length(bytes.len() as u64)?;
        let Encoding::Binary { stride } = self.encoding else { return Ok(Sink::default()) };
        let promised =
            self.promised.map_or(0, |(promised, _)| usize::try_from(promised).unwrap_or(usize::MAX));
        let mut sink = Sink::new(self.holds, promised);
        let mut row = Row::default();
        for record in bytes[self.start..].chunks_exact(stride).take(promised) {
            self.rows.record(record, &mut row);
            sink.row(&row);
        }
        Ok(sink)
    }

    fn check_count(&self, present: u64) -> Result<(), Broken> {
        match self.promised {
            Some((promised, line)) if present < promised => {
                let fault = Fault::Promised { element: self.element.clone(), promised, present };
                Err(fault.on_line(line))
            }
            _ => Ok(()),
        }
    }

    pub(crate) fn records(
        &self,
        blocks: &mut Blocks<'_>,
        stride: usize,
        take: &mut dyn FnMut(&Points) -> ControlFlow<()>,
    ) -> Result<(), ReadError> {
        let mut left = self.promised.map_or(0, |(promised, _)| promised);
        let together = (blocks.block / stride).max(1);
        let (mut points, mut row) = (Points::default(), Row::default());
        while left > 0 {
            let many = usize::try_from(left).unwrap_or(usize::MAX).min(together);
            blocks.fill(many * stride)?;
            points.clear();
            for record in blocks.bytes.chunks_exact(stride) {
                self.rows.record(record, &mut row);
                points.push(self.holds, &row);
            }
            if take(&points).is_break() {
                break;
            }
            left -= many as u64;
        }
        Ok(())
    }

    pub(crate) fn lines(
        &self,
        blocks: &mut Blocks<'_>,
        mut number: u64,
        end: u8,
        take: &mut dyn FnMut(&Points) -> ControlFlow<()>,
    ) -> Result<(), ReadError> {
        let (mut points, mut row, mut index) = (Points::default(), Row::default(), 0);
        let mut is_last = false;
        while !is_last {
            // The rest of the last block has no line end, so only new bytes are searched.
            let left_over = blocks.bytes.len();
            is_last = blocks.fill_more()?;
            let last = blocks.bytes[left_over..].iter().rposition(|byte| *byte == end);
            let whole =
                if is_last { blocks.bytes.len() } else { last.map_or(0, |last| left_over + last + 1) };
            points.clear();
            let mut lines = Lines::going_on(&blocks.bytes[..whole], number, end);
            for line in lines.by_ref().filter(|line| self.rows.is_row(line)) {
                if self.promised.is_some_and(|(promised, _)| index >= promised) {
                    return Err(Fault::Surplus.on_line(line.number).of(blocks.path));
                }
                let broken = |fault: Fault| fault.on_line(line.number).within(&self.element, index);
                self.rows.line(line, &mut row).map_err(|fault| broken(fault).of(blocks.path))?;
                points.push(self.holds, &row);
                index += 1;
            }
            number = lines.number();
            if take(&points).is_break() {
                return Ok(());
            }
            blocks.bytes.drain(..whole);
        }
        self.check_count(index).map_err(|broken| broken.of(blocks.path))
    }
}

/// A reader of a file in blocks.
pub(crate) struct Blocks<'a> {
    path: &'a Path,
    file: &'a File,
    bytes: Vec<u8>,
    block: usize,
}

impl<'a> Blocks<'a> {
    pub(crate) fn new(path: &'a Path, file: &'a File, block: usize) -> Self {
        Self { path, file, bytes: Vec::new(), block }
    }

    fn failed(&self, cause: io::Error) -> ReadError {
        ReadError::Io { path: self.path.into(), cause }
    }

    pub(crate) fn seek(&mut self, start: usize) -> Result<(), ReadError> {
        self.file.seek(SeekFrom::Start(start as u64)).map_err(|cause| self.failed(cause))?;
        Ok(())
    }

    /// Replaces the bytes by the next `length` bytes.
    fn fill(&mut self, length: usize) -> Result<(), ReadError> {
        self.bytes.clear();
        self.append(length)?;
        // The length was checked when the file was opened, so it has become shorter.
        if self.bytes.len() == length { Ok(()) } else { Err(self.failed(ErrorKind::UnexpectedEof.into())) }
    }

    /// Appends a block to the remaining bytes. Returns `true` if the block is the last one.
    fn fill_more(&mut self) -> Result<bool, ReadError> {
        let before = self.bytes.len();
        self.append(self.block)?;
        Ok(self.bytes.len() - before < self.block)
    }

    fn append(&mut self, length: usize) -> Result<(), ReadError> {
        let read = self.file.take(length as u64).read_to_end(&mut self.bytes);
        read.map_err(|cause| self.failed(cause))?;
        Ok(())
    }
}
