//! A small container with every kind of section, and functions that damage it.

use bytemuck::{Pod, Zeroable};
use nearmiss_store::{Array, File, OpenError, Writer};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct About {
    pub(crate) name: String,
    pub(crate) bandwidth: f64,
    pub(crate) levels: Vec<u32>,
    pub(crate) margin: Option<f32>,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(crate) struct Node {
    pub(crate) first: u32,
    pub(crate) count: u16,
    pub(crate) axis: u16,
    pub(crate) split: f32,
}

pub(crate) const KIND: [u8; 4] = *b"TEST";

pub(crate) struct Content {
    pub(crate) about: About,
    pub(crate) points: Vec<[f32; 3]>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) weights: [Vec<f64>; 2],
    pub(crate) flags: Vec<u8>,
}

impl Content {
    pub(crate) fn small() -> Self {
        let about =
            About { name: "small".to_owned(), bandwidth: 0.1, levels: vec![1, 300, 70_000], margin: None };
        let points = (0..7_u8).map(|i| [f32::from(i), -0.5, f32::MIN_POSITIVE]).collect();
        let node = |first| Node { first, count: 3, axis: 2, split: 1.5 };
        Self {
            about,
            points,
            nodes: vec![node(0), node(3), node(9)],
            weights: [vec![1.0 / 3.0, -0.0, f64::MAX], vec![]],
            flags: (1..=65).collect(),
        }
    }

    pub(crate) fn writer(&self) -> Writer<'_> {
        let mut writer = Writer::new(KIND, 3);
        writer.section(*b"POSN", 0, &self.points).unwrap();
        writer.section(*b"NODE", 0, &self.nodes).unwrap();
        writer.section(*b"WGHT", 0, &self.weights[0]).unwrap();
        writer.section(*b"WGHT", 1, &self.weights[1]).unwrap();
        writer.metadata(&self.about).unwrap();
        writer.section(*b"FLAG", 7, &self.flags).unwrap();
        writer
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let length = self.writer().write_to(&mut bytes).unwrap();
        assert_eq!(length, bytes.len() as u64);
        assert_eq!(length, self.writer().byte_len());
        bytes
    }

    /// Checks that `file` has the written content.
    pub(crate) fn check(&self, file: &File) {
        file.expect(KIND, 3..=3).unwrap();
        assert_eq!(file.metadata::<About>().unwrap(), self.about);
        assert_eq!(*file.array::<[f32; 3]>(*b"POSN", 0).unwrap(), *self.points);
        assert_eq!(*file.array::<Node>(*b"NODE", 0).unwrap(), *self.nodes);
        for (part, weights) in (0..).zip(&self.weights) {
            let bits = |weights: &[f64]| weights.iter().map(|w| w.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&file.array::<f64>(*b"WGHT", part).unwrap()), bits(weights));
        }
        assert_eq!(*file.array::<u8>(*b"FLAG", 7).unwrap(), *self.flags);
    }
}

/// Calls every accessor, which may fail but must not panic. Returns the number of successes.
pub(crate) fn use_all(file: &File) -> usize {
    fn total<T: Pod>(array: Result<Array<T>, OpenError>) -> usize {
        array.map_or(0, |array| 1 + array.iter().filter(|e| bytemuck::bytes_of(*e)[0] == 1).count().min(1))
    }
    let mut good = total(file.array::<[f32; 3]>(*b"POSN", 0)) + total(file.array::<Node>(*b"NODE", 0));
    good += total(file.array::<f64>(*b"WGHT", 0)) + total(file.array::<f64>(*b"WGHT", 1));
    good += total(file.array::<u8>(*b"FLAG", 7));
    good += usize::from(file.metadata::<About>().is_ok()) + usize::from(file.verify().is_ok());
    good + file.sections().iter().map(|s| usize::try_from(s.elements()).unwrap().min(1)).sum::<usize>()
}

/// Recomputes both checksums in the header, as an attacker would.
pub(crate) fn repair(bytes: &mut [u8]) {
    let count = u32::from_le_bytes(bytes[20..24].try_into().unwrap()) as usize;
    if let Some(table) = count.checked_mul(40).and_then(|length| bytes.get(64..64 + length)) {
        let sum = xxh3_64(table);
        put(bytes, 32, sum);
    }
    let sum = xxh3_64(&bytes[..56]);
    put(bytes, 56, sum);
}

/// Overwrites eight bytes.
pub(crate) fn put(bytes: &mut [u8], at: usize, value: u64) {
    bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
}

/// The random number generator `SplitMix64`, with the same numbers on every run.
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
        usize::try_from(self.next() % limit as u64).unwrap()
    }
}
