//! Tests with real files, skipped unless their folder exists beside the workspace.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use nearmiss_geometry::Aabb;
use nearmiss_io::{Model, Pieces, PointPieces, ReadError, read, read_in_pieces, read_watched};

/// Returns the folder, unless it is missing or the variable `NEARMISS_NO_DATA` is set.
#[expect(clippy::print_stdout, reason = "says why nothing is checked")]
fn data() -> Option<PathBuf> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data"));
    let there = folder.is_dir() && std::env::var_os("NEARMISS_NO_DATA").is_none();
    if !there {
        println!("skipped: no folder {} with real files", folder.display());
    }
    there.then(|| folder.into())
}

#[expect(clippy::disallowed_methods, reason = "a test may look at the clock")]
fn timed<T>(what: impl FnOnce() -> T) -> (T, Duration) {
    let start = std::time::Instant::now();
    let result = what();
    (result, start.elapsed())
}

#[expect(clippy::unwrap_used, reason = "a folder that cannot be listed fails the test")]
fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
            if path.is_dir() {
                folders.push(path);
            } else if endings.is_empty() || endings.contains(&ending) {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

/// Numbers of points, and of triangles after polygons are cut (0 without faces), as catalogued or
/// counted by hand.
const KNOWN: [(&str, usize, usize); 39] = [
    ("objects/dragon-5k.ply", 5_205, 11_102),
    ("objects/dragon-23k.ply", 22_998, 47_794),
    ("objects/dragon-100k.ply", 100_250, 202_520),
    ("objects/happy-buddha-50k.obj", 49_950, 100_000),
    ("objects/bunny-36k.obj", 35_947, 69_451),
    ("objects/beetle-20k.obj", 19_887, 38_656),
    ("objects/igea-134k.ply", 134_345, 268_686),
    ("objects/kitten-5k.xyz", 5_210, 0),
    ("objects/fcl-env.obj", 6_540, 2_180),
    ("objects/fcl-rob.obj", 648, 216),
    ("buildings/two-storey-scan-zup-753k.ply", 753_423, 0),
    ("buildings/sponza.obj", 60_848, 66_450),
    ("buildings/pillars-145k.pcd", 144_640, 0),
    ("buildings/facade-100k.ply", 100_000, 0),
    ("buildings/dungeon.obj", 5_101, 10_133),
    ("scans/room-113k-compressed.pcd", 112_586, 0),
    ("scans/rgbd-108k.pcd", 108_104, 0),
    ("scans/rgbd-organised-nan-307k.pcd", 307_200, 0),
    ("scans/lidar-70k-source.ply", 69_792, 0),
    ("scans/lidar-69k-target.ply", 69_088, 0),
    ("scans/rgbd-normals-120k.ply", 120_111, 0),
    ("scans/office-81k.3d", 81_360, 0),
    ("truth/bunny.ply", 34_835, 69_666),
    ("truth/dragon70k.ply", 69_448, 140_000),
    ("truth/happy-buddha.ply", 57_379, 114_858),
    ("deforming/cloth-ball/cloth_ball92.ply", 46_598, 92_230),
    ("formats/utm17_space.pcd", 10, 0),
    ("buildings/two-storey-scan-808k.laz", 808_042, 0),
    ("scans/lion-342k.copc.laz", 341_989, 0),
    ("formats/1.2-with-color.las", 1_065, 0),
    ("formats/test1_4.las", 1_000, 0),
    ("formats/autzen.las", 106, 0),
    ("formats/autzen.copc.laz", 107, 0),
    ("formats/extrabytes.laz", 1_065, 0),
    ("formats/simple.laz", 1_065, 0),
    ("formats/bunnyFloat.e57", 30_571, 0),
    ("formats/bunnyInt19.e57", 30_571, 0),
    ("formats/gearwheel.ascii.stl", 1_222, 2_444),
    ("formats/gearwheel.bin.stl", 1_222, 2_444),
];

fn given(model: &Model) -> usize {
    model.cloud.len() + model.cloud.dropped().duplicate + model.cloud.dropped().not_finite
}

fn triangles(model: &Model) -> usize {
    model.mesh.as_ref().map_or(0, |mesh| mesh.triangles().len())
}

#[test]
fn known_files_have_their_points_and_faces() {
    let Some(data) = data() else { return };
    for (name, points, faces) in KNOWN {
        let (model, time) = timed(|| read(data.join(name), None));
        let model = model.unwrap_or_else(|e| panic!("{e}"));
        println!("{time:8.1?} {name} {:?}", model.cloud.dropped());
        assert_eq!((given(&model), triangles(&model)), (points, faces), "{name}");
        if let Some(mesh) = &model.mesh {
            assert_eq!(mesh.vertices().len(), points, "{name}");
        }
    }
    let dropped = |name: &str| read(data.join(name), None).unwrap().cloud.dropped();
    assert_eq!(dropped("buildings/two-storey-scan-808k.laz").duplicate, 54_619);
    assert_eq!(dropped("scans/lion-342k.copc.laz").duplicate, 66_134);
    assert_eq!(dropped("scans/room-113k-compressed.pcd").duplicate, 112_586 - 56_159);
    assert_eq!(dropped("scans/rgbd-organised-nan-307k.pcd").not_finite, 57_553);
    assert_eq!(dropped("buildings/two-storey-scan-zup-753k.ply").duplicate, 0);
}

#[test]
fn attributes_come_along() {
    let Some(data) = data() else { return };
    let frame = read(data.join("scans/rgbd-normals-120k.ply"), None).unwrap();
    assert!(frame.cloud.colours().is_some(), "colours");
    let facade = read(data.join("buildings/facade-100k.ply"), None).unwrap();
    for cloud in [&frame.cloud, &facade.cloud] {
        let normals = cloud.normals().expect("normals");
        let unit = normals.iter().filter(|n| {
            let length_sq: f32 = n.iter().map(|x| x * x).sum();
            (length_sq - 1.0).abs() < 1e-2
        });
        assert!(unit.count() * 10 > 9 * normals.len(), "normals are of unit length");
    }
    assert!(read(data.join("scans/rgbd-108k.pcd"), None).unwrap().cloud.colours().is_some());
    assert!(read(data.join("objects/kitten-5k.xyz"), None).unwrap().cloud.normals().is_some(), "unnamed");
}

#[test]
fn every_file_of_a_known_format_reads() {
    let Some(data) = data() else { return };
    let mut count = 0;
    for folder in ["objects", "scans", "buildings", "truth", "deforming", "formats"] {
        for path in files(&data.join(folder), &["ply", "pcd", "obj", "xyz"]) {
            let name = path.strip_prefix(&data).unwrap();
            match read(&path, None) {
                Ok(model) => assert!(given(&model) >= 8, "{}", name.display()),
                // Two samples of the format have only three points.
                Err(ReadError::Cloud { .. }) => {
                    assert!(name.starts_with("formats") && name.to_string_lossy().contains("simple_"));
                }
                Err(other) => panic!("{other}"),
            }
            count += 1;
        }
    }
    assert!(count >= 90, "only {count} files");
    for (sequence, vertices) in
        [("elephant-gallop", 42_321), ("horse-gallop", 8_431), ("horse-collapse", 8_431), ("crane", 10_002)]
    {
        for path in files(&data.join("deforming").join(sequence), &["ply"]) {
            assert_eq!(given(&read(&path, None).unwrap()), vertices, "{}", path.display());
        }
    }
}

#[test]
fn three_encodings_of_a_sphere_agree() {
    let Some(data) = data() else { return };
    let of = |kind: &str| read(data.join(format!("formats/sphere_vnormals_{kind}.ply")), None).unwrap();
    assert_eq!(of("bbe"), of("ble"));
    let (text, binary) = (of("ascii"), of("ble"));
    assert_eq!(text.mesh.unwrap().triangles(), binary.mesh.unwrap().triangles());
    for (a, b) in text.cloud.positions().iter().zip(binary.cloud.positions()) {
        assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-5), "{a:?} {b:?}");
    }
}

#[test]
fn broken_files_get_a_clear_answer_in_time() {
    let Some(data) = data() else { return };
    let files = files(&data.join("malformed"), &[]);
    assert!(files.len() >= 39, "only {} files", files.len());
    for path in files {
        let (answer, time) = timed(|| read(&path, None));
        assert!(time < Duration::from_secs(1), "{} took {time:?}", path.display());
        let name = path.file_name().unwrap().to_string_lossy();
        match answer {
            Ok(model) => println!("ok: {name}: {} points", model.cloud.len()),
            Err(error) => {
                let message = error.to_string();
                println!("{}", message.replace(&*path.parent().unwrap().to_string_lossy(), ""));
                assert!(message.contains(&*name), "names the file: {message}");
                assert!(!message.ends_with('.'), "no full stop: {message}");
            }
        }
    }
}

/// Compares the scan of a building, with y up, and the same scan rotated to z up.
#[test]
fn two_versions_of_a_building_agree_after_their_change_of_axes() {
    let Some(data) = data() else { return };
    let cloud = |name: &str| read(data.join(name), None).unwrap().cloud;
    let (scanned, turned) =
        (cloud("buildings/two-storey-scan-808k.laz"), cloud("buildings/two-storey-scan-zup-753k.ply"));
    let hundredths = |p: [f64; 3]| {
        #[expect(clippy::cast_possible_truncation, reason = "metres")]
        let steps = p.map(|x| (100.0 * x).round() as i32);
        steps
    };
    let mut from: Vec<[i32; 3]> = (0..scanned.len()).map(|i| hundredths(scanned.point(i))).collect();
    let mut to: Vec<[i32; 3]> = (0..turned.len()).map(|i| hundredths(turned.point(i))).collect();
    from.iter_mut().for_each(|p| *p = [p[0], -p[2], p[1]]);
    from.sort_unstable();
    to.sort_unstable();
    assert_eq!(from.len(), 753_423);
    let differ = from.iter().zip(&to).filter(|(a, b)| a != b).count();
    assert_eq!(differ, 0, "{:?} and {:?}", from[0], to[0]);
}

#[test]
fn a_part_of_a_copc_file_is_read_alone() {
    let Some(data) = data() else { return };
    let path = data.join("scans/lion-342k.copc.laz");
    let open = || match read_in_pieces(&path, None, 1 << 20) {
        Ok(Pieces::Points(points)) => points,
        other => panic!("{other:?}"),
    };
    let bounds = Aabb { min: [-4.0, 3.0, -2.0], max: [-3.9, 3.1, -1.8] };
    let count = |points: PointPieces| {
        let (mut all, mut within) = (0, 0);
        let counted = points.each(|some| {
            all += some.len();
            within += some.positions.iter().filter(|p| bounds.contains(**p)).count();
        });
        counted.unwrap();
        (all, within)
    };
    let (all, within) = count(open());
    let (read, found) = count(open().near(bounds));
    assert_eq!((all, found), (341_989, within), "all that lie there are read");
    assert!(read < all / 2, "{read} points are read for {found}");
    assert!(open().has_levels());
    let coarse = open().at_resolution(1.0);
    assert_eq!(count(coarse).0, 35_903, "the root alone");
}

#[test]
fn files_read_in_blocks_equal_files_read_whole() {
    let Some(data) = data() else { return };
    for folder in ["formats", "scans", "objects"] {
        for entry in data.join(folder).read_dir().unwrap() {
            let path = entry.unwrap().path();
            let mut told = 0;
            match (read(&path, None), read_watched(&path, None, &mut |points| told += points)) {
                (Ok(whole), Ok(watched)) => {
                    assert!(format!("{whole:?}") == format!("{watched:?}"), "{}", path.display());
                    let dropped = whole.cloud.dropped();
                    let given = whole.cloud.len() + dropped.duplicate + dropped.not_finite;
                    assert!(told == given || told == 0, "{}: {told} of {given}", path.display());
                }
                (Err(whole), Err(watched)) => assert_eq!(whole.to_string(), watched.to_string()),
                (whole, _) => panic!("{}: {:?} whole only", path.display(), whole.err()),
            }
        }
    }
}
