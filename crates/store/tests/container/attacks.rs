//! Forged tables: the checksums of header and table match, the contents are wrong.

use crate::sample::{Content, put, repair};
use nearmiss_store::{Check, ContainerFault, File, Writer};

/// Byte offsets of the fields of table row `row`.
const fn tag(row: usize) -> usize {
    64 + 40 * row
}
const fn offset(row: usize) -> usize {
    tag(row) + 8
}
const fn length(row: usize) -> usize {
    tag(row) + 16
}
const fn element_size(row: usize) -> usize {
    tag(row) + 24
}

/// Applies `change` to a valid file, repairs the checksums, and returns the fault of opening it.
fn attack(change: impl Fn(&mut Vec<u8>)) -> ContainerFault {
    let mut bytes = Content::small().bytes();
    change(&mut bytes);
    repair(&mut bytes);
    let full = File::from_bytes(bytes.clone(), Check::Full).expect_err("refused with checksums").fault;
    let structure = File::from_bytes(bytes, Check::Structure).expect_err("refused without checksums").fault;
    assert_eq!(format!("{full:?}"), format!("{structure:?}"), "both find the same");
    structure
}

fn number(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
}

#[test]
fn repairing_an_honest_file_changes_nothing() {
    let good = Content::small().bytes();
    let mut repaired = good.clone();
    repair(&mut repaired);
    assert_eq!(good, repaired);
}

#[test]
fn sections_beyond_the_file_are_refused() {
    let file_end = Content::small().bytes().len() as u64;
    for beyond in [file_end + 64, 1 << 40, 1 << 63, u64::MAX - 63] {
        let found = attack(|bytes| put(bytes, offset(2), beyond));
        assert!(matches!(found, ContainerFault::OutOfBounds { offset, .. } if offset == beyond), "{found:?}");
    }
    for long in [file_end, 1 << 40, (u64::MAX / 12) * 12, 1 << 63] {
        let found = attack(|bytes| put(bytes, length(1), long / 12 * 12));
        assert!(matches!(found, ContainerFault::OutOfBounds { .. }), "{found:?}");
    }
    let both = attack(|bytes| {
        put(bytes, offset(3), u64::MAX - 63);
        put(bytes, length(3), 128);
    });
    assert!(
        matches!(both, ContainerFault::OutOfBounds { .. }),
        "the sum wraps round to a good value: {both:?}"
    );
}

#[test]
fn overlapping_and_wandering_sections_are_refused() {
    let same = attack(|bytes| {
        let first = number(bytes, offset(1));
        put(bytes, offset(2), first);
    });
    assert!(matches!(same, ContainerFault::Overlapping { .. }), "{same:?}");
    for inside in [0, 64, 128, 256] {
        let found = attack(|bytes| put(bytes, offset(1), inside));
        assert!(
            matches!(found, ContainerFault::Overlapping { offset, .. } if offset == inside),
            "header or table: {found:?}"
        );
    }
    let swapped = attack(|bytes| {
        let (a, b) = (number(bytes, offset(1)), number(bytes, offset(2)));
        put(bytes, offset(1), b);
        put(bytes, offset(2), a);
    });
    assert!(matches!(swapped, ContainerFault::Unclaimed { .. }), "{swapped:?}");
    // 65 flags take two units of 64 bytes. 32 flags take one, so the second belongs to no section.
    let hidden = attack(|bytes| put(bytes, length(5), 32));
    assert!(matches!(hidden, ContainerFault::Unclaimed { .. }), "{hidden:?}");
}

#[test]
fn misaligned_sections_are_refused() {
    for by in [1, 4, 8, 32, 63] {
        let found = attack(|bytes| {
            let honest = number(bytes, offset(2));
            put(bytes, offset(2), honest + by);
        });
        assert!(matches!(found, ContainerFault::Misaligned { .. }), "{found:?}");
    }
}

#[test]
fn element_sizes_that_do_not_divide_are_refused() {
    for size in [0_u32, 5, 11, u32::MAX] {
        let found =
            attack(|bytes| bytes[element_size(1)..element_size(1) + 4].copy_from_slice(&size.to_le_bytes()));
        assert!(
            matches!(found, ContainerFault::ElementSize { element_size, .. } if element_size == size),
            "{found:?}"
        );
    }
    // An empty section of zero-sized elements is rejected too.
    let found = attack(|bytes| bytes[element_size(4)..element_size(4) + 4].fill(0));
    assert!(matches!(found, ContainerFault::ElementSize { element_size: 0, length: 0, .. }), "{found:?}");
}

#[test]
fn counts_that_the_file_cannot_hold_are_refused() {
    for count in [40_u32, 1 << 20, u32::MAX] {
        let found = attack(|bytes| bytes[20..24].copy_from_slice(&count.to_le_bytes()));
        assert!(
            matches!(found, ContainerFault::TableOutOfBounds { count: c, .. } if c == count),
            "{found:?}"
        );
    }
    let fewer = attack(|bytes| bytes[20] = 5);
    assert!(matches!(fewer, ContainerFault::Unclaimed { .. }), "{fewer:?}");
    let none = attack(|bytes| bytes[20] = 0);
    assert!(matches!(none, ContainerFault::Unclaimed { .. }), "{none:?}");
    let more = attack(|bytes| bytes[20] = 7);
    assert!(matches!(more, ContainerFault::Overlapping { .. }), "the table grew into the metadata: {more:?}");
}

#[test]
fn lengths_that_lie_are_refused() {
    let honest = Content::small().bytes().len() as u64;
    for stated in [honest + 64, u64::MAX, 1 << 50] {
        let found = attack(|bytes| put(bytes, 24, stated));
        assert!(
            matches!(found, ContainerFault::Truncated { expected, found } if expected == stated && found == honest)
        );
    }
    for stated in [0, 64, honest - 64] {
        let found = attack(|bytes| put(bytes, 24, stated));
        assert!(
            matches!(found, ContainerFault::TrailingBytes { expected, .. } if expected == stated),
            "{found:?}"
        );
    }
    let ragged = attack(|bytes| {
        bytes.truncate(bytes.len() - 3);
        let stated = bytes.len() as u64;
        put(bytes, 24, stated);
    });
    assert!(matches!(ragged, ContainerFault::RaggedLength { .. }), "{ragged:?}");
    let appended = attack(|bytes| {
        bytes.resize(bytes.len() + 64, 0);
        let stated = bytes.len() as u64;
        put(bytes, 24, stated);
    });
    assert!(
        matches!(appended, ContainerFault::Unclaimed { offset, end } if (offset, end) == (honest, honest + 64))
    );
}

#[test]
fn names_listed_twice_and_reserved_bytes_are_refused() {
    let twice = attack(|bytes| bytes.copy_within(tag(3)..tag(3) + 8, tag(4)));
    assert!(matches!(twice, ContainerFault::DuplicateSection { .. }), "{twice:?}");
    for at in 40..56 {
        let found = attack(|bytes| bytes[at] = 1);
        assert!(matches!(found, ContainerFault::Padding { offset: 40 }), "{found:?}");
    }
    let found = attack(|bytes| bytes[tag(2) + 28] = 1);
    assert!(matches!(found, ContainerFault::Padding { offset: 172 }), "{found:?}");
}

#[test]
fn hostile_metadata_cost_nothing() {
    // A string of 2^62 bytes, and other invalid encodings, are errors.
    for bytes in [vec![253_u8, 0, 0, 0, 0, 0, 0, 0, 0x40], vec![0xFF; 4096], vec![255; 60_000], vec![]] {
        let mut writer = Writer::new(*b"TEST", 1);
        writer.section(*b"METB", 0, &bytes).unwrap();
        let mut file = Vec::new();
        writer.write_to(&mut file).unwrap();
        file[tag(0) + 3] = b'A';
        repair(&mut file);
        let file = File::from_bytes(file, Check::Full).unwrap();
        let error = file.metadata::<crate::sample::About>().unwrap_err();
        assert!(matches!(error.fault, ContainerFault::Metadata { .. }), "{error}");
        assert!(file.metadata::<(Vec<u128>, String)>().is_err());
    }
}
