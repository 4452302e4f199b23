//! The metadata section: one small serde value. Only this module depends on the encoder.
//!
//! The format is the standard configuration of bincode 2: little-endian, with integers of variable
//! length. Two limits bound the cost of a malicious file: the length of the section, and the memory
//! for decoding.

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::{ContainerFault, WriteError};

/// Maximum length of the metadata section in bytes: 64 KiB. It is for numbers and names. Data that
/// grow with the input belong in a section.
pub const METADATA_LIMIT: usize = 64 * 1024;

/// The decoder's limit in bytes of decoded values. The widest integer has 16 bytes and may be
/// encoded in one, so this factor accepts every value that fits [`METADATA_LIMIT`].
const CLAIM_LIMIT: usize = 16 * METADATA_LIMIT;

pub(crate) fn encode(value: &impl Serialize) -> Result<Vec<u8>, WriteError> {
    let bytes = bincode::serde::encode_to_vec(value, bincode::config::standard())
        .map_err(|source| WriteError::Metadata { source: Box::new(source) })?;
    if bytes.len() > METADATA_LIMIT {
        return Err(WriteError::MetadataTooLarge { length: bytes.len(), limit: METADATA_LIMIT });
    }
    Ok(bytes)
}

/// Decodes the section at `offset`. Bytes left over are an error.
pub(crate) fn decode<M: DeserializeOwned>(bytes: &[u8], offset: u64) -> Result<M, ContainerFault> {
    if bytes.len() > METADATA_LIMIT {
        return Err(ContainerFault::MetadataTooLarge {
            offset,
            length: bytes.len() as u64,
            limit: METADATA_LIMIT,
        });
    }
    let config = bincode::config::standard().with_limit::<CLAIM_LIMIT>();
    let (value, used) = bincode::serde::decode_from_slice(bytes, config)
        .map_err(|source| ContainerFault::Metadata { offset, source: Box::new(source) })?;
    if used != bytes.len() {
        return Err(ContainerFault::MetadataTrailing {
            offset: offset + used as u64,
            count: bytes.len() - used,
        });
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_fits_the_limit_comes_back() {
        // One byte each when encoded, sixteen when decoded: the worst ratio.
        let value = vec![7_u128; METADATA_LIMIT - 5];
        let bytes = encode(&value).unwrap();
        assert_eq!(decode::<Vec<u128>>(&bytes, 0).unwrap(), value);
    }

    #[test]
    fn too_much_is_refused_on_both_sides() {
        let value = vec![1_u8; METADATA_LIMIT];
        assert!(matches!(encode(&value), Err(WriteError::MetadataTooLarge { .. })));
        let bytes = vec![0; METADATA_LIMIT + 1];
        assert!(matches!(decode::<u8>(&bytes, 64), Err(ContainerFault::MetadataTooLarge { offset: 64, .. })));
    }

    #[test]
    fn bytes_left_over_and_lengths_beyond_the_section_are_refused() {
        let mut bytes = encode(&("name", 3_u32)).unwrap();
        bytes.push(0);
        let trailing = decode::<(String, u32)>(&bytes, 100).unwrap_err();
        assert!(
            matches!(trailing, ContainerFault::MetadataTrailing { offset: 106, count: 1 }),
            "{trailing:?}"
        );
        // 253 precedes a u64: the length of a string of 2^63 bytes.
        let huge = [253, 0, 0, 0, 0, 0, 0, 0, 0x80];
        assert!(matches!(decode::<String>(&huge, 0), Err(ContainerFault::Metadata { .. })));
        assert!(matches!(decode::<Vec<u64>>(&huge, 0), Err(ContainerFault::Metadata { .. })));
    }
}
