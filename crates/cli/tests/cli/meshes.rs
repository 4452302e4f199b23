//! Meshes: `preprocess --as-mesh`, `inspect`, `mesh-collide` and `--as-mesh` of other commands.

use std::fmt::Write as _;

use nearmiss_testdata::dragon::{Dragon, dragon_path};
use serde_json::Value;

use crate::running::{Place, keys, name, numbers, shift, sorted};

const FIELDS: &str = "verdict evidence reason witness normal_a normal_b residual source_a source_b gap \
                      distance_estimate band likelihood probability region triangles evaluations node_pairs \
                      leaf_pairs micros";

/// The faces of a cube with edges of length 2 about the origin, as OBJ with corners that repeat, and
/// with a triangle that is there twice and one without area.
fn cube() -> String {
    let corner = |i: u8| [i & 1, i >> 1 & 1, i >> 2 & 1].map(|bit| 2.0 * f64::from(bit) - 1.0);
    let quads: [[u8; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut text = String::new();
    for [x, y, z] in quads.as_flattened().iter().map(|&i| corner(i)) {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for first in (1..).step_by(4).take(6) {
        writeln!(text, "f {} {} {} {}", first, first + 1, first + 2, first + 3).unwrap();
    }
    text + "f 1 2 3\nf 1 2 2\n"
}

/// Returns a folder with a prepared cube.
pub(crate) fn cubes() -> Place {
    let place = Place::new();
    place.write("cube.obj", cube());
    place.ok(&["preprocess", "cube.obj", "-o", "cube.nm", "--as-mesh", "--quiet"]);
    place
}

#[test]
fn a_mesh_is_prepared_and_described() {
    let place = Place::new();
    place.write("cube.obj", cube());
    let told = place.ok(&["preprocess", "cube.obj", "-o", "cube.nm", "--as-mesh", "--json"]).json().remove(0);
    let fields = "triangles vertices dropped welded_vertices bounds nodes leaves depth_mean bytes seconds";
    assert_eq!(keys(&told), sorted(fields));
    assert_eq!((&told["triangles"], &told["vertices"]), (&12.into(), &8.into()));
    assert_eq!(told["dropped"], serde_json::json!({"degenerate": 1, "duplicate": 1}));
    assert_eq!((&told["welded_vertices"], told["bounds"][1][2].as_f64()), (&16.into(), Some(1.0)));
    assert_eq!(told["bytes"], place.path("cube.nm").metadata().unwrap().len());
    assert_eq!(keys(&told["seconds"]), sorted("read hierarchy write"));

    let seen = place.ok(&["inspect", "cube.nm", "--json"]).json().remove(0);
    assert_eq!(keys(&seen), sorted(&(fields.replace("seconds", "format_version"))));
    for key in ["triangles", "vertices", "dropped", "welded_vertices", "bounds", "bytes", "leaves"] {
        assert_eq!(seen[key], told[key], "{key}");
    }
    let people = place.ok(&["inspect", "cube.nm", "--verify"]).results;
    assert!(people.contains("triangles  12 (1 degenerate triangle, 1 duplicate dropped)"), "{people}");
    assert!(people.contains("vertices   8 (16 welded to others)"), "{people}");
    assert!(people.ends_with("verified   all checksums, ids and numbers are valid\n"), "{people}");

    let welded = ["preprocess", "cube.obj", "-o", "flat.nm", "--as-mesh", "--weld", "4", "--threads", "2"];
    place.refused(1, &welded, &["cube.obj: expected a mesh with at least one triangle of positive area"]);
}

#[test]
fn options_of_scans_do_not_apply_to_meshes() {
    let place = Place::new();
    place.write("cube.obj", cube());
    let prepare = ["preprocess", "cube.obj", "-o", "cube.nm", "--as-mesh"];
    for options in [
        &["--graph"][..],
        &["--kernel", "geodesic"],
        &["--radius-neighbours", "8"],
        &["--voxel", "0.1"],
        &["--crop", "0,0,0,1,1,1"],
        &["--scanner", "0,0,0"],
        &["--leaf", "4"],
    ] {
        place.refused(
            2,
            &[&prepare[..], options].concat(),
            &["--as-mesh", options[0], "cannot be used with"],
        );
    }
    place.refused(2, &["preprocess", "cube.obj", "-o", "cube.nm", "--weld", "0.1"], &["--as-mesh"]);
    for command in ["collide", "distance"] {
        let asked = [command, "cube.obj", "cube.obj", "--as-mesh"];
        for options in [&["--thickened", "0.1"][..], &["--surface-only"]] {
            place.refused(2, &[&asked[..], &["both"], options].concat(), &["--as-mesh", options[0]]);
        }
        let refused = [&asked[..], &["a", "--image", "x.png"]].concat();
        place.refused(
            2,
            &refused,
            &["--as-mesh a: expected options that apply to a mesh and a scan", "--image"],
        );
    }
    for options in [
        &["--prove", "x"][..],
        &["--resolution", "1"],
        &["--method", "sampling"],
        &["--order", "sides"],
        &["--flat"],
    ] {
        let asked = ["collide", "cube.obj", "cube.obj", "--as-mesh", "b"];
        place.refused(2, &[&asked[..], options].concat(), &["--as-mesh b", options[0]]);
    }
    place.refused(
        2,
        &["collide", "cube.obj", "cube.obj", "--as-mesh", "both", "--margin", "1"],
        &["--margin"],
    );
}

#[test]
fn what_is_no_mesh_is_refused_with_the_command_to_use() {
    let place = cubes();
    place.write("points.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 0\n1 0 1\n0 1 1\n1 1 1\n2 2 2\n");
    place.write("shapes.jsonl", "{\"sphere\":{\"centre\":[3,0,2],\"radius\":0.5}}\n");
    place.ok(&["preprocess", "points.xyz", "-o", "points.nm", "--quiet"]);
    let no_faces = ["points.xyz: expected a mesh, got points without faces", "name a file with faces"];
    place.refused(1, &["preprocess", "points.xyz", "-o", "out.nm", "--as-mesh"], &no_faces);
    place.refused(1, &["mesh-collide", "cube.nm", "points.xyz"], &no_faces);
    let no_mesh = ["points.nm: expected a prepared mesh, got a prepared scan", "`preprocess --as-mesh`"];
    place.refused(1, &["mesh-collide", "cube.nm", "points.nm"], &no_mesh);
    place.refused(1, &["distance", "points.nm", "cube.nm", "--as-mesh", "both"], &no_mesh);
    let no_scan = ["cube.nm: expected a prepared scan, got a prepared mesh", "`mesh-collide`", "`sample`"];
    for args in [
        &["collide", "cube.nm", "points.nm"][..],
        &["distance", "points.nm", "cube.nm"],
        &["clash", "cube.nm", "cube.nm"],
        &["curve", "cube.nm", "points.nm", "-o", "curve.ply"],
        &["touch", "cube.nm", "--shapes", "shapes.jsonl"],
        &["export", "cube.nm", "--points", "p.ply"],
        &["poses", "cube.nm", "points.nm", "--sweep", "-o", "poses.jsonl"],
    ] {
        place.refused(1, args, &no_scan);
    }
    let again = ["preprocess", "cube.nm", "-o", "out.nm", "--as-mesh"];
    place.refused(1, &again, &["cube.nm: expected a point cloud or mesh, got a prepared scan or mesh"]);
    let mut damaged = std::fs::read(place.path("cube.nm")).unwrap();
    let last = damaged.len() - 200;
    damaged[last] ^= 1;
    place.write("damaged.nm", damaged);
    place.refused(1, &["inspect", "damaged.nm", "--verify"], &["damaged.nm: damaged section"]);
    place.refused(
        1,
        &["mesh-collide", "damaged.nm", "cube.nm", "--verify"],
        &["damaged.nm: damaged section"],
    );
}

#[test]
fn every_verdict_about_meshes_has_all_fields() {
    let place = cubes();
    let ask = |options: &[&str]| {
        let answer = place.ok(&[&["mesh-collide", "cube.nm", "cube.nm", "--json"], options].concat());
        let answer = answer.json().remove(0);
        assert_eq!(keys(&answer), sorted(FIELDS));
        for null in ["residual", "source_a", "source_b", "distance_estimate", "likelihood"] {
            assert!(answer[null].is_null(), "{null} of {answer}");
        }
        assert_eq!(answer["band"], 0.0);
        answer
    };
    let hit = ask(&["--pose-b", &shift(1.5, 0.3, 0.2)]);
    assert_eq!((&hit["verdict"], &hit["evidence"]), (&"intersecting".into(), &"certified".into()));
    assert_eq!(hit["probability"], 1.0);
    let at = numbers(&hit["witness"]);
    let on = |p: &[f64]| {
        p.iter().any(|x| (x.abs() - 1.0).abs() < 1e-12) && p.iter().all(|x| x.abs() < 1.0 + 1e-12)
    };
    assert!(on(&at) && on(&[at[0] - 1.5, at[1] - 0.3, at[2] - 0.2]), "on both cubes: {hit}");
    let triangles = numbers(&hit["triangles"]);
    assert!(triangles.len() == 2 && triangles.iter().all(|&i| i < 14.0), "{hit}");

    // Faces that touch count.
    assert_eq!(ask(&["--pose-b", &shift(2.0, 0.3, 0.2)])["verdict"], "intersecting");
    let miss = ask(&["--pose-b", &shift(2.0 + 1e-9, 0.3, 0.2)]);
    assert_eq!((&miss["verdict"], &miss["evidence"]), (&"separated".into(), &"certified".into()));
    assert_eq!((&miss["probability"], &miss["gap"]), (&0.0.into(), &0.0.into()));
    assert!(miss["witness"].is_null() && miss["triangles"].is_null(), "{miss}");
    // A mesh within another one does not touch it.
    assert_eq!(ask(&["--pose-b", "0.5 0 0 0 0 0.5 0 0 0 0 0.5 0 0 0 0 1"])["verdict"], "separated");

    let short = ask(&["--pose-b", &shift(1.5, 0.3, 0.2), "--work", "0"]);
    assert_eq!((&short["verdict"], &short["reason"]), (&"undecided".into(), &"budget".into()));
    assert!(short["probability"] == 0.5 && short["evidence"].is_null(), "{short}");
    assert!(numbers(&short["region"]["centre"]).len() == 3 && hit["region"].is_null(), "{short}");
    let likely = ask(&["--pose-b", &shift(0.5, 0.3, 0.2), "--p-min", "0.0001", "--k-min", "1"]);
    assert_eq!(likely["verdict"], "undecided");
    assert!((0.0..=1.0).contains(&likely["probability"].as_f64().unwrap()), "{likely}");
    let words =
        |options: &[&str]| place.ok(&[&["mesh-collide", "cube.nm", "cube.nm"], options].concat()).results;
    assert!(words(&["--pose-b", &shift(1.5, 0.3, 0.2)]).starts_with("They touch at ("));
    let apart = words(&["--pose-b", &shift(3.0, 0.0, 0.0)]);
    assert!(apart.starts_with("No contact; 1.00000 apart (certified).\n"), "{apart}");
    assert!(words(&["--pose-b", &shift(9.0, 0.0, 0.0)]).contains("hint: the bounding boxes are 7 apart"));
    assert!(words(&["--budget", "0us"]).starts_with("Undecided: they touch with a probability of "));

    // The same from a raw file, and by the option of collide.
    for asked in [
        &["mesh-collide", "cube.obj", "cube.nm"][..],
        &["collide", "cube.nm", "cube.nm", "--as-mesh", "both"],
    ] {
        let mut again =
            place.ok(&[asked, &["--json", "--pose-b", &shift(1.5, 0.3, 0.2)]].concat()).json().remove(0);
        again["micros"] = hit["micros"].clone();
        assert_eq!(again, hit, "{asked:?}");
    }
    // Other units: the cube in millimetres beside one in metres.
    let scaled = ["--units-a", "mm", "--units-b", "m", "--pose-b", &shift(1.0005, 0.0, 0.0)];
    assert_eq!(ask(&scaled)["verdict"], "intersecting");
    let refused = ["mesh-collide", "cube.nm", "cube.nm", "--pose-b", "1 0.01 0 0 0 1 0 0 0 0 1 0 0 0 0 1"];
    place.refused(1, &refused, &["--pose-b: expected a rotation", "a ten-thousandth of the diagonal"]);
}

#[test]
fn distances_of_meshes_are_exact() {
    let place = cubes();
    let ask = |options: &[&str]| {
        let asked = ["distance", "cube.nm", "cube.nm", "--as-mesh", "both", "--json"];
        place.ok(&[&asked[..], options].concat()).json().remove(0)
    };
    let told = ask(&["--pose-b", &shift(3.0, 3.0, 0.0)]);
    let fields = "lower upper points band evidence triangles evaluations node_pairs leaf_pairs micros";
    assert_eq!(keys(&told), sorted(fields));
    let [lower, upper] = ["lower", "upper"].map(|key| told[key].as_f64().unwrap());
    assert!(lower.to_bits() == upper.to_bits() && (upper - 2.0_f64.sqrt()).abs() < 1e-12, "{told}");
    assert_eq!((&told["band"], &told["evidence"]), (&0.0.into(), &"certified".into()));
    let p = [0, 1].map(|k| numbers(&told["points"][k]));
    let apart = (0..3).map(|k| (p[0][k] - p[1][k]).powi(2)).sum::<f64>().sqrt();
    assert!((apart - upper).abs() < 1e-12, "{told}");
    let short = ask(&["--pose-b", &shift(3.0, 3.0, 0.0), "--work", "1"]);
    assert_eq!(short["complete"], false, "{short}");
    assert!(
        short["lower"].as_f64().unwrap() <= upper && short["upper"].as_f64().unwrap() >= upper,
        "{short}"
    );
    let people =
        place.ok(&["distance", "cube.nm", "cube.nm", "--as-mesh", "both", "--pose-b", &shift(3.0, 0.0, 0.0)]);
    assert!(people.results.starts_with("They are 1.00000 apart (certified)."), "{}", people.results);
}

#[test]
fn all_contacts_of_meshes_form_closed_curves() {
    let place = cubes();
    let asked = ["mesh-collide", "cube.nm", "cube.nm", "--pose-b", &shift(1.5, 0.3, 0.2), "--all"];
    let told =
        place.ok(&[&asked[..], &["--json", "--csv", "c.csv", "--ply", "c.ply"]].concat()).json().remove(0);
    let fields = format!("{FIELDS} complete contact_count contacts link clashes");
    assert_eq!(keys(&told), sorted(&fields));
    assert_eq!(told["complete"], true);
    let contacts = told["contacts"].as_array().unwrap();
    assert_eq!(told["contact_count"].as_u64().unwrap(), contacts.len() as u64);
    // The segments of one closed curve around the overlap: as many ends meet as there are.
    let length: f64 = contacts
        .iter()
        .map(|contact| {
            let ends = [0, 1].map(|k| numbers(&contact["ends"][k]));
            (0..3).map(|k| (ends[0][k] - ends[1][k]).powi(2)).sum::<f64>().sqrt()
        })
        .sum();
    // Two faces at right angles of either cube: 1.7 + 1.8 at x = 1, the same at x = 0.5, and 4 times 0.5.
    let outline = 2.0 * (1.7 + 1.8) + 2.0 * 0.5;
    assert!((length - outline).abs() < 1e-9, "{length} instead of {outline}");
    assert_eq!(told["clashes"].as_array().unwrap().len(), 1, "{told}");
    let of_clash = "contacts centre size bounds depth depth_lower depth_direction point triangles";
    assert_eq!(keys(&told["clashes"][0]), sorted(of_clash));
    assert!(told["clashes"][0]["depth"].is_null(), "{told}");
    // They overlap by 0.5 along x, and by more along y and z.
    let deep = place.ok(&[&asked[..], &["--penetration", "--json"]].concat()).json().remove(0);
    let clash = &deep["clashes"][0];
    let (depth, lower) = (clash["depth"].as_f64().unwrap(), clash["depth_lower"].as_f64().unwrap());
    assert!((depth - 0.5).abs() < 1e-5 && lower > 0.4 && lower <= depth, "{clash}");
    assert!(numbers(&clash["depth_direction"])[0] > 0.999, "{clash}");
    let people = place.ok(&[&asked[..], &["--penetration"]].concat()).results;
    assert!(people.contains(" 0.5 deep"), "{people}");
    let table = std::fs::read_to_string(place.path("c.csv")).unwrap();
    assert_eq!(table.lines().count(), contacts.len() + 1);
    assert!(table.starts_with("clash,x,y,z,normal_a_x,") && table.contains("to_z,triangle_a,triangle_b\n"));
    let ply = std::fs::read(place.path("c.ply")).unwrap();
    let head = format!("element vertex {}\n", contacts.len());
    assert!(String::from_utf8_lossy(&ply).contains(&head), "{head}");
    let people = place.ok(&asked).results;
    assert!(people.contains(&format!("{} contacts in 1 clash ", contacts.len())), "{people}");
    assert!(people.lines().filter(|line| line.contains("between triangle")).count() == contacts.len() + 1);
    let few = place.ok(&[&asked[..], &["--json", "--work", "4"]].concat()).json().remove(0);
    assert_eq!(few["complete"], false, "{few}");
}

#[test]
fn paths_of_meshes_are_answered_in_order_on_any_number_of_threads() {
    let place = Place::new();
    let dragon = dragon_path(Dragon::Points5k);
    place.ok(&["preprocess", name(&dragon), "-o", "dragon.nm", "--as-mesh", "--quiet"]);
    let lines: String = (0..1500_u32)
        .map(|i| format!("{} {} 0.01 0.01 0 0 0 1\n", 0.5 * f64::from(i), 0.3 - 0.0002 * f64::from(i)))
        .collect();
    place.write("path.tum", lines);
    let answers = |options: &[&str]| {
        let asked = ["mesh-collide", "dragon.nm", "dragon.nm", "--poses", "path.tum", "--json"];
        let mut answers = place.ok(&[&asked[..], options].concat()).json();
        answers.iter_mut().for_each(|answer| answer["micros"] = Value::Null);
        answers
    };
    let expected = answers(&[]);
    let hits = expected.iter().filter(|answer| answer["verdict"] == "intersecting").count();
    assert!(expected.len() == 1500 && (300..1200).contains(&hits), "{hits} of {} hit", expected.len());
    assert!(answers(&["--threads", "3"]) == expected, "on three threads");
    let first = answers(&["--first", "--threads", "2"]);
    let number = expected.iter().position(|answer| answer["verdict"] == "intersecting").unwrap() + 1;
    assert_eq!(first.len(), number, "up to the first contact");

    // A shorter path, with table, plot and summary.
    let text = std::fs::read_to_string(place.path("path.tum")).unwrap();
    let short: String = text.lines().step_by(50).map(|line| format!("{line}\n")).collect();
    place.write("short.tum", short);
    for command in [&["mesh-collide"][..], &["distance", "--as-mesh", "both"]] {
        let asked = ["dragon.nm", "dragon.nm", "--poses", "short.tum", "--csv", "t.csv", "--plot", "t.svg"];
        let done = place.ok(&[command, &asked].concat());
        let summary = done.results.lines().last().unwrap();
        assert!(summary.starts_with("30 poses: ") && summary.contains("touch (first on line "), "{summary}");
        let table = std::fs::read_to_string(place.path("t.csv")).unwrap();
        for (i, row) in table.lines().skip(1).enumerate() {
            let row: Vec<&str> = row.split(',').collect();
            assert_eq!(row[2], expected[50 * i]["verdict"], "{row:?}");
            let [lower, upper] = [5, 6].map(|k| row[k].parse::<f64>().unwrap());
            assert!(
                lower.to_bits() == upper.to_bits() && (upper == 0.0) == (row[2] == "intersecting"),
                "{row:?}"
            );
        }
        let plot = std::fs::read_to_string(place.path("t.svg")).unwrap();
        assert!(plot.starts_with("<svg") && !plot.contains("NaN"), "{plot}");
    }
    place.write("faulty", "0 0 0 0 0 0 1\nnonsense\n");
    let done = place.run(&["mesh-collide", "dragon.nm", "dragon.nm", "--poses", "faulty"]);
    assert!(done.status == 1 && done.results.starts_with("line 1: They touch"), "{}", done.results);
    assert!(done.errors.contains("faulty: line 2: "), "{}", done.errors);
}

#[test]
fn a_penetration_tells_how_to_get_meshes_apart() {
    let place = cubes();
    let ask = |options: &[&str]| {
        let asked = ["mesh-collide", "cube.nm", "cube.nm", "--penetration", "--json"];
        let answer = place.ok(&[&asked[..], options].concat()).json().remove(0);
        assert_eq!(keys(&answer), sorted(&format!("{FIELDS} penetration")));
        answer
    };
    let deep = ask(&["--pose-b", &shift(1.5, 0.3, 0.2)]);
    let found = &deep["penetration"];
    assert_eq!(keys(found), sorted("lower upper direction evidence"));
    let [lower, upper] = ["lower", "upper"].map(|key| found[key].as_f64().unwrap());
    assert!(lower > 0.45 && lower <= 0.5 && (0.5..0.5001).contains(&upper), "{deep}");
    let way = numbers(&found["direction"]);
    assert!((way[0] - 1.0).abs() < 1e-6, "{deep}");
    // Moved by that much they are apart.
    let moved: Vec<f64> = [1.5, 0.3, 0.2].iter().zip(&way).map(|(x, u)| x + upper * u).collect();
    let apart = ask(&["--pose-b", &shift(moved[0], moved[1], moved[2])]);
    assert!(apart["verdict"] == "separated" && apart["penetration"].is_null(), "{apart}");
    // One inside the other overlaps it.
    let inside = ask(&["--pose-b", "0.5 0 0 0 0 0.5 0 0 0 0 0.5 0 0 0 0 1"]);
    let depth = inside["penetration"]["upper"].as_f64().unwrap();
    assert!(inside["verdict"] == "separated" && (1.5..1.5001).contains(&depth), "{inside}");
    let short = ask(&["--pose-b", &shift(1.5, 0.3, 0.2), "--work", "10"]);
    assert!(short["penetration"]["complete"] == false, "{short}");
    assert!(short["penetration"]["upper"].as_f64().unwrap() >= upper, "{short}");

    let asked = ["mesh-collide", "cube.nm", "cube.nm", "--penetration", "--pose-b", &shift(1.5, 0.3, 0.2)];
    let words = place.ok(&asked).results;
    assert!(words.contains("Moving b by 0.500"), "{words}");
    assert!(words.contains(" along (1.00000, 0.00000, 0.00000) separates them; no move below 0."), "{words}");
    place.write("poses.txt", "1.5 0 0 0 0 0 1\n5 0 0 0 0 0 1\n");
    let many =
        place.ok(&["mesh-collide", "cube.nm", "cube.nm", "--penetration", "--poses", "poses.txt"]).results;
    assert_eq!(many.matches("Moving b by").count(), 1, "{many}");
}

#[test]
fn pictures_of_meshes_show_contacts_and_gaps() {
    let place = cubes();
    for (x, file) in [(1.5, "hit.png"), (3.0, "miss.png")] {
        let pose = shift(x, 0.3, 0.2);
        let asked = ["mesh-collide", "cube.nm", "cube.nm", "--pose-b", &pose, "--image", file, "--quiet"];
        place.ok(&asked);
        let bytes = std::fs::read(place.path(file)).unwrap();
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() > 5000, "{file}: {} bytes", bytes.len());
    }
    place.ok(&[
        "collide",
        "cube.nm",
        "cube.nm",
        "--as-mesh",
        "both",
        "--image",
        "same.png",
        "--view",
        "30,20",
    ]);
    place.refused(2, &["mesh-collide", "cube.nm", "cube.nm", "--image", "x.jpg"], &["x.jpg", ".png"]);
    place.refused(2, &["mesh-collide", "cube.nm", "cube.nm", "--view", "30,20"], &["--image"]);
}
