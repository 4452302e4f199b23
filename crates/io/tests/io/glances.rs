//! The estimates of `glance`, compared with the contents of files.

use std::path::Path;

use nearmiss_io::{Format, PlyPoints, glance};

fn points(count: u32) -> Vec<[f64; 3]> {
    (0..count).map(|i| [f64::from(i % 100), f64::from(i / 100), f64::from(i % 7) / 8.0]).collect()
}

fn text(points: &[[f64; 3]]) -> String {
    points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect()
}

fn check(path: &Path, count: u64, tolerance: f64) {
    let Some(seen) = glance(path, None) else { panic!("{} is not recognised", path.display()) };
    let off = seen.points.abs_diff(count) as f64;
    assert!(off <= tolerance * count as f64, "{seen:?} of {count} points in {}", path.display());
    let length = std::fs::metadata(path).map(|data| data.len()).ok();
    assert_eq!(Some(seen.bytes), length, "{}", path.display());
    if let Some(bounds) = seen.bounds {
        assert_eq!((bounds.min[0], bounds.max[2]), (0.0, 0.75), "{}", path.display());
        let high = (count / 100) as f64;
        assert!((0.9 * high..=high).contains(&(bounds.max[1] + 1.0)), "{bounds:?} of {}", path.display());
    }
}

#[test]
fn points_are_counted_without_being_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for count in [200, 30_000, 200_000] {
        let all = points(count);
        let rows = text(&all);
        let mut ply = Vec::new();
        PlyPoints::double(&all).write(&mut ply).unwrap();
        std::fs::write(path("a.ply"), ply).unwrap();
        let pcd =
            format!("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH {count}\nHEIGHT 1\nDATA ascii\n{rows}");
        std::fs::write(path("a.pcd"), pcd).unwrap();
        std::fs::write(path("a.xyz"), &rows).unwrap();
        let vertices: String = rows.lines().map(|row| format!("v {row}\n")).collect();
        let faces: String = (3..count).map(|i| format!("f {} {} {i}\n", i - 2, i - 1)).collect();
        std::fs::write(path("a.obj"), vertices + &faces).unwrap();
        for (name, tolerance) in [("a.ply", 0.0), ("a.pcd", 0.0), ("a.xyz", 0.3), ("a.obj", 0.3)] {
            check(&path(name), u64::from(count), tolerance);
            let has_bounds = glance(path(name), None).unwrap().bounds.is_some();
            assert!(has_bounds == (name != "a.obj") || count == 200, "{name} of {count}");
        }
    }
}

#[test]
fn counts_that_the_file_has_no_space_for_are_not_believed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("vast.ply");
    let header =
        "element vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    for format in ["ascii", "binary_little_endian"] {
        std::fs::write(&path, format!("ply\nformat {format} 1.0\n{header}0 0 0\n1 1 1\n")).unwrap();
        assert!(glance(&path, None).unwrap().points < 10, "{format}");
    }
    std::fs::write(&path, b"\x01\x02 something else").unwrap();
    assert_eq!(glance(&path, Some(Format::Ply)), None);
    assert_eq!(glance(folder.path(), None), None, "a folder");
    assert_eq!(glance(folder.path().join("missing.ply"), None), None);
}
