//! PCD, the format of the Point Cloud Library, versions 0.5 to 0.7: ascii, binary and
//! `binary_compressed`.
//!
//! Fields with several values per point (COUNT above 1) are skipped. NaN points are passed on; the
//! cloud drops them. VIEWPOINT is ignored: points stay in the frame of the file. Numbers are little
//! endian.

mod header;
mod lzf;

use crate::columns::Row;
use crate::error::{Broken, Fault};
use crate::rows::{self, Layout, Rows};
use crate::scalar::{Order, Scalar};
use crate::sink::Sink;
use crate::text::{Line, Lines, number, shown, whole};
use header::{Encoding, Field, Header, Part};

/// Memory for reading a point in bytes, besides its record: double precision, then rounding and
/// sorting.
const BYTES_A_POINT: u128 = 64;

/// Memory in bytes that compressed data may always take: enough for two million equal points.
const FREE: u128 = 128 << 20;

/// Additional memory in bytes that each compressed byte may take. Scans take some 10 bytes per
/// compressed byte, and camera frames with few valid pixels up to 100. Malicious data can reach
/// 2000.
const BYTES_A_BYTE: u128 = 128;

/// Parses a PCD file.
pub(crate) fn parse(bytes: &[u8]) -> Result<Sink, Broken> {
    let (header, lines) = header::parse(bytes)?;
    match header.encoding {
        Encoding::Ascii => ascii(&header, lines),
        Encoding::Binary => binary(&header, bytes, lines.offset()),
        Encoding::Compressed => compressed(&header, bytes, lines.offset()),
    }
}

/// Returns the layout of the points, unless they are compressed or the header is invalid.
pub(crate) fn layout(head: &[u8]) -> Option<Layout> {
    let (header, lines) = header::parse(head).ok()?;
    let encoding = match header.encoding {
        Encoding::Ascii => rows::Encoding::of_text(&lines),
        Encoding::Binary => rows::Encoding::Binary { stride: header.stride },
        Encoding::Compressed => return None,
    };
    let promised = Some((header.points, header.line));
    Some(Layout {
        start: lines.offset(),
        encoding,
        element: "point".into(),
        promised,
        holds: header.holds,
        rows: Box::new(header),
    })
}

/// Returns the number of points in the header, limited to those that fit into a file of this
/// length.
pub(crate) fn count(head: &[u8], length: u64) -> Option<u64> {
    let (header, lines) = header::parse(head).ok()?;
    let room = u128::from(length - lines.offset() as u64);
    let fit = match header.encoding {
        Encoding::Ascii => room / (2 * header.fields.len()) as u128 + 1,
        Encoding::Binary => room / header.stride as u128,
        Encoding::Compressed => (FREE + BYTES_A_BYTE * room) / BYTES_A_POINT,
    };
    Some(header.points.min(u64::try_from(fit).unwrap_or(u64::MAX)))
}

impl Rows for Header {
    fn is_row(&self, line: &Line<'_>) -> bool {
        !line.text.trim_ascii().is_empty()
    }

    fn line(&self, line: Line<'_>, row: &mut Row) -> Result<(), Fault> {
        words_to_row(self, line.words(), row)
    }

    fn record(&self, bytes: &[u8], row: &mut Row) {
        for field in &self.fields {
            field.read(&bytes[field.offset..], row);
        }
    }
}

fn ascii(header: &Header, mut lines: Lines<'_>) -> Result<Sink, Broken> {
    let fit = lines.left() / (2 * header.fields.len()) + 1;
    let mut sink = Sink::new(header.holds, header.capacity(fit));
    let mut row = Row::default();
    for index in 0..header.points {
        let Some(line) = lines.next_filled() else {
            return Err(header.promised(index));
        };
        words_to_row(header, line.words(), &mut row)
            .map_err(|fault| fault.on_line(line.number).within("point", index))?;
        sink.row(&row);
    }
    match lines.next_filled() {
        Some(line) => Err(Fault::Surplus.on_line(line.number)),
        None => Ok(sink),
    }
}

fn words_to_row<'a>(
    header: &Header,
    mut words: impl Iterator<Item = &'a [u8]>,
    row: &mut Row,
) -> Result<(), Fault> {
    for field in &header.fields {
        let short = || Fault::ShortLine { column: field.name.clone() };
        let wrong = |word| Fault::NotANumber { column: field.name.clone(), found: shown(word) };
        match field.part {
            Part::Slot(slot, _) => {
                let word = words.next().ok_or_else(short)?;
                row[slot] = number(word).ok_or_else(|| wrong(word))?;
            }
            Part::Packed(scalar) => {
                let word = words.next().ok_or_else(short)?;
                unpack(packed(word, scalar).ok_or_else(|| wrong(word))?, row);
            }
            Part::Nothing => {
                for _ in 0..field.count {
                    words.next().ok_or_else(short)?;
                }
            }
        }
    }
    match words.next() {
        Some(_) => Err(Fault::LongLine),
        None => Ok(()),
    }
}

fn binary(header: &Header, bytes: &[u8], start: usize) -> Result<Sink, Broken> {
    let stride = header.stride;
    let present = (bytes.len() - start) / stride;
    if header.points > present as u64 {
        return Err(header.promised(present as u64));
    }
    let points = header.capacity(present);
    let mut sink = Sink::new(header.holds, points);
    let mut row = Row::default();
    for (index, record) in bytes[start..].chunks_exact(stride).take(points).enumerate() {
        for field in &header.fields {
            field
                .read(&record[field.offset..], &mut row)
                .ok_or_else(|| cut(start + index * stride, index))?;
        }
        sink.row(&row);
    }
    Ok(sink)
}

/// Parses compressed data: the compressed and the uncompressed length, then the values, field by
/// field.
fn compressed(header: &Header, bytes: &[u8], start: usize) -> Result<Sink, Broken> {
    let length = |at: usize| {
        let length = bytes.get(at..).and_then(<[u8]>::first_chunk);
        length.map(|length| u32::from_le_bytes(*length))
    };
    let (Some(packed), Some(declared)) = (length(start), length(start + 4)) else {
        return Err(Fault::PastEnd.at_byte(start));
    };
    // A product of two 64-bit numbers cannot overflow 128 bits.
    let needed = u128::from(header.points) * header.stride as u128;
    if needed != u128::from(declared) {
        let unpacked = Fault::UnpackedSize {
            declared: declared.into(),
            needed: u64::try_from(needed).unwrap_or(u64::MAX),
        };
        return Err(unpacked.at_byte(start + 4));
    }
    let left = (bytes.len() - start - 8) as u64;
    let data = usize::try_from(packed).ok().and_then(|n| bytes[start + 8..].get(..n)).ok_or_else(|| {
        let values = packed.into();
        Fault::ListPastEnd { values, left }.at_byte(start)
    })?;
    let taken = needed + BYTES_A_POINT * u128::from(header.points);
    if taken > FREE + BYTES_A_BYTE * data.len() as u128 {
        let (points, packed) = (header.points, packed.into());
        return Err(Fault::Expansion { points, packed }.at_byte(start));
    }
    let unpacked = lzf::unpack(data, declared).map_err(|at| Fault::Corrupt.at_byte(start + 8 + at))?;
    let points = header.capacity(usize::MAX);
    let mut sink = Sink::new(header.holds, points);
    let mut row = Row::default();
    for index in 0..points {
        for field in &header.fields {
            let at = field.offset * points + field.size * field.count * index;
            field.read(&unpacked[at..], &mut row).ok_or_else(|| cut(start + 8, index))?;
        }
        sink.row(&row);
    }
    Ok(sink)
}

fn cut(byte: usize, index: usize) -> Broken {
    Fault::PastEnd.at_byte(byte).within("point", index as u64)
}

impl Field {
    /// Reads the value of the field from the start of `bytes` into `row`. Returns `None` if `bytes`
    /// is too short.
    fn read(&self, bytes: &[u8], row: &mut Row) -> Option<()> {
        match self.part {
            Part::Slot(slot, scalar) => row[slot] = scalar.read(bytes, Order::Little)?,
            // Read as bits, since packed colours may be signalling NaNs.
            Part::Packed(_) => unpack(u32::from_le_bytes(*bytes.first_chunk()?), row),
            Part::Nothing => {}
        }
        Some(())
    }
}

/// Parses a number whose bits are a packed colour.
fn packed(word: &[u8], scalar: Scalar) -> Option<u32> {
    match scalar {
        Scalar::F32 if number(word)?.is_nan() => Some(0),
        Scalar::F32 => std::str::from_utf8(word).ok()?.parse().map(f32::to_bits).ok(),
        Scalar::I32 => whole(word).map(i32::cast_unsigned),
        _ => whole(word),
    }
}

/// Unpacks red, green and blue from the lower three bytes.
fn unpack(bits: u32, row: &mut Row) {
    let [_, r, g, b] = bits.to_be_bytes();
    row[6..9].copy_from_slice(&[r, g, b].map(f64::from));
}
