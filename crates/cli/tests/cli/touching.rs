//! `touch`.

use nearmiss_testdata::shapes::sphere;

use crate::running::{Place, keys, numbers, shift, sorted};

/// Shapes near and on a ball of radius 1 at (3, 0, 0) in the world.
const SHAPES: &str = r#"
{"sphere":{"centre":[3,0,2],"radius":0.5},"name":"above"}
{"sphere":{"centre":[3,0,2],"radius":1.1}}

{"capsule":{"ends":[[0,0,0],[1.5,0,0]],"radius":0.25}}
{"capsule":{"ends":[[0,0,0],[2.5,0,0]],"radius":0.25}}
{"box":{"pose":[1,0,0,3, 0,1,0,0, 0,0,1,3, 0,0,0,1],"half":[0.5,0.5,0.75]}}
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
    assert_eq!(keys(&told[0]), sorted("touches nearest gap source micros"));
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
    assert!(lines[0].starts_with("line 2: No contact; 0.5") && lines[0].contains(" from point "), "{people}");
    assert!(lines[1].starts_with("line 3: It touches point ") && lines.len() == 6, "{people}");
}

#[test]
fn what_is_no_shape_is_refused_with_its_line() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    let good = r#"{"sphere":{"centre":[3,0,2],"radius":0.5}}"#;
    for (line, words) in [
        (r#"{"sphere":{"centre":[0,0,0],"radius":-1}}"#, &["line 2", "`radius`, got -1"][..]),
        (r#"{"sphere":{"centre":[0,0],"radius":1}}"#, &["line 2", "column"]),
        (r#"{"sphere":{"centre":[0,0,0]}}"#, &["line 2", "radius"]),
        (r#"{"cone":{}}"#, &["line 2", "unknown shape `cone`; known: sphere, capsule, box"]),
        (
            r#"{"box":{"pose":[1,0,0,0,0,2,0,0,0,0,1,0,0,0,0,1],"half":[1,1,1]}}"#,
            &["line 2", "pose", "rotation"],
        ),
        ("sphere", &["line 2", "column 1"]),
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
