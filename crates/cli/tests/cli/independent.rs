//! A comparison of the points read with those of independent readers: laspy with lazrs, plyfile,
//! pye57, trimesh and NumPy, if `cargo xtask readers` has installed them.

use std::path::{Path, PathBuf};
use std::process::Command;

use nearmiss_testdata::files;

use crate::running::Place;

/// The folder of the repository.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// The formats that independent readers know.
const ENDINGS: [&str; 11] = ["las", "laz", "e57", "ply", "npy", "xyz", "csv", "stl", "off", "glb", "gltf"];

/// Returns real files, if the folder `shared` is beside the repository.
fn real() -> Vec<PathBuf> {
    let folder = Path::new(ROOT).join("../shared/data");
    let mut found = Vec::new();
    for part in ["formats", "scans", "buildings", "objects"] {
        let entries = std::fs::read_dir(folder.join(part)).into_iter().flatten().flatten();
        found.extend(entries.map(|entry| entry.path()));
    }
    found.retain(|path| path.extension().is_some_and(|ending| ENDINGS.iter().any(|known| ending == *known)));
    found.sort();
    found
}

#[test]
fn the_points_are_those_of_independent_readers() {
    let python = Path::new(ROOT).join("target/readers/bin/python");
    if !python.exists() {
        eprintln!("skipped: no independent readers; `cargo xtask readers` installs them");
        return;
    }
    let place = Place::new();
    let mut paths = Vec::new();
    for (name, bytes) in files::all() {
        if ENDINGS.iter().any(|ending| name.ends_with(ending)) {
            paths.push(place.write(name, bytes));
        }
    }
    assert!(paths.len() >= 14, "{paths:?}");
    paths.extend(real());
    let output = Command::new(python)
        .arg(Path::new(ROOT).join("xtask/readers/compare.py"))
        .arg(env!("CARGO_BIN_EXE_nearmiss"))
        .args(&paths)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    print!("{said}");
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(said.lines().count(), paths.len(), "{said}");
}
