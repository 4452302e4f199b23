//! `curve`.

use nearmiss_testdata::shapes::{Sampling, bowl, patch, sphere};

use crate::running::{Place, keys, numbers, shift, sorted, text};

#[test]
fn two_spheres_cut_each_other_in_a_circle() {
    let place = Place::new();
    place.cloud("one.xyz", sphere(1.0), 0.05);
    place.cloud("other.xyz", sphere(1.0), 0.05);
    let pose = shift(1.0, 0.0, 0.0);
    let asked =
        ["curve", "one.xyz", "other.xyz", "--pose-b", &pose, "-o", "c.ply", "--json", "--image", "c.png"];
    let told = place.ok(&asked).json().remove(0);
    assert_eq!(keys(&told), sorted("verdict points curves closed length max_residual evaluations micros"));
    assert_eq!((&told["curves"], &told["closed"]), (&1.into(), &1.into()), "{told}");
    assert_eq!(told["verdict"], "intersecting");
    let circle = std::f64::consts::TAU * 0.75_f64.sqrt();
    assert!((told["length"].as_f64().unwrap() / circle - 1.0).abs() < 0.01, "{told} for {circle}");
    assert!(told["max_residual"].as_f64().unwrap() < 1e-3 * 0.08, "{told}");

    // Rows of three doubles and the number of the curve, then edges of two indices.
    let ply = std::fs::read(place.path("c.ply")).unwrap();
    let count = usize::try_from(told["points"].as_u64().unwrap()).unwrap();
    let end = b"end_header\n";
    let body = ply.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = String::from_utf8_lossy(&ply[..body]).into_owned();
    assert!(header.contains(&format!("element vertex {count}\n")), "{header}");
    assert!(
        header.contains(&format!("element edge {count}\n")),
        "as many edges as points in a loop: {header}"
    );
    let edges = &ply[body + 28 * count..];
    assert_eq!(edges.len(), 8 * count);
    let rows: Vec<&[u8]> = ply[body..body + 28 * count].chunks(28).collect();
    for row in &rows {
        let p: Vec<f64> = row[..24].chunks(8).map(|c| f64::from_le_bytes(c.try_into().unwrap())).collect();
        assert!((p[0] - 0.5).abs() < 0.01 && (p[1].hypot(p[2]) - 0.75_f64.sqrt()).abs() < 0.01, "{p:?}");
        assert_eq!(row[24..], [0; 4], "of the first curve");
    }
    for (i, edge) in edges.chunks(8).enumerate() {
        let ends: Vec<usize> =
            edge.chunks(4).map(|c| u32::from_le_bytes(c.try_into().unwrap()) as usize).collect();
        assert_eq!(ends, [i, (i + 1) % count], "in order, and back to the first");
    }
    assert!(std::fs::read(place.path("c.png")).unwrap().starts_with(b"\x89PNG"));

    let people = place.ok(&asked[..7]).results;
    assert!(people.starts_with("They intersect in 1 closed curve, length 5.4"), "{people}");
    let finer = [&asked[..8], &["--spacing", "0.01", "--tolerance", "1e-7"]].concat();
    let finer = place.ok(&finer).json().remove(0);
    assert!(
        finer["points"].as_u64().unwrap() > 500 && finer["max_residual"].as_f64().unwrap() < 1e-5,
        "{finer}"
    );
}

#[test]
fn ends_misses_and_budgets_are_said() {
    let place = Place::new();
    place.cloud("bowl.xyz", bowl(1.0), 0.05);
    place.cloud("wall.xyz", patch(3.0, 3.0), 0.05);
    place.ok(&["preprocess", "bowl.xyz", "-o", "bowl.nm", "--quiet"]);
    let upright = "1 0 0 0 0 0 -1 0.3 0 1 0 0 0 0 0 1";
    let asked = ["curve", "bowl.nm", "wall.xyz", "--pose-b", upright, "-o", "c.ply"];
    let people = place.ok(&asked).results;
    assert!(people.starts_with("They intersect in 1 open curve, length 3"), "{people}");
    assert!(people.contains("Ends: 2 at the border of a."), "{people}");
    let short = place.ok(&[&asked[..], &["--work", "300", "--json"]].concat()).json().remove(0);
    assert_eq!(short["complete"], false, "{short}");
    let expected = if short["curves"] == 0 { "undecided" } else { "intersecting" };
    assert_eq!(short["verdict"], expected, "{short}");
    let short = place.ok(&[&asked[..], &["--budget", "0us"]].concat()).results;
    assert!(short.starts_with("No curve found.\n") && short.contains("budget ran out"), "{short}");

    let away = shift(0.0, 0.0, 9.0);
    let missed = ["curve", "bowl.nm", "wall.xyz", "--pose-b", &away, "-o", "none.ply"];
    let people = place.ok(&missed).results;
    let gap = people
        .strip_prefix("They do not intersect; they are at least ")
        .and_then(|rest| rest.split_once(" apart (certified).\n"));
    let gap: f64 = gap.unwrap_or_else(|| panic!("{people}")).0.parse().unwrap();
    assert!((7.0..9.0).contains(&gap), "{people}");
    let told = place.ok(&[&missed[..], &["--json"]].concat()).json().remove(0);
    assert_eq!(numbers(&serde_json::json!([told["points"], told["curves"], told["length"]])), [0.0; 3]);
    assert_eq!(told["verdict"], "separated", "{told}");
    for what in ["surfaces", "obstacles"] {
        let answer = &told[what];
        assert_eq!(
            (&answer["verdict"], &answer["evidence"]),
            (&"separated".into(), &"certified".into()),
            "{told}"
        );
        assert!(answer["gap"].as_f64().unwrap() >= gap, "{told}");
    }
    assert!(std::fs::read_to_string(place.path("none.ply")).unwrap().contains("element vertex 0\n"));
}

/// If scans touch without a curve, the answer does not call them apart, and does not call a contact
/// of points one of surfaces.
#[test]
fn contacts_without_a_curve_are_said() {
    let place = Place::new();
    let floor = patch(3.0, 3.0).sample(Sampling::clean(0.1)).points;
    let pole = (0..80_u8).map(|i| [0.52, 0.53, 0.6 + 0.01 * f64::from(i)]);
    place.write("pole.xyz", text(&floor.iter().copied().chain(pole).collect::<Vec<_>>()));
    place.cloud("plate.xyz", patch(1.0, 1.0), 0.1);
    let pose = shift(0.5, 0.5, 1.0);
    let asked = ["curve", "pole.xyz", "plate.xyz", "--pose-b", &pose, "-o", "c.ply"];
    let people = place.ok(&asked).results;
    assert!(!people.contains("They do not intersect"), "{people}");
    assert!(
        people.contains("But they touch at (0.5") && people.contains("where no surface is sampled"),
        "{people}"
    );
    let told = place.ok(&[&asked[..], &["--json"]].concat()).json().remove(0);
    assert_eq!((&told["verdict"], &told["curves"]), (&"intersecting".into(), &0.into()), "{told}");
    assert_eq!(told["obstacles"]["verdict"], "intersecting", "{told}");
    assert_ne!(told["surfaces"]["verdict"], "intersecting", "{told}");
    let witness = numbers(&told["obstacles"]["witness"]);
    assert!((witness[2] - 1.0).abs() < 0.05, "{told}");

    // A ball rests on a plate: their discs intersect, but there is no curve to follow.
    place.cloud("ball.xyz", sphere(1.0), 0.1);
    let mut met = 0;
    for height in ["0.97", "0.98", "0.99", "1", "1.01", "1.02", "1.03"] {
        let pose = shift(0.0, 0.0, height.parse().unwrap());
        let asked = ["curve", "pole.xyz", "ball.xyz", "--pose-b", &pose, "-o", "c.ply"];
        let told = place.ok(&[&asked[..], &["--json"]].concat()).json().remove(0);
        let people = place.ok(&asked).results;
        if told["curves"] != 0 {
            continue;
        }
        let meet = told["surfaces"]["verdict"] == "intersecting";
        assert_eq!(told["verdict"] == "intersecting", meet || told["obstacles"]["verdict"] == "intersecting");
        assert_eq!(people.starts_with("No curve found, but they "), meet, "{height}: {people}");
        met += usize::from(meet);
    }
    assert!(met > 0, "no ball rests on the plate");
}

#[test]
fn curves_are_refused_with_a_reason() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    let both = |options: &[&'static str]| [&["curve", "ball.xyz", "ball.xyz"][..], options].concat();
    for (options, word) in [
        (&[][..], "--output"),
        (&["-o", "c.ply", "--spacing", "0"], "more than zero"),
        (&["-o", "c.ply", "--tolerance", "-1"], "more than zero"),
        (&["-o", "ball.xyz"], "would replace the input"),
        (&["-o", "c.png", "--image", "c.png"], "two outputs"),
        (&["-o", "c.ply", "--image", "c.jpg"], "PNG"),
        (&["-o", "c.ply", "--pose-b", "1 2 3"], "got 3"),
    ] {
        place.refused(2, &both(options), &[word]);
    }
    place.refused(1, &["curve", "ball.xyz", "none.xyz", "-o", "c.ply"], &["none.xyz", "no such file"]);
    assert_eq!(place.files(), ["ball.xyz"], "nothing is left of what failed");
}
