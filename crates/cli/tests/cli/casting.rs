//! `cast`.

use nearmiss_testdata::shapes::sphere;

use crate::running::{Place, keys, numbers, shift, sorted};

/// Rays from inside and outside a ball of radius 1 at (3, 0, 0) in the world.
const RAYS: &str = r#"
{"origin":[3,0,0],"direction":[0,0,2],"name":"from inside"}
{"origin":[0,0,0],"direction":[1,0,0],"name":["beam"],"id":7}

{"origin":[0,0,0],"direction":[1,0,0],"max":1.5}
{"origin":[0,0,0],"direction":[1,0,0],"radius":0.25}
{"origin":[0,2,0],"direction":[1,0,0]}
"#;

#[test]
fn rays_hit_a_ball_where_it_is() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.05);
    place.write("rays.jsonl", RAYS);
    let pose = shift(3.0, 0.0, 0.0);
    let asked = ["cast", "ball.xyz", "--rays", "rays.jsonl", "--pose", &pose, "--json"];
    let told = place.ok(&asked).json();
    assert_eq!(keys(&told[0]), sorted("name t point normal source evidence micros"));
    assert_eq!(keys(&told[2]), sorted("t point normal source evidence micros"));
    assert!(told[0]["name"] == "from inside" && told[1]["id"] == 7 && told[1]["name"][0] == "beam");
    for (line, expected) in told.iter().zip([Some(1.0), Some(2.0), None, Some(1.75), None]) {
        let t = line["t"].as_f64();
        assert_eq!(t.is_some(), expected.is_some(), "{line} for {expected:?}");
        let Some((t, expected)) = t.zip(expected) else {
            assert!(
                line["point"].is_null() && line["normal"].is_null() && line["evidence"] == "certified",
                "{line}"
            );
            continue;
        };
        assert!((t - expected).abs() < 0.01, "{line} for {expected}");
        let p = numbers(&line["point"]);
        let off = ((p[0] - 3.0).powi(2) + p[1] * p[1] + p[2] * p[2]).sqrt();
        assert!((off - 1.0).abs() < 0.005 && line["evidence"] == "certified", "{line}");
    }
    assert!(numbers(&told[0]["normal"])[2] < -0.99, "towards the origin: {}", told[0]);
    let people = place.ok(&asked[..6]).results;
    let lines: Vec<&str> = people.lines().collect();
    assert!(
        lines[0].starts_with("line 2 (from inside): It hits (3.0")
            && lines[0].contains("(certified), at point "),
        "{people}"
    );
    assert!(lines[1].starts_with("line 3 (7): It hits"), "{people}");
    assert_eq!(lines[2], "line 5: It hits nothing (certified).", "{people}");
    place.write("rays.jsonl", r#"{"origin":[-2000,0,0],"direction":[0,1,0]}"#);
    let far = place.ok(&asked[..4]).errors;
    assert!(
        far.contains("the ray on line 1 is 2000 away, and the scan is 3.46 from corner to corner"),
        "{far}"
    );
}

#[test]
fn one_ray_needs_no_file() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.05);
    let asked = ["cast", "ball.xyz", "--from=-5,0,0", "--to=-3,0,0"];
    let people = place.ok(&asked).results;
    assert!(people.starts_with("It hits (") && people.contains(" after 4.00"), "{people}");
    let t = |radius: &str| {
        let told = place.ok(&[&asked[..], &["--radius", radius, "--json"]].concat()).json();
        assert_eq!(told.len(), 1, "one ray");
        told[0]["t"].as_f64().unwrap()
    };
    assert!((t("0") - 4.0).abs() < 0.01 && (t("0.5") - 3.5).abs() < 0.01, "{} and {}", t("0"), t("0.5"));
    let away = place.ok(&["cast", "ball.xyz", "--from=2,0,0", "--to=3,0,0"]).results;
    assert_eq!(away, "It hits nothing (certified).\n");
    place.refused(2, &["cast", "ball.xyz", "--from=1,0,0"], &["--to"]);
    place.refused(2, &["cast", "ball.xyz", "--to=1,0,0"], &["--from"]);
    place.refused(2, &["cast", "ball.xyz", "--from=1,0,0", "--to=1,0,0"], &["--to", "another place"]);
}

#[test]
fn what_is_no_ray_is_refused_with_its_line() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    let good = r#"{"origin":[3,0,2],"direction":[0,0,1]}"#;
    for (line, words) in [
        (r#"{"origin":[0,0,0],"direction":[0,0,0]}"#, &["line 2", "`direction`"][..]),
        (r#"{"origin":[0,0],"direction":[0,0,1]}"#, &["line 2", "column"]),
        (r#"{"origin":[0,0,0]}"#, &["line 2", "direction"]),
        (r#"{"origin":[0,0,0],"direction":[0,0,1],"max":-1}"#, &["line 2", "`max`"]),
        (r#"{"origin":[0,0,0],"direction":[0,0,1],"radius":-1}"#, &["line 2", "`radius`"]),
        ("ray", &["line 2", "expected one object in {}"]),
    ] {
        place.write("rays.jsonl", format!("{good}\n{line}\n"));
        place.refused(1, &["cast", "ball.xyz", "--rays", "rays.jsonl"], words);
    }
    place.write("rays.jsonl", "\n");
    place.refused(1, &["cast", "ball.xyz", "--rays", "rays.jsonl"], &["expected rays, got none", "origin"]);
    place.refused(2, &["cast", "ball.xyz"], &["--rays", "--image"]);
}

#[test]
fn a_depth_image_shows_the_ball_in_its_middle() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.05);
    let asked =
        ["cast", "ball.xyz", "--image", "depth.png", "--from=4,0,0", "--to", "0,0,0", "--angle", "90"];
    place.ok(&asked);
    let file = std::io::BufReader::new(std::fs::File::open(place.path("depth.png")).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    let width = info.width as usize;
    // The image is 1080 by 720 pixels, with a frame of 12.
    let at = |x: usize, y: usize| &pixels[3 * ((y + 12) * width + x + 12)..][..3];
    assert_eq!(width, 1080 + 24, "with its frame");
    assert_eq!(at(20, 20), [228, 230, 234], "beside the ball nothing is hit");
    // Its nearest place is yellow, its rim at asin 1/4 from the middle, 139 pixels, is violet.
    let [middle, rim] = [at(540, 360), at(540, 360 - 130)];
    assert!(middle[0] > 200 && middle[2] < 120, "{middle:?}");
    assert!(rim[2] > rim[1], "{rim:?}");
    assert_eq!(at(540, 360 - 150), [228, 230, 234], "above the ball");
    for (wrong, words) in [
        (["--from=4,0", "--to=0,0,0"], ["X,Y,Z", "--from"]),
        (["--from=1,0,0", "--to=1,0,0"], ["--to", "another place"]),
    ] {
        place.refused(2, &["cast", "ball.xyz", "--image", "depth.png", wrong[0], wrong[1]], &words);
    }
    place.refused(2, &["cast", "ball.xyz", "--image", "depth.png"], &["--from"]);
}

#[test]
fn hits_are_points_that_can_be_prepared() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.05);
    let camera = ["cast", "ball.xyz", "--from=4,0,0", "--to=0,0,0", "--image", "depth.png"];
    let more = ["--size", "90x60", "--points", "hits.ply", "--json"];
    let told = place.ok(&[&camera[..], &more].concat()).json();
    assert_eq!(keys(&told[0]), sorted("columns rows hits nearest furthest micros"));
    assert!(told.len() == 1 && told[0]["columns"] == 90 && told[0]["rows"] == 60, "{told:?}");
    let [nearest, furthest] = ["nearest", "furthest"].map(|key| told[0][key].as_f64().unwrap());
    // The furthest places are where rays graze the ball, √15 away.
    assert!((nearest - 3.0).abs() < 0.01 && (furthest - 15.0_f64.sqrt()).abs() < 0.1, "{told:?}");
    // Squares of twelve pixels.
    assert_eq!(place.picture("depth.png").0, 1080 + 24);
    let points = place.ok(&["preprocess", "hits.ply", "-o", "hits.nm", "--json"]).json();
    assert_eq!(points[0]["points"], told[0]["hits"]);
    let head = std::fs::read(place.path("hits.ply")).unwrap();
    let head = String::from_utf8_lossy(&head[..400]);
    for property in ["double x", "float nx", "uint source", "uint ray", "float t"] {
        assert!(head.contains(&format!("property {property}")), "{head}");
    }
    place.write("rays.jsonl", RAYS);
    place.ok(&[
        "cast",
        "ball.xyz",
        "--pose",
        &shift(3.0, 0.0, 0.0),
        "--rays",
        "rays.jsonl",
        "--points",
        "five.ply",
    ]);
    let five = std::fs::read(place.path("five.ply")).unwrap();
    assert!(String::from_utf8_lossy(&five).contains("element vertex 3"), "three of five rays hit");
    for (more, words) in [
        (&["--size", "0x60"][..], &["--size", "640x480"][..]),
        (&["--rays", "rays.jsonl", "--points", "hits.ply"], &["--points", "--rays", "--from"]),
        (&["--points", "hits.png"], &["hits.png", ".ply"]),
    ] {
        place.refused(2, &[&camera[..], more].concat(), words);
    }
    place.refused(
        2,
        &["cast", "hits.ply", "--from=4,0,0", "--to=0,0,0", "--points", "hits.ply"],
        &["replace"],
    );
    place.refused(2, &["cast", "ball.xyz", "--from=4,0,0", "--to=0,0,0", "--size", "9x9"], &["--image"]);
    // A tall image stays within bounds, as wide as its legend.
    place.ok(&[&camera[..], &["--size", "2x4096"]].concat());
    assert_eq!(place.picture("depth.png").0, 1080 + 24);
    let away = ["cast", "ball.xyz", "--from=4,0,0", "--to=9,0,0", "--points", "none.ply"];
    assert!(place.ok(&away).errors.contains("none.ply has no points"));
    let far = place.ok(&["cast", "ball.xyz", "--from=4000,0,0", "--to=0,0,0"]).errors;
    assert!(far.contains("the place of --from is 4000 away") && far.contains("--units"), "{far}");
}
