//! `poses`.

use nearmiss_testdata::dragon::{Dragon, dragon_path};

use crate::running::{Place, keys, name, numbers};

fn dragon() -> Place {
    let place = Place::new();
    place.ok(&["preprocess", name(&dragon_path(Dragon::Points5k)), "-o", "d.nm", "--quiet"]);
    place
}

fn lines(place: &Place, file: &str) -> Vec<serde_json::Value> {
    let text = std::fs::read_to_string(place.path(file)).unwrap();
    text.lines().map(|l| serde_json::from_str(l).unwrap()).collect()
}

#[test]
fn a_sweep_has_thirteen_distances_of_normalised_scans() {
    let place = dragon();
    place.ok(&["poses", "d.nm", "d.nm", "--sweep", "--per-distance", "20", "--normalise", "-o", "s.jsonl"]);
    let bounds = place.ok(&["inspect", "d.nm", "--json"]).json()[0]["bounds"].clone();
    let [min, max] = [numbers(&bounds[0]), numbers(&bounds[1])];
    let longest = (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max);
    let lines = lines(&place, "s.jsonl");
    assert_eq!(lines.len(), 260);
    for (i, line) in lines.iter().enumerate() {
        assert_eq!(keys(line), ["a", "b", "d"]);
        let d = line["d"].as_f64().unwrap();
        assert!((d - 0.25 * (i / 20) as f64).abs() < 1e-12, "line {i}: {d}");
        let centres = ["a", "b"].map(|object| {
            let m = numbers(&line[object]);
            let scale = (0..3).map(|k| m[4 * k].powi(2)).sum::<f64>().sqrt();
            assert!(
                (scale * longest - 2.0).abs() < 1e-9,
                "{object} of line {i} has size {}",
                scale * longest
            );
            [0, 1, 2]
                .map(|r| m[4 * r + 3] + (0..3).map(|k| m[4 * r + k] * 0.5 * (min[k] + max[k])).sum::<f64>())
        });
        let apart = (0..3).map(|k| (centres[0][k] - centres[1][k]).powi(2)).sum::<f64>().sqrt();
        assert!((apart - d).abs() < 1e-9, "line {i}: centres {apart} apart, not {d}");
    }
    let answers = place.ok(&["collide", "d.nm", "d.nm", "--poses", "s.jsonl", "--json"]).json();
    let hits = |range: std::ops::Range<usize>| {
        answers[range].iter().filter(|a| a["verdict"] == "intersecting").count()
    };
    assert!(hits(0..20) >= 18, "at one centre they meet");
    assert_eq!(hits(240..260), 0, "at distance 3 they do not");
}

#[test]
fn poses_keep_the_units_of_the_files() {
    let place = dragon();
    let half: String = std::fs::read_to_string({
        place.ok(&["convert", name(&dragon_path(Dragon::Points5k)), "half.xyz"]);
        place.path("half.xyz")
    })
    .unwrap();
    let halved = |line: &str| {
        let row = numbers(&serde_json::json!(
            line.split_whitespace().take(3).map(|x| x.parse::<f64>().unwrap() / 2.0).collect::<Vec<_>>()
        ));
        format!("{} {} {}\n", row[0], row[1], row[2])
    };
    let rows = half.lines().filter(|line| line.starts_with(|c: char| c == '-' || c.is_ascii_digit()));
    place.write("half.xyz", rows.map(halved).collect::<String>());
    for kind in ["--sweep", "--near"] {
        let make = |extra: &[&str]| {
            let args =
                [&["poses", "d.nm", "half.xyz", kind, "--per-distance", "6", "-o", "-"], extra].concat();
            place.ok(&args).json()
        };
        let kept = make(&[]);
        let identity = numbers(&serde_json::json!(nearmiss::Pose::IDENTITY.to_row_major()));
        for line in &kept {
            assert_eq!(numbers(&line["a"]), identity, "a stays");
            let m = numbers(&line["b"]);
            let row: f64 = m[..3].iter().map(|x| x * x).sum();
            assert!((row - 1.0).abs() < 1e-12, "b keeps its size: {row}");
        }
        // For scans of the same size, both conventions give equivalent poses.
        let ask = |file: &str, extra: &[&str]| {
            let args = ["poses", "d.nm", "d.nm", kind, "--per-distance", "6", "-o", file];
            place.ok(&[&args[..], extra].concat());
            let answers = place.ok(&["collide", "d.nm", "d.nm", "--poses", file, "--json"]).json();
            answers.iter().map(|answer| answer["verdict"].clone()).collect::<Vec<_>>()
        };
        assert_eq!(ask("units.jsonl", &[]), ask("same.jsonl", &["--normalise"]), "{kind}");
    }
}

#[test]
fn near_poses_lie_about_first_touch() {
    let place = dragon();
    place.ok(&["poses", "d.nm", "d.nm", "--near", "--per-distance", "60", "-o", "n.jsonl"]);
    let lines = lines(&place, "n.jsonl");
    assert_eq!(lines.len(), 60);
    let report = place.ok(&["inspect", "d.nm", "--json"]).json().remove(0);
    let radius = report["sampling_radius"].as_f64().unwrap() * numbers(&lines[0]["a"])[0];
    let touching = format!("{}", 0.25 * radius * 1.05);
    let args = ["collide", "d.nm", "d.nm", "--poses", "n.jsonl", "--thickened", &touching, "--json"];
    let answers = place.ok(&args).json();
    let mut apart = 0;
    for (line, answer) in lines.iter().zip(&answers) {
        let offset = line["offset"].as_f64().unwrap() / radius;
        assert!(offset.abs() <= 10.0, "{offset} r");
        if offset > 0.0 {
            apart += 1;
        }
        if offset > 0.2 {
            assert_eq!(
                answer["verdict"], "separated",
                "{offset} r from first touch, none is nearer than r/2"
            );
        } else if (-0.01..0.0).contains(&offset) {
            assert_eq!(answer["verdict"], "intersecting", "just within touch: {offset} r");
        }
    }
    assert_eq!(apart, 30, "half of them");
}

#[test]
fn the_seed_decides_everything() {
    let place = dragon();
    let make = |kind: &str, seed: &str| {
        let args = ["poses", "d.nm", "d.nm", kind, "--per-distance", "8", "--seed", seed, "-o", "p.jsonl"];
        place.ok(&args);
        std::fs::read_to_string(place.path("p.jsonl")).unwrap()
    };
    for kind in ["--sweep", "--near"] {
        let zero = make(kind, "0");
        assert_eq!(make(kind, "0"), zero, "{kind}");
        let one = make(kind, "1");
        let shared = one.lines().filter(|line| zero.lines().any(|other| other == *line)).count();
        assert_eq!(shared, 0, "{kind}: seeds 0 and 1 share no pose");
    }
    place.refused(2, &["poses", "d.nm", "d.nm", "--sweep", "--near", "-o", "p.jsonl"], &["--near"]);
    place.refused(2, &["poses", "d.nm", "d.nm", "--near", "-o", "d.nm"], &["would replace the input"]);
}
