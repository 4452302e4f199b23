//! `collide --method interpolation`.

use nearmiss_testdata::shapes::sphere;
use serde_json::Value;

use crate::running::{Place, numbers, shift};

const METHOD: [&str; 2] = ["--method", "interpolation"];

fn ask(place: &Place, scans: [&str; 2], options: &[&str]) -> Value {
    let asked = [&["collide", scans[0], scans[1], "--json"], &METHOD[..], options].concat();
    let done = place.ok(&asked);
    assert_eq!(done.results.lines().count(), 1, "{}", done.results);
    done.json().remove(0)
}

/// Returns `true` for a point on the circle of radius 0.8 in which two unit spheres intersect if
/// their centres are 1.2 apart.
fn is_on_the_circle(place: &Value, off: f64) -> bool {
    let p = numbers(place);
    (p[0] - 0.6).abs() < off && (p[1].hypot(p[2]) - 0.8).abs() < off
}

#[test]
fn scans_without_a_graph_are_refused_and_raw_ones_get_one() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.08);
    place.ok(&["preprocess", "ball.xyz", "-o", "bare.nm", "--quiet"]);
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm", "--close-pairs", "--quiet"]);
    for scans in [["bare.nm", "ball.nm"], ["ball.nm", "bare.nm"]] {
        for flat in [&[][..], &["--flat"]] {
            let asked = [&["collide", scans[0], scans[1]], &METHOD[..], flat].concat();
            let remedy = "`nearmiss preprocess INPUT -o bare.nm --graph`, or use --method traversal";
            place.refused(2, &asked, &["bare.nm: expected a proximity graph in both scans", remedy]);
        }
    }
    place.ok(&["preprocess", "ball.xyz", "-o", "graph.nm", "--graph", "--quiet"]);
    let annulus = ["--flat", "--brackets", "annulus"];
    let asked = [&["collide", "graph.nm", "ball.nm"], &METHOD[..], &annulus].concat();
    place.refused(2, &asked, &["graph.nm: expected close pairs", "-o graph.nm --close-pairs`"]);
    ask(&place, ["ball.nm", "graph.nm"], &annulus);
    ask(&place, ["ball.xyz", "graph.nm"], &annulus);
    let touching = shift(1.2, 0.0, 0.0);
    for scans in [["ball.xyz", "ball.xyz"], ["ball.nm", "ball.xyz"], ["ball.xyz", "ball.nm"]] {
        for flat in [&[][..], &["--flat"]] {
            let hit = ask(&place, scans, &[&["--pose-b", &touching], flat].concat());
            assert_eq!((&hit["verdict"], &hit["evidence"]), (&"intersecting".into(), &"certified".into()));
            assert!(is_on_the_circle(&hit["witness"], 0.02), "{hit}");
            assert!(hit["evaluations"].as_u64().unwrap() > 0, "{hit}");
        }
    }
    let stored = ask(&place, ["ball.nm", "ball.nm"], &["--flat", "--pose-b", &touching]);
    let raw = ask(&place, ["ball.xyz", "ball.xyz"], &["--flat", "--pose-b", &touching]);
    assert_eq!(
        (&stored["witness"], &stored["evaluations"]),
        (&raw["witness"], &raw["evaluations"]),
        "a file changes nothing"
    );
}

#[test]
fn all_contacts_are_listed() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.08);
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm", "--close-pairs", "--quiet"]);
    let touching = shift(1.2, 0.0, 0.0);
    for (flat, least) in [(&[][..], 20), (&["--flat"], 8), (&["--flat", "--brackets", "annulus"], 8)] {
        let options = [&["--all", "--pose-b", &touching], flat].concat();
        let told = ask(&place, ["ball.nm", "ball.nm"], &options);
        assert_eq!((&told["verdict"], &told["complete"]), (&"intersecting".into(), &true.into()), "{told}");
        let contacts = told["contacts"].as_array().unwrap();
        assert!(contacts.len() >= least, "{} contacts, {flat:?}", contacts.len());
        for contact in contacts {
            assert!(is_on_the_circle(&contact["point"], 0.05), "{contact}");
        }
        let missed = ask(
            &place,
            ["ball.nm", "ball.nm"],
            &[&["--all", "--pose-b", &shift(2.3, 0.0, 0.0)], flat].concat(),
        );
        assert_eq!((&missed["verdict"], &missed["contacts"]), (&"separated".into(), &Value::Array(vec![])));
    }
}

#[test]
fn numbers_of_the_search_count_or_are_refused() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.04);
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm", "--close-pairs", "--quiet"]);
    // There is no contact, so all points drawn are evaluated.
    let apart = shift(1.7, 1.2, 0.0);
    let evaluations = |options: &[&str]| {
        let options = [&["--flat", "--pose-b", &apart], options].concat();
        ask(&place, ["ball.nm", "ball.nm"], &options)["evaluations"].as_u64().unwrap()
    };
    let few = evaluations(&["--surfels", "5"]);
    let many = evaluations(&["--surfels", "30"]);
    let sure = evaluations(&["--surfels", "30", "--probability", "0.999999"]);
    assert!(0 < few && few < many && many < sure, "{few}, {many}, {sure}");
    assert!(evaluations(&["--surfels", "adapted"]) > 0);
    assert_ne!(evaluations(&["--surfels", "adapted"]), many);
    let touching = shift(1.2, 0.0, 0.0);
    for refinement in ["newton", "sphere", "grid"] {
        let told = ask(
            &place,
            ["ball.nm", "ball.nm"],
            &["--flat", "--refinement", refinement, "--pose-b", &touching],
        );
        assert!(is_on_the_circle(&told["witness"], 0.02), "{refinement}: {told}");
        assert!(told["residual"].as_f64().unwrap() <= 0.1 * 0.08, "{refinement}: {told}");
    }

    let refused = |options: &[&str], words: &[&str]| {
        place.refused(2, &[&["collide", "ball.nm", "ball.nm"], options].concat(), words);
    };
    refused(&["--flat"], &["--flat", "--method"]);
    refused(&["--method", "traversal", "--flat"], &["--flat", "interpolation"]);
    for surfels in ["0", "65537", "some", "-3"] {
        let surfels = format!("--surfels={surfels}");
        refused(&[METHOD[0], METHOD[1], "--flat", &surfels], &["surfels", "adapted"]);
    }
    for probability in ["0", "1", "-0.1", "NaN"] {
        let probability = format!("--probability={probability}");
        refused(&[METHOD[0], METHOD[1], "--flat", &probability], &["probability"]);
    }
    refused(&[METHOD[0], METHOD[1], "--margin", "0.1"], &["margin"]);
}

#[test]
fn a_density_is_measured_derived_and_stored() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.1);
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm", "--close-pairs", "--quiet"]);
    let options = ["density", "ball.nm", "--error", "0.02", "--per-distance", "10", "--json", "--quiet"];
    let told = place.ok(&options).json().remove(0);
    assert_eq!(told["derived"], 216, "30 surfels, one in fifty empty");
    assert!(told["error"].as_f64().unwrap() <= 0.02 && told["tests"] == 130, "{told}");
    assert!(told["samples"].as_u64().unwrap() <= 207, "{told}");
    assert_eq!(place.ok(&[&options[..], &["--store"]].concat()).json().remove(0), told, "the same");
    assert_eq!(place.ok(&["inspect", "ball.nm", "--verify", "--json"]).results.lines().count(), 1);
    place.refused(2, &["density", "ball.xyz", "--store"], &["--store"]);
}
