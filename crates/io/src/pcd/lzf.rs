//! Decompression of LZF (Marc Lehmann), as used by PCD.
//!
//! A control byte `c` below 32 copies `c + 1` bytes from the input. Any other control byte copies
//! from earlier output. Its upper three bits are the length minus 2; 7 means that the next byte is
//! added. Its lower five bits are the high bits of the distance minus 1, and the following byte is
//! the low bits.

/// Maximum expansion: three bytes of input give at most 264 bytes of output, 88 per byte.
const EXPANSION: usize = 88;

/// Decompresses `input` to exactly `size` bytes. The error is the offset in the input of the fault.
pub(super) fn unpack(input: &[u8], size: u32) -> Result<Vec<u8>, usize> {
    let size = usize::try_from(size).ok().filter(|&size| size / EXPANSION <= input.len());
    let size = size.ok_or(0_usize)?;
    let mut out = Vec::with_capacity(size);
    let mut at = 0;
    while let Some(&control) = input.get(at) {
        let start = at;
        at += 1;
        if control < 32 {
            let end = at + usize::from(control) + 1;
            out.extend_from_slice(input.get(at..end).ok_or(start)?);
            at = end;
        } else {
            let mut length = usize::from(control >> 5) + 2;
            if length == 9 {
                length += usize::from(*input.get(at).ok_or(start)?);
                at += 1;
            }
            let low = usize::from(*input.get(at).ok_or(start)?);
            at += 1;
            let back = (usize::from(control & 31) << 8 | low) + 1;
            let from = out.len().checked_sub(back).ok_or(start)?;
            // If the length exceeds the distance, source and copy overlap, and the copy repeats
            // itself.
            if back >= length {
                out.extend_from_within(from..from + length);
            } else {
                (from..from + length).for_each(|i| out.push(out[i]));
            }
        }
        if out.len() > size {
            return Err(start);
        }
    }
    if out.len() == size { Ok(out) } else { Err(at) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_packer_of_another_crate() {
        let mut state = 1_u32;
        let mut cases = 0;
        for length in [5_usize, 64, 300, 10_000] {
            for variety in [1_u32, 3, 7, 200] {
                let data: Vec<u8> = (0..length)
                    .map(|_| {
                        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                        u8::try_from((state >> 24) % variety).unwrap()
                    })
                    .collect();
                let Ok(packed) = lzf::compress(&data) else {
                    continue; // does not get shorter
                };
                cases += 1;
                let size = u32::try_from(length).unwrap();
                assert_eq!(unpack(&packed, size), Ok(data), "{length} bytes of {variety} kinds");
                for wrong in [size - 1, size + 1] {
                    assert!(unpack(&packed, wrong).is_err(), "not {wrong} bytes");
                }
                for cut in 0..packed.len().min(300) {
                    assert!(unpack(&packed[..cut], size).is_err(), "cut after {cut}");
                }
            }
        }
        assert!(cases >= 9, "only {cases} inputs could be packed");
    }

    #[test]
    fn promises_beyond_any_expansion_allocate_nothing() {
        assert_eq!(unpack(&[0, 7], u32::MAX), Err(0));
        assert_eq!(unpack(&[32, 5], 3), Err(0), "nothing to copy from");
    }
}
