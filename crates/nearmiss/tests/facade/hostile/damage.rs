//! Random damage, which is the same for the same seed.

use crate::hostile::repair::{HEADER, ROW};

/// `SplitMix64`.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, limit: usize) -> usize {
        usize::try_from(self.next() % limit.max(1) as u64).unwrap()
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
}

const FLOATS: [f32; 14] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    0.0,
    -0.0,
    1e-45,
    -1.0,
    1.0,
    1e12,
    -1e12,
    1e20,
    f32::MAX,
    f32::MIN,
    1e-18,
];

const COUNTS: [u64; 12] =
    [0, 1, 2, 63, 64, 128, 1 << 31, u32::MAX as u64, 1 << 32, u64::MAX - 63, 1 << 63, u64::MAX];

/// Damages `bytes`, a container, in one to three places.
pub(crate) fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(3) {
        if bytes.len() > HEADER {
            once(bytes, random);
        }
    }
}

fn once(bytes: &mut Vec<u8>, random: &mut Random) {
    let (length, at) = (bytes.len(), random.below(bytes.len()));
    let some = random.below(length - at).min(1 << random.below(10));
    match random.below(12) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.next().to_le_bytes()[0],
        2 => bytes.truncate(at),
        3 => {
            let to = random.below(length - some);
            bytes.copy_within(at..at + some, to);
        }
        4 => bytes[at..at + some].fill(0),
        5 => drop(bytes.splice(at..at, vec![random.next().to_le_bytes()[0]; random.below(130)])),
        6 => drop(bytes.drain(at..at + some)),
        // A field of the header or the table.
        7 => put(bytes, 8 + 4 * random.below(14), &random.one(&COUNTS).to_le_bytes()[..random.one(&[4, 8])]),
        8 => put(bytes, HEADER + 4 * random.below(10 * ROW / 4), &random.one(&COUNTS).to_le_bytes()),
        // A number in an array.
        9 => put(bytes, at / 4 * 4, &random.one(&FLOATS).to_le_bytes()),
        10 => {
            let word = bytes.get(at / 4 * 4..).and_then(<[u8]>::first_chunk).copied().unwrap_or_default();
            let scaled = f32::from_le_bytes(word) * random.one(&[-1.0, 0.5, 0.99, 1.001, 2.0, 1e6]);
            put(bytes, at / 4 * 4, &scaled.to_le_bytes());
        }
        // A run of equal numbers.
        _ => {
            let value = random.one(&FLOATS).to_le_bytes();
            for word in bytes[at / 4 * 4..].chunks_exact_mut(4).take(some) {
                word.copy_from_slice(&value);
            }
        }
    }
}

fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
    if let Some(place) = bytes.get_mut(at..at + value.len()) {
        place.copy_from_slice(value);
    }
}

/// Makes the header state the actual length of the file, so that a truncated or extended file
/// passes that check.
pub(crate) fn restate_length(bytes: &mut Vec<u8>) {
    bytes.resize(bytes.len().next_multiple_of(64), 0);
    let length = bytes.len() as u64;
    put(bytes, 24, &length.to_le_bytes());
}
