//! A mesh against a scan: `--as-mesh a` and `b` of `collide` and `distance`.

use crate::meshes::cubes;
use crate::running::{Place, numbers, shift};

/// Returns a folder with a prepared cube, and a prepared floor of 40 × 40 points 0.25 apart at z = 0,
/// about the origin.
fn cube_and_floor() -> Place {
    let place = cubes();
    let row =
        |i: u32| format!("{} {} 0\n", 0.25 * f64::from(i % 40) - 4.875, 0.25 * f64::from(i / 40) - 4.875);
    place.write("floor.xyz", (0..1600).map(row).collect::<String>());
    place.ok(&["preprocess", "floor.xyz", "-o", "floor.nm", "--quiet"]);
    place
}

#[test]
fn a_mesh_and_a_scan_collide_in_either_order() {
    let place = cube_and_floor();
    let mesh_first = |options: &[&str], pose: &str| {
        let asked = ["collide", "cube.nm", "floor.nm", "--as-mesh", "a", "--json", "--pose-a", pose];
        place.ok(&[&asked[..], options].concat()).json().remove(0)
    };
    let scan_first = |options: &[&str], pose: &str| {
        let asked = ["collide", "floor.nm", "cube.nm", "--as-mesh", "b", "--json", "--pose-b", pose];
        place.ok(&[&asked[..], options].concat()).json().remove(0)
    };
    let [sunk, above] = [shift(0.1, 0.2, 0.7), shift(0.1, 0.2, 1.5)];
    for (pose, options, verdict) in [
        (&sunk, &[][..], "intersecting"),
        (&sunk, &["--surface-only"], "intersecting"),
        (&sunk, &["--detail", "verdict", "--evidence", "estimated"], "intersecting"),
        (&above, &[], "separated"),
        (&above, &["--thickened", "0.4"], "separated"),
        (&above, &["--thickened", "0.6"], "intersecting"),
        (&above, &["--margin", "0.6"], "intersecting"),
        (&sunk, &["--work", "0"], "undecided"),
        (&sunk, &["--all"], "intersecting"),
    ] {
        let (one, two) = (mesh_first(options, pose), scan_first(options, pose));
        assert_eq!(
            (&one["verdict"], &two["verdict"]),
            (&verdict.into(), &verdict.into()),
            "{options:?}: {one}"
        );
        assert_eq!(one["witness"], two["witness"], "{options:?}");
        let swapped = [
            ("normal_a", "normal_b"),
            ("normal_b", "normal_a"),
            ("source_a", "source_b"),
            ("source_b", "source_a"),
        ];
        for (of_one, of_two) in swapped {
            assert_eq!(one[of_one], two[of_two], "{options:?}, {of_one}");
        }
        if verdict == "intersecting" {
            let (triangle, point) = (one["source_a"].as_u64().unwrap(), one["source_b"].as_u64().unwrap());
            assert!(triangle < 14 && point < 1600, "{one}");
        }
    }
    let hit = mesh_first(&[], &sunk);
    assert_eq!(hit["evidence"], "certified");
    let at = numbers(&hit["witness"]);
    assert!(
        at[2].abs() < 1e-6 && ((at[0] - 0.1).abs() - 1.0).abs().min(((at[1] - 0.2).abs() - 1.0).abs()) < 1e-6,
        "{hit}"
    );
    let miss = scan_first(&[], &above);
    assert!(
        miss["evidence"] == "certified" && (0.3..=0.5).contains(&miss["gap"].as_f64().unwrap()),
        "{miss}"
    );
}

#[test]
fn answers_about_a_mesh_and_a_scan_are_sentences() {
    let place = cube_and_floor();
    let [sunk, above] = [shift(0.1, 0.2, 0.7), shift(0.1, 0.2, 1.5)];
    let people = |options: &[&str]| {
        place.ok(&[&["collide", "cube.nm", "floor.nm", "--as-mesh", "a"], options].concat()).results
    };
    let words = people(&["--pose-a", &sunk]);
    assert!(
        words.starts_with("They touch at (")
            && words.contains("between triangle ")
            && words.contains(" of a and point "),
        "{words}"
    );
    let words = people(&["--pose-a", &above]);
    assert!(words.starts_with("No contact; between 0.39") && words.contains("(certified)"), "{words}");
    assert!(
        people(&["--pose-a", &shift(0.0, 0.0, 90.0)]).contains("hint: the bounding boxes are 89 apart"),
        "far"
    );
    let words = people(&["--pose-a", &sunk, "--thickened", "0.1"]);
    assert!(words.starts_with("A ball of radius 0.1 meets the mesh at ("), "{words}");
    assert!(
        people(&["--pose-a", &sunk, "--work", "0"]).starts_with("Cannot tell: the budget ran out"),
        "budget"
    );
    // Raw inputs, and inputs of the wrong kind.
    let raw = place.ok(&["collide", "floor.xyz", "cube.obj", "--as-mesh", "b", "--pose-b", &sunk]).results;
    assert!(raw.starts_with("They touch at ("), "{raw}");
    place.refused(
        1,
        &["collide", "cube.nm", "floor.nm", "--as-mesh", "b"],
        &["floor.nm: expected a prepared mesh, got a prepared scan"],
    );
    place.refused(
        1,
        &["collide", "floor.nm", "cube.nm"],
        &["cube.nm: expected a prepared scan, got a prepared mesh", "--as-mesh"],
    );
}

#[test]
fn all_contacts_and_paths_of_a_mesh_and_a_scan() {
    let place = cube_and_floor();
    let sunk = shift(0.1, 0.2, 0.7);
    let asked = ["collide", "cube.nm", "floor.nm", "--as-mesh", "a", "--pose-a", &sunk, "--all"];
    let told =
        place.ok(&[&asked[..], &["--json", "--csv", "c.csv", "--ply", "c.ply"]].concat()).json().remove(0);
    let contacts = told["contacts"].as_array().unwrap();
    assert!(contacts.len() > 4 && told["complete"] == true, "{told}");
    for contact in contacts {
        let [x, y, z] = [0, 1, 2].map(|k| numbers(&contact["point"])[k]);
        assert!(
            z.abs() < 0.1 && (((x - 0.1).abs() - 1.0).abs() < 0.1 || ((y - 0.2).abs() - 1.0).abs() < 0.1),
            "{contact}"
        );
        assert!(numbers(&contact["normal_b"])[2].abs() > 0.99, "the normal of the floor: {contact}");
    }
    let table = std::fs::read_to_string(place.path("c.csv")).unwrap();
    assert_eq!(table.lines().count(), contacts.len() + 1);
    let words = place.ok(&asked).results;
    assert!(words.contains("contacts in 1 clash") && words.contains("between triangle "), "{words}");

    let lines: String = (0..40).map(|i| format!("0 0 {} 0 0 0 1\n", 3.0 - 0.1 * f64::from(i))).collect();
    place.write("path.txt", lines);
    let path = ["cube.nm", "floor.nm", "--as-mesh", "a", "--poses", "path.txt"];
    // Lines place b alone: the floor moves down to the cube and through it.
    let expected: Vec<bool> = (0..40).map(|i| (3.0 - 0.1 * f64::from(i)).abs() < 1.0 + 1e-9).collect();
    for threads in ["1", "2"] {
        let answers = place.ok(&[&["collide"], &path[..], &["--json", "--threads", threads]].concat()).json();
        let hits: Vec<bool> = answers.iter().map(|answer| answer["verdict"] == "intersecting").collect();
        assert_eq!(hits, expected, "{threads} threads");
    }
    let done = place.ok(&[&["collide"], &path[..], &["--csv", "t.csv", "--plot", "t.svg"]].concat());
    assert!(done.results.lines().last().unwrap().starts_with("40 poses: "), "{}", done.results);
    let done = place.ok(&[&["distance"], &path[..], &["--csv", "d.csv", "--plot", "d.svg"]].concat());
    assert!(done.results.lines().last().unwrap().starts_with("40 poses: "), "{}", done.results);
    for table in ["t.csv", "d.csv"] {
        let table = std::fs::read_to_string(place.path(table)).unwrap();
        for (row, hit) in table.lines().skip(1).zip(&expected) {
            assert_eq!(row.split(',').nth(2).unwrap() == "intersecting", *hit, "{row}");
        }
    }
    let first = place.ok(&[&["collide"], &path[..], &["--first", "--json"]].concat()).json();
    assert_eq!(first.len(), 21, "up to the first contact");
}

#[test]
fn the_distance_of_a_mesh_and_a_scan_has_bounds() {
    let place = cube_and_floor();
    let above = shift(0.1, 0.2, 3.0);
    let mesh_first = ["distance", "cube.nm", "floor.nm", "--as-mesh", "a", "--pose-a", &above];
    let scan_first = ["distance", "floor.nm", "cube.nm", "--as-mesh", "b", "--pose-b", &above];
    for (options, exact) in [(&[][..], 2.0), (&["--surface-only"], 2.0), (&["--thickened", "0.5"], 1.5)] {
        let [one, two] = [mesh_first, scan_first]
            .map(|asked| place.ok(&[&asked[..], options, &["--json"]].concat()).json().remove(0));
        let [lower, upper] = ["lower", "upper"].map(|key| one[key].as_f64().unwrap());
        assert!(lower <= exact + 1e-6 && exact - 1e-6 <= upper && upper < exact + 0.05, "{options:?}: {one}");
        assert!(lower > 0.8 * exact, "{one}");
        assert_eq!((&one["lower"], &one["upper"]), (&two["lower"], &two["upper"]), "{options:?}");
        assert_eq!(
            (&one["source_a"], &one["points"][0]),
            (&two["source_b"], &two["points"][1]),
            "{options:?}"
        );
        assert!((numbers(&one["points"][0])[2] - 2.0).abs() < 1e-6, "on the mesh: {one}");
    }
    let words = place.ok(&mesh_first).results;
    assert!(words.starts_with("They are between ") && words.contains("between triangle "), "{words}");
}
