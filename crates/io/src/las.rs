//! LAS 1.0 to 1.4 (ASPRS) with all point formats, and LAZ, its compression by laszip, COPC included.
//!
//! Records are fixed in length and need no library; LAZ is decoded by the crate `laz`, chunk by chunk, after
//! its tables were checked against the length of the file.

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
use crate::out::Lattice;
use crate::points::Points;
use crate::selection::Selection;
use header::Header;

/// Points whose colours are looked at to tell eight bits a channel from sixteen.
const LOOKED_AT: usize = 1 << 16;

/// What a header says: how many points, and their bounds.
pub(crate) fn glance(head: &[u8]) -> Option<(u64, Option<Aabb>)> {
    let header = Header::parse(head).ok()?;
    Some((header.count, header.bounds))
}

/// The steps in which coordinates are counted.
pub(crate) fn lattice(input: Input<'_>) -> Option<Lattice> {
    let Header { scale, offset, .. } = Header::parse(&input.head(header::LONGEST).ok()?).ok()?;
    Some(Lattice { scale, offset })
}

/// Returns `true` if parts of space, and levels, can be read alone.
pub(crate) fn has_levels(input: Input<'_>) -> bool {
    octree(input).is_some()
}

#[cfg(feature = "laz")]
fn octree(input: Input<'_>) -> Option<copc::Octree> {
    // Its record is the first one.
    let head = input.head(1 << 12).ok()?;
    copc::Octree::of(&head, &Header::parse(&head).ok()?)
}

#[cfg(not(feature = "laz"))]
fn octree(_: Input<'_>) -> Option<()> {
    None
}

/// Goes over all points, some `block` bytes of records at a time; of COPC over those that are selected, and
/// some about them.
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
        return Err(Fault::Feature { what: "LAZ", feature: "laz" }.at_byte(0).into());
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

/// Makes points of records.
struct Records<'a> {
    header: &'a Header,
    holds: Holds,
    /// How many bits a colour channel takes: 16 by the standard, and 8 in many files.
    colour_bits: Option<u8>,
    points: Points,
}

impl Records<'_> {
    /// Hands out whole records as points.
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

/// The colour in a record.
fn channels(record: &[u8], at: usize) -> [u16; 3] {
    [0, 2, 4].map(|k| u16::from_le_bytes([record[at + k], record[at + k + 1]]))
}

/// Eight if no channel needs more: then a program wrote them as they were.
fn colour_bits(mut colours: impl Iterator<Item = [u16; 3]>) -> u8 {
    if colours.any(|colour| colour.iter().any(|channel| *channel > 0xff)) { 16 } else { 8 }
}
