//! `touch`.

use nearmiss_testdata::shapes::sphere;
use serde_json::Value;

use crate::running::{Place, keys, numbers, shift, sorted};

/// Shapes near and on a ball of radius 1 at (3, 0, 0) in the world.
const SHAPES: &str = r#"
{"sphere":{"centre":[3,0,2],"radius":0.5},"name":"above"}
{"sphere":{"centre":[3,0,2],"radius":1.1}}

{"capsule":{"ends":[[0,0,0],[1.5,0,0]],"radius":0.25}}
{"capsule":{"ends":[[0,0,0],[2.5,0,0]],"radius":0.25}}
# A box above the ball, by a quaternion, and one that cuts it.
{"box":{"pose":[3,0,3, 0,0,0,1],"half":[0.5,0.5,0.75]}}
{"box":{"pose":[0,-1,0,3, 1,0,0,0, 0,0,1,0, 0,0,0,1],"half":[2,2,0.1]}}
"#;

#[test]
fn shapes_touch_a_ball_where_they_do() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.05);
    place.write("shapes.jsonl", SHAPES);
    let pose = shift(3.0, 0.0, 0.0);
    let asked = ["touch", "ball.xyz", "--shapes", "shapes.jsonl", "--pose", &pose, "--json"];
    let told = place.ok(&asked).json();
    assert_eq!(keys(&told[0]), sorted("name touches nearest gap source micros"));
    assert_eq!(keys(&told[1]), sorted("touches nearest gap source micros"));
    assert_eq!(told[0]["name"], "above");
    let touches: Vec<bool> = told.iter().map(|line| line["touches"].as_bool().unwrap()).collect();
    assert_eq!(touches, [false, true, false, true, false, true], "{told:?}");
    for (line, expected) in told.iter().zip([0.5, -0.1, 0.25, -0.2, 1.25, 0.0]) {
        let gap = line["gap"].as_f64().unwrap();
        assert!((gap - expected).abs() < 0.06, "{line} for {expected}");
        assert_eq!(gap <= 0.0, line["touches"].as_bool().unwrap(), "{line}");
        let p = numbers(&line["nearest"]);
        let off = ((p[0] - 3.0).powi(2) + p[1] * p[1] + p[2] * p[2]).sqrt();
        assert!((off - 1.0).abs() < 1e-5, "a point of the ball: {line}");
    }
    let people = place.ok(&asked[..6]).results;
    let lines: Vec<&str> = people.lines().collect();
    assert!(
        lines[0].starts_with("line 2 (above): No contact; 0.5") && lines[0].contains(" from point "),
        "{people}"
    );
    assert!(lines[1].starts_with("line 3: It touches point ") && lines.len() == 6, "{people}");
}

#[test]
fn what_is_no_shape_is_refused_with_its_line() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    let good = r#"{"sphere":{"centre":[3,0,2],"radius":0.5}}"#;
    for (line, words) in [
        (r#"{"sphere":{"centre":[0,0,0],"radius":-1}}"#, &["line 2", "`radius`, got -1"][..]),
        (r#"{"sphere":{"centre":[0,0],"radius":1}}"#, &["line 2", "column", r#"a sphere is {"sphere""#]),
        (r#"{"sphere":{"centre":[0,0,0]}}"#, &["line 2", "radius"]),
        (
            r#"{"box":{"pose":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"half":[1,1,1],"radios":1}}"#,
            &["line 2", "unknown field `radios`"],
        ),
        (
            r#"{"sphere":{"centre":[0,0,0],"radius":1},"radius":0.5}"#,
            &["line 2", "expected `radius` within the shape, got it beside it"],
        ),
        (r#"{"sphere":{"centre":[0,0,0],"radius":1},"margin":1}"#, &["line 2", "--margin"]),
        (r#"{"prism":{}}"#, &["line 2", "unknown shape `prism`; known: sphere, capsule, box, cylinder"]),
        (r#"{"cone":{}}"#, &["line 2", "pose", r#"a cone is {"cone":{"pose":"#]),
        (r#"{"capsule":{"#, &["line 2", "the whole object on one line", "a capsule is"]),
        (r#"[{"sphere":{"centre":[0,0,0],"radius":1}}]"#, &["line 2", "one object in {} on each line"]),
        (r#"{"hull":{"points":[]}}"#, &["line 2", "at least one point in `points`"]),
        (r#"{"segment":{"points":[[0,0,0],[1,0,0]],"radius":-2}}"#, &["line 2", "`radius`, got -2"]),
        (
            r#"{"cylinder":{"pose":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"half_height":-1,"radius":1}}"#,
            &["line 2", "`half_height`, got -1"],
        ),
        (
            r#"{"sphere":{"centre":[0,0,0],"radius":1},"box":{"pose":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"half":[1,1,1]}}"#,
            &["line 2", "expected one shape, got 2"],
        ),
        (
            r#"{"box":{"pose":[1,0,0,0,0,2,0,0,0,0,1,0,0,0,0,1],"half":[1,1,1]}}"#,
            &["line 2", "pose", "rotation"],
        ),
        ("sphere", &["line 2", "expected one object in {}"]),
        (r#"{"type":"sphere","radius":1}"#, &["line 2", "as the key, got `type`", r#"{"sphere":"#]),
        (
            r#"{"box":{"pose":[0,0,0,1],"half":[1,1,1]}}"#,
            &["line 2", "`pose`", "7 (x y z qx qy qz qw), got 4"],
        ),
        (r#"{"sphere":{"centre":[0,0,0],"radius":"big"}}"#, &["line 2", "expected a number"]),
    ] {
        place.write("shapes.jsonl", format!("{good}\n{line}\n"));
        place.refused(1, &["touch", "ball.xyz", "--shapes", "shapes.jsonl"], words);
    }
    place.write("shapes.jsonl", "\n\n");
    place.refused(
        1,
        &["touch", "ball.xyz", "--shapes", "shapes.jsonl"],
        &["expected shapes, got none", "sphere"],
    );
    place.refused(2, &["touch", "ball.xyz"], &["--shapes"]);
    place.refused(1, &["touch", "ball.xyz", "--shapes", "none.jsonl"], &["none.jsonl", "no such file"]);
}

/// A point far away leaves too few digits for the others.
#[test]
fn a_stray_point_beyond_all_measure_is_named() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.05);
    let points = std::fs::read_to_string(place.path("ball.xyz")).unwrap();
    place.write("stray.xyz", format!("{points}\n1e7 1e7 1e7\n"));
    let words =
        ["stray.xyz", "for a spacing of 7.0", "coordinates up to 1.00e7", "remove points that are far"];
    place.refused(1, &["preprocess", "stray.xyz", "-o", "stray.nm"], &words);
    place.ok(&["preprocess", "stray.xyz", "-o", "stray.nm", "--remove-outliers", "16,2"]);
}

/// A shape in millimetres beside a scan in metres is likely a mistake, and one beyond all measure is refused.
#[test]
fn shapes_in_another_unit_are_doubted() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    let ask = |line: &str, surface: bool| {
        place.write("shapes.jsonl", line);
        let asked = ["touch", "ball.xyz", "--shapes", "shapes.jsonl", "--surface"];
        place.run(&asked[..if surface { 5 } else { 4 }])
    };
    for (line, words) in [
        (r#"{"sphere":{"centre":[0,0,2000],"radius":1}}"#, Some("the shape on line 1 is 2000 away")),
        (
            r#"{"sphere":{"centre":[0,0,0],"radius":300}}"#,
            Some("the shape on line 1 is 1039 from corner to corner"),
        ),
        (r#"{"sphere":{"centre":[0,0,1],"radius":0.001}}"#, Some("and the spacing of the scan is 0.")),
        (r#"{"sphere":{"centre":[0,0,1],"radius":0.1}}"#, None),
        (r#"{"sphere":{"centre":[0,0,20],"radius":0}}"#, None),
    ] {
        for surface in [false, true] {
            let told = ask(line, surface).errors;
            let is_doubted = told.contains("give it in the unit of the scan");
            assert_eq!(is_doubted, words.is_some(), "{line}: {told}");
            assert!(words.is_none_or(|words| told.contains(words)), "{line}: {told}");
        }
    }
    // A scan in millimetres, and shapes in metres.
    place.write("shapes.jsonl", r#"{"sphere":{"centre":[0,0,0.0014],"radius":0.0005}}"#);
    let asked = ["touch", "ball.xyz", "--shapes", "shapes.jsonl", "--surface", "--units", "mm", "--json"];
    let told = place.ok(&asked);
    assert!(told.errors.is_empty(), "{}", told.errors);
    let depth = told.json()[0]["contacts"][0]["depth"].as_f64().unwrap();
    assert!((depth - 1e-4).abs() < 5e-5, "{depth}");
    let told = ask(r#"{"sphere":{"centre":[0,0,1],"radius":0.001}}"#, true).errors;
    assert!(told.contains("both in metres with --units"), "{told}");
    for line in
        [r#"{"sphere":{"centre":[1e300,0,0],"radius":1}}"#, r#"{"sphere":{"centre":[0,0,0],"radius":1e300}}"#]
    {
        place.write("shapes.jsonl", line);
        let asked = ["touch", "ball.xyz", "--shapes", "shapes.jsonl", "--surface"];
        place.refused(1, &asked, &["line 1", "too far away or too large"]);
    }
}

/// Shapes near and in a floor at z = 0, with half their depth or twice their distance.
const ON_FLOOR: &str = r#"
{"sphere":{"centre":[0.51,0.52,0.19],"radius":0.2}}
{"capsule":{"ends":[[0.3,0.5,0.09],[0.7,0.5,0.09]],"radius":0.1}}
{"box":{"pose":[1,0,0,0.5, 0,1,0,0.5, 0,0,1,0.19, 0,0,0,1],"half":[0.3,0.2,0.2]}}
{"box":{"pose":[1,0,0,0.5, 0,1,0,0.5, 0,0,1,0.19, 0,0,0,1],"half":[0.2,0.1,0.1],"radius":0.1}}
{"cylinder":{"pose":[1,0,0,0.5, 0,0,-1,0.5, 0,1,0,0.19, 0,0,0,1],"half_height":0.2,"radius":0.1}}
{"cone":{"pose":[1,0,0,0.5, 0,0,-1,0.5, 0,1,0,0.19, 0,0,0,1],"half_height":0.2,"radius":0.1}}
{"hull":{"points":[[0.5,0.5,-0.01],[0.6,0.5,0.3],[0.5,0.7,0.3],[0.4,0.4,0.4]]}}
{"triangle":{"points":[[0.5,0.5,-0.01],[0.6,0.5,0.3],[0.5,0.7,0.3]]}}
{"segment":{"points":[[0.5,0.5,-0.01],[0.6,0.5,0.3]]}}
"#;

#[test]
fn shapes_on_a_floor_have_contacts_with_the_surface() {
    let place = Place::new();
    place.cloud("floor.xyz", nearmiss_testdata::shapes::patch(2.0, 2.0), 0.05);
    place.write("shapes.jsonl", ON_FLOOR);
    let asked = ["touch", "floor.xyz", "--shapes", "shapes.jsonl", "--surface", "--json"];
    let told = place.ok(&asked).json();
    assert_eq!(told.len(), 9, "{told:?}");
    assert_eq!(keys(&told[0]), sorted("touches evidence reason lower upper contacts band micros"));
    for line in &told {
        assert!(line["touches"] == true && line["lower"] == 0.0 && line["upper"] == 0.0, "{line}");
        let contacts = line["contacts"].as_array().unwrap();
        assert_eq!(keys(&contacts[0]), sorted("point normal depth id"));
        let depth = contacts[0]["depth"].as_f64().unwrap();
        assert!((depth - 0.01).abs() < 1e-3 && numbers(&contacts[0]["normal"])[2] > 0.99, "{line}");
    }
    // Two units higher, nothing touches.
    let lowered = shift(0.0, 0.0, -2.0);
    let above = [&asked[..5], &["--pose", lowered.as_str(), "--json"]].concat();
    for line in place.ok(&above).json() {
        let (lower, upper) = (line["lower"].as_f64().unwrap(), line["upper"].as_f64().unwrap());
        assert!(line["touches"] == false && line["evidence"] == "certified", "{line}");
        assert!(lower > 1.9 && lower < 1.99 && (upper - 1.99).abs() < 1e-3, "{line}");
        assert_eq!(line["contacts"].as_array().map(Vec::len), Some(0), "{line}");
    }
    let within = [&asked[..5], &["--pose", lowered.as_str(), "--margin", "2", "--json"]].concat();
    for line in place.ok(&within).json() {
        let depth = line["contacts"][0]["depth"].as_f64().unwrap();
        assert!(line["touches"] == true && (depth + 1.99).abs() < 1e-3, "{line}");
    }
    let thick = ["touch", "floor.xyz", "--shapes", "shapes.jsonl", "--thickened", "0.05", "--json"];
    assert!(place.ok(&thick).json().iter().all(|line| line["evidence"] == "certified"), "balls are exact");
    let people = place.ok(&asked[..5]).results;
    assert!(
        people.contains("line 2: The shape touches it (certified). 6 contacts, the deepest 0.0100 deep at "),
        "{people}"
    );
    place.refused(
        2,
        &["touch", "floor.xyz", "--shapes", "shapes.jsonl", "--margin", "1"],
        &["--margin", "--surface"],
    );
    // Against the points alone, all shapes have an answer as well.
    let of_points = place.ok(&["touch", "floor.xyz", "--shapes", "shapes.jsonl", "--json"]).json();
    assert!(of_points.iter().all(|line| line["gap"].as_f64().is_some_and(|gap| gap < 0.1)), "{of_points:?}");
}

#[test]
fn shapes_along_a_path_hit_a_ball_or_are_proven_free() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.08);
    place.write("into.txt", "3 0 0 0 0 0 1\n-3 0 0 0 0 0 1\n");
    place.write("past.jsonl", "# past it\n[3,0,0,0,0,0,1]\n{\"b\":[0,3,0,0,0,0,1]}\n[-3,0,0,0,0,0,1]\n");
    place.write(
        "shapes.jsonl",
        r#"{"sphere":{"centre":[0,0,0],"radius":0.5},"name":"head"}
{"capsule":{"ends":[[0,0,-0.5],[0,0,0.5]],"radius":0.2}}
{"box":{"pose":[0,0,0,0,0,0,1],"half":[0.3,0.3,0.3]}}
"#,
    );
    let asked = |path: &str, more: &[&str]| {
        let args = ["touch", "ball.xyz", "--shapes", "shapes.jsonl", "--surface", "--path", path];
        place.ok(&[&args[..], more].concat())
    };
    let told = asked("into.txt", &["--json"]).json();
    let expected = "verdict evidence t_free t_hit contact clearance clearance_at clearance_upper reason \
                    band distances micros";
    assert_eq!(keys(&told[1]), sorted(expected));
    assert_eq!(told[0]["name"], "head");
    // The reach of each shape along the path, at whose end the path is at -3.
    for (line, reach) in told.iter().zip([0.5, 0.2, 0.3]) {
        let [free, hit] = ["t_free", "t_hit"].map(|key| line[key].as_f64().unwrap());
        let exact = (3.0 - 1.0 - reach) / 6.0;
        assert_eq!((&line["verdict"], &line["evidence"]), (&"impact".into(), &"estimated".into()), "{line}");
        assert!((hit - exact).abs() < 0.01 && free <= hit && free > exact - 0.04, "{line}");
        assert!(numbers(&line["contact"]["normal"])[0] > 0.9, "{line}");
    }
    for line in asked("past.jsonl", &["--json"]).json() {
        let [kept, upper] = ["clearance", "clearance_upper"].map(|key| line[key].as_f64().unwrap());
        assert_eq!((&line["verdict"], &line["evidence"]), (&"free".into(), &"certified".into()), "{line}");
        assert!(line["t_free"] == 2.0 && kept > 0.3 && kept <= upper && upper < 1.0, "{line}");
    }
    // The path comes within 2.12 of the middle.
    let near = asked("past.jsonl", &["--margin", "1", "--json"]).json();
    assert!(near.iter().all(|line| line["verdict"] == "impact"), "{near:?}");
    let people = asked("into.txt", &[]).results;
    assert!(people.starts_with("line 1 (head): The shape hits the scan at t = 0.24"), "{people}");
    let people = asked("past.jsonl", &[]).results;
    assert!(people.contains("The whole motion is free (certified): always at least 0."), "{people}");

    let cut = asked("into.txt", &["--work", "2", "--json"]).json();
    for (line, whole) in cut.iter().zip(&told) {
        let [free, hit] = [line, whole].map(|line| line["t_free"].as_f64().unwrap());
        assert!(line["reason"] == "budget" && line["distances"] == 2, "{line}");
        assert!(free > 0.1 && free <= hit, "{line}, {whole}");
    }
    let people = asked("into.txt", &["--budget", "1ns"]).results;
    assert!(people.contains("Cannot tell: the search reached its limit"), "{people}");

    place.write("turned.jsonl", "{\"a\":[1,0,0,0,0,0,1]}\n");
    let touch = ["touch", "ball.xyz", "--shapes", "shapes.jsonl", "--path"];
    let refused = |status: i32, path: &str, more: &[&str], what: &[&str]| {
        place.refused(status, &[&touch[..], &[path], more].concat(), what);
    };
    refused(2, "into.txt", &[], &["--path", "--surface"]);
    refused(1, "turned.jsonl", &["--surface"], &["turned.jsonl", "line 1", "--pose"]);
    refused(1, "none.txt", &["--surface"], &["none.txt"]);
    place.refused(2, &[&touch[..4], &["--surface", "--work", "9"]].concat(), &["--work", "--path"]);
}

#[test]
fn a_penetration_tells_the_way_out_of_a_ball() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.05);
    place.write(
        "shapes.jsonl",
        r#"{"sphere":{"centre":[0.8,0,0],"radius":0.3}}
{"sphere":{"centre":[0.3,0,0],"radius":0.3}}
{"sphere":{"centre":[2,0,0],"radius":0.3}}
"#,
    );
    let asked = ["touch", "ball.xyz", "--shapes", "shapes.jsonl", "--surface", "--penetration", "--json"];
    let solid = place.ok(&[&asked[..], &["--solid"]].concat()).json();
    for (line, exact) in solid.iter().zip([0.5, 1.0]) {
        let found = &line["penetration"];
        assert_eq!(keys(found), sorted("lower upper direction evidence"));
        let [lower, upper] = ["lower", "upper"].map(|key| found[key].as_f64().unwrap());
        assert!(lower <= exact + 0.05 && lower > exact - 0.1 && (upper - exact).abs() < 0.05, "{line}");
        assert!(numbers(&found["direction"])[0] > 0.98, "{line}");
    }
    assert!(solid[2]["penetration"].is_null(), "{solid:?}");
    let hollow = place.ok(&asked).json();
    assert!(
        numbers(&hollow[0]["penetration"]["direction"])[0] < -0.98,
        "the other side is nearer: {hollow:?}"
    );
    assert!(hollow[1]["penetration"].is_null(), "{hollow:?}");
    let words = place.ok(&[&asked[..6], &["--solid"]].concat()).results;
    assert!(words.contains("Moving it by 0.5"), "{words}");
    let limited = place.ok(&[&asked[..], &["--solid", "--work", "8"]].concat()).json();
    for (line, whole) in limited.iter().zip(&solid).take(2) {
        let ([found, whole], bound) =
            ([&line["penetration"], &whole["penetration"]], |found: &Value, key| {
                found[key].as_f64().unwrap()
            });
        assert!(found["complete"] == false && whole.get("complete").is_none(), "{line}");
        assert!(
            bound(found, "upper") >= bound(whole, "lower") && bound(found, "lower") <= bound(whole, "upper"),
            "{line}"
        );
    }
    let at_once = place.ok(&[&asked[..], &["--budget", "1ns"]].concat()).json();
    assert!(at_once[0]["penetration"]["complete"] == false, "{at_once:?}");
    let refused = place.run(&["touch", "ball.xyz", "--shapes", "shapes.jsonl", "--surface", "--work", "9"]);
    assert!(refused.status == 2 && refused.errors.contains("--penetration"), "{}", refused.errors);
    let refused = place.run(&["touch", "ball.xyz", "--shapes", "shapes.jsonl", "--penetration"]);
    assert!(refused.status == 2 && refused.errors.contains("add --surface"), "{}", refused.errors);
}
