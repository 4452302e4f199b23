//! COPC: LAZ whose chunks are the nodes of an octree, so that a region or a level of detail can be
//! read alone.

use std::collections::BTreeSet;
use std::io::Read;

use super::header::{Header, record};
use super::laz::Chunk;
use crate::error::Fault;
use crate::input::{Input, Stop};
use crate::scalar::{Order, Scalar};
use crate::selection::Selection;

/// Length of an entry of the hierarchy in bytes.
const ENTRY: usize = 32;

/// The octree as described in the COPC record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Octree {
    centre: [f64; 3],
    half: f64,
    /// Distance between points of the root.
    spacing: f64,
    /// Offset and length of the first page of the hierarchy, in bytes.
    root: [u64; 2],
}

impl Octree {
    /// Reads the octree from the start of a file. Returns `None` if the file is not COPC.
    pub(super) fn of(head: &[u8], header: &Header) -> Option<Self> {
        let (_, content) = record(head, header, b"copc", 1)?;
        let real = |i: usize| Scalar::F64.read(content.get(8 * i..)?, Order::Little);
        let whole = |i: usize| content.get(8 * i..)?.first_chunk().map(|n| u64::from_le_bytes(*n));
        let octree = Self {
            centre: [real(0)?, real(1)?, real(2)?],
            half: real(3)?,
            spacing: real(4)?,
            root: [whole(5)?, whole(6)?],
        };
        let is_sound =
            octree.centre.iter().all(|c| c.is_finite()) && octree.half > 0.0 && octree.spacing > 0.0;
        is_sound.then_some(octree)
    }

    /// Returns the chunks of the selected nodes, in file order.
    pub(super) fn chunks(
        &self,
        input: Input<'_>,
        header: &Header,
        selection: &Selection,
        length: u64,
    ) -> Result<Vec<Chunk>, Stop> {
        let (mut pages, mut seen) = (vec![self.root], BTreeSet::new());
        let mut chunks = Vec::new();
        let mut page = Vec::new();
        while let Some([offset, bytes]) = pages.pop() {
            let at = |cause: &str| Fault::Decoder { cause: cause.into() }.at(crate::At::Byte(offset));
            // A repeated page would lead to an endless loop.
            if offset.checked_add(bytes).is_none_or(|end| end > length) || !seen.insert(offset) {
                return Err(at("expected distinct pages within the file, got one outside or twice").into());
            }
            page.clear();
            input.reader(offset)?.take(bytes).read_to_end(&mut page)?;
            for entry in page.chunks_exact(ENTRY) {
                let [level, x, y, z] = [0, 4, 8, 12].map(|k| signed(entry, k));
                let start = u64::from_le_bytes(*entry[16..].first_chunk().unwrap_or(&[0; 8]));
                let [bytes, points] = [24, 28].map(|k| signed(entry, k));
                if !self.is_selected(level, [x, y, z], selection) {
                    continue;
                }
                let bytes = u64::try_from(bytes).unwrap_or_default();
                if points < 0 {
                    pages.push([start, bytes]);
                    continue;
                }
                if start < header.start || start.checked_add(bytes).is_none_or(|end| end > length) {
                    return Err(at("expected nodes within the points of the file, got one outside").into());
                }
                chunks.push(Chunk { start, bytes, points: u64::try_from(points).unwrap_or_default() });
            }
        }
        chunks.retain(|chunk| chunk.points > 0);
        chunks.sort_unstable_by_key(|chunk| chunk.start);
        Ok(chunks)
    }

    fn is_selected(&self, level: i32, place: [i32; 3], selection: &Selection) -> bool {
        let share = 0.5_f64.powi(level.clamp(0, 60));
        // A level is needed if the previous level is too coarse.
        let is_coarse =
            level == 0 || selection.spacing.is_none_or(|wanted| 2.0 * self.spacing * share > wanted);
        let is_inside = selection.bounds.is_none_or(|bounds| {
            let edge = 2.0 * self.half * share;
            // Points may be on the upper border of a node, and rounding may move them across.
            let slack = edge * 1e-6;
            (0..3).all(|k| {
                let low = self.centre[k] - self.half + edge * f64::from(place[k]);
                low - slack <= bounds.max[k] && bounds.min[k] <= low + edge + slack
            })
        });
        is_coarse && is_inside
    }
}

/// Reads a signed 32-bit integer of an entry.
fn signed(entry: &[u8], at: usize) -> i32 {
    entry[at..].first_chunk().map_or(0, |bytes| i32::from_le_bytes(*bytes))
}
