//! The header of LAS 1.0 to 1.4: the fields needed to read points.

use nearmiss_geometry::Aabb;

use crate::columns::Holds;
use crate::error::{Broken, Fault};
use crate::scalar::{Order, Scalar};

/// Length of the longest header in bytes.
pub(super) const LONGEST: usize = 375;

/// Length of the shortest header in bytes.
const SHORTEST: usize = 227;

/// Length of the header of a variable-length record in bytes.
#[cfg(feature = "laz")]
const RECORD: usize = 54;

/// Length of a point record in bytes, for each point format, without extra bytes.
const SIZES: [u16; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];

/// Offsets of the fields of the header.
mod field {
    pub(super) const MINOR_VERSION: usize = 25;
    pub(super) const HEADER_SIZE: usize = 94;
    pub(super) const POINTS: usize = 96;
    pub(super) const RECORDS: usize = 100;
    pub(super) const FORMAT: usize = 104;
    pub(super) const STRIDE: usize = 105;
    pub(super) const COUNT: usize = 107;
    pub(super) const SCALE: usize = 131;
    pub(super) const OFFSET: usize = 155;
    /// Maximum and minimum of x, maximum and minimum of y, …
    pub(super) const BOUNDS: usize = 179;
    pub(super) const LONG_COUNT: usize = 247;
}

/// The fields of the header that describe the points.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    /// Offset of the first variable-length record.
    pub(super) header_size: usize,
    /// Offset of the first point.
    pub(super) start: u64,
    /// Number of variable-length records.
    pub(super) records: u32,
    pub(super) format: u8,
    /// `true` if the points are compressed by laszip.
    pub(super) compressed: bool,
    /// Length of an uncompressed point record in bytes.
    pub(super) stride: usize,
    pub(super) count: u64,
    pub(super) scale: [f64; 3],
    pub(super) offset: [f64; 3],
    pub(super) bounds: Option<Aabb>,
}

impl Header {
    /// Parses the header at the start of `head`.
    pub(super) fn parse(head: &[u8]) -> Result<Self, Broken> {
        if head.len() < SHORTEST {
            return Err(Fault::PastEnd.at_byte(head.len()));
        }
        let number = |scalar: Scalar, at: usize| {
            let bytes = head.get(at..).unwrap_or_default();
            scalar.read(bytes, Order::Little).unwrap_or_default()
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number of its size"
        )]
        let whole = |scalar, at| number(scalar, at) as u64;
        let expected = |expected, found: u64, at| {
            Err(Fault::Expected { expected, found: found.to_string().into() }.at_byte(at))
        };
        let minor = whole(Scalar::U8, field::MINOR_VERSION);
        let major = head[field::MINOR_VERSION - 1];
        if minor > 4 || major != 1 {
            let found = format!("{major}.{minor}").into();
            return Err(Fault::Expected { expected: "LAS 1.0 to 1.4", found }.at_byte(field::MINOR_VERSION));
        }
        // laszip sets the two highest bits.
        let format = head[field::FORMAT] & 0x3f;
        let Some(&least) = SIZES.get(usize::from(format)) else {
            return expected("a point format from 0 to 10", format.into(), field::FORMAT);
        };
        let stride = whole(Scalar::U16, field::STRIDE);
        if stride < least.into() {
            return expected("a record length that fits the point format", stride, field::STRIDE);
        }
        let short = whole(Scalar::U32, field::COUNT);
        let long = head.get(field::LONG_COUNT..).and_then(<[u8]>::first_chunk).copied();
        let long = if minor == 4 { long.map_or(0, u64::from_le_bytes) } else { 0 };
        let count = if long > 0 { long } else { short };
        let three = |at: usize| [0, 8, 16].map(|k| number(Scalar::F64, at + k));
        let (scale, offset) = (three(field::SCALE), three(field::OFFSET));
        for k in 0..3 {
            for (value, at) in [(scale[k], field::SCALE), (offset[k], field::OFFSET)] {
                let is_none = !value.is_finite() || at == field::SCALE && value == 0.0;
                if is_none && count > 0 {
                    let found = value.to_string().into();
                    let expected = "finite nonzero scales and finite offsets";
                    return Err(Fault::Expected { expected, found }.at_byte(at + 8 * k));
                }
            }
        }
        let bound = |k: usize| number(Scalar::F64, field::BOUNDS + 8 * k);
        let bounds = Aabb { min: [bound(1), bound(3), bound(5)], max: [bound(0), bound(2), bound(4)] };
        let are_bounds =
            (0..3).all(|k| bounds.min[k] <= bounds.max[k] && (bounds.max[k] - bounds.min[k]).is_finite());
        Ok(Self {
            header_size: usize::try_from(whole(Scalar::U16, field::HEADER_SIZE)).unwrap_or_default(),
            start: whole(Scalar::U32, field::POINTS),
            #[expect(clippy::cast_possible_truncation, reason = "four bytes")]
            records: whole(Scalar::U32, field::RECORDS) as u32,
            format,
            compressed: head[field::FORMAT] & 0x80 != 0,
            stride: usize::try_from(stride).unwrap_or_default(),
            count,
            scale,
            offset,
            bounds: are_bounds.then_some(bounds),
        })
    }

    /// Returns the attributes of the point format. Every format has intensities and classes.
    pub(super) fn holds(&self) -> Holds {
        Holds { normals: false, colours: self.colours().is_some(), intensities: true, classes: true }
    }

    /// Returns the offset of the colour in a record, if the point format has colours.
    pub(super) fn colours(&self) -> Option<usize> {
        match self.format {
            2 => Some(20),
            3 | 5 => Some(28),
            7 | 8 | 10 => Some(30),
            _ => None,
        }
    }

    /// Checks that the points start after the header and, if uncompressed, that the file contains
    /// all of them.
    pub(super) fn check(&self, length: u64) -> Result<(), Broken> {
        if self.start < SHORTEST as u64 || self.start > length {
            let found = self.start.to_string().into();
            let expected = "points that start behind the header and within the file";
            return Err(Fault::Expected { expected, found }.at_byte(field::POINTS));
        }
        let present = (length - self.start) / self.stride as u64;
        if !self.compressed && present < self.count {
            return Err(self.promised(present));
        }
        Ok(())
    }

    /// Returns the fault of a file that contains only `present` of its points.
    pub(super) fn promised(&self, present: u64) -> Broken {
        let fault = Fault::Promised { element: "point".into(), promised: self.count, present };
        fault.at_byte(if self.count > u64::from(u32::MAX) { field::LONG_COUNT } else { field::COUNT })
    }
}

/// Finds the variable-length record with this user id and record id. Returns its offset and
/// content. `head` is the part of the file before the points.
#[cfg(feature = "laz")]
pub(super) fn record<'a>(head: &'a [u8], header: &Header, user: &[u8], id: u16) -> Option<(usize, &'a [u8])> {
    let mut at = header.header_size.max(SHORTEST);
    // Ends at the end of `head`, whatever number the header declares.
    for _ in 0..header.records {
        let start = at + RECORD;
        let about = head.get(at..start)?;
        let length = usize::from(u16::from_le_bytes([about[20], about[21]]));
        let by = about[2..18].split(|byte| *byte == 0).next().unwrap_or_default();
        if by == user && about[18..20] == id.to_le_bytes() {
            return head.get(start..start + length).map(|content| (start, content));
        }
        at = start + length;
    }
    None
}
