//! A golden file that is never rewritten: every later version reads it, or rejects it with an error
//! that names the version.

use nearmiss_store::{Check, File, LAYOUT, Writer};
use xxhash_rust::xxh3::xxh3_64;

const GOLDEN: &[u8] = include_bytes!("../golden/v1.nm");

const POINTS: [[f32; 3]; 3] = [[0.0, 0.5, -1.0], [1.0e-3, 2.0, 3.25], [f32::MAX, f32::MIN_POSITIVE, -0.0]];
const IDS: [u32; 5] = [4, 3, 2, 1, u32::MAX];
const ROOTS: [f64; 1] = [std::f64::consts::SQRT_2];
const EMPTY: [u16; 0] = [];

type About = (String, u64, f64, Option<i32>, Vec<u8>, bool);

fn about() -> About {
    ("golden".to_owned(), 1 << 40, 0.1, Some(-7), vec![1, 2, 3], true)
}

fn written_today() -> Vec<u8> {
    let mut writer = Writer::new(*b"GOLD", 1);
    writer.section(*b"POSN", 0, &POINTS).unwrap();
    writer.section(*b"IDS ", 0, &IDS).unwrap();
    writer.section(*b"IDS ", 1, &EMPTY).unwrap();
    writer.metadata(&about()).unwrap();
    writer.section(*b"ROOT", 0, &ROOTS).unwrap();
    let mut bytes = Vec::new();
    writer.write_to(&mut bytes).unwrap();
    bytes
}

#[test]
fn the_golden_file_opens_and_holds_what_it_held() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/v1.nm");
    for file in [
        File::open(path, Check::Full).unwrap(),
        File::read(path, Check::Full).unwrap(),
        File::from_bytes(GOLDEN, Check::Full).unwrap(),
    ] {
        file.expect(*b"GOLD", 1..=1).unwrap();
        assert_eq!(*file.array::<[f32; 3]>(*b"POSN", 0).unwrap(), POINTS);
        assert_eq!(*file.array::<u32>(*b"IDS ", 0).unwrap(), IDS);
        assert_eq!(*file.array::<u16>(*b"IDS ", 1).unwrap(), EMPTY);
        assert_eq!(*file.array::<f64>(*b"ROOT", 0).unwrap(), ROOTS);
        assert_eq!(file.metadata::<About>().unwrap(), about());
    }
}

#[test]
fn todays_writer_makes_the_same_bytes() {
    assert_eq!(LAYOUT, 1, "a new layout gets a golden file of its own; this one stays");
    assert_eq!(written_today(), GOLDEN);
}

/// A naive reader, written from the tables of the README, without code of the crate.
#[test]
fn the_layout_is_the_one_in_the_readme() {
    let u32_at = |at: usize| u32::from_le_bytes(GOLDEN[at..at + 4].try_into().unwrap());
    let u64_at = |at: usize| u64::from_le_bytes(GOLDEN[at..at + 8].try_into().unwrap());
    assert_eq!(GOLDEN[..8], [0x8E, 0x6E, 0x6D, 0x69, 0x73, 0x73, 0x0D, 0x0A]);
    assert_eq!(u32_at(8), 1);
    assert_eq!(&GOLDEN[12..16], b"GOLD");
    assert_eq!(u32_at(16), 1);
    let count = u32_at(20) as usize;
    assert_eq!(count, 5);
    assert_eq!(u64_at(24), GOLDEN.len() as u64);
    assert_eq!(u64_at(32), xxh3_64(&GOLDEN[64..64 + 40 * count]));
    assert_eq!(GOLDEN[40..56], [0; 16]);
    assert_eq!(u64_at(56), xxh3_64(&GOLDEN[..56]));

    let mut end = 64 + 40 * count;
    let names = [(b"META", 0, 1), (b"POSN", 0, 12), (b"IDS ", 0, 4), (b"IDS ", 1, 2), (b"ROOT", 0, 8)];
    for (row, (tag, part, size)) in names.into_iter().enumerate() {
        let at = 64 + 40 * row;
        assert_eq!((&GOLDEN[at..at + 4], u32_at(at + 4)), (&tag[..], part));
        let offset = usize::try_from(u64_at(at + 8)).unwrap();
        let length = usize::try_from(u64_at(at + 16)).unwrap();
        assert_eq!((u32_at(at + 24), u32_at(at + 28)), (size, 0));
        assert_eq!(offset, end.div_ceil(64) * 64);
        assert!(GOLDEN[end..offset].iter().all(|&byte| byte == 0), "padding before {row}");
        assert_eq!(u64_at(at + 32), xxh3_64(&GOLDEN[offset..offset + length]));
        end = offset + length;
    }
    assert_eq!(GOLDEN.len(), end.div_ceil(64) * 64);
    assert!(GOLDEN[end..].iter().all(|&byte| byte == 0), "padding at the end");

    let ids = usize::try_from(u64_at(64 + 2 * 40 + 8)).unwrap();
    assert_eq!(u32_at(ids), 4);
    assert_eq!(u32_at(ids + 16), u32::MAX);
}
