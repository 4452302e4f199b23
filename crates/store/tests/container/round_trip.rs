//! Round trips: written content is read back, with every constructor of `File`.

use std::sync::Arc;

use crate::sample::{About, Content, KIND, Node};
use nearmiss_store::{Check, ContainerFault, File, SectionId, WriteError, Writer};

#[test]
fn every_way_in_gives_the_same_content() {
    let content = Content::small();
    let bytes = content.bytes();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("small.nm");
    assert_eq!(content.writer().save(&path).unwrap(), bytes.len() as u64);
    assert_eq!(std::fs::read(&path).unwrap(), bytes);

    let leaked: &'static [u8] = Box::leak(bytes.clone().into_boxed_slice());
    for check in [Check::Full, Check::Structure] {
        let files = [
            File::open(&path, check).unwrap(),
            File::read(&path, check).unwrap(),
            File::from_bytes(bytes.clone(), check).unwrap(),
            File::from_bytes(Arc::<[u8]>::from(bytes.as_slice()), check).unwrap(),
            File::from_bytes(leaked, check).unwrap(),
        ];
        for file in &files {
            content.check(file);
            file.verify().unwrap();
            assert_eq!((file.kind(), file.version(), file.byte_len()), (KIND, 3, bytes.len() as u64));
        }
        assert!(files[..2].iter().all(|file| file.path() == Some(path.as_path())));
        assert!(files[2..].iter().all(|file| file.path().is_none()));
    }
}

#[test]
fn opened_and_read_files_serve_every_alignment_in_place() {
    #[repr(C, align(64))]
    #[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
    struct Lane([f32; 16]);

    let lanes = [Lane([1.0; 16]), Lane([2.0; 16])];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lanes.nm");
    let mut writer = Writer::new(KIND, 1);
    writer.section(*b"BYTE", 0, &[1_u8, 2, 3]).unwrap().section(*b"LANE", 0, &lanes).unwrap();
    writer.save(&path).unwrap();
    for file in [File::open(&path, Check::Full).unwrap(), File::read(&path, Check::Full).unwrap()] {
        let array = file.array::<Lane>(*b"LANE", 0).unwrap();
        assert!(array.is_in_place());
        assert_eq!(*array, lanes);
        assert!(file.array::<u8>(*b"BYTE", 0).unwrap().is_in_place());
    }
    // Bytes in memory may start at an odd address. Then the elements are copied.
    let mut bytes = vec![0];
    writer.write_to(&mut bytes).unwrap();
    let shifted: &'static [u8] = &Box::leak(bytes.into_boxed_slice())[1..];
    let file = File::from_bytes(shifted, Check::Full).unwrap();
    assert_eq!(*file.array::<Lane>(*b"LANE", 0).unwrap(), lanes);
}

#[test]
fn the_same_content_gives_the_same_bytes() {
    assert_eq!(Content::small().bytes(), Content::small().bytes());
    let folder = tempfile::tempdir().unwrap();
    let paths = [folder.path().join("a.nm"), folder.path().join("another name")];
    for path in &paths {
        Content::small().writer().save(path).unwrap();
    }
    assert_eq!(std::fs::read(&paths[0]).unwrap(), std::fs::read(&paths[1]).unwrap());
}

#[test]
fn arrays_outlive_the_file_and_its_replacement() {
    let content = Content::small();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.nm");
    content.writer().save(&path).unwrap();
    let file = File::open(&path, Check::Full).unwrap();
    let points = file.array::<[f32; 3]>(*b"POSN", 0).unwrap();
    drop(file);
    if cfg!(unix) {
        let mut other = Writer::new(KIND, 4);
        other.section(*b"POSN", 0, &[[9.0_f32; 3]]).unwrap();
        other.save(&path).unwrap();
        assert_eq!(File::open(&path, Check::Full).unwrap().version(), 4);
        std::fs::remove_file(&path).unwrap();
    }
    assert_eq!(*points, *content.points);
}

#[test]
fn a_read_file_does_not_mind_what_happens_to_the_file() {
    let content = Content::small();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.nm");
    content.writer().save(&path).unwrap();
    let file = File::read(&path, Check::Structure).unwrap();
    std::fs::File::options().write(true).open(&path).unwrap().set_len(0).unwrap();
    content.check(&file);
    file.verify().unwrap();
}

#[test]
fn sections_are_listed_metadata_first() {
    let file = File::from_bytes(Content::small().bytes(), Check::Full).unwrap();
    let listed: Vec<_> =
        file.sections().iter().map(|s| (s.id.to_string(), s.elements(), s.element_size)).collect();
    let expected =
        [("POSN/0", 7, 12), ("NODE/0", 3, 12), ("WGHT/0", 3, 8), ("WGHT/1", 0, 8), ("FLAG/7", 65, 1)];
    assert_eq!(listed[0].0, "META/0");
    for ((name, elements, size), expected) in listed[1..].iter().zip(expected) {
        assert_eq!((name.as_str(), *elements, *size), expected);
    }
    assert_eq!(listed.len(), 1 + expected.len());
    assert!(file.has(*b"WGHT", 1) && !file.has(*b"WGHT", 2) && file.has(*b"META", 0));
}

#[test]
fn a_container_without_sections_is_one_header() {
    let mut bytes = Vec::new();
    assert_eq!(Writer::new(KIND, 0).write_to(&mut bytes).unwrap(), 64);
    let file = File::from_bytes(bytes, Check::Full).unwrap();
    assert!(file.sections().is_empty());
    assert!(matches!(
        file.metadata::<u8>().unwrap_err().fault,
        ContainerFault::MissingSection { section: SectionId { tag: [b'M', b'E', b'T', b'A'], part: 0 } }
    ));
}

#[test]
fn asking_for_what_is_not_there_says_so() {
    let file = File::from_bytes(Content::small().bytes(), Check::Full).unwrap();
    let missing = file.array::<u8>(*b"NONE", 2).unwrap_err().with_path("town.zip/scan.nm");
    assert!(matches!(missing.fault, ContainerFault::MissingSection { .. }));
    assert_eq!(
        missing.to_string(),
        "town.zip/scan.nm: section NONE/2 is missing; prepare it again with `preprocess`"
    );

    let wrong = file.array::<[f32; 4]>(*b"POSN", 0).unwrap_err();
    assert!(
        matches!(wrong.fault, ContainerFault::WrongElementSize { expected: 16, found: 12, .. }),
        "{wrong}"
    );
    assert_eq!(file.array::<Node>(*b"POSN", 0).unwrap().len(), 7, "only the size is stored, as documented");

    let kind = file.expect(*b"SLIC", 1..=9).unwrap_err();
    assert!(
        matches!(kind.fault, ContainerFault::Kind { found: KIND, expected: [b'S', b'L', b'I', b'C'] }),
        "{kind}"
    );
    for (supported, advice) in
        [(1..=2, "versions 1 to 2, got version 3; update"), (4..=4, "version 4, got version 3; prepare")]
    {
        let version = file.expect(KIND, supported).unwrap_err();
        assert!(matches!(version.fault, ContainerFault::Version { found: 3, .. }));
        assert!(version.to_string().contains(advice), "{version}");
    }
    assert!(matches!(
        file.metadata::<[[u64; 32]; 4]>().unwrap_err().fault,
        ContainerFault::Metadata { offset: 320, .. }
    ));
    assert!(matches!(
        file.metadata::<u8>().unwrap_err().fault,
        ContainerFault::MetadataTrailing { offset: 321, .. }
    ));
}

#[test]
fn a_writer_refuses_names_that_are_taken() {
    let mut writer = Writer::new(KIND, 1);
    writer.section(*b"POSN", 0, &[1_u8]).unwrap();
    let twice = writer.section(*b"POSN", 0, &[2_u8]).unwrap_err();
    assert!(matches!(twice, WriteError::DuplicateSection { section: SectionId { part: 0, .. } }), "{twice}");
    let reserved = writer.section(*b"META", 5, &[2_u8]).unwrap_err();
    assert!(matches!(reserved, WriteError::ReservedTag { section: SectionId { part: 5, .. } }), "{reserved}");
    writer.metadata(&1_u8).unwrap();
    assert!(matches!(writer.metadata(&2_u8), Err(WriteError::DuplicateSection { .. })));
    // Rejected sections were not added.
    let mut bytes = Vec::new();
    writer.write_to(&mut bytes).unwrap();
    let file = File::from_bytes(bytes, Check::Full).unwrap();
    assert_eq!(file.sections().len(), 2);
    assert_eq!(*file.array::<u8>(*b"POSN", 0).unwrap(), [1]);
    assert_eq!(file.metadata::<u8>().unwrap(), 1);
}

#[test]
fn metadata_that_serde_cannot_number_are_an_error() {
    struct Endless;
    impl serde::Serialize for Endless {
        fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.collect_seq(std::iter::repeat_n(1_u8, 3).filter(|_| true))
        }
    }
    let error = Writer::new(KIND, 1).metadata(&Endless).unwrap_err();
    assert!(matches!(error, WriteError::Metadata { .. }), "{error}");
    let large = About { levels: vec![0; 70_000], ..Content::small().about };
    let error = Writer::new(KIND, 1).metadata(&large).unwrap_err();
    assert!(matches!(error, WriteError::MetadataTooLarge { limit: 65_536, .. }), "{error}");
}

/// Reads from the kernel which pages of the map were accessed.
#[cfg(all(target_os = "linux", feature = "mmap"))]
#[test]
fn opening_without_checksums_leaves_the_bulk_alone() {
    let bulk = vec![1_u64; 8 << 20];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large-and-untouched.nm");
    let mut writer = Writer::new(KIND, 1);
    writer.section(*b"BULK", 0, &bulk).unwrap();
    writer.save(&path).unwrap();

    let resident_kib = || {
        let maps = std::fs::read_to_string("/proc/self/smaps").unwrap();
        let (_, ours) = maps.split_once("large-and-untouched.nm").expect("the file is mapped");
        let line = ours.lines().find(|line| line.starts_with("Rss:")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap()
    };
    let file = File::open(&path, Check::Structure).unwrap();
    let array = file.array::<u64>(*b"BULK", 0).unwrap();
    assert!(resident_kib() <= 1024, "{} KiB of 65536 were touched", resident_kib());
    file.verify().unwrap();
    assert!(resident_kib() >= 60_000, "verifying reads all of them");
    assert_eq!(*array, *bulk);
}
