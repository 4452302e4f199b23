//! `slices start`, `reach` and `route`.

use std::fs;

use nearmiss_testdata::house::{STOREY, house, scanned};
use serde_json::Value;

use crate::running::{Place, keys, numbers, sorted, text};
use crate::slicing::with_house;

fn told(place: &Place, args: &[&str]) -> Value {
    place.ok(&[&["slices"], args, &["--json", "--quiet"]].concat()).json().remove(0)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

#[test]
fn a_place_to_start_serves() {
    let place = with_house();
    let near = told(&place, &["start", "house", "--near", "9,6.5,0.1"]);
    assert_eq!(keys(&near), sorted("position distance floor"));
    assert!((0.1..0.6).contains(&number(&near["distance"])) && near["floor"] == 0, "{near}");
    let any = told(&place, &["start", "house"]);
    assert!(any["distance"].is_null() && any["floor"] == 0, "{any}");
    for found in [&near, &any] {
        let [x, y, z] = numbers(&found["position"])[..] else { panic!("{found}") };
        place.write("route.json", format!("{{\"start\":[{x},{y},{z}],\"points\":[]}}"));
        let walked = place.ok(&["slices", "walk", "house", "--route", "route.json"]).results;
        assert!(walked.contains("0 blocked, 0 falling"), "{walked}");
    }
    let people = place.ok(&["slices", "start", "house", "--near", "9,6.5,0.1"]).results;
    assert!(people.starts_with("Nearest place to stand: [") && people.ends_with(" away.\n"), "{people}");
    // Places are accepted in the form in which they are printed.
    let spot = people.split(['[', ']']).nth(1).unwrap();
    for spot in [spot.replace(' ', ""), spot.to_owned(), format!("[{spot}]"), format!("({spot})")] {
        told(&place, &["reach", "house", "--start", &spot]);
    }
    place.refused(2, &["slices", "reach", "house", "--start", "[1,2,3"], &["expected three numbers"]);
    let people = place.ok(&["slices", "start", "house"]).results;
    assert!(people.starts_with("A place to start: ["), "{people}");
}

#[test]
fn reach_is_told_painted_and_listed() {
    let place = with_house();
    let files = ["--csv", "r.csv", "--image", "r.png"];
    let reach = told(&place, &[&["reach", "house", "--start", "3,6,0.1"][..], &files].concat());
    assert_eq!(keys(&reach), sorted("start places area bounds floors step seconds"));
    let floors = reach["floors"].as_array().unwrap();
    assert_eq!(floors.len(), 2, "by the stairs: {reach}");
    let mut sum = 0.0;
    for (floor, height) in floors.iter().zip([0.0, STOREY]) {
        assert_eq!(keys(floor), sorted("height places area"));
        assert!((number(&floor["height"]) - height).abs() < 0.03, "{reach}");
        assert!((number(&floor["area"]) - number(&floor["places"]) * 0.0025).abs() < 1e-6, "{reach}");
        sum += number(&floor["area"]);
    }
    assert!((number(&reach["area"]) - sum).abs() < 1e-6 && (40.0..300.0).contains(&sum), "{reach}");
    let csv = fs::read_to_string(place.path("r.csv")).unwrap();
    assert!(csv.starts_with("x,y,z\n"));
    assert_eq!(csv.lines().count() as u64, 1 + reach["places"].as_u64().unwrap());
    let (low, high) = (numbers(&reach["bounds"][0]), numbers(&reach["bounds"][1]));
    for line in csv.lines().skip(1) {
        let p: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        assert!((0..3).all(|k| low[k] <= p[k] && p[k] <= high[k]), "{line}");
    }
    assert!(fs::read(place.path("r.png")).unwrap().starts_with(b"\x89PNG"));
    // Whoever climbs little stays below, unless it falls from above.
    let low = told(&place, &["reach", "house", "--start", "3,6,0.1", "--climb", "0.1"]);
    assert_eq!(low["floors"][1]["places"], 0, "{low}");
    let above = ["reach", "house", "--start", "10,8,3", "--climb", "0.1"];
    assert_eq!(told(&place, &above)["floors"][0]["places"], 0);
    let falls = told(&place, &[&above[..], &["--falls"]].concat());
    assert!(number(&falls["floors"][0]["places"]) > 1000.0, "{falls}");
    let people = place.ok(&["slices", "reach", "house", "--start", "3,6,0.1"]).results;
    assert!(
        people.starts_with("Within reach of (3.00, 6.00, 0.0") && people.contains("floor      at z = "),
        "{people}"
    );
}

/// Along any axis, a route is a file that `walk` takes as it is.
#[test]
fn a_route_is_found_and_walked_without_a_stop() {
    let points = scanned(&house(), 0.04, 0.003, 3);
    for (up, turn) in [
        ("z", (|p: [f64; 3]| p) as fn([f64; 3]) -> [f64; 3]),
        ("-y", |[x, y, z]| [x + 0.1, -z, y + 1.0 / 3.0]),
    ] {
        let place = Place::new();
        let turned: Vec<[f64; 3]> = points.iter().map(|p| turn(*p)).collect();
        place.write("house.xyz", text(&turned));
        place.ok(&["slices", "build", "house.xyz", "-o", "house", "--pixel", "0.05", "--up", up, "--quiet"]);
        let spot = |p: [f64; 3]| turn(p).map(|x| x.to_string()).join(",");
        let (from, to) =
            (format!("--from={}", spot([2.0, 8.0, 0.1])), format!("--to={}", spot([14.0, 9.0, STOREY])));
        let files = ["-o", "route.json", "--image", "r.png"];
        let route = told(&place, &[&["route", "house", &from, &to][..], &files].concat());
        assert_eq!(
            keys(&route),
            sorted("found route length lattice_length end nearest away seconds"),
            "{up}: {route}"
        );
        assert!(route["found"] == true && route["nearest"].is_null() && route["away"].is_null(), "{route}");
        let length = number(&route["length"]);
        assert!(length > 12.0 && length <= number(&route["lattice_length"]), "{up}: {route}");
        let saved: Value = serde_json::from_slice(&fs::read(place.path("route.json")).unwrap()).unwrap();
        assert_eq!(saved, route["route"]);
        assert_eq!(keys(&saved), sorted("start points"));
        assert!(fs::read(place.path("r.png")).unwrap().starts_with(b"\x89PNG"));
        let walk = ["slices", "walk", "house", "--route", "route.json", "--json"];
        let steps = place.ok(&walk).json();
        assert!(steps.iter().all(|step| step["blocked"] == false && step["falling"] == false), "{up}");
        assert_eq!(steps.last().unwrap()["position"], route["end"], "{up}");
        assert!((2..60).contains(&saved["points"].as_array().unwrap().len()), "{up}: {saved}");
        let people = place.ok(&["slices", "route", "house", &from, &to]).results;
        assert!(people.starts_with("A route of "), "{people}");
    }
}

#[test]
fn the_place_that_is_proposed_for_a_goal_is_within_reach() {
    let place = with_house();
    // In the wall of the stairs, above the floor, and upstairs with a climb too low for the stairs.
    for (goal, climb) in [("9,6.5,0.1", "0.35"), ("3,6,1.5", "0.35"), ("10,8,4", "0.1")] {
        let route = ["slices", "route", "house", "--from", "3,6,0.1", "--climb", climb, "--to"];
        let done = place.run(&[&route[..], &[goal]].concat());
        assert_eq!(done.status, 1, "{goal}: {}", done.errors);
        let told = done.errors.split_once("nearest place within reach of the start: ").map(|it| it.1);
        let (proposed, _) =
            told.and_then(|it| it.split_once("], ")).unwrap_or_else(|| panic!("{}", done.errors));
        let proposed = format!("{proposed}]");
        let people = place.ok(&[&route[..], &[&proposed]].concat()).results;
        assert!(people.starts_with("A route of "), "{goal}: {proposed}: {people}");
    }
}

#[test]
fn where_there_is_no_route_that_is_told() {
    let place = with_house();
    let route = ["slices", "route", "house", "--from", "3,6,0.1"];
    let upstairs = [&route[..], &["--to", "10,8,3", "--climb", "0.1"]].concat();
    let done = place.run(&[&upstairs[..], &["--json", "--image", "r.png", "-o", "route.json"]].concat());
    assert_eq!(done.status, 1, "{}", done.errors);
    let answer = done.json().remove(0);
    assert!(answer["found"] == false && answer["route"].is_null() && answer["length"].is_null(), "{answer}");
    let away = number(&answer["away"]);
    assert!((2.0..4.0).contains(&away) && numbers(&answer["nearest"]).len() == 3, "{answer}");
    assert!(fs::read(place.path("r.png")).unwrap().starts_with(b"\x89PNG"));
    assert!(!place.path("route.json").exists());
    place.write("w.json", "{}");
    let reach = |more: &[&'static str]| [&["slices", "reach", "house"][..], more].concat();
    for (status, args, words) in [
        (
            1,
            upstairs.clone(),
            &["house", "no route from [3, 6, 0.1] to [10, 8, 3]", "as near as ", "climb"][..],
        ),
        (
            1,
            [&route[..], &["--to", "9,6.5,0.1"]].concat(),
            &["goal [9, 6.5, 0.1] is inside an obstacle; nearest"],
        ),
        (1, [&route[..], &["--to", "3,6,1.5"]].concat(), &["goal [3, 6, 1.5] is in the air; nearest"]),
        (
            1,
            reach(&["--start", "12,8,0.1"]),
            &["start [12, 8, 0.1] is under a ceiling that is too low", "nearest"],
        ),
        (1, reach(&["--start", "-9,8,0.1"]), &["start [-9, 8, 0.1] is outside the map; nearest"]),
        (2, reach(&[]), &["--start"]),
        (2, reach(&["--start", "1,2"]), &["three numbers"]),
        (2, reach(&["--start", "3,6,0.1", "--avatar", "1,1"]), &["three lengths"]),
        (2, reach(&["--start", "3,6,0.1", "--climb", "5"]), &["climb"]),
        (2, reach(&["--start", "3,6,0.1", "--step", "1e-12"]), &["longer step"]),
        (2, reach(&["--start", "3,6,0.1", "--image", "a.jpg"]), &["PNG"]),
        (
            2,
            reach(&["--start", "3,6,0.1", "--image", "a.png", "--csv", "./a.png"]),
            &["--image and --csv", "same file"],
        ),
        (2, reach(&["--start", "3,6,0.1", "--csv", "house/index.nms"]), &["replace the input"]),
        (2, vec!["slices", "start", "house", "--avatar", "90,90,90"], &["smaller avatar"]),
    ] {
        place.refused(status, &args, words);
    }
}

#[test]
fn walks_start_where_somebody_stands() {
    let place = with_house();
    for (start, words) in [
        ("[3,6,1.2]", "w.json: start [3, 6, 1.2] is in the air; nearest place to stand: [3, 6, 0.0"),
        ("[90,6,0]", "w.json: start [90, 6, 0] is outside the map; nearest place to stand: [16"),
        ("[3,6,-1e9]", "is outside the map; nearest place to stand: ["),
        ("[9,6.5,0.1]", "w.json: start [9, 6.5, 0.1] is inside an obstacle; nearest place to stand: ["),
    ] {
        place.write("w.json", format!("{{\"start\":{start},\"points\":[[3,6]]}}"));
        place.refused(
            1,
            &["slices", "walk", "house", "--route", "w.json", "--cache", "40"],
            &[words, " away"],
        );
    }
}
