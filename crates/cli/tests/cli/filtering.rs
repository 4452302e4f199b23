//! Filters of `preprocess`.

use nearmiss_testdata::shapes::{Sampling, sphere};
use serde_json::json;

use crate::running::{Place, keys, text};

/// Returns a ball of radius 1 with a spacing of 0.1, with isolated points before and after it in
/// the list, and the number of points of the ball.
fn ball_and_strays() -> (Vec<[f64; 3]>, usize) {
    let strays: Vec<[f64; 3]> = (0..20_u8).map(|i| [f64::from(i) - 9.5, 5.0, 0.0]).collect();
    let ball = sphere(1.0).sample(Sampling::clean(0.1)).points;
    let points = [&strays[..10], &ball, &strays[10..]].concat();
    (points, ball.len())
}

#[test]
fn every_filter_says_how_many_points_it_removed() {
    let place = Place::new();
    let (points, ball) = ball_and_strays();
    let all = points.len();
    place.write("all.xyz", text(&points));
    for (option, value, field, removed) in [
        ("--crop", "-2,-2,-2,2,2,2", "crop", 20),
        ("--remove-outliers", "6,3", "outliers", 20),
        ("--min-neighbours", "3,0.3", "few_neighbours", 20),
    ] {
        let done = place.ok(&["preprocess", "all.xyz", "-o", "ball.nm", "--json", option, value]);
        let report = &done.json()[0];
        let expected = format!("{option} {value} removed {removed} of ");
        assert!(done.errors.starts_with(&expected) && done.errors.ends_with("points\n"), "{}", done.errors);
        assert_eq!(keys(&report["dropped"]).len(), 4, "{report}");
        assert_eq!(report["dropped"]["filtered"], removed, "{report}");
        assert_eq!(report["dropped"][field], removed, "{report}");
        assert_eq!(report["points"], ball, "{report}");
        let quiet = place.ok(&["preprocess", "all.xyz", "-o", "b.nm", "--json", "--quiet", option, value]);
        assert_eq!(quiet.errors, "", "{option}");
        assert_eq!(quiet.json()[0]["dropped"], report["dropped"], "{option}");
    }
    let done = place.ok(&["preprocess", "all.xyz", "-o", "ball.nm", "--json", "--voxel", "0.25"]);
    let report = &done.json()[0];
    let kept = report["points"].as_u64().unwrap();
    assert!((100..(ball / 2) as u64).contains(&kept), "{report}");
    assert_eq!(report["dropped"]["voxel"].as_u64(), Some(all as u64 - kept), "{report}");
}

#[test]
fn filters_are_applied_in_their_order_and_sources_lead_to_the_input() {
    let place = Place::new();
    let (mut points, ball) = ball_and_strays();
    // Dropped before any filter.
    points.insert(3, [f64::NAN; 3]);
    points.insert(7, points[5]);
    place.write("all.xyz", text(&points));
    let asked = [
        "--min-neighbours",
        "1,0.5",
        "--remove-outliers",
        "4,8",
        "--voxel",
        "0.01",
        "--crop",
        "-9,-2,-2,9,6,2",
    ];
    let done = place.ok(&[&["preprocess", "all.xyz", "-o", "ball.nm", "--json"][..], &asked].concat());
    let options: Vec<&str> = done.errors.lines().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(options, ["--crop", "--voxel", "--remove-outliers", "--min-neighbours"], "{}", done.errors);
    let dropped = &done.json()[0]["dropped"];
    let (outliers, few) = (&dropped["outliers"], &dropped["few_neighbours"]);
    assert_eq!(outliers.as_u64().unwrap() + few.as_u64().unwrap(), 18, "{dropped}");
    let first = json!({"not_finite": 1, "duplicate": 1, "filtered": 20, "crop": 2, "voxel": 0, "outliers": outliers, "few_neighbours": few});
    assert_eq!(*dropped, first);

    let seen = place.ok(&["inspect", "ball.nm", "--verify", "--json"]).json().remove(0);
    assert_eq!(seen["dropped"], json!({"not_finite": 1, "duplicate": 1, "filtered": 20}));
    let touched: Vec<String> = (0..points.len())
        .step_by(17)
        .filter(|i| points[*i].iter().all(|c| c.abs() < 2.0))
        .map(|i| format!("{{\"sphere\":{{\"centre\":{:?},\"radius\":1e-6}}}}", points[i]))
        .collect();
    place.write("shapes.jsonl", touched.join("\n"));
    let answers = place.ok(&["touch", "ball.nm", "--shapes", "shapes.jsonl", "--json"]).json();
    assert!(answers.len() > ball / 20, "{} answers", answers.len());
    let expected = (0..points.len()).step_by(17).filter(|i| points[*i].iter().all(|c| c.abs() < 2.0));
    for (answer, i) in answers.iter().zip(expected) {
        assert_eq!(answer["source"], i, "{answer}");
        assert_eq!(answer["touches"], true, "{answer}");
    }
}

#[test]
fn normals_and_the_graph_follow_the_points_that_stay() {
    let place = Place::new();
    let (points, ball) = ball_and_strays();
    place.write("at.txt", "0 0 1.01\n0.99 0 0\n");
    let values = [1.0, -1.0].map(|side| {
        let row = |[x, y, z]: &[f64; 3]| format!("{x} {y} {z} {} {} {}\n", side * x, side * y, side * z);
        let rows: String = points.iter().map(row).collect();
        place.write("all.csv", format!("x y z nx ny nz\n{rows}"));
        let done = place.ok(&[
            "preprocess",
            "all.csv",
            "-o",
            "ball.nm",
            "--graph",
            "--json",
            "--crop",
            "-2,-2,-2,2,2,2",
        ]);
        assert_eq!(done.json()[0]["points"], ball);
        assert_eq!(done.json()[0]["graph"]["components"], 1);
        let values = place.ok(&["eval", "ball.nm", "--points", "at.txt", "--json"]).json();
        [0, 1].map(|i| values[i]["f"].as_f64().unwrap())
    });
    let [out, inwards] = values;
    assert_eq!(out, inwards.map(|f| -f), "sides follow the normals of the input");
}

#[test]
fn senseless_filters_are_refused() {
    let place = Place::new();
    let points: Vec<[f64; 3]> = ball_and_strays().0.iter().map(|p| p.map(|x| x + 10.0)).collect();
    place.write("all.xyz", text(&points));
    for (option, value, words) in [
        ("--voxel", "0", &["--voxel", "more than zero"][..]),
        ("--voxel", "-0.1", &["--voxel", "more than zero"]),
        ("--remove-outliers", "16", &["--remove-outliers", "K,SIGMA"]),
        ("--remove-outliers", "0,2", &["--remove-outliers", "1 or more"]),
        ("--min-neighbours", "4,nan", &["--min-neighbours", "N,R"]),
        ("--crop", "0,0,0,1,1", &["--crop", "six numbers"]),
        ("--crop", "0,0,1,1,1,0", &["--crop", "expected z0 ≤ z1, got 1 and 0"]),
    ] {
        place.refused(2, &["preprocess", "all.xyz", "-o", "out.nm", option, value], words);
    }
    for (option, value, words) in [
        ("--voxel", "100", &["all.xyz: --voxel 100: ", "at least 8", "smaller"][..]),
        ("--voxel", "1e-300", &["--voxel", "64 bits"]),
        ("--remove-outliers", "100000,1", &["--remove-outliers 100000,1", "fewer neighbours"]),
        ("--min-neighbours", "5,0.001", &["at least 8", "got 0 of", "larger radius"]),
        ("--crop", "30,30,30,40,40,40", &["at least 8", "got 0 of", "make the box larger"]),
    ] {
        place.refused(1, &["preprocess", "all.xyz", "-o", "out.nm", option, value], words);
    }
}
