//! `distance`.

use nearmiss_testdata::shapes::sphere;

use crate::running::{Place, keys, numbers, shift, sorted};

#[test]
fn two_spheres_are_as_far_apart_as_they_are() {
    let place = Place::new();
    place.cloud("one.xyz", sphere(1.0), 0.05);
    let pose = shift(3.0, 0.0, 0.0);
    let asked = ["distance", "one.xyz", "one.xyz", "--pose-b", &pose, "--json"];
    let told = place.ok(&asked).json().remove(0);
    let expected = "lower upper points evidence source_a source_b evaluations node_pairs leaf_pairs micros";
    assert_eq!(keys(&told), sorted(expected));
    let [lower, upper] = ["lower", "upper"].map(|key| told[key].as_f64().unwrap());
    // Both surfaces lie a little inside their spheres.
    assert!(lower > 0.7 && lower <= upper && (1.0..1.01).contains(&upper), "{told}");
    assert_eq!(told["evidence"], "certified", "{told}");
    let points = numbers(&serde_json::json!([told["points"][0][0], told["points"][1][0]]));
    assert!((points[0] - 1.0).abs() < 0.01 && (points[1] - 2.0).abs() < 0.01, "{told}");

    let people = place.ok(&asked[..5]).results;
    assert!(people.starts_with("They are at least 0.") && people.contains(" and at most 1.0"), "{people}");
    let thick = [&asked[..], &["--thickened", "0.25"]].concat();
    let told = place.ok(&thick).json().remove(0);
    assert_eq!(told["lower"], told["upper"], "of points exact");
    assert!((told["upper"].as_f64().unwrap() - 0.5).abs() < 0.02, "{told}");
    assert!(place.ok(&thick[..5]).results.starts_with("They are at least"));

    let short = place.ok(&[&asked[..], &["--work", "40"]].concat()).json().remove(0);
    assert_eq!(short["complete"], false, "{short}");
    let bounds = ["lower", "upper"].map(|key| short[key].as_f64().unwrap());
    assert!(bounds[0] <= lower && bounds[1] >= upper, "{short}");
    assert!(place.ok(&[&asked[..5], &["--budget", "0us"]].concat()).results.contains("budget ran out"));
}

#[test]
fn what_meets_is_at_distance_zero_and_lines_are_answered_in_order() {
    let place = Place::new();
    place.cloud("one.xyz", sphere(1.0), 0.05);
    let pose = shift(1.0, 0.0, 0.0);
    let asked = ["distance", "one.xyz", "one.xyz", "--pose-b", &pose];
    assert!(place.ok(&asked).results.starts_with("They touch (certified)."));
    place.ok(&["poses", "one.xyz", "one.xyz", "--sweep", "--per-distance", "1", "-o", "poses.jsonl"]);
    let told = place.ok(&["distance", "one.xyz", "one.xyz", "--poses", "poses.jsonl", "--json"]).json();
    assert_eq!(told.len(), 13, "a line a pose");
    let upper: Vec<f64> = told.iter().map(|line| line["upper"].as_f64().unwrap()).collect();
    assert!(upper[7..8].iter().all(|&d| d <= 1e-9) && (upper[12] - 1.0).abs() < 0.02, "{upper:?}");
    let people = place.ok(&["distance", "one.xyz", "one.xyz", "--poses", "poses.jsonl"]).results;
    assert!(people.lines().nth(12).unwrap().starts_with("line 13: They are at least"), "{people}");
}

#[test]
fn distances_are_refused_with_a_reason() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    let both = |options: &[&'static str]| [&["distance", "ball.xyz", "ball.xyz"][..], options].concat();
    for (options, word) in [
        (&["--thickened", "-1"][..], "zero or more"),
        (&["--budget", "5"], "units"),
        (&["--pose-b", "1 2 3"], "3 numbers"),
        (&["--thickened", "1", "--kernel", "geodesic"], "cannot be used with"),
    ] {
        place.refused(2, &both(options), &[word]);
    }
    place.refused(1, &["distance", "ball.xyz", "none.xyz"], &["none.xyz", "no such file"]);
}
