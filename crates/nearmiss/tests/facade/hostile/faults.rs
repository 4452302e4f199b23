//! Files that are truncated, come from other machines or versions, or are replaced while a scan is
//! open.

use std::io;

use nearmiss::store::{ContainerFault, File, WriteError, WriteStep};
use nearmiss::{BuildOptions, Check, GraphOptions, LoadError, PointCloud, Scan};
use nearmiss_testdata::arbitrary::{self, CloudKind};

use crate::hostile::cases::cut_anywhere;
use crate::hostile::exercise::exercise;
use crate::hostile::repair::repair;

fn scan(seed: u64) -> Scan {
    let points = arbitrary::cloud(CloudKind::Sphere, 120, seed);
    Scan::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap()
}

fn bytes_of(scan: &Scan) -> Vec<u8> {
    let mut bytes = Vec::new();
    scan.write_to(&mut bytes).unwrap();
    bytes
}

/// The errors of opening `bytes` with and without comparing checksums.
fn refusals(bytes: &[u8]) -> [LoadError; 2] {
    [Check::Full, Check::Structure].map(|check| Scan::from_bytes(bytes.to_vec(), check).unwrap_err())
}

#[test]
fn a_scan_cut_anywhere_is_refused_even_if_its_header_owns_up() {
    cut_anywhere(&bytes_of(&scan(1)), refusals);
}

#[test]
fn a_file_of_a_machine_of_the_other_byte_order_is_named_as_such() {
    let whole = bytes_of(&scan(1));
    // Such a machine writes numbers in the opposite byte order. The first eight bytes are bytes, or
    // are swapped as one number.
    for swapped in [&[(0, 8)][..], &[(8, 12)], &[(8, 12), (16, 20), (20, 24), (24, 32), (32, 40), (56, 64)]] {
        let mut other = whole.clone();
        for &(start, end) in swapped {
            other[start..end].reverse();
        }
        for refused in refusals(&other) {
            let LoadError::Open(refused) = refused else { panic!("{refused}") };
            assert!(matches!(refused.fault, ContainerFault::ByteOrder), "{swapped:?}: {refused}");
            assert!(refused.to_string().contains("big-endian machine; prepare it again"), "{refused}");
        }
    }
}

#[test]
fn parts_that_are_not_the_components_are_refused() {
    let points = arbitrary::cloud(CloudKind::FarClusters, 120, 1);
    let cloud = PointCloud::from_positions(&points).unwrap();
    let scan = Scan::build(&cloud, &BuildOptions::default()).unwrap();
    let scan = scan.with_graph(&cloud, &GraphOptions::default(), None).unwrap();
    assert!(scan.graph().unwrap().parts().len() > 1, "several parts");
    let whole = bytes_of(&scan);
    let file = File::from_bytes(whole.clone(), Check::Full).unwrap();
    let parts = file.sections().iter().find(|section| section.id.tag == *b"PART").unwrap();
    let first = usize::try_from(parts.offset).unwrap();
    // Overwrites the number of points of the first part, or the second part with the first.
    for (from, to) in [(first..first + 4, first + 4), (first..first + 12, first + 12)] {
        let mut lying = whole.clone();
        lying.copy_within(from, to);
        repair(&mut lying);
        let refused = Scan::from_bytes(lying, Check::Full).unwrap_err();
        assert!(matches!(refused, LoadError::Flaw(_)), "{refused}");
        assert!(refused.to_string().contains("part"), "{refused}");
    }
}

#[test]
fn a_scan_answers_the_same_while_its_file_is_replaced_and_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.nm");
    let (first, second) = (scan(1), scan(2));
    first.save(&path).unwrap();
    let open = Scan::open(&path, Check::Full).unwrap();
    let before = exercise(&open, &first);
    for _ in 0..3 {
        second.save(&path).unwrap();
        assert_eq!(exercise(&open, &first), before, "the bytes that were opened");
        first.save(&path).unwrap();
    }
    second.save(&path).unwrap();
    let replaced = Scan::open(&path, Check::Full).unwrap();
    assert_ne!(exercise(&replaced, &first), before, "who opens it now gets the other scan");
    std::fs::remove_file(&path).unwrap();
    assert_eq!(exercise(&open, &first), before, "even without a name");
}

/// A folder in which not even root can create files.
#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_takes_no_files_is_reported() {
    let refused = scan(1).save("/proc/scan.nm").unwrap_err();
    let WriteError::Io { path, step: WriteStep::Create, source } = &refused else { panic!("{refused}") };
    assert_eq!(path.as_deref(), Some(std::path::Path::new("/proc/scan.nm")));
    let kinds = [io::ErrorKind::NotFound, io::ErrorKind::PermissionDenied];
    assert!(kinds.contains(&source.kind()), "{source:?}");
    assert!(refused.to_string().ends_with("is writable"), "{refused}");
}
