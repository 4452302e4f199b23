//! Recomputes all checksums of a container, as an attacker who knows the format could.

use xxhash_rust::xxh3::xxh3_64;

/// Length of the header in bytes.
pub(crate) const HEADER: usize = 64;

/// Length of a table row in bytes.
pub(crate) const ROW: usize = 40;

fn number(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

fn put(bytes: &mut [u8], at: usize, value: u64) {
    bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
}

/// Recomputes the checksums of each section in the file, of the table, and of the header.
pub(crate) fn repair(bytes: &mut [u8]) {
    let Some(count) = bytes.get(20..24).and_then(<[u8]>::first_chunk) else { return };
    let rows = u32::from_le_bytes(*count) as usize;
    let rows = rows.min(bytes.len().saturating_sub(HEADER) / ROW);
    for row in (0..rows).map(|row| HEADER + ROW * row) {
        let [Some(offset), Some(length)] = [8, 16].map(|field| number(bytes, row + field)) else { return };
        let (offset, length) = (usize::try_from(offset), usize::try_from(length));
        let (Ok(offset), Ok(length)) = (offset, length) else { continue };
        let section = offset.checked_add(length).and_then(|end| bytes.get(offset..end));
        if let Some(sum) = section.map(xxh3_64) {
            put(bytes, row + 32, sum);
        }
    }
    if bytes.len() >= HEADER {
        let table = xxh3_64(&bytes[HEADER..HEADER + ROW * rows]);
        put(bytes, 32, table);
        let header = xxh3_64(&bytes[..56]);
        put(bytes, 56, header);
    }
}
