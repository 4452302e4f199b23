//! `sample`: patterns, distances, numbers of points.

use std::fs;
use std::process::Command;

use crate::running::{Place, keys, sorted};

/// A floor of two triangles.
const RAMP: &str = "v 0 0 0\nv 4 0 0\nv 4 3 1\nv 0 3 1\nf 1 2 3\nf 1 3 4\n";

/// Samples the ramp, and returns the points.
fn sampled(place: &Place, options: &[&str]) -> Vec<[f64; 3]> {
    place.ok(&[&["sample", "ramp.obj", "-o", "points.ply", "--quiet"], options].concat());
    place.ok(&["convert", "points.ply", "points.xyz"]);
    let text = fs::read_to_string(place.path("points.xyz")).unwrap();
    let point = |line: &str| {
        let numbers: Vec<f64> = line.split_whitespace().map(|x| x.parse().unwrap()).collect();
        [numbers[0], numbers[1], numbers[2]]
    };
    text.lines().filter(|line| !line.starts_with('#')).map(point).collect()
}

fn least_distance(points: &[[f64; 3]]) -> f64 {
    let distance = |p: [f64; 3], q: [f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
    let of = |i: usize| points[..i].iter().map(move |q| distance(points[i], *q));
    (1..points.len()).flat_map(of).fold(f64::INFINITY, f64::min)
}

#[test]
fn points_at_a_spacing_are_blue_noise_unless_another_pattern_is_given() {
    let place = Place::new();
    place.write("ramp.obj", RAMP);
    let spaced = ["--spacing", "0.1"];
    let told =
        place.ok(&[&["sample", "ramp.obj", "-o", "r.ply", "--json"], &spaced[..]].concat()).json().remove(0);
    assert_eq!(keys(&told), sorted("points triangles pattern seconds"));
    assert_eq!((&told["triangles"], &told["pattern"]), (&2.into(), &"blue-noise".into()), "{told}");
    let blue = sampled(&place, &spaced);
    assert_eq!(told["points"], blue.len());
    // 4 × √10 of area.
    assert!((900..1200).contains(&blue.len()), "{told}");
    let apart = least_distance(&blue);
    assert!(apart > 0.0949 && apart < 0.11, "{apart}");

    let rows = sampled(&place, &["--spacing", "0.1", "--pattern", "regular"]);
    let random = sampled(&place, &["--spacing", "0.1", "--pattern", "random", "--seed", "2"]);
    assert!(rows.len() > blue.len() && random.len() > rows.len(), "{} {}", rows.len(), random.len());
    assert_ne!(blue, sampled(&place, &["--spacing", "0.1", "--seed", "2"]));
    assert_eq!(blue, sampled(&place, &["--spacing", "0.1", "--seed", "0", "--pattern", "blue-noise"]));
}

#[test]
fn a_number_of_points_is_met_in_blue_noise_and_at_random() {
    let place = Place::new();
    place.write("ramp.obj", RAMP);
    let blue = sampled(&place, &["--points", "1000"]);
    let random = sampled(&place, &["--points", "1000", "--pattern", "random"]);
    assert_eq!((blue.len(), random.len()), (1000, 1000));
    // The densest arrangement of 1000 points on this area is 0.12 apart.
    let apart = [least_distance(&blue), least_distance(&random)];
    assert!(apart[0] > 0.65 * 0.12 && apart[1] < 0.02, "{apart:?}");

    let done = place.ok(&["sample", "ramp.obj", "-o", "a.ply", "--points", "1000", "--seed", "4"]);
    assert!(done.results.starts_with("1000 points on 2 triangles"), "{}", done.results);
    for threads in ["1", "3"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_nearmiss"));
        command.args(["sample", "ramp.obj", "-o", "b.ply", "--points", "1000", "--seed", "4"]);
        let done = command.env("RAYON_NUM_THREADS", threads).current_dir(place.path("")).output().unwrap();
        assert!(done.status.success());
        assert_eq!(fs::read(place.path("a.ply")).unwrap(), fs::read(place.path("b.ply")).unwrap());
    }
}

#[test]
fn samples_that_cannot_be_made_are_refused() {
    let place = Place::new();
    place.write("ramp.obj", RAMP);
    place.write("vertices.obj", "v 0 0 0\nv 4 0 0\nv 4 3 1\n");
    place.write("line.obj", "v 0 0 0\nv 4 0 0\nf 1 2 2\n");
    let refused = |status: i32, mesh: &str, options: &[&str], words: &[&str]| {
        place.refused(status, &[&["sample", mesh, "-o", "s.ply"], options].concat(), words);
    };
    refused(
        2,
        "ramp.obj",
        &["--points", "9", "--pattern", "regular"],
        &["--spacing", "--pattern", "--points"],
    );
    refused(2, "ramp.obj", &[], &["--spacing", "--points"]);
    refused(2, "ramp.obj", &["--points", "0"], &["--points"]);
    refused(2, "ramp.obj", &["--points", "9", "--pattern", "white"], &["white", "blue-noise"]);
    refused(1, "ramp.obj", &["--spacing=-1"], &["ramp.obj", "-1"]);
    refused(1, "ramp.obj", &["--spacing", "1e-7", "--memory", "1TB"], &["ramp.obj", "spacing"]);
    refused(1, "vertices.obj", &["--points", "9"], &["vertices.obj", "faces"]);
    refused(1, "line.obj", &["--points", "9"], &["line.obj", "spacing"]);
}
