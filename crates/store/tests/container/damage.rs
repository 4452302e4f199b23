//! Accidental damage: flipped, missing and added bytes, and files of other formats.

use std::path::Path;

use crate::sample::{Content, Random, put, repair, use_all};
use nearmiss_store::{Check, ContainerFault, File, Looks};

fn fault(bytes: Vec<u8>, check: Check) -> ContainerFault {
    let error = File::from_bytes(bytes, check).expect_err("ought to be refused");
    assert!(error.path.is_none());
    error.fault
}

#[test]
fn every_change_of_a_single_byte_is_refused() {
    let good = Content::small().bytes();
    let mut refused = 0;
    for at in 0..good.len() {
        for change in [0x01, 0x80, 0xFF] {
            let mut bytes = good.clone();
            bytes[at] ^= change;
            let found = fault(bytes, Check::Full);
            let expected = match at {
                0..8 => matches!(found, ContainerFault::NotAContainer { .. }),
                8..12 => matches!(found, ContainerFault::Layout { supported: 1, .. }),
                12..64 => matches!(found, ContainerFault::HeaderChecksum { .. }),
                64..304 => matches!(found, ContainerFault::TableChecksum { .. }),
                _ => matches!(found, ContainerFault::Checksum { .. } | ContainerFault::Padding { .. }),
            };
            assert!(expected, "byte {at} changed by {change:#x}: {found:?}");
            refused += 1;
        }
    }
    assert_eq!(refused, 3 * good.len());
}

#[test]
fn a_checksum_that_fails_names_its_section_and_a_padding_byte_its_place() {
    let good = Content::small().bytes();
    let file = File::from_bytes(good.clone(), Check::Full).unwrap();
    let mut padding = vec![true; good.len()];
    padding[..304].fill(false);
    for section in file.sections() {
        let start = usize::try_from(section.offset).unwrap();
        let length = usize::try_from(section.length).unwrap();
        padding[start..start + length].fill(false);
        for at in start..start + length {
            let mut bytes = good.clone();
            bytes[at] ^= 4;
            let ContainerFault::Checksum { section: id, offset, stored, computed } =
                fault(bytes, Check::Full)
            else {
                panic!("byte {at} is of {}", section.id)
            };
            assert_eq!((id, offset, stored), (section.id, section.offset, section.checksum));
            assert_ne!(stored, computed);
        }
    }
    assert!(padding.iter().any(|&p| p), "the file has padding to be damaged");
    for at in (0..good.len()).filter(|&at| padding[at]) {
        let mut bytes = good.clone();
        bytes[at] = 1;
        let found = fault(bytes, Check::Full);
        assert!(
            matches!(found, ContainerFault::Padding { offset } if offset == at as u64),
            "byte {at}: {found:?}"
        );
    }
}

#[test]
fn what_structure_lets_pass_verify_finds() {
    let good = Content::small().bytes();
    for at in 304..good.len() {
        let mut bytes = good.clone();
        bytes[at] ^= 0x10;
        let file = File::from_bytes(bytes, Check::Structure).unwrap();
        use_all(&file);
        let found = file.verify().expect_err("a changed byte").fault;
        assert!(
            matches!(found, ContainerFault::Checksum { .. } | ContainerFault::Padding { .. }),
            "byte {at}: {found:?}"
        );
    }
}

#[test]
fn every_truncation_and_every_extension_is_refused() {
    let good = Content::small().bytes();
    for check in [Check::Full, Check::Structure] {
        assert!(matches!(fault(Vec::new(), check), ContainerFault::Empty));
        for length in 1..good.len() {
            let expected = if length < 64 { 64 } else { good.len() } as u64;
            let found = fault(good[..length].to_vec(), check);
            assert!(
                matches!(found, ContainerFault::Truncated { expected: e, found: f } if e == expected && f == length as u64),
                "{length} bytes: {found:?}"
            );
        }
        for more in [1, 63, 64, 1000] {
            let mut bytes = good.clone();
            bytes.resize(good.len() + more, 0);
            assert!(matches!(fault(bytes, check), ContainerFault::TrailingBytes { .. }));
        }
    }
}

#[test]
fn truncated_files_are_refused_from_disk_too() {
    let good = Content::small().bytes();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.nm");
    for length in [0, 1, 63, 64, 100, good.len() - 1] {
        std::fs::write(&path, &good[..length]).unwrap();
        let errors = [File::open(&path, Check::Structure), File::read(&path, Check::Structure)];
        for error in errors.map(|result| result.expect_err("ought to be refused")) {
            assert_eq!(error.path.as_deref(), Some(path.as_path()));
            let expected = if length == 0 {
                matches!(error.fault, ContainerFault::Empty)
            } else {
                matches!(error.fault, ContainerFault::Truncated { found, .. } if found == length as u64)
            };
            assert!(expected, "{length} bytes: {error}");
        }
    }
}

#[test]
fn random_damage_never_panics_repaired_checksums_or_not() {
    let good = Content::small().bytes();
    let mut random = Random(1);
    let (mut opened, mut refused) = (0, 0);
    for round in 0..60_000 {
        let mut bytes = good.clone();
        for _ in 0..=random.below(4) {
            // Mostly header fields and the table.
            let at = if random.below(4) == 0 { random.below(bytes.len()) } else { 12 + random.below(292) };
            match random.below(4) {
                0 => bytes[at] = random.next().to_le_bytes()[0],
                1 => bytes[at] ^= 1 << random.below(8),
                2 => {
                    let interesting = [0, 1, 64, 128, 1 << 31, 1 << 32, u64::MAX, u64::MAX - 63, 1 << 63];
                    let at = at / 8 * 8;
                    put(&mut bytes, at.min(good.len() - 8), interesting[random.below(interesting.len())]);
                }
                _ => {
                    let from = random.below(bytes.len() - 8);
                    bytes.copy_within(from..from + 8, at.min(good.len() - 8));
                }
            }
        }
        if random.below(16) == 0 {
            bytes.truncate(random.below(good.len()).max(64));
        }
        if round % 4 != 0 {
            repair(&mut bytes);
        }
        match File::from_bytes(bytes, Check::Structure) {
            Ok(file) => {
                use_all(&file);
                opened += 1;
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                refused += 1;
            }
        }
    }
    assert!(opened > 3000 && refused > 20_000, "both ways were taken: {opened} opened, {refused} refused");
}

#[test]
fn files_of_other_kinds_are_named() {
    for (start, looks) in [
        (&b"ply\nformat ascii 1.0\n"[..], Looks::Ply),
        (b"# .PCD v0.7", Looks::Pcd),
        (b"LASF", Looks::Las),
        (b"0.0 0.0 1.0\n", Looks::Text),
        (b"\0\0\0\0\0\0\0\0\0\0", Looks::Zeros),
        (b"\x8Enmiss\n\x01\0\0\0", Looks::LineEnds),
        (b"\x1F\x8B\x08", Looks::Gzip),
        (b"\x8E", Looks::Unknown),
    ] {
        let found = fault(start.to_vec(), Check::Full);
        if start == b"\x8E" {
            assert!(matches!(found, ContainerFault::Truncated { expected: 64, found: 1 }), "{found:?}");
        } else {
            assert!(matches!(found, ContainerFault::NotAContainer { looks: l } if l == looks), "{found:?}");
        }
    }
}

#[test]
fn the_other_byte_order_and_other_layouts_are_recognised() {
    let good = Content::small().bytes();
    let mut swapped = good.clone();
    swapped[..8].reverse();
    assert!(matches!(fault(swapped, Check::Full), ContainerFault::ByteOrder));
    let mut newer = good;
    newer[8] = 2;
    repair(&mut newer);
    let found = fault(newer, Check::Full);
    assert!(matches!(found, ContainerFault::Layout { found: 2, supported: 1 }));
    assert!(found.to_string().ends_with("update the program"), "{found}");
}

#[test]
fn what_is_not_a_file_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.nm");
    for mapped in [true, false] {
        let load = |path: &Path| {
            if mapped { File::open(path, Check::Full) } else { File::read(path, Check::Full) }
        };
        let error = load(&missing).unwrap_err();
        assert!(
            matches!(&error.fault, ContainerFault::Io { source } if source.kind() == std::io::ErrorKind::NotFound)
        );
        assert_eq!(error.to_string(), format!("{}: no such file; check the path", missing.display()));
        assert!(
            std::error::Error::source(&error).is_some(),
            "the system's words are one step down the chain"
        );
        assert!(matches!(
            load(folder.path()).unwrap_err().fault,
            ContainerFault::NotAFile { directory: true }
        ));
        if cfg!(unix) {
            let device = load(Path::new("/dev/zero")).unwrap_err();
            assert!(matches!(device.fault, ContainerFault::NotAFile { directory: false }), "{device}");
        }
    }
}
