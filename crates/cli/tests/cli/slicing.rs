//! `slices` and `sample`.

use std::fs;
use std::io::BufRead;

use nearmiss::slices::SliceFolder;
use nearmiss_testdata::house::{Quad, STAIRS, STOREY, house, scanned, triangles};
use serde_json::Value;

use crate::running::{Place, keys, numbers, sorted, text};

const FIELDS: &str = "slices distinct width height pixel slice_height points dropped obstacle noise noise_estimated bytes seconds";

/// The generated house as points, and its map.
pub(crate) fn with_house() -> Place {
    let place = Place::new();
    place.write("house.xyz", text(&scanned(&house(), 0.04, 0.003, 3)));
    place.ok(&["slices", "build", "house.xyz", "-o", "house", "--pixel", "0.05", "--quiet"]);
    place
}

/// Surfaces as an OBJ file.
pub(crate) fn obj(quads: &[Quad]) -> String {
    let mesh = triangles(quads);
    let vertices = mesh.vertices().iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = mesh.triangles().iter().map(|t| {
        let [a, b, c] = t.map(|v| v + 1);
        format!("f {a} {b} {c}\n")
    });
    vertices.chain(faces).collect()
}

#[test]
fn a_map_is_built_inspected_and_exported() {
    let place = with_house();
    let built = place.ok(&[
        "slices",
        "build",
        "house.xyz",
        "-o",
        "again",
        "--pixel",
        "0.05",
        "--threads",
        "1",
        "--json",
    ]);
    let built = built.json().remove(0);
    assert_eq!(keys(&built), sorted(FIELDS));
    assert_eq!(built["pixel"], 0.05);
    assert!((built["slice_height"].as_f64().unwrap() - 0.15).abs() < 1e-12, "three pixels");
    assert_eq!((&built["width"], &built["height"]), (&321.into(), &241.into()), "{built}");
    for file in fs::read_dir(place.path("house")).unwrap() {
        let file = file.unwrap();
        let other = place.path("again").join(file.file_name());
        assert_eq!(
            fs::read(file.path()).unwrap(),
            fs::read(other).unwrap(),
            "the same on any number of threads"
        );
    }
    let mut told = place.ok(&["slices", "inspect", "house", "--verify", "--json"]).json().remove(0);
    told["seconds"] = built["seconds"].clone();
    let detail = ["bounds", "up", "floors"].map(|field| told.as_object_mut().unwrap().remove(field).unwrap());
    assert_eq!(told, built, "but for what inspect alone tells");
    let [bounds, up, floors] = detail;
    let (low, high) = (numbers(&bounds[0]), numbers(&bounds[1]));
    for (k, end) in [16.0, 12.0].into_iter().enumerate() {
        assert!(low[k] > -0.15 && low[k] < 0.01 && high[k] > end - 0.01 && high[k] < end + 0.15, "{bounds}");
    }
    assert_eq!(up, "z");
    let heights: Vec<f64> =
        floors.as_array().unwrap().iter().map(|floor| floor["height"].as_f64().unwrap()).collect();
    assert!(heights.len() == 2 && heights[0].abs() < 0.03 && (heights[1] - STOREY).abs() < 0.03, "{floors}");
    assert!(floors.as_array().unwrap().iter().all(|floor| floor["area"].as_f64() > Some(40.0)), "{floors}");
    let people = place.ok(&["slices", "inspect", "house"]).results;
    assert!(people.contains("321 × 241 pixels") && people.contains("up is z"), "{people}");
    assert!(
        people.contains("\nbounds     from (-0.0") && people.matches("\nfloor      at z = ").count() == 2,
        "{people}"
    );

    place.ok(&["slices", "export", "house", "-o", "images", "--quiet"]);
    let slices = usize::try_from(built["slices"].as_u64().unwrap()).unwrap();
    assert_eq!(fs::read_dir(place.path("images")).unwrap().count(), slices);
    let decoder = png::Decoder::new(std::io::BufReader::new(
        fs::File::open(place.path("images/slice-0005.png")).unwrap(),
    ));
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((frame.width, frame.height, frame.color_type), (321, 241, png::ColorType::Rgb));
    // Between the floors: black, or green with blue that tells walls from the few pixels that they only
    // graze.
    let mut kinds = [0_u32; 3];
    for pixel in pixels.chunks(3) {
        match pixel {
            [0, 0, 0] => kinds[0] += 1,
            [_, 255, 26] => kinds[1] += 1,
            [_, 255, 255] => kinds[2] += 1,
            other => panic!("{other:?} is no colour of the paper's"),
        }
    }
    assert!(kinds[0] > 60_000 && kinds[2] > 1000 && kinds[1] < kinds[2], "{kinds:?}");
}

#[test]
fn meshes_are_sampled_and_the_papers_rule_can_be_asked_for() {
    let place = Place::new();
    place.write("house.obj", obj(&house()));
    let built = place
        .ok(&["slices", "build", "house.obj", "-o", "map", "--resolution", "200", "--json"])
        .json()
        .remove(0);
    assert_eq!(built["width"], 200, "{built}");
    assert!(
        built["distinct"].as_u64() < built["slices"].as_u64(),
        "walls are the same all the way up: {built}"
    );
    let people = place
        .ok(&["slices", "build", "house.obj", "-o", "map", "--obstacle", "0.07", "--resolution", "200"])
        .results;
    assert!(people.contains("(7.0 % of a slice)"), "{people}");
    // A floor of two triangles has fewer corners than a cloud needs points.
    place.write("ramp.obj", "v 0 0 0\nv 4 0 0\nv 4 3 1\nv 0 3 1\nf 1 2 3\nf 1 3 4\n");
    let built =
        place.ok(&["slices", "build", "ramp.obj", "-o", "ramp", "--pixel", "0.1", "--json"]).json().remove(0);
    assert_eq!((&built["width"], &built["height"]), (&41.into(), &31.into()), "{built}");
}

#[test]
fn what_is_dropped_and_what_noise_is_reckoned_with_is_told() {
    let place = Place::new();
    let mut points = text(&scanned(&house(), 0.04, 0.003, 3));
    points.push_str("nan 1 1\n1 inf 1\n2 2 -inf\n");
    place.write("house.xyz", points);
    let build = ["slices", "build", "house.xyz", "-o", "map", "--pixel", "0.05"];
    let told = |options: &[&str]| {
        let people = place.ok(&[&build[..], options].concat()).results;
        assert!(people.contains(", 3 others left out"), "{people}");
        let told = place.ok(&["slices", "inspect", "map", "--json"]).json().remove(0);
        assert_eq!(told["dropped"], 3, "{told}");
        (people, told)
    };
    let (people, json) = told(&[]);
    let noise = json["noise"].as_f64().unwrap();
    assert!((0.005..0.02).contains(&noise) && json["noise_estimated"] == true, "{json}");
    assert!(people.contains("; noise 0.0") && people.contains(" (estimated)\n"), "{people}");
    let (people, json) = told(&["--noise", "0.02"]);
    assert_eq!((&json["noise"], &json["noise_estimated"]), (&0.02.into(), &false.into()), "{json}");
    assert!(people.contains("; noise 0.02\n"), "{people}");
    let share = json["obstacle"].as_f64().unwrap();
    assert!((share - (0.05 + 0.02) / 0.15).abs() < 1e-12, "{json}");
    let (people, json) = told(&["--obstacle", "0.07"]);
    assert_eq!((&json["noise"], &json["obstacle"]), (&0.0.into(), &0.07.into()), "{json}");
    assert!(people.contains("(7.0 % of a slice)\n") && !people.contains("noise"), "{people}");
    // Slices hardly higher than what a slope of 45° spans: noise has no room.
    let (people, json) = told(&["--slice-height", "0.057"]);
    assert!(json["obstacle"].as_f64().unwrap() < 0.91, "{json}");
    assert!(people.contains("give higher slices"), "{people}");

    place.write("house.obj", obj(&house()));
    let built = place.ok(&["slices", "build", "house.obj", "-o", "of-mesh", "--pixel", "0.1", "--json"]);
    let built = built.json().remove(0);
    assert_eq!((&built["noise"], &built["noise_estimated"]), (&0.0.into(), &false.into()), "{built}");
    assert_eq!(built["dropped"], 0, "{built}");
}

fn answers(place: &Place, args: &[&str]) -> Vec<Value> {
    place.ok(&[&["slices", "query", "house", "--json"], args].concat()).json()
}

#[test]
fn boxes_and_objects_are_answered() {
    let place = with_house();
    place.write(
        "boxes.jsonl",
        "{\"min\":[3,6,0.5],\"max\":[3.5,6.5,2]}\n\n{\"min\":[8.9,6.2,0.5],\"max\":[9.1,6.4,2],\"name\":\"wall\"}\n\
         {\"min\":[10,8,3.2],\"max\":[10.2,8.2,4]}\n{\"min\":[90,0,0],\"max\":[91,1,1]}\n",
    );
    let found = answers(&place, &["--boxes", "boxes.jsonl"]);
    assert_eq!(found.len(), 4);
    for answer in &found {
        assert_eq!(keys(answer), sorted("collides obstacle floor pixels micros"));
    }
    assert_eq!((&found[0]["collides"], &found[0]["pixels"]), (&false.into(), &0.into()), "{}", found[0]);
    assert!(found[0]["floor"].as_f64().unwrap().abs() < 0.02, "{}", found[0]);
    assert_eq!((&found[1]["collides"], &found[1]["obstacle"]), (&true.into(), &true.into()), "{}", found[1]);
    assert!((found[2]["floor"].as_f64().unwrap() - STOREY).abs() < 0.02, "{}", found[2]);
    assert!(found[3]["floor"].is_null(), "{}", found[3]);
    let mean = answers(&place, &["--boxes", "boxes.jsonl", "--floor", "mean"]);
    assert!(
        mean[0]["floor"].as_f64() < found[0]["floor"].as_f64(),
        "the mean of noise is below its greatest"
    );
    let people = place.ok(&["slices", "query", "house", "--boxes", "boxes.jsonl"]).results;
    assert!(people.starts_with("Free; the floor below is at "), "{people}");
    assert!(people.contains("Occupied in ") && people.contains(", with obstacles; "), "{people}");

    let crate_corners: Vec<[f64; 3]> =
        (0..8_u8).map(|i| [0, 1, 2].map(|k| f64::from(i >> k & 1) * 0.5)).collect();
    place.write("crate.xyz", text(&crate_corners));
    place.ok(&["slices", "build", "crate.xyz", "-o", "crate", "--pixel", "0.05"]);
    place.write(
        "poses.jsonl",
        "{\"b\":[0,-1,0,8.9, 1,0,0,6.5, 0,0,1,0.5, 0,0,0,1]}\n\
         {\"a\":[1,0,0,5, 0,1,0,0, 0,0,1,0, 0,0,0,1],\"b\":[0,-1,0,9, 1,0,0,6.5, 0,0,1,0.5, 0,0,0,1]}\n",
    );
    let found = answers(&place, &["--map", "crate", "--poses", "poses.jsonl"]);
    assert_eq!(keys(&found[0]), sorted("collides obstacle floor pixels micros"));
    assert_eq!(found[0]["collides"], false, "turned, it stands before the wall: {}", found[0]);
    assert_eq!(found[1]["collides"], false, "the house is moved: {}", found[1]);
    place.write("into.jsonl", "{\"b\":[1,0,0,8.9, 0,1,0,6.5, 0,0,1,0.5, 0,0,0,1]}\n");
    assert_eq!(
        answers(&place, &["--map", "crate", "--poses", "into.jsonl"])[0]["collides"],
        false,
        "only corners"
    );
    place.write("wall.jsonl", "{\"b\":[1,0,0,9, 0,1,0,6.5, 0,0,1,0.5, 0,0,0,1]}\n");
    let found = answers(&place, &["--map", "crate", "--poses", "wall.jsonl"]);
    assert_eq!(
        (&found[0]["collides"], &found[0]["pixels"]),
        (&true.into(), &4.into()),
        "four corners: {}",
        found[0]
    );
}

#[test]
fn an_avatar_walks_up_the_stairs_and_leaves_a_trace() {
    let place = with_house();
    let y = 0.5 * (STAIRS[0] + STAIRS[1]);
    place.write("route.json", format!("{{\"start\":[1.2,{y},0.1],\"points\":[[8,{y}],[8,9]]}}"));
    let walk = [
        "slices",
        "walk",
        "house",
        "--route",
        "route.json",
        "--cache",
        "3",
        "--trace",
        "t.csv",
        "--image",
        "w.png",
    ];
    let done = place.ok(&[&walk[..], &["--json"]].concat());
    assert!(done.errors.contains("warning: --cache 3 is raised to "), "{}", done.errors);
    let steps = done.json();
    assert!(steps.len() > 150, "{} steps", steps.len());
    for step in &steps {
        assert_eq!(keys(step), sorted("position blocked falling slices hits misses stalls"));
    }
    let last = numbers(&steps.last().unwrap()["position"]);
    assert!(
        (last[0] - 8.0).abs() < 1e-9 && (last[1] - 9.0).abs() < 1e-9 && (last[2] - STOREY).abs() < 0.02,
        "{last:?}"
    );
    let trace = fs::read_to_string(place.path("t.csv")).unwrap();
    assert_eq!(trace.lines().count(), steps.len() + 1);
    assert!(trace.starts_with("distance,x,y,z,blocked,falling\n"), "{trace}");
    assert!(fs::read(place.path("w.png")).unwrap().starts_with(b"\x89PNG"));
    let strip = |steps: &[Value]| -> Vec<Value> {
        steps.iter().map(|step| serde_json::json!([step["position"], step["hits"], step["misses"]])).collect()
    };
    let again = place.ok(&[&walk[..], &["--json"]].concat()).json();
    assert_eq!(strip(&again), strip(&steps), "but for stalls the same again");
    let people = place.ok(&walk).results;
    assert!(people.starts_with("Arrived at (8, 9, 3"), "{people}");
    place.write("wall.json", "{\"start\":[7,6.5,0.1],\"points\":[[12,6.5]]}");
    let people = place.ok(&["slices", "walk", "house", "--route", "wall.json"]).results;
    assert!(people.contains("on the way to point 1: an obstacle is in the way"), "{people}");
}

#[test]
fn walks_without_steps_are_told_as_they_were() {
    let place = with_house();
    for (route, words) in [
        ("[3,6,0.2],\"points\":[]", "Arrived at (3, 6, 0.0"),
        ("[3,6,0.2],\"points\":[[3,6]]", "Arrived at (3, 6, 0.0"),
        ("[3,6,0.2],\"points\":[[3,90]]", "Stopped at (3, "),
        ("[10,6.5,3.3],\"points\":[[10,4.5]]", "Arrived at (10, 4.5, "),
    ] {
        place.write("route.json", format!("{{\"start\":{route}}}"));
        let told = place.ok(&["slices", "walk", "house", "--route", "route.json", "--image", "w.png"]);
        assert!(told.results.contains(words), "{route}: {}", told.results);
        assert!(fs::read(place.path("w.png")).unwrap().starts_with(b"\x89PNG"), "{route}");
    }
}

#[test]
fn a_walk_ends_when_nobody_reads_it() {
    let place = with_house();
    place.write("route.json", "{\"start\":[3,6,0.1],\"points\":[[7,6]]}");
    // Two thousand million steps.
    let args = ["slices", "walk", "house", "--route", "route.json", "--step", "2e-9", "--json"];
    let mut walk = std::process::Command::new(env!("CARGO_BIN_EXE_nearmiss"))
        .args(args)
        .current_dir(place.path(""))
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    std::io::BufReader::new(walk.stdout.take().unwrap()).read_line(&mut line).unwrap();
    assert!(line.starts_with("{\"position\":"), "{line}");
    assert_eq!(walk.wait().unwrap().code(), Some(0));
}

#[test]
fn what_does_not_serve_is_refused_by_name() {
    let place = with_house();
    place.write(
        "flat.xyz",
        text(&(0..20_u8).map(|i| [f64::from(i), f64::from(i % 7), 1.0]).collect::<Vec<_>>()),
    );
    place.write("letters.xyz", "dear all\n");
    place.write("boxes.jsonl", "{\"min\":[0,0,0],\"max\":[1,1,1]}\n{\"min\":[0,0,0],\"max\":[1,1]}\n");
    place.write("empty.jsonl", "\n");
    place.write("inside.jsonl", "{\"min\":[0,0,9],\"max\":[1,1,1]}\n");
    place.write("tilted.jsonl", "{\"b\":[1,0,0,0, 0,0,-1,0, 0,1,0,0, 0,0,0,1]}\n");
    place.write("nan.json", "{\"start\":[1,1,1e999],\"points\":[]}");
    place.write("route.json", "{\"start\":[3,6,0.1],\"points\":[[4,6]]}");
    place.write("far.json", "{\"start\":[3,6,0.1],\"points\":[[4,6],[1e300,6]]}");
    place.write("from-far.json", "{\"start\":[1e300,6,0.1],\"points\":[[4,6]]}");
    let build =
        |options: &[&'static str]| [&["slices", "build", "house.xyz", "-o", "new"][..], options].concat();
    let query = |file: &'static str| vec!["slices", "query", "house", "--boxes", file];
    let walk = |options: &[&'static str]| [&["slices", "walk", "house", "--route"][..], options].concat();
    for (status, args, words) in [
        (1, vec!["slices", "build", "flat.xyz", "-o", "new"], &["flat.xyz", "no extent along z"][..]),
        (1, build(&["--pixel", "0.00001"]), &["house.xyz", "2^31"]),
        (1, build(&["--pixel", "0.002", "--memory", "64MB"]), &["house.xyz", "at most 61 MiB"]),
        (
            1,
            build(&["--pixel", "100", "--slice-height", "1.2e-8", "--obstacle", "0.5"]),
            &["house.xyz", "slices of 1 × 1 pixels", "at most 4096 MiB", "higher slices"],
        ),
        (2, build(&["--pixel", "0"]), &["more than zero"]),
        (2, build(&["--pixel", "1", "--resolution", "3"]), &["cannot be used with"]),
        (2, build(&["--obstacle", "0.1", "--noise", "1"]), &["cannot be used with"]),
        (2, build(&["--max-slope", "90"]), &["below 90"]),
        (2, build(&["--max-slope", "nan"]), &["below 90"]),
        (2, build(&["--noise", "-1"]), &["at least 0"]),
        (2, build(&["--noise", "nan"]), &["at least 0"]),
        (2, build(&["--obstacle", "nan"]), &["above 0"]),
        (2, build(&["--obstacle", "0"]), &["above 0"]),
        (2, build(&["--obstacle", "1"]), &["no wall"]),
        (2, build(&["--pixel", "1e308"]), &["a pixel side above 0", "got 1e308"]),
        (2, build(&["--memory", "0"]), &["expected a size of memory"]),
        (2, vec!["slices", "build", "none.xyz", "-o", "new", "--obstacle", "2"], &["no wall"]),
        // Before the input is read.
        (
            1,
            vec!["slices", "build", "letters.xyz", "-o", "flat.xyz"],
            &["flat.xyz", "cannot make the folder"],
        ),
        (1, vec!["slices", "build", "letters.xyz", "-o", "."], &["other files"]),
        (1, vec!["slices", "build", "letters.xyz", "-o", "new"], &["letters.xyz"]),
        (2, build(&["--up", "w"]), &["expected x, y, z"]),
        (1, vec!["slices", "build", "none.xyz", "-o", "new"], &["none.xyz", "no such file"]),
        (1, vec!["slices", "build", "house.xyz", "-o", "."], &["other files"]),
        (1, vec!["slices", "inspect", "."], &["index.nms", "no such file"]),
        (1, query("boxes.jsonl"), &["boxes.jsonl", "line 2", "column"]),
        (1, query("empty.jsonl"), &["expected boxes, got none"]),
        (1, query("inside.jsonl"), &["line 1", "min at most max"]),
        (2, vec!["slices", "query", "house"], &["--boxes"]),
        (
            1,
            vec!["slices", "query", "house", "--map", "house", "--poses", "tilted.jsonl"],
            &["line 1", "a tilt of"],
        ),
        (1, walk(&["nan.json"]), &["nan.json"]),
        (2, walk(&["route.json", "--avatar", "1,1"]), &["three lengths"]),
        (2, walk(&["route.json", "--climb", "5"]), &["a climb below"]),
        (2, walk(&["route.json", "--climb", "1e300"]), &["a climb below"]),
        (2, walk(&["route.json", "--climb", "1e-15"]), &["a climb of", "greater length"]),
        (2, walk(&["route.json", "--step", "1e-15"]), &["a step of", "greater length"]),
        (2, walk(&["route.json", "--image", "w.jpg"]), &["PNG"]),
        (2, walk(&["route.json", "--image", "./w.png", "--trace", "w.png"]), &["same file"]),
        (2, walk(&["route.json", "--image", "w.png", "--trace", "house/../w.png"]), &["same file"]),
        (1, walk(&["far.json"]), &["far.json", "point 2", "off the map"]),
        (1, walk(&["from-far.json"]), &["from-far.json", "point 0", "off the map"]),
        (1, vec!["sample", "house.xyz", "-o", "s.ply", "--points", "9"], &["house.xyz", "faces"]),
    ] {
        place.refused(status, &args, words);
    }
    assert!(!place.path("new").exists(), "what is refused leaves nothing");
}

#[test]
fn the_slice_that_is_needed_and_missing_is_named() {
    let place = with_house();
    let folder = SliceFolder::open(place.path("house")).unwrap();
    let image = |slice: usize| place.path(&format!("house/{:016x}.nms", folder.checksums()[slice]));
    // By checksum they come in another order.
    let lost = [6, 9, 15, 20, 3];
    assert!(!lost.map(|slice| folder.checksums()[slice]).is_sorted());
    for slice in lost {
        fs::remove_file(image(slice)).unwrap();
    }
    let needs = |slice: f64| {
        let grid = folder.grid();
        let z = grid.origin[2] + (slice + 0.5) * grid.slice_height;
        format!("{{\"min\":[3,6,{z}],\"max\":[3.5,6.5,{z}]}}\n")
    };
    place.write("boxes.jsonl", needs(9.0) + &needs(3.0) + "{\"min\":[90,0,0],\"max\":[91,1,1]}\n");
    let done = place.run(&["slices", "query", "house", "--boxes", "boxes.jsonl", "--json"]);
    assert_eq!(done.status, 1, "{}", done.errors);
    let found = done.json();
    assert!(found[0].is_null() && found[1].is_null() && found[2]["collides"] == false, "{found:?}");
    let said = |done: &str, word: &str| -> Vec<String> {
        let lines = done.lines().filter_map(|line| line.strip_prefix(&format!("{word}: slice ")));
        lines.map(|line| line.split(':').next().unwrap().to_owned()).collect()
    };
    assert_eq!(said(&done.errors, "error"), ["9"], "the first that is needed: {}", done.errors);
    assert_eq!(said(&done.errors, "warning"), ["3", "6", "15", "20"], "{}", done.errors);
    let done = place.run(&["slices", "inspect", "house", "--verify"]);
    assert_eq!(said(&done.errors, "warning"), ["3", "6", "9", "15"], "{}", done.errors);
    assert_eq!(said(&done.errors, "error"), ["20"], "{}", done.errors);
    assert!(done.errors.ends_with(".nms: no such file; build the slices again\n"), "{}", done.errors);

    // Also where it is the object's.
    place.ok(&["slices", "build", "house.xyz", "-o", "whole", "--pixel", "0.4", "--quiet"]);
    place.write("pose.jsonl", "{\"b\":[1,0,0,50, 0,1,0,0, 0,0,1,0, 0,0,0,1]}\n");
    let done = place.run(&["slices", "query", "whole", "--map", "house", "--poses", "pose.jsonl"]);
    assert_eq!((done.status, said(&done.errors, "error")), (1, vec!["3".to_owned()]), "{}", done.errors);
}
