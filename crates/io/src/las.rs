//! LAS 1.0 to 1.4 (ASPRS) with all point formats, and LAZ, its compression by laszip, COPC included.
//!
//! Records of LAS have a fixed length and are read here. LAZ is decoded by the crate `laz`, chunk
//! by chunk, after its tables are checked against the length of the file.

#[cfg(feature = "laz")]
mod copc;
mod header;
#[cfg(feature = "laz")]
mod laz;
#[cfg(feature = "laz")]
mod times;

use std::io::Read;
use std::ops::ControlFlow;

use nearmiss_geometry::Aabb;

use crate::columns::{Holds, Row};
#[cfg(not(feature = "laz"))]
use crate::error::Fault;
use crate::input::{Input, Stop};
use crate::out::ScaleOffset;
use crate::points::Points;
use crate::selection::Selection;
use header::Header;

/// Number of points examined to decide whether colour channels have 8 or 16 bits.
const LOOKED_AT: usize = 1 << 16;

/// Reads the number of points and their bounds from the header.
pub(crate) fn glance(head: &[u8]) -> Option<(u64, Option<Aabb>)> {
    let header = Header::parse(head).ok()?;
    Some((header.count, header.bounds))
}

/// Returns the scale and offset of the coordinates.
pub(crate) fn lattice(input: Input<'_>) -> Option<ScaleOffset> {
    let Header { scale, offset, .. } = Header::parse(&input.head(header::LONGEST).ok()?).ok()?;
    Some(ScaleOffset { scale, offset })
}

/// Returns `true` if the file is COPC, of which a region or a level of detail can be read alone.
pub(crate) fn has_levels(input: Input<'_>) -> bool {
    octree(input).is_some()
}

#[cfg(feature = "laz")]
fn octree(input: Input<'_>) -> Option<copc::Octree> {
    // The record of COPC is the first one.
    let head = input.head(1 << 12).ok()?;
    copc::Octree::of(&head, &Header::parse(&head).ok()?)
}

#[cfg(not(feature = "laz"))]
fn octree(_: Input<'_>) -> Option<()> {
    None
}

/// Passes all points to `take`, in blocks of about `block` bytes of records. For COPC, only nodes
/// that meet the selection are read, so some points beyond it are passed too.
pub(crate) fn each(
    input: Input<'_>,
    block: usize,
    selection: &Selection,
    take: &mut dyn FnMut(&Points) -> ControlFlow<()>,
) -> Result<(), Stop> {
    let head = input.head(header::LONGEST)?;
    let header = Header::parse(&head)?;
    header.check(input.length()?)?;
    if header.count == 0 {
        return Ok(());
    }
    let mut records =
        Records { header: &header, holds: header.holds(), colour_bits: None, points: Points::default() };
    let together = (block / header.stride).max(1);
    if header.compressed {
        #[cfg(feature = "laz")]
        {
            let octree = if *selection == Selection::default() { None } else { octree(input) };
            let length = input.length()?;
            let chosen = octree.map(|octree| octree.chunks(input, &header, selection, length)).transpose()?;
            return laz::each(input, &header, chosen, together, &mut |bytes| records.hand_out(bytes, take));
        }
        #[cfg(not(feature = "laz"))]
        {
            // Only the octree of COPC, a kind of LAZ, serves a selection.
            let _ = selection;
            return Err(Fault::Feature { what: "LAZ", feature: "laz" }.at_byte(0).into());
        }
    }
    let mut reader = input.reader(header.start)?;
    let mut bytes = Vec::new();
    let mut left = header.count;
    while left > 0 {
        let many = usize::try_from(left).unwrap_or(usize::MAX).min(together);
        bytes.clear();
        reader.by_ref().take((many * header.stride) as u64).read_to_end(&mut bytes)?;
        if bytes.len() < many * header.stride {
            return Err(header.promised(header.count - left + (bytes.len() / header.stride) as u64).into());
        }
        if records.hand_out(&bytes, take).is_break() {
            break;
        }
        left -= many as u64;
    }
    Ok(())
}

/// Converts records to points.
struct Records<'a> {
    header: &'a Header,
    holds: Holds,
    /// Number of bits of a colour channel: 16 by the standard, but 8 in many files.
    colour_bits: Option<u8>,
    points: Points,
}

impl Records<'_> {
    /// Converts whole records to points and passes them to `take`.
    fn hand_out(
        &mut self,
        bytes: &[u8],
        take: &mut dyn FnMut(&Points) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Header { stride, format, scale, offset, .. } = *self.header;
        let colours = self.header.colours();
        let bits = *self.colour_bits.get_or_insert_with(|| match colours {
            Some(at) => {
                colour_bits(bytes.chunks_exact(stride).take(LOOKED_AT).map(|record| channels(record, at)))
            }
            None => 16,
        });
        let (class_at, class_mask) = if format < 6 { (15, 0x1f) } else { (16, 0xff) };
        self.points.clear();
        self.points.reserve(self.holds, bytes.len() / stride);
        for record in bytes.chunks_exact(stride) {
            let mut row: Row = [0.0; 11];
            for k in 0..3 {
                let steps = i32::from_le_bytes([
                    record[4 * k],
                    record[4 * k + 1],
                    record[4 * k + 2],
                    record[4 * k + 3],
                ]);
                row[k] = f64::from(steps) * scale[k] + offset[k];
            }
            if let Some(at) = colours {
                let [r, g, b] = channels(record, at).map(|channel| f64::from(channel >> (bits - 8)));
                (row[6], row[7], row[8]) = (r, g, b);
            }
            row[9] = f64::from(u16::from_le_bytes([record[12], record[13]]));
            row[10] = f64::from(record[class_at] & class_mask);
            self.points.push(self.holds, &row);
        }
        take(&self.points)
    }
}

/// Returns the colour of a record.
fn channels(record: &[u8], at: usize) -> [u16; 3] {
    [0, 2, 4].map(|k| u16::from_le_bytes([record[at + k], record[at + k + 1]]))
}

/// Returns 8 if every channel is below 256, as some programs write 8-bit colours unscaled;
/// otherwise 16.
fn colour_bits(mut colours: impl Iterator<Item = [u16; 3]>) -> u8 {
    if colours.any(|colour| colour.iter().any(|channel| *channel > 0xff)) { 16 } else { 8 }
}
