//! The inverse of Marc Lehmann's LZF compression, as PCD uses it.
//!
//! A control byte below 32 copies that many bytes and one from the input; any other holds in its upper three
//! bits a length, with 7 for "more in the next byte", and in its lower five the high bits of how far back in
//! the output the copy starts. Lengths count from 2, distances from 1.

/// Three bytes of input make at most 264 of output, so that many a byte bound what can be promised.
const EXPANSION: usize = 88;

/// Exactly `size` bytes from `input`; the error is how far into the input the fault was noticed.
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
            // Source and copy overlap where the length exceeds the distance; then the copy repeats itself.
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
