//! Paths of poses: formats, summaries, tables and plots.

use std::f64::consts::TAU;

use nearmiss::Pose;
use nearmiss_testdata::shapes::sphere;

use crate::running::Place;

/// Returns a folder with a prepared ball of radius 1.
fn ball() -> Place {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.08);
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm"]);
    place
}

/// Returns poses of a turning ball that approaches, touches, and moves away again.
fn quaternions() -> Vec<([f64; 3], [f64; 4])> {
    (0..40_u32)
        .map(|i| {
            let t = f64::from(i) / 39.0;
            let half = 0.5 * TAU * t;
            (
                [1.2 + 8.0 * (t - 0.5).powi(2), 0.3 * t, -0.1],
                [0.6 * half.sin(), 0.0, 0.8 * half.sin(), half.cos()],
            )
        })
        .collect()
}

fn joined(numbers: &[f64], divider: &str) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(divider)
}

/// Writes the `i`-th pose, a translation and a quaternion, as a line.
type Line<'a> = &'a dyn Fn(usize, &[f64; 3], &[f64; 4]) -> String;

#[test]
fn every_format_of_poses_gives_the_same_answers() {
    let place = ball();
    let matrix = |t: &[f64; 3], q: &[f64; 4]| Pose::new(*t, *q).to_row_major();
    let file = |header: &str, line: Line<'_>| {
        let lines =
            quaternions().iter().enumerate().map(|(i, (t, q))| line(i, t, q) + "\n").collect::<String>();
        format!("{header}{lines}")
    };
    let rows = |m: &[f64; 16]| {
        m.chunks(4).map(|row| format!("[{}]", joined(row, ","))).collect::<Vec<_>>().join(",")
    };
    let seven = |t: &[f64; 3], q: &[f64; 4]| [&t[..], &q[..]].concat();
    let identity = joined(&Pose::IDENTITY.to_row_major(), ",");
    let files = [
        file("", &|_, t, q| format!("{{\"a\":[{identity}],\"b\":[{}]}}", joined(&matrix(t, q), ","))),
        file("", &|_, t, q| format!("{{\"b\":[{}]}}", joined(&seven(t, q), ","))),
        file("", &|_, t, q| format!("[{}]", joined(&matrix(t, q), ","))),
        file("", &|_, t, q| format!("[{}]", rows(&matrix(t, q)))),
        file("", &|_, t, q| joined(&matrix(t, q), " ")),
        file("# KITTI\n", &|_, t, q| joined(&matrix(t, q)[..12], " ")),
        file("# TUM: time x y z qx qy qz qw\n", &|i, t, q| format!("{i} {}", joined(&seven(t, q), " "))),
        file("", &|_, t, q| joined(&seven(t, q), ", ")),
        file("qw;qx;qy;qz;stamp;pos_x;pos_y;pos_z\n", &|i, t, q| {
            format!("{};{};{i};{}", q[3], joined(&q[..3], ";"), joined(t, ";"))
        }),
    ];
    let answers = |text: &str| {
        place.write("path", text);
        let mut answers = place.ok(&["collide", "ball.nm", "ball.nm", "--poses", "path", "--json"]).json();
        for answer in &mut answers {
            answer["micros"] = serde_json::Value::Null;
        }
        answers
    };
    let [first, others @ ..] = &files[..] else { panic!() };
    let expected = answers(first);
    let touching = expected.iter().filter(|answer| answer["verdict"] == "intersecting").count();
    assert!((5..35).contains(&touching), "{touching} of 40 touch");
    for text in others {
        let found = answers(text);
        for (i, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert_eq!(found["verdict"], expected["verdict"], "line {i} of\n{text}");
            let gap = |answer: &serde_json::Value| answer["gap"].as_f64().unwrap_or(0.0);
            assert!((gap(found) - gap(expected)).abs() < 1e-5, "line {i}: {found} instead of {expected}");
        }
        assert_eq!(found.len(), expected.len());
    }
}

#[test]
fn a_pose_of_the_command_line_stands_for_what_lines_leave_out() {
    let place = ball();
    place.write("path", "3 0 0 0 0 0 1\n");
    let ask = |pose: &[&str]| {
        let args = [&["collide", "ball.nm", "ball.nm", "--poses", "path", "--json"], pose].concat();
        place.ok(&args).json()[0]["verdict"].clone()
    };
    assert_eq!(ask(&[]), "separated");
    assert_eq!(ask(&["--pose-a", "1.5 0 0 0 0 0 1"]), "intersecting");
    place.refused(
        1,
        &["collide", "ball.nm", "ball.nm", "--poses", "path", "--pose-b", "0 0 0 0 0 0 1"],
        &["path: line 1: expected one pose of b, got one here and one in --pose-b; leave one out"],
    );
}

/// Few test points find no contact of balls that touch.
#[test]
fn without_a_known_clearance_none_is_told() {
    let place = ball();
    let lines: String = (0..8_u32).map(|i| format!("{} 0 0 0 0 0 1\n", 1.6 + 0.1 * f64::from(i))).collect();
    place.write("path.txt", lines);
    let method = ["--method", "sampling", "--test-points", "1", "--tolerance", "0.001"];
    let args = ["collide", "ball.nm", "ball.nm", "--poses", "path.txt", "--csv", "t.csv", "--plot", "t.svg"];
    let told = place.ok(&[&args[..], &method].concat()).results;
    let table = std::fs::read_to_string(place.path("t.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let is_missed = |row: &[&str]| row[2] == "separated" && row[5..10].iter().all(|field| field.is_empty());
    let missed: Vec<usize> = (0..8).filter(|&i| is_missed(&rows[i])).collect();
    assert!(missed.first() == Some(&0) && missed.len() < 8, "contact at 1.6, none at 2.3: {table}");
    for (i, line) in told.lines().take(8).enumerate() {
        let is_unknown = line.ends_with("No contact found; no clearance is known (estimated).");
        assert_eq!(is_unknown, missed.contains(&i), "{line}");
        assert!(is_unknown || rows[i][6].parse::<f64>().unwrap() > 0.0, "{:?}", rows[i]);
    }
    let summary = told.lines().last().unwrap();
    let poses = if missed.len() == 1 { "pose" } else { "poses" };
    let expected = format!("No clearance is known for {} {poses} apart (first on line 1)", missed.len());
    assert!(summary.contains(&expected), "{summary}");
    assert!(!summary.contains("Smallest clearance without contact: 0,"), "{summary}");
    let json = place.ok(&[&args[..5], &method, &["--json"]].concat()).json();
    for answer in &json {
        assert_eq!(answer["gap"].is_null(), answer["evidence"] == "estimated", "{answer}");
    }
    assert!(missed.iter().all(|&i| json[i]["gap"].is_null()), "{json:?}");
    let plot = std::fs::read_to_string(place.path("t.svg")).unwrap();
    let lines = plot.split("<polyline points=\"").skip(1).map(|line| line.split('"').next().unwrap());
    let points: usize = lines.map(|line| line.split(' ').count()).sum();
    assert_eq!(points, 8 - missed.len(), "{plot}");
}

#[test]
fn a_path_is_summed_up_tabled_and_drawn() {
    let place = ball();
    let lines: String = (0..30_u32)
        .map(|i| format!("{} {} 0 0 0 0 0 1\n", 0.5 * f64::from(i), 4.0 - 0.1 * f64::from(i)))
        .collect();
    place.write("path.tum", lines);
    for command in ["collide", "distance"] {
        let args =
            [command, "ball.nm", "ball.nm", "--poses", "path.tum", "--csv", "t.csv", "--plot", "t.svg"];
        let done = place.ok(&args);
        let summary = done.results.lines().last().unwrap();
        // The balls touch at distances up to 2, from line 21 on, within the spacing.
        assert!(summary.starts_with("30 poses: "), "{summary}");
        let table = std::fs::read_to_string(place.path("t.csv")).unwrap();
        let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!(rows.len(), 31);
        assert_eq!(rows[0][..3], ["line", "time", "verdict"]);
        let first = rows.iter().position(|row| row[2] == "intersecting").unwrap();
        assert!((20..=22).contains(&first), "{first}");
        assert!(summary.contains(&format!("(first on line {first}, time {}", rows[first][1])), "{summary}");
        for (i, row) in rows.iter().enumerate().skip(1) {
            assert_eq!((row.len(), row[0]), (11, &i.to_string()[..]));
            let [lower, upper] = [5, 6].map(|k| row[k].parse::<f64>().unwrap());
            let truth = (2.1 - 0.1 * f64::from(u32::try_from(i).unwrap())).max(0.0);
            assert!(lower <= truth + 0.02 && upper >= truth - 0.12 && upper <= truth + 0.05, "{row:?}");
        }
        let least = rows[first - 1][6].parse::<f64>().unwrap();
        assert!(summary.contains("Smallest clearance of those apart: "), "{summary}");
        assert!(summary.contains(&format!(", on line {}, time", first - 1)), "{summary}, {least}");
        let plot = std::fs::read_to_string(place.path("t.svg")).unwrap();
        assert!(plot.starts_with("<svg") && plot.contains("time 14.5") && !plot.contains("NaN"), "{plot}");
    }
    // With a margin, poses within it are not said to touch.
    let near = ["collide", "ball.nm", "ball.nm", "--poses", "path.tum", "--margin", "0.3", "--plot", "m.svg"];
    let summary = place.ok(&near).results.lines().last().unwrap().to_owned();
    assert!(summary.contains(" within 0.3 (first on line ") && !summary.contains("touch"), "{summary}");
    assert!(std::fs::read_to_string(place.path("m.svg")).unwrap().contains(">within margin<"));
    let refused = ["collide", "ball.nm", "ball.nm", "--poses", "path.tum", "--plot", "t.png"];
    place.refused(2, &refused, &["--plot: expected a name that ends in .svg, got `t.png`"]);
}

#[test]
fn a_small_ball_inside_a_solid_one_is_not_apart() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.05);
    // A small ball within a large one, which is solid.
    place.cloud("small.xyz", sphere(0.3), 0.02);
    place.write("poses.txt", "0 0 0 0 0 0 1\n3 0 0 0 0 0 1\n");
    let nested = ["collide", "ball.xyz", "small.xyz", "--poses", "poses.txt", "--penetration", "--quiet"];
    let told = place.ok(&[&nested[..], &["--solid", "a"]].concat()).results;
    assert!(told.contains("2 poses: 1 apart, 1 with one inside the other."), "{told}");
    let told = place.ok(&nested).results;
    assert!(told.contains("2 poses: 2 apart."), "{told}");
}
