//! Reading in pieces of files that are longer than the head in which the header is parsed.

use std::fs;
use std::path::Path;

use nearmiss_io::{Pieces, PlyPoints, read_in_pieces};

/// Returns the points of a file, and the largest number of points in a block.
fn gone_over(path: &Path, block: usize) -> (Vec<[f64; 3]>, usize) {
    let Ok(Pieces::Points(pieces)) = read_in_pieces(path, None, block) else { panic!("{}", path.display()) };
    let (mut points, mut most) = (Vec::new(), 0);
    let done = pieces.each(|piece| {
        points.extend_from_slice(&piece.positions);
        most = most.max(piece.len());
    });
    assert!(done.is_ok(), "{done:?}");
    (points, most)
}

#[test]
fn long_files_come_piece_by_piece_and_long_headers_whole() {
    let place = tempfile::tempdir().unwrap();
    let points: Vec<[f64; 3]> = (0..20_000_u16).map(|i| [f64::from(i), f64::from(i % 7), f64::NAN]).collect();
    let mut ply = Vec::new();
    PlyPoints::double(&points).write(&mut ply).unwrap();
    let header = ply.windows(10).position(|window| window == b"end_header").unwrap();
    let comments = "comment said at length\n".repeat(4000);
    let long = [&ply[..header], comments.as_bytes(), &ply[header..]].concat();
    let rows: String = points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    let remarks = "# said at length\n".repeat(5000);
    let pcd = format!("FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nPOINTS {}\nDATA ascii\n{rows}", points.len());
    for (name, bytes, is_whole) in [
        ("a.ply", ply, false),
        ("long.ply", long, true),
        ("a.xyz", rows.clone().into_bytes(), false),
        ("marked.xyz", [b"\xef\xbb\xbf", rows.as_bytes()].concat(), false),
        ("long.xyz", format!("{remarks}{rows}").into_bytes(), true),
        ("a.pcd", pcd.into_bytes(), false),
    ] {
        let path = place.path().join(name);
        fs::write(&path, bytes).unwrap();
        for block in [1 << 10, 1 << 16, 1 << 30] {
            let (found, most) = gone_over(&path, block);
            let bits = |points: &[[f64; 3]]| -> Vec<[u64; 3]> {
                points.iter().map(|p| p.map(|x| if x.is_nan() { 1 } else { x.to_bits() })).collect()
            };
            assert!(bits(&found) == bits(&points), "{name}, blocks of {block}: {} points", found.len());
            // A point takes at least six bytes.
            assert!(is_whole || most <= block / 6 + 1, "{name}, blocks of {block}: {most} at a time");
            assert_eq!(most == points.len(), is_whole || block == 1 << 30, "{name}, blocks of {block}");
        }
    }
}
