//! Sources of the values of elements: text or bytes.

use super::header::{Element, Property};
use crate::error::{At, Broken, Fault};
use crate::scalar::{Order, Scalar};
use crate::text::{Line, Lines, number, shown, whole};

/// A source of the values of all elements, in the order of the header.
pub(super) trait Source<'a> {
    /// Returns the number of unread bytes.
    fn left(&self) -> usize;
    /// Returns the minimum length of a row of the element in bytes; never 0.
    fn least_size(&self, element: &Element) -> usize;
    /// Advances to the next row. Returns `false` at the end.
    fn start_row(&mut self, element: &Element) -> bool;
    /// Reads the next value.
    fn number(&mut self, property: &Property, scalar: Scalar) -> Result<f64, Fault>;
    /// Reads the next value as the length of a list.
    fn length(&mut self, property: &Property, scalar: Scalar) -> Result<u64, Fault>;
    /// Skips `values` values of the property.
    fn skip(&mut self, property: &Property, values: u64) -> Result<(), Fault>;
    /// Checks that the row has no further values.
    fn finish_row(&mut self) -> Result<(), Fault>;
    /// Returns the position of the row.
    fn at(&self) -> At;
}

/// A source of text, with one row per line.
pub(super) struct Ascii<'a> {
    lines: Lines<'a>,
    row: &'a [u8],
    number: u64,
}

impl<'a> Ascii<'a> {
    pub(super) fn new(lines: Lines<'a>) -> Self {
        Self { lines, row: &[], number: 0 }
    }

    /// Creates a source of a single row.
    pub(super) fn of_line(line: Line<'a>) -> Self {
        Self { lines: Lines::new(&[]), row: line.text, number: line.number }
    }

    /// Checks that the file ends with the last element.
    pub(super) fn finish(mut self) -> Result<(), Broken> {
        match self.lines.next_filled() {
            Some(line) => Err(Fault::Surplus.on_line(line.number)),
            None => Ok(()),
        }
    }

    fn word(&mut self, property: &Property) -> Result<&'a [u8], Fault> {
        let row = self.row.trim_ascii_start();
        if row.is_empty() {
            return Err(Fault::ShortLine { column: property.name.clone() });
        }
        let end = row.iter().position(u8::is_ascii_whitespace).unwrap_or(row.len());
        let (word, rest) = row.split_at(end);
        self.row = rest;
        Ok(word)
    }
}

impl<'a> Source<'a> for Ascii<'a> {
    fn left(&self) -> usize {
        self.lines.left()
    }

    /// Counts a digit and a space for each property.
    fn least_size(&self, element: &Element) -> usize {
        (2 * element.properties.len()).max(2) - 1
    }

    fn start_row(&mut self, _: &Element) -> bool {
        let line = self.lines.next_filled();
        if let Some(line) = line {
            (self.row, self.number) = (line.text, line.number);
        }
        line.is_some()
    }

    fn number(&mut self, property: &Property, _: Scalar) -> Result<f64, Fault> {
        let word = self.word(property)?;
        number(word).ok_or_else(|| Fault::NotANumber { column: property.name.clone(), found: shown(word) })
    }

    fn length(&mut self, property: &Property, _: Scalar) -> Result<u64, Fault> {
        let word = self.word(property)?;
        whole(word).ok_or_else(|| Fault::NotWhole { expected: "a list length", found: shown(word) })
    }

    fn skip(&mut self, property: &Property, values: u64) -> Result<(), Fault> {
        (0..values).try_for_each(|_| self.word(property).map(|_| ()))
    }

    fn finish_row(&mut self) -> Result<(), Fault> {
        match self.row.trim_ascii() {
            [] => Ok(()),
            _ => Err(Fault::LongLine),
        }
    }

    fn at(&self) -> At {
        At::Line(self.number)
    }
}

/// A source of bytes, with contiguous rows.
pub(super) struct Binary<'a> {
    bytes: &'a [u8],
    offset: usize,
    row: usize,
    order: Order,
}

impl<'a> Binary<'a> {
    /// Creates a source that starts at `offset`.
    pub(super) fn new(bytes: &'a [u8], offset: usize, order: Order) -> Self {
        Self { bytes, offset, row: offset, order }
    }
}

impl<'a> Source<'a> for Binary<'a> {
    fn left(&self) -> usize {
        self.bytes.len() - self.offset
    }

    /// Counts the size of each property, and of lists only the length.
    fn least_size(&self, element: &Element) -> usize {
        let sizes = element.properties.iter().map(|p| p.list.unwrap_or(p.scalar).size());
        sizes.sum::<usize>().max(1)
    }

    fn start_row(&mut self, element: &Element) -> bool {
        self.row = self.offset;
        self.left() >= self.least_size(element)
    }

    #[inline]
    fn number(&mut self, _: &Property, scalar: Scalar) -> Result<f64, Fault> {
        let value = scalar.read(&self.bytes[self.offset..], self.order);
        let value = value.ok_or(Fault::PastEnd)?;
        self.offset += scalar.size();
        Ok(value)
    }

    fn length(&mut self, property: &Property, scalar: Scalar) -> Result<u64, Fault> {
        let value = self.number(property, scalar)?;
        if value < 0.0 || value.fract() != 0.0 {
            return Err(Fault::NotWhole { expected: "a list length", found: value.to_string().into() });
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and not negative; a float that saturates is longer than any file"
        )]
        let values = value as u64;
        let left = self.left() as u64;
        let size = property.scalar.size() as u64;
        if values.checked_mul(size).is_none_or(|bytes| bytes > left) {
            return Err(Fault::ListPastEnd { values, left });
        }
        Ok(values)
    }

    fn skip(&mut self, property: &Property, values: u64) -> Result<(), Fault> {
        let size = property.scalar.size();
        let bytes = usize::try_from(values).ok().and_then(|v| v.checked_mul(size));
        let bytes = bytes.filter(|&b| b <= self.left()).ok_or(Fault::PastEnd)?;
        self.offset += bytes;
        Ok(())
    }

    fn finish_row(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    fn at(&self) -> At {
        At::Byte(self.row as u64)
    }
}
