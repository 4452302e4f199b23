//! Damaged files: a reader returns a model or an error, and at most as many points as fit into the
//! file.

use std::path::Path;

use nearmiss_io::{
    Format, Model, Pieces, ReadError, read_bytes, read_in_pieces, read_mesh_bytes, read_watched,
};
use proptest::prelude::*;

use nearmiss_testdata::files;

fn check(bytes: &[u8], format: Option<Format>, name: &str) {
    let check = |answer: Result<Model, ReadError>| match answer {
        Ok(model) => {
            let given =
                model.cloud.len() + model.cloud.dropped().duplicate + model.cloud.dropped().not_finite;
            // A point takes at least three bytes, and compression expands a byte to at most 88.
            assert!(given * 3 <= bytes.len() * 88, "{name}: {given} points");
            let source = model.cloud.source();
            assert!(source.iter().all(|&i| (i as usize) < given), "{name}");
            if let Some(mesh) = model.mesh {
                assert_eq!(mesh.vertices().len(), given, "{name}");
            }
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.starts_with(name), "{message}");
            assert!(message.len() < 400, "{message}");
            assert!(!message.chars().any(char::is_control), "{message:?}");
        }
    };
    check_pieces(bytes, format, name);
    check(read_bytes(bytes, format, Path::new(name)));
    let _mesh_or_error = read_mesh_bytes(bytes, format, Path::new(name));
}

/// Checks that reading in pieces of a few rows gives the same points or the same error.
fn check_pieces(bytes: &[u8], format: Option<Format>, name: &str) {
    let place = tempfile::tempdir().expect("a folder for a file");
    let path = place.path().join(name);
    std::fs::write(&path, bytes).expect("a file");
    let whole = read_bytes(bytes, format, &path);
    let mut told = 0;
    match (&whole, read_watched(&path, format, &mut |points| told += points)) {
        (Ok(whole), Ok(watched)) => {
            // As text, because numbers may be NaN.
            assert_eq!(format!("{whole:?}"), format!("{watched:?}"), "{name}");
            let dropped = whole.cloud.dropped();
            let given = whole.cloud.len() + dropped.duplicate + dropped.not_finite;
            assert!(told == given || told == 0, "{name}: {told} of {given} points were told");
        }
        (Err(whole), Err(watched)) => assert_eq!(whole.to_string(), watched.to_string(), "{name}"),
        (whole, watched) => panic!("{name}: {whole:?} in memory, {watched:?} watched"),
    }
    for block in [30, 200] {
        let pieces = read_in_pieces(&path, format, block).and_then(|pieces| match pieces {
            Pieces::Mesh { vertices, .. } => Ok(vertices.positions),
            Pieces::Points(pieces) => {
                let mut points = Vec::new();
                pieces.each(|piece| points.extend_from_slice(&piece.positions))?;
                let mut again = 0;
                pieces.each(|piece| again += piece.len())?;
                assert_eq!(again, points.len(), "{name}");
                Ok(points)
            }
        });
        match (&whole, pieces) {
            (Ok(Model { cloud, .. }), Ok(points)) => {
                let dropped = cloud.dropped();
                assert_eq!(points.len(), cloud.len() + dropped.duplicate + dropped.not_finite, "{name}");
                for (i, source) in cloud.source().iter().enumerate() {
                    let (rounded, exact) = (cloud.point(i), points[*source as usize]);
                    assert!(
                        (0..3).all(|k| (rounded[k] - exact[k]).abs() <= cloud.step()),
                        "{name}: {exact:?}"
                    );
                }
            }
            // Too few points and too large coordinates are errors of the cloud only.
            (Err(ReadError::Cloud { .. }), Ok(_) | Err(ReadError::MeshNotFinite { .. })) => {}
            (Err(broken), Err(in_pieces)) => {
                assert_eq!(broken.to_string(), in_pieces.to_string(), "in the same words");
            }
            (whole, pieces) => panic!("{name}: {whole:?} whole, {pieces:?} in pieces"),
        }
    }
}

fn any_sample() -> impl Strategy<Value = (&'static str, Vec<u8>)> {
    proptest::sample::select(files::all())
}

fn any_format() -> impl Strategy<Value = Option<Format>> {
    proptest::sample::select(Format::ALL.map(Some).into_iter().chain([None]).collect::<Vec<_>>())
}

/// Bytes with a meaning in some format.
const TELLING: &[u8] = b"0123456789-+.eE \n\r\t#/,;\\\"xyzfvn\0\xff\x80";

fn any_byte() -> impl Strategy<Value = u8> {
    prop_oneof![any::<u8>(), proptest::sample::select(TELLING)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn changed_bytes(
        (name, mut bytes) in any_sample(),
        changes in proptest::collection::vec((any::<proptest::sample::Index>(), any_byte()), 1..12),
    ) {
        for (index, byte) in changes {
            let at = index.index(bytes.len());
            bytes[at] = byte;
        }
        check(&bytes, None, name);
    }

    #[test]
    fn changed_headers(
        (name, mut bytes) in any_sample(),
        changes in proptest::collection::vec((0_usize..500, any_byte()), 1..4),
    ) {
        for (at, byte) in changes {
            let at = at % bytes.len();
            bytes[at] = byte;
        }
        check(&bytes, None, name);
    }

    #[test]
    fn lines_left_out_doubled_or_exchanged(
        (name, bytes) in any_sample(),
        a in any::<proptest::sample::Index>(),
        b in any::<proptest::sample::Index>(),
        what in 0..3,
    ) {
        let mut lines: Vec<&[u8]> = bytes.split_inclusive(|&b| b == b'\n').collect();
        let (a, b) = (a.index(lines.len()), b.index(lines.len()));
        match what {
            0 => drop(lines.remove(a)),
            1 => lines.insert(b, lines[a]),
            _ => lines.swap(a, b),
        }
        check(&lines.concat(), None, name);
    }

    #[test]
    fn numbers_replaced(
        (name, bytes) in any_sample(),
        which in any::<proptest::sample::Index>(),
        number in proptest::sample::select(vec![
            "0", "-1", "1e999", "nan", "18446744073709551615", "18446744073709551616", "4294967296",
            "9223372036854775807", "-9223372036854775808", "99999999999999999999999", "1.5", "x", "",
        ]),
    ) {
        let digits: Vec<usize> = (0..bytes.len())
            .filter(|&i| bytes[i].is_ascii_digit() && (i == 0 || !bytes[i - 1].is_ascii_digit()))
            .collect();
        prop_assume!(!digits.is_empty());
        let start = digits[which.index(digits.len())];
        let length = bytes[start..].iter().take_while(|b| b.is_ascii_digit()).count();
        let mut changed = bytes;
        changed.splice(start..start + length, number.bytes());
        check(&changed, None, name);
    }

    #[test]
    fn read_as_another_format((name, bytes) in any_sample(), format in any_format()) {
        check(&bytes, format, name);
    }

    #[test]
    fn noise(bytes in proptest::collection::vec(any_byte(), 1..200), format in any_format()) {
        check(&bytes, format, "noise");
    }
}

#[test]
fn cut_off_anywhere() {
    let mut refused = 0;
    for (name, bytes) in files::all() {
        check(&bytes, None, name);
        for end in 0..bytes.len() {
            check(&bytes[..end], None, name);
            refused += usize::from(read_bytes(&bytes[..end], None, Path::new(name)).is_err());
        }
        // Formats with counts detect every cut, except within the last number or line end.
        if ["ply", "pcd", "las", "laz", "npy"].iter().any(|ending| name.ends_with(ending)) {
            for end in 0..bytes.len() - 11 {
                let cut = read_bytes(&bytes[..end], None, Path::new(name));
                assert!(cut.is_err(), "{name} cut after {end} of {} bytes", bytes.len());
            }
        }
    }
    assert!(refused > 5000, "only {refused} cuts were noticed");
}
