//! `convert`, and the attributes that it keeps.

use std::fs;

use nearmiss::io::read;
use nearmiss_testdata::shapes::{Sampling, sphere};

use crate::running::{Place, keys, sorted, text};

/// Returns a table with a class for each point; every third point is ground.
fn table(points: &[[f64; 3]]) -> String {
    let mut table = String::from("x y z classification\n");
    for (i, [x, y, z]) in points.iter().enumerate() {
        table += &format!("{x} {y} {z} {}\n", [2, 5, 6][i % 3]);
    }
    table
}

#[test]
fn round_trips_through_all_formats_are_exact() {
    let place = Place::new();
    // Multiples of a step, so that LAS is exact too.
    let points: Vec<[f64; 3]> = (0..500_i32)
        .map(|i| [i % 20, i / 20 % 5, i / 100].map(|k| 4_000_000.0 + f64::from(k) * 0.125))
        .collect();
    place.write("start.csv", table(&points));
    let mut from = "start.csv".to_owned();
    for to in ["a.ply", "a.pcd", "a.las", "a.laz", "b.las", "a.xyz"] {
        let report = place.ok(&["convert", &from, to, "--json"]).json().remove(0);
        assert_eq!(keys(&report), sorted("read dropped written bytes seconds"));
        assert_eq!((report["read"].as_u64(), report["written"].as_u64()), (Some(500), Some(500)), "{to}");
        let cloud = read(place.path(to), None).unwrap().cloud;
        let places: Vec<[f64; 3]> = (0..500).map(|i| cloud.point(i)).collect();
        assert_eq!(places, points, "{to}");
        let ground = cloud.classes().unwrap().iter().filter(|class| **class == 2).count();
        assert_eq!(ground, 167, "{to}");
        from = to.to_owned();
    }
    place.refused(1, &["convert", "a.npy", "b.ply"], &["a.npy", "no such file"]);
    let done = place.ok(&["convert", "a.xyz", "a.npy"]);
    assert!(done.errors.contains("intensities, classes"), "{}", done.errors);
    place.ok(&["convert", "a.npy", "c.xyz"]);
    assert_eq!(fs::read_to_string(place.path("c.xyz")).unwrap().lines().count(), 500);
    // No temporary files are left.
    assert!(place.files().iter().all(|name| !name.contains("tmp")), "{:?}", place.files());
}

#[test]
fn points_are_chosen_by_box_and_class() {
    let place = Place::new();
    let points = sphere(1.0).sample(Sampling::clean(0.1)).points;
    place.write("all.xyz", table(&points));
    let written = |args: &[&str]| {
        let args = [&["convert", "all.xyz", "part.ply", "--json"], args].concat();
        place.ok(&args).json().remove(0)["written"].as_u64()
    };
    let upper = points.iter().filter(|p| p[2] >= 0.0).count() as u64;
    assert_eq!(written(&["--crop", "-inf,-inf,0,inf,inf,inf"]), Some(upper));
    assert_eq!(written(&["--class", "2"]), Some((points.len() as u64).div_ceil(3)));
    assert_eq!(written(&["--class", "2,5,6"]), Some(points.len() as u64));
    place.refused(1, &["convert", "all.xyz", "x.ply", "--class", "9"], &["all.xyz", "none of its"]);
    place.refused(2, &["convert", "all.xyz", "x.ply", "--class", "300"], &["0 to 255"]);
    place.refused(2, &["convert", "all.xyz", "x.docx"], &["x.docx", "expected ply, pcd"]);
    place.refused(2, &["convert", "all.xyz", "./all.xyz"], &["would replace the input"]);
    place.write("plain.xyz", text(&points));
    place.refused(1, &["convert", "plain.xyz", "x.ply", "--class", "2"], &["have no classes"]);
    // `preprocess` selects classes too.
    let report = place
        .ok(&["preprocess", "all.xyz", "-o", "a.nm", "--json", "--quiet", "--class", "2"])
        .json()
        .remove(0);
    let left_out = points.len() as u64 - (points.len() as u64).div_ceil(3);
    assert_eq!(report["dropped"]["class"].as_u64(), Some(left_out), "{report}");
    place.refused(
        1,
        &["preprocess", "plain.xyz", "-o", "b.nm", "--class", "2"],
        &["plain.xyz", "--class 2", "expected points with classes"],
    );
}

#[test]
fn voxels_and_units() {
    let place = Place::new();
    let mut points = sphere(1.0).sample(Sampling::clean(0.02)).points;
    points.push([f64::NAN, 0.0, 0.0]);
    place.write("all.xyz", text(&points));
    let report = place.ok(&["convert", "all.xyz", "few.ply", "--voxel", "0.1", "--json"]).json().remove(0);
    assert_eq!(report["dropped"]["not_finite"].as_u64(), Some(1));
    place.ok(&["preprocess", "all.xyz", "-o", "few.nm", "--voxel", "0.1", "--quiet"]);
    let in_memory = place.ok(&["inspect", "few.nm", "--json"]).json().remove(0)["points"].as_u64();
    assert_eq!(report["written"].as_u64(), in_memory, "as many cells as in memory");
    place.ok(&["convert", "few.ply", "mm.ply", "--units", "mm"]);
    place.ok(&["convert", "few.ply", "inches.ply", "--units", "in", "--from-units", "mm"]);
    let [metres, mm, inches] =
        ["few.ply", "mm.ply", "inches.ply"].map(|name| read(place.path(name), None).unwrap().cloud);
    for i in 0..metres.len() {
        for k in 0..3 {
            assert!((mm.point(i)[k] - 1000.0 * metres.point(i)[k]).abs() < 1e-3, "point {i}");
            assert!((25.4 * inches.point(i)[k] - metres.point(i)[k]).abs() < 1e-6, "point {i}");
        }
    }
    place.refused(
        2,
        &["convert", "all.xyz", "x.ply", "--voxel", "1e-30"],
        &["cannot be numbered", "larger size"],
    );
}

#[test]
fn parts_and_levels_are_of_copc_alone() {
    let place = Place::new();
    place.write("all.xyz", text(&sphere(1.0).sample(Sampling::clean(0.1)).points));
    place.refused(
        1,
        &["convert", "all.xyz", "x.laz", "--resolution", "0.1"],
        &["all.xyz", "no levels", "use `--voxel`"],
    );
}
