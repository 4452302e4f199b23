//! `sweep`.

use nearmiss_testdata::shapes::sphere;

use crate::meshes::cubes;
use crate::running::{Place, keys, numbers, sorted};

/// Returns a folder with a ball of radius 1, and three paths: into another one, past it, and of one
/// pose.
fn place() -> Place {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.08);
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm"]);
    place.write("into.txt", "6 0 0 0 0 0 1\n-6 0 0 0 0 0 1\n");
    place.write("past.txt", "# past it\n6 0 0 0 0 0 1\n0 4 0 0 0 0 1\n");
    place.write("one.txt", "3 0 0 0 0 0 1\n");
    place
}

#[test]
fn impacts_and_free_motions_are_told_in_json_and_in_words() {
    let place = place();
    let ask = |path: &str, more: &[&str]| {
        let args = [&["sweep", "ball.nm", "ball.nm", "--path", path][..], more].concat();
        place.ok(&args)
    };
    let told = ask("into.txt", &["--json"]).json().remove(0);
    let expected = "verdict evidence t_free t_hit contact clearance clearance_at clearance_upper reason band \
                    distances contacts intervals evaluations node_pairs leaf_pairs micros";
    assert_eq!(keys(&told), sorted(expected));
    assert_eq!(told["verdict"], "impact", "{told}");
    let [free, hit] = ["t_free", "t_hit"].map(|key| told[key].as_f64().unwrap());
    // The balls touch when their centres are 2 apart.
    assert!(free < hit && free > 0.31 && (hit - 1.0 / 3.0).abs() < 0.01, "{told}");
    let point = numbers(&told["contact"]["point"]);
    assert!((point[0] - 1.0).abs() < 0.2 && point[1].abs() < 0.3, "{told}");
    assert_eq!(told["clearance"], serde_json::Value::Null, "{told}");
    let people = ask("into.txt", &[]).results;
    assert!(
        people.starts_with("They touch at t = 0.33") && people.contains("proven free up to t = 0.3"),
        "{people}"
    );
    assert!(people.contains("distance quer") && people.contains("node pair"), "{people}");

    let told = ask("past.txt", &["--json"]).json().remove(0);
    assert_eq!((&told["verdict"], &told["evidence"]), (&"free".into(), &"certified".into()), "{told}");
    assert_eq!(told["t_free"], 1.0, "{told}");
    let [kept, upper] = ["clearance", "clearance_upper"].map(|key| told[key].as_f64().unwrap());
    // The line from (6, 0, 0) to (0, 4, 0) is 3.33 from the origin.
    assert!(kept > 0.4 && kept <= upper && upper < 2.1, "{told}");
    let people = ask("past.txt", &[]).results;
    assert!(
        people.starts_with("The whole motion is free (certified): the distance is always at least "),
        "{people}"
    );
    let near = ask("past.txt", &["--clearance", "1.5", "--json"]).json().remove(0);
    assert_eq!(near["verdict"], "impact", "{near}");
    assert!(
        ask("past.txt", &["--clearance", "1.5"]).results.contains("come within 1.5 of each other at t = "),
        "told"
    );
    let still = ask("one.txt", &["--json"]).json().remove(0);
    assert_eq!((&still["verdict"], &still["t_free"]), (&"free".into(), &0.0.into()), "{still}");
    let short = ask("into.txt", &["--work", "20", "--json"]).json().remove(0);
    assert_eq!((&short["verdict"], &short["reason"]), (&"undecided".into(), &"budget".into()), "{short}");
    assert!(
        ask("into.txt", &["--work", "20"]).results.starts_with("Cannot tell: the budget ran out"),
        "told"
    );
    let balls = ask("into.txt", &["--thickened", "0.1", "--json"]).json().remove(0);
    assert!((balls["t_hit"].as_f64().unwrap() - 3.8 / 12.0).abs() < 0.01, "{balls}");
}

#[test]
fn a_picture_shows_the_motion_and_the_distance() {
    let place = place();
    for path in ["into.txt", "past.txt", "one.txt"] {
        place.ok(&["sweep", "ball.nm", "ball.nm", "--path", path, "--image", "sweep.png"]);
        let (width, pixels) = place.picture("sweep.png");
        let painted = pixels.chunks(3).filter(|p| p.iter().any(|&c| c < 200)).count();
        assert!(width > 1000 && painted > 5000, "{path}: {painted} pixels");
    }
}

#[test]
fn a_picture_shows_a_mesh_as_a_scan_of_it() {
    let place = cubes();
    place.cloud("ball.xyz", sphere(1.0), 0.08);
    place.write("past.txt", "6 0 0 0 0 0 1\n0 4 0 0 0 0 1\n");
    place.ok(&["sample", "cube.obj", "-o", "cube.ply", "--spacing", "0.08", "--quiet"]);
    let painted = |[a, b]: [&str; 2], as_mesh: &[&str]| {
        let args = ["--path", "past.txt", "--view", "40,30", "--image", "sweep.png"];
        place.ok(&[&["sweep", a, b][..], as_mesh, &args].concat());
        let (width, pixels) = place.picture("sweep.png");
        // The middle of the left half: the motion.
        let rows: Vec<&[u8]> = pixels.chunks(3 * width).skip(100).take(width / 2 - 200).collect();
        let part = |row: &&[u8]| row[300..3 * (width / 2 - 100)].to_vec();
        rows.iter().flat_map(part).collect::<Vec<u8>>()
    };
    for (which, order) in [("a", [0, 1]), ("b", [1, 0])] {
        let ordered = |cube| order.map(|k| [cube, "ball.xyz"][k]);
        let scan = painted(ordered("cube.ply"), &[]);
        let mesh = painted(ordered("cube.obj"), &["--as-mesh", which]);
        let is_ground = |pixel: &[u8]| pixel.iter().all(|&c| c > 225);
        let things = scan.chunks(3).filter(|pixel| !is_ground(pixel)).count();
        let pairs = scan.chunks(3).zip(mesh.chunks(3));
        let differ = pairs.filter(|(p, q)| is_ground(p) != is_ground(q)).count();
        assert!(things > 20_000 && differ < things / 20, "{which}: {differ} of {things} pixels differ");
    }
}

#[test]
fn two_meshes_are_swept_by_their_triangles() {
    let place = cubes();
    place.write("into.txt", "6 0.1 0 0 0 0 1\n-6 0.1 0 0 0 0 1\n");
    place.write("past.txt", "6 3 0 0 0 0 1\n-6 3 0 0 0 0 1\n");
    let ask = |b: &str, path: &str, more: &[&str]| {
        let args = ["sweep", "cube.obj", b, "--as-mesh", "both", "--path", path];
        place.ok(&[&args[..], more].concat())
    };
    let told = ask("cube.obj", "past.txt", &["--json"]).json().remove(0);
    assert_eq!((&told["verdict"], &told["evidence"]), (&"free".into(), &"certified".into()), "{told}");
    let [kept, upper] = ["clearance", "clearance_upper"].map(|key| told[key].as_f64().unwrap());
    assert!(kept > 0.7 && kept <= 1.0 && (1.0..1.1).contains(&upper), "{told}");
    for b in ["cube.obj", "cube.nm"] {
        let told = ask(b, "into.txt", &["--json", "--image", "sweep.png"]).json().remove(0);
        let [free, hit, band] = ["t_free", "t_hit", "band"].map(|key| told[key].as_f64().unwrap());
        // Their edges are 2 long.
        let (exact, off) = ((6.0 - 2.0) / 12.0, band / 12.0);
        assert!(free <= exact && exact - free < off && (hit - exact).abs() < off, "{told}");
        assert_eq!(told["evidence"], "certified", "{told}");
        let (wide, pixels) = place.picture("sweep.png");
        let painted = pixels.chunks(3).filter(|p| p.iter().any(|&c| c < 200)).count();
        assert!(wide > 1000 && painted > 5000, "{painted} pixels");
    }
    let people = ask("cube.nm", "into.txt", &["--clearance", "0.5"]).results;
    assert!(people.starts_with("They come within 0.5 of each other at t = "), "{people}");
    let args = ["sweep", "cube.obj", "cube.obj", "--path", "into.txt", "--as-mesh", "both"];
    for more in [&["--thickened", "0.1"][..], &["--surface-only"], &["--kernel", "euclidean"]] {
        place.refused(2, &[&args[..], more].concat(), &["two meshes", more[0]]);
    }
}

#[test]
fn paths_that_are_no_motion_are_refused_with_their_line() {
    let place = place();
    place.write("grows.txt", "1 0 0 3 0 1 0 0 0 0 1 0 0 0 0 1\n2 0 0 3 0 2 0 0 0 0 2 0 0 0 0 1\n");
    place.write("empty.txt", "# nothing\n");
    place.write("nan.txt", "3 0 0 0 0 0 1\nnan 0 0 0 0 0 1\n");
    let refused = |path: &str, words: &[&str]| {
        place.refused(1, &["sweep", "ball.nm", "ball.nm", "--path", path], words);
    };
    refused("grows.txt", &["line 2", "expected one scale along a path, got 1 and then 2"]);
    refused("empty.txt", &["expected poses, got none"]);
    refused("nan.txt", &["line 2"]);
    refused("missing.txt", &["missing.txt"]);
    let args = ["sweep", "ball.nm", "ball.nm", "--path", "into.txt"];
    place.refused(2, &args[..3], &["--path"]);
    place.refused(2, &[&args[..], &["--clearance", "-1"]].concat(), &["--clearance"]);
    place.refused(2, &[&args[..], &["--image", "sweep.jpg"]].concat(), &[".png"]);
}
