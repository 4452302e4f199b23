//! `collide`.

use nearmiss_testdata::dragon::{Dragon, dragon_path};
use nearmiss_testdata::shapes::sphere;
use serde_json::Value;

use crate::running::{Place, keys, name, numbers, shift, sorted};

const FIELDS: &str = "verdict evidence reason witness normal_a normal_b residual source_a source_b gap \
                      distance_estimate band likelihood evaluations node_pairs leaf_pairs micros";

fn balls() -> Place {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.08);
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm", "--quiet"]);
    place
}

fn ask(place: &Place, options: &[&str]) -> Value {
    let done = place.ok(&[&["collide", "ball.nm", "ball.nm", "--json"], options].concat());
    assert_eq!(done.results.lines().count(), 1, "{}", done.results);
    let answer = done.json().remove(0);
    assert_eq!(keys(&answer), sorted(FIELDS));
    answer
}

#[test]
fn a_manifold_is_told_when_asked_for() {
    let place = balls();
    let asked = |x: f64| {
        let options = ["--pose-b", &shift(x, 0.0, 0.0), "--detail", "manifold", "--json"];
        place.ok(&[&["collide", "ball.nm", "ball.nm"], &options[..]].concat()).json().remove(0)
    };
    let hit = asked(1.96);
    assert_eq!(keys(&hit), sorted(&format!("{FIELDS} manifold")));
    let places = hit["manifold"].as_array().unwrap();
    assert!((3..=8).contains(&places.len()), "{hit}");
    assert!((places[0]["gap"].as_f64().unwrap() + 0.04).abs() < 0.01, "{hit}");
    for at in places {
        // b is on the side of positive x.
        assert!(numbers(&at["normal"])[0] < -0.8 && (numbers(&at["point"])[0] - 0.98).abs() < 0.05, "{at}");
        assert!(at["source_a"].is_u64() && at["source_b"].is_u64(), "{at}");
    }
    assert_eq!(asked(2.5)["manifold"], Value::Array(Vec::new()));
    let told = place.ok(&[
        "collide",
        "ball.nm",
        "ball.nm",
        "--pose-b",
        &shift(1.96, 0.0, 0.0),
        "--detail",
        "manifold",
    ]);
    assert!(told.results.lines().filter(|line| line.contains("push a along")).count() == places.len());
}

#[test]
fn every_verdict_has_all_fields() {
    let place = balls();
    let touching = shift(1.2, 0.0, 0.0);
    let hit = ask(&place, &["--pose-b", &touching]);
    assert_eq!((&hit["verdict"], &hit["evidence"]), (&"intersecting".into(), &"certified".into()));
    let witness = numbers(&hit["witness"]);
    assert!((witness[0] - 0.6).abs() < 0.02, "the circle x = 0.6: {witness:?}");
    assert!(hit["residual"].as_f64().unwrap() < 1e-6, "{hit}");
    for normal in ["normal_a", "normal_b"] {
        let length: f64 = numbers(&hit[normal]).iter().map(|x| x * x).sum();
        assert!((length - 1.0).abs() < 1e-9, "{normal} of {hit}");
    }
    assert!(hit["source_a"].is_u64() && hit["source_b"].is_u64(), "{hit}");
    for null in ["reason", "gap", "distance_estimate", "likelihood"] {
        assert!(hit[null].is_null(), "{null} of {hit}");
    }

    let quick = ask(&place, &["--pose-b", &touching, "--detail", "verdict"]);
    assert_eq!((&quick["verdict"], &quick["evidence"]), (&"intersecting".into(), &"estimated".into()));
    assert_eq!(quick["evaluations"], 0);

    let miss = ask(&place, &["--pose-b", &shift(2.5, 0.0, 0.0)]);
    assert_eq!(miss["verdict"], "separated");
    assert!(miss["gap"].as_f64().unwrap() <= 0.5, "{miss}");
    assert!(miss["witness"].is_null() && miss["source_a"].is_null() && miss["residual"].is_null(), "{miss}");

    let short = ask(&place, &["--pose-b", &touching, "--work", "3"]);
    assert_eq!((&short["verdict"], &short["reason"]), (&"undecided".into(), &"budget".into()));
    assert!(
        short["evidence"].is_null() && (0.0..=1.0).contains(&short["likelihood"].as_f64().unwrap()),
        "{short}"
    );
    let ample = ask(&place, &["--pose-b", &touching, "--budget", "10s", "--work", "1000000"]);
    assert_eq!(ample["verdict"], "intersecting");
}

#[test]
fn sources_are_indices_into_the_input() {
    let place = balls();
    let text = std::fs::read_to_string(place.path("ball.xyz")).unwrap();
    let points: Vec<Vec<f64>> =
        text.lines().map(|l| l.split(' ').map(|x| x.parse().unwrap()).collect()).collect();
    let hit = ask(&place, &["--pose-b", &shift(0.0, 1.2, 0.0)]);
    let witness = numbers(&hit["witness"]);
    for (source, dy) in [("source_a", 0.0), ("source_b", 1.2)] {
        let p = &points[usize::try_from(hit[source].as_u64().unwrap()).unwrap()];
        let q = [p[0], p[1] + dy, p[2]];
        let distance = (0..3).map(|k| (q[k] - witness[k]).powi(2)).sum::<f64>().sqrt();
        assert!(distance < 0.2, "{source} is {distance} from the witness");
    }
}

#[test]
fn thickened_points_are_decided_exactly() {
    let place = balls();
    let apart = shift(3.0, 0.0, 0.0);
    let hit = ask(&place, &["--pose-b", &apart, "--thickened", "0.51"]);
    assert_eq!((&hit["verdict"], &hit["evidence"]), (&"intersecting".into(), &"certified".into()));
    assert!(hit["normal_a"].is_null() && hit["residual"].as_f64().unwrap() <= 0.51, "{hit}");
    let miss = ask(&place, &["--pose-b", &apart, "--thickened", "0.45"]);
    assert_eq!((&miss["verdict"], &miss["evidence"]), (&"separated".into(), &"certified".into()));
    assert!((0.0..=0.11).contains(&miss["gap"].as_f64().unwrap()), "{miss}");
}

fn identity() -> String {
    commas(0.0)
}

/// Returns the matrix of a shift along x, separated by commas.
fn commas(x: f64) -> String {
    shift(x, 0.0, 0.0).replace(' ', ",")
}

/// A single point above a sheet is part of the obstacle, but of no surface.
#[test]
fn a_stray_is_an_obstacle_and_no_surface() {
    let place = Place::new();
    let mut sheet = String::new();
    for i in 0..40_u8 {
        for j in 0..40_u8 {
            sheet += &format!("{} {} 0\n", f64::from(i) * 0.1, f64::from(j) * 0.1);
        }
    }
    place.write("sheet.xyz", format!("{sheet}2 2 3\n"));
    place.write("plain.xyz", &sheet);
    // The second sheet is 0.02 below the isolated point.
    let pose = shift(0.0, 0.0, 2.98);
    let ask = |command: &str, options: &[&str]| {
        let asked = [&[command, "sheet.xyz", "plain.xyz", "--pose-b", &pose, "--json"], options].concat();
        place.ok(&asked).json().remove(0)
    };
    let hit = ask("collide", &[]);
    assert_eq!((&hit["verdict"], &hit["evidence"]), (&"intersecting".into(), &"certified".into()), "{hit}");
    assert!((0.1..=0.5).contains(&hit["band"].as_f64().unwrap()), "at most the reach: {hit}");
    let miss = ask("collide", &["--surface-only"]);
    assert_ne!(miss["verdict"], "intersecting", "{miss}");
    let near = ask("distance", &[]);
    assert_eq!(near["upper"], 0.0, "{near}");
    let far = ask("distance", &["--surface-only"]);
    assert!(far["upper"].as_f64().unwrap() > 0.1 && far["evidence"] == "estimated", "{far}");
    let tried = ask("collide", &["--method", "sampling", "--seed", "1"]);
    assert_ne!(tried["verdict"], "intersecting", "the paper's method knows surfaces alone: {tried}");
    place.refused(
        2,
        &["collide", "sheet.xyz", "plain.xyz", "--surface-only", "--thickened", "1"],
        &["cannot be used"],
    );
    place.refused(
        2,
        &["distance", "sheet.xyz", "plain.xyz", "--surface-only", "--thickened", "1"],
        &["cannot be used"],
    );
}

#[test]
fn people_read_sentences() {
    let place = balls();
    let say = |options: &[&str]| {
        let done = place.ok(&[&["collide", "ball.nm", "ball.xyz"], options].concat());
        done.results.lines().next().unwrap().to_owned()
    };
    let touch = say(&["--pose-b", &shift(1.2, 0.0, 0.0)]);
    assert!(
        touch.starts_with("They touch at (0.6")
            && touch.contains(") (certified). The nearest measured points are "),
        "{touch}"
    );
    let after = |words: &str| touch.split(words).nth(1).and_then(|t| t.split(' ').next()).unwrap();
    let apart: f64 = after("measured points are ").parse().unwrap();
    let band: f64 = after("gaps below ").parse().unwrap();
    assert!(apart < 0.16 && (0.08..0.25).contains(&band), "a spacing of 0.08: {touch}");
    let balls = say(&["--pose-b", &shift(2.05, 0.0, 0.0), "--thickened", "0.1"]);
    assert!(balls.starts_with("Balls of radius 0.1 overlap at (1.0"), "{balls}");
    let apart = balls.split("the two points are ").nth(1).and_then(|t| t.strip_suffix(" apart."));
    assert!((0.05..=0.2).contains(&apart.unwrap().parse().unwrap()), "{balls}");
    let between = |told: &str| -> Vec<f64> {
        let told =
            told.strip_prefix("No contact; ").and_then(|t| t.strip_suffix(" apart (certified).")).unwrap();
        told.trim_start_matches("between ").split(" and ").map(|x| x.parse().unwrap()).collect()
    };
    // The distance of the balls is that of their points, less both radii.
    let exact = between(&say(&["--pose-b", &shift(2.5, 0.0, 0.0), "--thickened", "0.1"]));
    assert!(exact.len() == 1 && (0.3..0.35).contains(&exact[0]), "{exact:?}");
    for (x, true_distance) in [(9.0, 7.0), (2.5, 0.5)] {
        let told = between(&say(&["--pose-b", &shift(x, 0.0, 0.0)]));
        assert!(told.len() == 2 && told[0] <= true_distance + 0.02, "{told:?}");
        assert!(told[0] >= 0.85 * true_distance - 0.16 && (told[1] - true_distance).abs() < 0.03, "{told:?}");
    }
    place.write("far.jsonl", format!("{{\"a\":[{0}],\"b\":[{1}]}}\n", identity(), commas(9.0)));
    let told = say(&["--poses", "far.jsonl"]);
    assert_eq!(between(told.strip_prefix("line 1: ").unwrap()).len(), 2, "{told}");
    for (x, is_hinted) in [(9.0, true), (4.5, true), (3.5, false), (2.5, false)] {
        let done = place.ok(&["collide", "ball.nm", "ball.xyz", "--pose-b", &shift(x, 0.0, 0.0)]);
        assert_eq!(done.results.contains("hint: the bounding boxes are"), is_hinted, "{x}: {}", done.results);
    }
    let far = shift(9.0, 0.0, 0.0);
    let one = place.ok(&["collide", "ball.nm", "ball.nm", "--pose-b", &far, "--evidence", "estimated"]);
    assert!(one.results.contains("\n1 node pair, "), "{}", one.results);
    let short = say(&["--pose-b", &shift(1.2, 0.0, 0.0), "--work", "1"]);
    assert!(short.starts_with("Cannot tell: ") && short.contains("--work"), "{short}");
}

#[test]
fn poses_come_as_numbers_brackets_or_files() {
    let place = balls();
    let spaced = shift(1.2, 0.0, 0.0);
    let commas = spaced.replace(' ', ", ");
    let file = place.write("pose.txt", spaced.replace(" 0 1 0 ", "\n0 1 0 "));
    let negative = "-1 0 0 1.2 0 -1 0 0 0 0 1 0 0 0 0 1";
    let witness = |m: &str| numbers(&ask(&place, &["--pose-b", m])["witness"]);
    let expected = witness(&spaced);
    assert_eq!(witness(&commas), expected);
    assert_eq!(witness(&format!("[{commas}]")), expected);
    assert_eq!(witness(name(&file)), expected);
    assert!((witness(negative)[0] - 0.6).abs() < 0.05, "a turn about z");
    let world = ask(&place, &["--pose-a", &shift(0.0, 0.0, 5.0), "--pose-b", &shift(1.2, 0.0, 5.0)]);
    assert!((numbers(&world["witness"])[2] - 5.0).abs() < 1.1, "in the world: {world}");
}

#[test]
fn a_file_of_poses_is_answered_in_order() {
    let place = balls();
    let matrix = |x: f64| format!("[{}]", shift(x, 0.0, 0.0).replace(' ', ","));
    let mut lines = String::new();
    for i in 0..2500_u32 {
        let x = if i % 3 == 0 { 1.5 } else { 2.5 };
        lines += &format!("{{\"a\":{},\"b\":{},\"truth\":null}}\n", matrix(0.0), matrix(x));
        if i == 7 {
            lines += "\n";
        }
    }
    place.write("poses.jsonl", &lines);
    let untimed = |threads: &str| {
        let args =
            ["collide", "ball.nm", "ball.nm", "--poses", "poses.jsonl", "--json", "--threads", threads];
        let mut answers = place.ok(&args).json();
        for answer in &mut answers {
            assert!(answer["micros"].as_f64().unwrap() > 0.0, "{answer}");
            answer["micros"] = Value::Null;
        }
        answers
    };
    let one = untimed("1");
    assert_eq!(one.len(), 2500);
    for (i, answer) in one.iter().enumerate() {
        let expected = if i % 3 == 0 { "intersecting" } else { "separated" };
        assert_eq!(answer["verdict"], expected, "line {i}");
    }
    assert_eq!(untimed("2"), one, "whatever the threads");
    let people = place.ok(&["collide", "ball.nm", "ball.nm", "--poses", "poses.jsonl"]);
    assert_eq!(people.results.lines().count(), 2501, "a line a pose, and a summary");
    assert!(people.results.starts_with("line 1: They touch"), "{}", people.results.lines().next().unwrap());
    let [last, summary] = people.results.lines().skip(2499).collect::<Vec<_>>()[..] else { panic!() };
    assert!(last.starts_with("line 2501: "), "one line is blank: {last}");
    let words = "2500 poses: 834 touch (first on line 1, at (0.7";
    assert!(summary.starts_with(words), "{summary}");
    assert!(summary.contains("), 1666 apart. Smallest clearance of those apart: between 0.4"), "{summary}");
}

#[test]
fn a_faulty_line_is_named_after_the_answers_before_it() {
    let place = balls();
    let identity = "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]";
    let good = format!("{{\"a\":{identity},\"b\":{identity}}}");
    for (bad, word) in [
        ("nonsense", "expected JSON as on the first line, got `nonsense`"),
        ("3", "expected JSON as on the first line, got `3`; a line is {\"a\":[…],\"b\":[…]}"),
        ("[[1]]", "expected the numbers of a pose"),
        (&good.replacen("0,0,0,1]", "7,8,9,1]", 1), "`a`: expected a last row of 0 0 0 1, got a last column"),
        (&good.replacen("[1,0", "[1.123456789,0", 1), "bounds by 0.101, more than 0.0117 (a"),
        ("{\"a\":[1,2,3],\"b\":[]}", "`a`: expected 16 numbers (a row-major 4×4 matrix), 12"),
        ("{\"c\":1}", "expected `a`, `b` or both, got neither"),
        (&good.replace("0,0,0,1]}", "0,0,1,1]}"), "`b`: expected a last row"),
        (&good.replacen("[1,0", "[2,0", 1), "`a`: expected a rotation"),
        (&good.replacen("[1,", "[-1,", 1), "determinant, got -1"),
        (&good.replacen("[1,", "[1e999,", 1), "number out of range"),
    ] {
        place.write("poses.jsonl", format!("{good}\n\n{bad}\n{good}\n"));
        for threads in ["1", "2"] {
            let args =
                ["collide", "ball.nm", "ball.nm", "--poses", "poses.jsonl", "--json", "--threads", threads];
            let done = place.run(&args);
            assert_eq!(done.status, 1, "{bad}");
            assert!(done.errors.starts_with("error: poses.jsonl: line 3: "), "{bad}: {}", done.errors);
            assert!(done.errors.contains(word), "`{word}` in {}", done.errors);
            assert_eq!(done.json().len(), 1, "the answer before it: {bad}");
        }
    }
}

#[test]
fn with_first_the_answers_end_with_the_first_hit() {
    let place = balls();
    let line = |x: f64| {
        let matrix = |x: f64| format!("[{}]", shift(x, 0.0, 0.0).replace(' ', ","));
        format!("{{\"a\":{},\"b\":{}}}", matrix(0.0), matrix(x))
    };
    let (apart, touching) = (line(2.5), line(1.5));
    let ask = |lines: &[&str], threads: &str| {
        place.write("poses.jsonl", lines.join("\n"));
        let args = ["collide", "ball.nm", "ball.nm", "--poses", "poses.jsonl", "--json", "--first"];
        place.run(&[&args[..], &["--threads", threads]].concat())
    };
    for threads in ["1", "2"] {
        for hits in [&[][..], &[0], &[1500, 40, 41], &[1023], &[1024], &[1999]] {
            let mut lines = vec![apart.as_str(); 2000];
            hits.iter().for_each(|&i| lines[i] = &touching);
            let done = ask(&lines, threads);
            assert_eq!((done.status, done.errors.as_str()), (0, ""));
            let answers = done.json();
            let count = hits.iter().min().map_or(2000, |first| first + 1);
            assert_eq!(answers.len(), count, "{hits:?} on {threads} threads");
            let is_hit = |answer: &Value| answer["verdict"] == "intersecting";
            assert_eq!(is_hit(answers.last().unwrap()), !hits.is_empty(), "{hits:?}: the last one");
            assert!(!answers[..count - 1].iter().any(is_hit), "{hits:?}: no other");
        }
        let after = ask(&[&apart, &touching, "nonsense"], threads);
        assert_eq!((after.status, after.json().len()), (0, 2), "what comes after the hit is not looked at");
        let before = ask(&[&apart, "nonsense", &touching], threads);
        assert_eq!((before.status, before.json().len()), (1, 1), "a fault before it counts");
        assert!(before.errors.starts_with("error: poses.jsonl: line 2: "), "{}", before.errors);
    }
}

#[test]
fn wrong_usage_ends_with_status_2() {
    let place = balls();
    let both = |options: &[&'static str]| [&["collide", "ball.nm", "ball.nm"], options].concat();
    for (options, word) in [
        (
            &["--pose-a", "1 2 3"][..],
            "--pose-a: expected 16 numbers (a row-major 4×4 matrix), 12 (its first three rows) or 7",
        ),
        (&["--pose-b", "elsewhere"], "or a file that holds them; found no file `elsewhere`"),
        (&["--budget", "200"], "ns, us, ms or s"),
        (&["--budget", "-3us"], "--budget"),
        (&["--thickened", "-1"], "--thickened"),
        (&["--thickened", "nan"], "--thickened"),
        (&["--threads", "many"], "--threads"),
        (&["--poses", "p.jsonl", "--image", "x.png"], "cannot be used with"),
        (&["--image", "ball.nm"], "would replace the input"),
        (&["--detail", "everything"], "manifold"),
        (&["--first"], "--poses"),
        (&["--margin", "-1"], "--margin"),
        (&["--evidence", "proven"], "certified"),
        (&["--prove", "ball.nm"], "would replace the input"),
        (&["--prove", "p.jsonl", "--thickened", "1"], "cannot be used with"),
    ] {
        place.refused(2, &both(options), &[word]);
    }
    place.refused(2, &["collide", "ball.nm"], &["<B>"]);
    place.refused(2, &["preprocess", "ball.xyz"], &["--output"]);
    place.refused(2, &["preprocess", "ball.xyz", "-o", "x.nm", "--leaf", "2"], &["4..=64"]);
    place.refused(2, &["preprocess", "ball.xyz", "-o", "x.nm", "--bandwidth", "0"], &["more than zero"]);
    place.refused(2, &["preprocess", "ball.xyz", "-o", "x.nm", "--reach", "0"], &["more than zero"]);
    place.refused(2, &["preprocess", "ball.xyz", "-o", "./ball.xyz"], &["would replace the input"]);
    place.refused(2, &["export", "ball.nm"], &["--points"]);
    place.refused(2, &["poses", "ball.nm", "ball.nm", "-o", "p.jsonl"], &["--sweep"]);
    let none = ["poses", "ball.nm", "ball.nm", "--near", "--per-distance", "0", "-o", "p.jsonl"];
    place.refused(2, &none, &["--per-distance"]);
    for command in ["preprocess", "inspect", "eval", "collide", "curve", "poses", "export"] {
        let help = place.ok(&["help", command]).results;
        assert!(help.contains("Example") && help.contains(&format!("nearmiss {command} ")), "{help}");
    }
    assert_eq!(place.ok(&["--help"]).status, 0);
    assert!(place.ok(&["--version"]).results.starts_with("nearmiss "));
    place.refused(1, &both(&["--pose-b", "0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0"]), &["--pose-b", "last row"]);
    place.refused(1, &both(&["--poses", "missing.jsonl"]), &["missing.jsonl: no such file; check the path"]);
    place.write("empty.jsonl", "\n\n");
    for threads in ["1", "2"] {
        let args = both(&["--poses", "empty.jsonl", "--threads", threads]);
        place.refused(1, &args, &["empty.jsonl: expected poses, got none; a line is"]);
    }
    let transposed = "1 0 0 0 0 1 0 0 0 0 1 0 1 2 3 1";
    place.refused(1, &both(&["--pose-b", transposed]), &["--pose-b", "transpose the matrix"]);
    let sheared = "1 0.123456789 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
    place.refused(1, &both(&["--pose-a", sheared]), &["--pose-a", "a tenth of the sampling radius"]);
}

#[test]
fn a_picture_shows_both_scans_and_the_contact() {
    let place = Place::new();
    let dragon = dragon_path(Dragon::Points5k);
    place.ok(&["preprocess", name(&dragon), "-o", "d.nm", "--quiet"]);
    let mut sizes = Vec::new();
    for (file, x) in [("hit.png", 0.09), ("miss.png", 0.5)] {
        place.ok(&["collide", "d.nm", "d.nm", "--pose-b", &shift(x, 0.03, 0.01), "--image", file, "--quiet"]);
        let decoder =
            png::Decoder::new(std::io::BufReader::new(std::fs::File::open(place.path(file)).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        let count = |is: fn(&[u8]) -> bool| pixels.chunks(3).filter(|p| is(p)).count();
        let [blue, orange] =
            [count(|p| p[2] > p[0].saturating_add(60)), count(|p| p[0] > p[2].saturating_add(60))];
        assert!(blue > 10_000 && orange > 10_000, "{file}: {blue} blue and {orange} orange pixels");
        sizes.push((info.width, info.height));
    }
    assert_eq!(sizes[0], sizes[1]);
    assert_eq!(place.files(), ["d.nm", "hit.png", "miss.png"], "no temporary files stay");
}

#[test]
fn separations_are_certified_and_their_proof_is_written() {
    let place = balls();
    let apart = shift(0.0, 3.0, 0.0);
    let certified = ask(&place, &["--pose-b", &apart, "--prove", "proof.jsonl"]);
    assert_eq!((&certified["verdict"], &certified["evidence"]), (&"separated".into(), &"certified".into()));
    let gap = certified["gap"].as_f64().unwrap();
    assert!(gap > 0.0 && gap <= 1.0, "the balls are 1 apart: {gap}");
    let proof: Value =
        serde_json::from_str(&std::fs::read_to_string(place.path("proof.jsonl")).unwrap()).unwrap();
    let count = |list: &str| proof[list].as_array().unwrap().len();
    assert!(count("pairs") > 0 && count("nodes_a") > 0 && count("nodes_b") > 0, "{proof}");
    assert_eq!((&proof["gap"], &proof["semantics"]), (&certified["gap"], &"obstacle".into()));
    assert_eq!(proof["placed_a"].as_array().unwrap().len(), 16);

    let estimated = ask(&place, &["--pose-b", &apart, "--evidence", "estimated"]);
    assert_eq!((&estimated["evidence"], &estimated["gap"]), (&"estimated".into(), &Value::Null));
    let told = place.ok(&["collide", "ball.nm", "ball.nm", "--pose-b", &apart]).results;
    assert!(told.contains("No contact; between 0.9") && told.contains("(certified)"), "{told}");
    let told =
        place.ok(&["collide", "ball.nm", "ball.nm", "--pose-b", &apart, "--evidence", "estimated"]).results;
    assert!(told.contains("No contact found; between 0.9") && told.contains("(estimated)"), "{told}");
}

#[test]
fn a_margin_makes_near_misses_contacts() {
    let place = balls();
    let apart = shift(0.0, 2.6, 0.0);
    let far = ask(&place, &["--pose-b", &apart, "--margin", "0.4"]);
    assert_eq!(far["verdict"], "separated", "0.6 apart: {far}");
    let near = ask(&place, &["--pose-b", &apart, "--margin", "0.8"]);
    assert_eq!((&near["verdict"], &near["evidence"]), (&"intersecting".into(), &"certified".into()));
    assert!((numbers(&near["witness"])[1] - 1.3).abs() < 0.2, "between them: {near}");
    let residual = near["residual"].as_f64().unwrap();
    assert!((0.29..=0.4).contains(&residual), "half a distance from 0.6 to 0.8: {residual}");
    let told = place.ok(&["collide", "ball.nm", "ball.nm", "--pose-b", &apart, "--margin", "0.8"]).results;
    assert!(told.contains("They come within 0.8 of each other at "), "{told}");
    let balls = ask(&place, &["--pose-b", &apart, "--thickened", "0.2", "--margin", "0.3"]);
    assert_eq!(balls["verdict"], "intersecting", "0.2 apart: {balls}");
}
