//! LAZ: chunks of points compressed by laszip.
//!
//! The decoder of the crate `laz` trusts its input: it allocates as many entries as the chunk table
//! declares, and as many bytes as a layer declares. Both are checked against the length of the file
//! first, and each chunk is decoded from its own bytes alone.

use std::io::{Cursor, Read, Seek, SeekFrom};
use std::ops::ControlFlow;

use laz::laszip::ChunkTable;
use laz::record::{LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor};
use laz::{DecompressionSelection, LasZipError, LazItem, LazItemType, LazVlr};

use super::header::{Header, record};
use super::times::Times;
use crate::error::{Broken, Fault};
use crate::guard::guarded;
use crate::input::{Input, Stop};
use crate::text::{bytes, counted};

/// Maximum number of bytes read before the points: more than all variable-length records of any
/// scan.
const HEAD: usize = 1 << 26;

/// The fields that are decoded in layered formats. Times are left out, because damaged times lead
/// the decoder of `laz` into an endless recursion.
const FIELDS: u32 = DecompressionSelection::Z
    | DecompressionSelection::CLASSIFICATION
    | DecompressionSelection::INTENSITY
    | DecompressionSelection::RGB;

/// Compressor code of laszip for files with a single chunk up to the end of the file.
const ONE_CHUNK: u16 = 1;

/// Length of the header of the chunk table in bytes: its version and the number of entries.
const TABLE: u64 = 8;

/// Length in bytes of the offset of the chunk table, stored before the first chunk.
const PLACE: u64 = 8;

type Decoder<'a> = Box<dyn RecordDecompressor<Cursor<&'a [u8]>> + 'a>;

/// A chunk: its offset, its length in bytes, and its number of points.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chunk {
    pub(super) start: u64,
    pub(super) bytes: u64,
    pub(super) points: u64,
}

/// The compression described by the record of laszip.
struct Packing {
    vlr: LazVlr,
    /// Offset of the record.
    at: usize,
    layered: bool,
    one_chunk: bool,
}

/// Passes all records to `take`, at most `together` at a time. `chosen` restricts them to some
/// chunks.
pub(super) fn each(
    input: Input<'_>,
    header: &Header,
    chosen: Option<Vec<Chunk>>,
    together: usize,
    take: &mut dyn FnMut(&[u8]) -> ControlFlow<()>,
) -> Result<(), Stop> {
    let before = usize::try_from(header.start).unwrap_or(usize::MAX).min(HEAD);
    let packing = Packing::of(&input.head(before)?, header)?;
    let length = input.length()?;
    let (mut packed, mut records) = (Vec::new(), Vec::new());
    let (chunks, wanted) = match chosen {
        Some(chunks) => {
            let wanted = chunks.iter().map(|chunk| chunk.points).sum();
            (chunks, wanted)
        }
        None => (chunks(input, header, &packing, length)?, header.count),
    };
    let mut done = 0;
    for chunk in chunks {
        if done == wanted {
            break;
        }
        let points = chunk.points.min(wanted - done);
        packed.clear();
        input.reader(chunk.start)?.take(chunk.bytes).read_to_end(&mut packed)?;
        let corrupt = |cause: String, so_far: u64| -> Stop {
            let place = Fault::Decoder { cause: cause.into() }.at(crate::At::Byte(chunk.start));
            place.within("point", done + so_far).into()
        };
        if packing.layered {
            check_layers(&packed, packing.vlr.items(), header.stride, points)
                .map_err(|fault| Stop::from(fault.at(crate::At::Byte(chunk.start)).within("point", done)))?;
        }
        let mut decoder = packing.decoder(&packed)?;
        let mut so_far = 0;
        while so_far < points {
            let many = usize::try_from(points - so_far).unwrap_or(usize::MAX).min(together);
            records.clear();
            records.resize(many * header.stride, 0);
            // Damaged data may make the decoder panic.
            let mut decoded = 0;
            let each = || {
                for record in records.chunks_exact_mut(header.stride) {
                    decoder.decompress_next(record)?;
                    decoded += 1;
                }
                Ok::<(), std::io::Error>(())
            };
            match guarded(each) {
                Some(Ok(())) => (),
                Some(Err(cause)) => return Err(corrupt(cause.to_string(), so_far + decoded)),
                None => return Err(corrupt("the decoder panicked".into(), so_far + decoded)),
            }
            if take(&records).is_break() {
                return Ok(());
            }
            so_far += many as u64;
        }
        done += points;
    }
    if done < wanted { Err(header.promised(done).into()) } else { Ok(()) }
}

impl Packing {
    fn of(head: &[u8], header: &Header) -> Result<Self, Broken> {
        let Some((at, content)) = record(head, header, LazVlr::USER_ID.as_bytes(), LazVlr::RECORD_ID) else {
            return Err(Fault::Undeclared { what: "a laszip record" }.at_byte(header.header_size));
        };
        let wrong = |cause: String| Fault::Decoder { cause: cause.into() }.at_byte(at);
        let vlr = LazVlr::from_buffer(content).map_err(|cause| wrong(cause.to_string()))?;
        let sizes: usize = vlr.items().iter().map(|item| usize::from(item.size())).sum();
        let as_declared = vlr.items().iter().all(|item| size_of_item(item) == usize::from(item.size()));
        if sizes != header.stride || !as_declared {
            return Err(wrong(format!("expected items of {} in all, got {sizes}", bytes(header.stride))));
        }
        let layers = vlr.items().iter().filter(|item| item.version() >= 3).count();
        if layers != 0 && layers != vlr.items().len() {
            return Err(wrong("expected all items or none in layers, got some".into()));
        }
        let one_chunk = content.get(..2) == Some(&ONE_CHUNK.to_le_bytes());
        let packing = Self { layered: layers > 0, vlr, at, one_chunk };
        // Fails if an item is unknown, which does not depend on the data.
        packing.decoder(&[]).map(drop)?;
        Ok(packing)
    }

    fn decoder<'a>(&self, packed: &'a [u8]) -> Result<Decoder<'a>, Broken> {
        let unknown =
            |cause: LasZipError| Fault::Decoder { cause: cause.to_string().into() }.at_byte(self.at);
        let source = Cursor::new(packed);
        if self.layered {
            let mut decoder = LayeredPointRecordDecompressor::new(source);
            decoder.set_fields_from(self.vlr.items()).map_err(unknown)?;
            decoder.set_selection(DecompressionSelection(FIELDS));
            return Ok(Box::new(decoder));
        }
        let mut decoder = SequentialPointRecordDecompressor::new(source);
        for item in self.vlr.items() {
            if item.item_type() == LazItemType::GpsTime && item.version() == 2 {
                decoder.add_field_decompressor(Times::default());
            } else {
                decoder.set_fields_from(&vec![*item]).map_err(unknown)?;
            }
        }
        Ok(Box::new(decoder))
    }
}

/// Returns all chunks. They are contiguous from the start of the points to the chunk table.
fn chunks(input: Input<'_>, header: &Header, packing: &Packing, length: u64) -> Result<Vec<Chunk>, Stop> {
    if packing.one_chunk {
        return Ok(vec![Chunk { start: header.start, bytes: length - header.start, points: header.count }]);
    }
    let wrong =
        |cause: String, at: u64| Stop::from(Fault::Decoder { cause: cause.into() }.at(crate::At::Byte(at)));
    let first = header.start + PLACE;
    let place = |at: u64| -> Result<u64, Stop> {
        let mut bytes = [0; 8];
        input.reader(at)?.read_exact(&mut bytes)?;
        Ok(u64::from_le_bytes(bytes))
    };
    if first + TABLE > length {
        return Err(Fault::PastEnd.at(crate::At::Byte(length)).into());
    }
    let mut table = place(header.start)?;
    // A writer that cannot seek stores the offset at the end of the file.
    if table <= header.start || i64::try_from(table).is_err() {
        table = place(length - 8)?;
    }
    if table < first || table > length - TABLE {
        let cause = "expected a chunk table, got an unfinished file; repair it with `las2las` or PDAL".into();
        return Err(wrong(cause, header.start));
    }
    let mut reader = input.reader(table + 4)?;
    let mut count = [0; 4];
    reader.read_exact(&mut count)?;
    let count = u64::from(u32::from_le_bytes(count));
    // The first point of each chunk is stored uncompressed.
    let most = (table - first) / header.stride as u64;
    if count > most {
        return Err(wrong(
            format!("expected at most {}, got {count}", counted(most, "chunk", "chunks")),
            table,
        ));
    }
    // The decoder reads the header of the table again.
    reader.seek(SeekFrom::Start(table))?;
    let is_variable = packing.vlr.uses_variable_size_chunks();
    let entries = guarded(|| ChunkTable::read(&mut reader, is_variable))
        .ok_or_else(|| wrong("the decoder panicked at the chunk table".into(), table))?
        .map_err(|cause| wrong(cause.to_string(), table))?;
    let mut start = first;
    let mut chunks = Vec::new();
    for entry in entries.as_ref() {
        let points = if is_variable { entry.point_count } else { packing.vlr.chunk_size().into() };
        if entry.byte_count > table - start {
            let (left, found) = (bytes(table - start), entry.byte_count);
            return Err(wrong(format!("expected a chunk within the {left} left, got {found}"), table));
        }
        chunks.push(Chunk { start, bytes: entry.byte_count, points });
        start += entry.byte_count;
    }
    Ok(chunks)
}

/// Returns the size of an item of this kind in bytes, which the decoder assumes.
fn size_of_item(item: &LazItem) -> usize {
    match item.item_type() {
        LazItemType::Byte(count) | LazItemType::Byte14(count) => count.into(),
        LazItemType::Point10 => 20,
        LazItemType::GpsTime | LazItemType::RGBNIR14 => 8,
        LazItemType::RGB12 | LazItemType::RGB14 => 6,
        LazItemType::WavePacket13 | LazItemType::WavePacket14 => 29,
        LazItemType::Point14 => 30,
    }
}

/// Returns the number of layers of an item in a chunk.
fn layers_of(item: &LazItem) -> usize {
    match item.item_type() {
        LazItemType::Point14 => 9,
        LazItemType::RGB14 | LazItemType::WavePacket14 => 1,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(count) => count.into(),
        _ => 0,
    }
}

/// Checks that a chunk contains its first point and all layers that it declares.
fn check_layers(chunk: &[u8], items: &[LazItem], stride: usize, points: u64) -> Result<(), Fault> {
    let layers: usize = items.iter().map(layers_of).sum();
    let content = stride + 4 + 4 * layers;
    let Some(sizes) = chunk.get(stride..content) else { return Err(Fault::PastEnd) };
    let number = |i: usize| u64::from(u32::from_le_bytes([0, 1, 2, 3].map(|k| sizes[4 * i + k])));
    if number(0) < points {
        return Err(Fault::Promised { element: "point".into(), promised: points, present: number(0) });
    }
    let declared: u64 = (1..=layers).map(number).sum();
    let left = (chunk.len() - content) as u64;
    if declared > left { Err(Fault::ListPastEnd { values: declared, left }) } else { Ok(()) }
}
