//! `animate`: meshes and scans that deform from file to file.

use std::fmt::Write as _;

use serde_json::Value;

use crate::running::{Place, keys, sorted, text};

const FIELDS: &str = "t bv_updates events update_micros query_micros verdict evidence";

/// Vertices of a square sheet of 21 × 21 at a height, dented in the middle.
fn sheet(height: f64, dent: f64) -> Vec<[f64; 3]> {
    let lattice = (0..441_u32).map(|i| [f64::from(i % 21) - 10.0, f64::from(i / 21) - 10.0]);
    lattice.map(|[x, y]| [x, y, height - dent * (-0.05 * (x * x + y * y)).exp()]).collect()
}

/// A sheet as OBJ, with its faces or without.
fn obj(vertices: &[[f64; 3]], faces: bool) -> String {
    let mut out = String::new();
    for [x, y, z] in vertices {
        writeln!(out, "v {x} {y} {z}").unwrap();
    }
    for i in (1..=420).filter(|i| faces && i % 21 != 0) {
        writeln!(out, "f {} {} {} {}", i, i + 1, i + 22, i + 21).unwrap();
    }
    out
}

/// Frames of a sheet that dents from a height of 4.5 to below 0, as a scan and as a mesh.
fn frames() -> Place {
    let place = Place::new();
    for k in 0..4_u8 {
        let frame = sheet(4.5, 2.0 * f64::from(k));
        place.write(&format!("scan-{k}.xyz"), text(&frame));
        let written = if k == 0 { obj(&frame, true) } else { text(&frame) };
        place.write(&format!("mesh-{k}.{}", if k == 0 { "obj" } else { "xyz" }), written);
    }
    let floor: Vec<[f64; 3]> = sheet(0.0, 0.0).iter().map(|[x, y, z]| [x + 0.3, y + 0.4, *z]).collect();
    place.write("floor.xyz", text(&floor));
    place.write("floor.obj", obj(&floor, true));
    place
}

fn verdicts(told: &[Value]) -> Vec<&str> {
    told.iter().map(|line| line["verdict"].as_str().unwrap()).collect()
}

const SCAN: [&str; 4] = ["scan-0.xyz", "scan-1.xyz", "scan-2.xyz", "scan-3.xyz"];
const MESH: [&str; 4] = ["mesh-0.obj", "mesh-1.xyz", "mesh-2.xyz", "mesh-3.xyz"];

#[test]
fn a_denting_sheet_meets_the_floor_in_the_last_frame() {
    let place = frames();
    for frames in [SCAN, MESH] {
        for floor in ["floor.xyz", "floor.obj"] {
            for method in ["auto", "refit", "rebuild"] {
                let args = [&["animate"], &frames[..], &["--against", floor, "--method", method, "--json"]];
                let told = place.ok(&args.concat()).json();
                assert_eq!(keys(&told[0]), sorted(FIELDS));
                let expected = ["separated", "separated", "separated", "intersecting"];
                assert_eq!(verdicts(&told), expected, "{frames:?} against {floor} by {method}");
                assert!(told.iter().all(|line| line["bv_updates"].as_u64() > Some(20)), "{told:?}");
                let times: Vec<f64> = told.iter().map(|line| line["t"].as_f64().unwrap()).collect();
                assert_eq!(times, [0.0, 1.0, 2.0, 3.0]);
                assert!(told[..2].iter().all(|line| line["evidence"] == "certified"), "{told:?}");
            }
        }
    }
    let args =
        [&["animate"], &SCAN[..], &["--against-frames"], &MESH[..], &["--rate", "4", "--json"]].concat();
    let told = place.ok(&args).json();
    assert_eq!(told.len(), 13, "four times a second for three seconds, with both ends");
    assert!(verdicts(&told).iter().all(|verdict| *verdict == "intersecting"), "two copies: {told:?}");
}

#[test]
fn kinetic_trees_give_the_verdicts_of_refitting() {
    let place = frames();
    let by = |method: &str, partner: &[&str]| {
        let args = [&["animate"], &MESH[..], partner, &["--method", method, "--rate", "20", "--json"]];
        place.ok(&args.concat()).json()
    };
    for partner in [
        &["--against", "floor.obj"][..],
        &["--against-frames", "floor.obj", "floor.obj", "floor.obj", "floor.obj"],
        // Against itself.
        &[],
    ] {
        let [kinetic, refitted] = ["kinetic", "refit"].map(|method| by(method, partner));
        assert_eq!(verdicts(&kinetic), verdicts(&refitted), "{partner:?}");
        assert_eq!(keys(&kinetic[0]), sorted(FIELDS));
        let of = |told: &[Value], field: &str| -> u64 {
            told.iter().filter_map(|line| line[field].as_u64()).sum()
        };
        // The mesh moves rigidly, so nothing of it meets.
        assert!(partner.is_empty() || of(&kinetic, "events") > 0, "{kinetic:?}");
        assert!(of(&kinetic, "bv_updates") < of(&refitted, "bv_updates"), "{partner:?}");
    }
    let refused = [&["animate"], &SCAN[..], &["--against", "floor.obj", "--method", "kinetic"]].concat();
    place.refused(2, &refused, &["--method kinetic", "meshes", "points without faces", "--method refit"]);
}

#[test]
fn pictures_and_pages_show_a_motion() {
    let place = frames();
    for (frames, floor, method) in [(SCAN, "floor.obj", "auto"), (MESH, "floor.obj", "kinetic")] {
        let shown =
            ["--against", floor, "--method", method, "--rate", "4", "--image", "a.png", "--html", "a.html"];
        let told = place.ok(&[&["animate"], &frames[..], &shown[..]].concat());
        assert_eq!(told.results.lines().count(), 14, "13 query times and a summary");
        let png = std::fs::read(place.path("a.png")).unwrap();
        assert_eq!(&png[1..4], b"PNG", "{frames:?}");
        let page = std::fs::read_to_string(place.path("a.html")).unwrap();
        assert_eq!(page.matches("<svg").count(), 4, "{frames:?}: updates, events, update and query time");
        assert!(page.contains("Events") && page.contains("data:image/png;base64,"), "{frames:?}");
    }
    let wrong = [&["animate"], &MESH[..], &["--image", "a.jpg"]].concat();
    place.refused(2, &wrong, &["a.jpg", ".png"]);
    // Asked this often, both ways are tried.
    let often = [&["animate"], &MESH[..], &["--against", "floor.obj", "--rate", "40"]].concat();
    let told = place.ok(&often);
    assert!(
        told.errors.contains("at 40 query times a second; kinetic trees take less time"),
        "{}",
        told.errors
    );
}

#[test]
fn motions_without_a_partner_are_told_and_summed_up() {
    let place = frames();
    let told = place.ok(&[&["animate"], &MESH[..], &["--json"]].concat()).json();
    assert_eq!(verdicts(&told), ["separated"; 4], "the sheet does not meet itself");
    let told = place.ok(&[&["animate"], &SCAN[..], &["--json"]].concat()).json();
    assert!(told.iter().all(|line| line["verdict"].is_null() && line["evidence"].is_null()), "{told:?}");
    let people = place.ok(&[&["animate"], &MESH[..], &["--against", "floor.obj", "--rate", "2"]].concat());
    let lines: Vec<&str> = people.results.lines().collect();
    assert_eq!(lines.len(), 8, "{lines:?}");
    assert!(lines[1].starts_with("0.5 s: separated, certified (moved in "), "{lines:?}");
    assert!(lines[7].starts_with("7 query times: 2 intersecting, 5 separated; "), "{lines:?}");
}

#[test]
fn frames_that_do_not_belong_together_are_refused() {
    let place = frames();
    place.write("short.xyz", text(&sheet(0.0, 0.0)[..400]));
    let mut broken = text(&sheet(4.0, 0.0));
    broken = broken.replacen("4", "nan", 1);
    place.write("broken.xyz", broken);
    place.refused(
        1,
        &["animate", "scan-0.xyz", "short.xyz"],
        &["short.xyz", "expected 441 points", "scan-0.xyz", "400"],
    );
    place.refused(1, &["animate", "mesh-0.obj", "short.xyz"], &["short.xyz", "441 vertices", "400"]);
    place.refused(1, &["animate", "scan-0.xyz", "broken.xyz"], &["broken.xyz", "point", "NaN"]);
    place.refused(
        2,
        &["animate", "scan-0.xyz", "scan-1.xyz", "--against-frames", "mesh-0.obj"],
        &["--against-frames", "2, got 1"],
    );
    place.refused(2, &["animate", "scan-0.xyz", "--rate", "0"], &["--rate", "above 0"]);
    place.refused(2, &["animate"], &["FRAMES"]);
    place.refused(1, &["animate", "scan-0.xyz", "--against", "none.nm"], &["none.nm", "no such file"]);
}
