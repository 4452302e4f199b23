//! The health of a scan, and the advice of `preprocess` and `inspect`.

use crate::running::{Place, numbers, text};

/// Returns a grid of points `step` apart in the plane z = 0.
fn grid(from: [f64; 2], counts: [u16; 2], step: f64) -> Vec<[f64; 3]> {
    let row = |i: u16| {
        (0..counts[1]).map(move |j| [from[0] + f64::from(i) * step, from[1] + f64::from(j) * step, 0.0])
    };
    (0..counts[0]).flat_map(row).collect()
}

/// Returns the report of some points as JSON, and the lines of health and advice.
fn examined(points: &[[f64; 3]], options: &[&str]) -> (serde_json::Value, Vec<String>) {
    let place = Place::new();
    place.write("scan.xyz", text(points));
    place.ok(&[&["preprocess", "scan.xyz", "-o", "scan.nm", "--quiet"], options].concat());
    let report = place.ok(&["inspect", "scan.nm", "--json"]).json().remove(0);
    let told = place.ok(&["inspect", "scan.nm"]).results;
    let advice = told.lines().filter(|line| line.starts_with("advice") || line.starts_with("health"));
    (report, advice.map(Into::into).collect())
}

fn find<'a>(lines: &'a [String], word: &str) -> &'a str {
    lines.iter().find(|line| line.contains(word)).unwrap_or_else(|| panic!("{word} in {lines:?}"))
}

#[test]
fn uneven_spacing_is_told_with_its_share_of_the_area() {
    // Two adjacent plates of the same area, with spacings of 0.02 and 0.4.
    let dense = grid([0.0, 0.0], [150, 150], 0.02);
    let sparse = grid([3.0, 0.0], [8, 8], 0.4);
    let (report, told) = examined(&[dense, sparse].concat(), &[]);
    let uneven = &report["health"]["uneven"];
    let number = |field: &str| uneven[field].as_f64().unwrap();
    assert!((0.001..0.006).contains(&number("share")), "64 of 22,564: {uneven}");
    assert!((0.35..0.65).contains(&number("area")), "half: {uneven}");
    assert!((14.0..26.0).contains(&number("times")), "20: {uneven}");
    assert!(report["health"]["outliers"].as_f64().unwrap() < 0.001, "{report}");
    let advice = find(&told, "times sparser than the rest");
    let reach = advice.split("--reach ").nth(1).and_then(|t| t.split('`').next()).unwrap();
    assert!((0.4..1.2).contains(&reach.parse().unwrap()), "{advice}");
    // The recommended command joins both plates.
    assert!(report["kinds"]["sheet"].as_f64().unwrap() < 0.9985, "{report}");
    let place = Place::new();
    let points = [grid([0.0, 0.0], [150, 150], 0.02), grid([3.0, 0.0], [8, 8], 0.4)].concat();
    place.write("scan.xyz", text(&points));
    let joined = place.ok(&["preprocess", "scan.xyz", "-o", "s.nm", "--json", "--reach", reach]).json();
    assert!(joined[0]["kinds"]["sparse"].as_f64().unwrap() < 0.0001, "{}", joined[0]);
    assert!((joined[0]["reach"].as_f64().unwrap() - reach.parse::<f64>().unwrap()).abs() < 1e-6);
}

/// Points in mid-air are advised to be removed, not to be joined to a surface, which would fill the room.
#[test]
fn scattered_points_are_outliers() {
    let mut points = grid([0.0, 0.0], [150, 150], 0.02);
    let mut state = 1_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        3.0 * f64::from(state >> 8) / f64::from(1_u32 << 24)
    };
    points.extend((0..60).map(|_| [random(), random(), 0.3 + random()]));
    let (report, told) = examined(&points, &[]);
    let share = report["health"]["outliers"].as_f64().unwrap();
    assert!((0.0018..0.0032).contains(&share), "60 of 22,560 are 0.0027: {share}");
    assert!(find(&told, "in no surface with them").contains("--remove-outliers 8,2"), "{told:?}");
    assert!(!told.iter().any(|line| line.contains("to join them")), "{told:?}");
}

/// Coordinates that were rounded to single precision before they were written are told, and multiples of a
/// coarser grid are not.
#[test]
fn coordinates_that_were_rounded_before_are_told() {
    let place = Place::new();
    let at = |round: fn(f64) -> f64| -> Vec<[f64; 3]> {
        grid([0.0, 0.0], [60, 60], 0.7137)
            .iter()
            .map(|p| [round(500_000.0 + p[0]), round(4_649_776.0 + p[1]), p[2]])
            .collect()
    };
    #[expect(clippy::cast_possible_truncation, reason = "the rounding in question")]
    let rounded: fn(f64) -> f64 = |x| f64::from(x as f32);
    for (name, points, is_rounded) in [
        ("single.xyz", at(rounded), true),
        ("double.xyz", at(|x| x), false),
        ("metres.xyz", at(f64::round), false),
    ] {
        place.write(name, text(&points));
        let done = place.ok(&["preprocess", name, "-o", "scan.nm", "--quiet"]);
        let told = "the coordinates are multiples of 0.5, to which single precision rounds";
        assert_eq!(done.errors.contains(told), is_rounded, "{name}: {}", done.errors);
    }
}

#[test]
fn borders_holes_and_strays_are_told() {
    // A plate of 60 by 60 points, 0.1 apart, with a hole of 20 by 20, and five points far above it.
    let mut points = grid([0.0, 0.0], [60, 60], 0.1);
    points.retain(|p| !((1.95..3.95).contains(&p[0]) && (1.95..3.95).contains(&p[1])));
    for i in 0..5_u8 {
        points.push([f64::from(i), 1.0, 4.0 + 3.0 * f64::from(i)]);
    }
    let (report, told) = examined(&points, &[]);
    // Of 3205 points, 236 are at the outer border and 84 at the hole.
    let border = report["health"]["border"].as_f64().unwrap();
    assert!((0.05..0.16).contains(&border), "about a tenth: {border}");
    let health = find(&told, "health");
    assert!(health.contains("% lie at its border") && !health.contains(" 0 % lie"), "{health}");
    assert!(find(&told, "lie at borders").contains("`collide --margin 0."), "{told:?}");
    let holes = &report["health"]["holes"];
    let widths = numbers(&holes["widths"]);
    assert!(widths[0] > report["reach"].as_f64().unwrap() && (1.5..2.4).contains(&widths[1]), "{holes}");
    assert!((0.01..0.05).contains(&holes["share"].as_f64().unwrap()), "84 of 3205: {holes}");
    let closing = find(&told, "holes wider than the reach").split("--thickened ").nth(1).unwrap();
    let closing: f64 = closing.split('`').next().unwrap().parse().unwrap();
    assert!((0.75..1.2).contains(&closing), "half the hole, less in its corners: {told:?}");
    assert!(!told.iter().any(|line| line.contains("times sparser")), "strays are no sheet: {told:?}");
    assert!(
        find(&told, "in no surface with them").contains("of the points (about 5) are outliers"),
        "{told:?}"
    );
    let kinds = &report["kinds"];
    let alone = kinds["stray"].as_f64().unwrap() + kinds["sparse"].as_f64().unwrap();
    assert!(alone >= 5.0 / 3205.0 - 1e-9, "{kinds}");
}

#[test]
fn more_neighbours_are_advised_where_they_help() {
    use nearmiss_testdata::scanner::{Frame, frame};
    let place = Place::new();
    // The noise is as large as the spacing along a ring: six neighbours spread in all directions,
    // twelve reach the next ring.
    let points = frame(&Frame { beams: 16, steps: 1800, noise: 0.01, seed: 1 });
    place.write("frame.xyz", text(&points));
    let prepare = |k: &str, json: &[&str]| {
        let args = ["preprocess", "frame.xyz", "-o", "frame.nm", "--radius-neighbours", k];
        place.ok(&[&args[..], json].concat())
    };
    let told = prepare("6", &[]).results;
    assert!(
        told.contains("lie on lines")
            && told.contains("use `preprocess --radius-neighbours 12`, use `preprocess --reach "),
        "{told}"
    );
    let lines = |k: &str| prepare(k, &["--json"]).json()[0]["kinds"]["line"].as_f64().unwrap();
    let (few, many) = (lines("6"), lines("12"));
    assert!(few > 0.1 && many < 0.02, "following it helps: {few} to {many}");
}

#[test]
fn advice_is_given_once() {
    let place = Place::new();
    // A solid blob without surfaces: a Kronecker sequence, which is evenly distributed in three
    // dimensions.
    let blob: Vec<[f64; 3]> =
        (1..3000_u16).map(|i| [0.8192, 0.6711, 0.5497].map(|step| f64::from(i) * step % 1.0)).collect();
    place.write("blob.xyz", text(&blob));
    let advice = |options: &[&str]| {
        let done = place.ok(&[&["preprocess", "blob.xyz", "-o", "blob.nm"], options].concat());
        done.results.lines().find(|l| l.contains("a single surface")).expect("a blob is ambiguous").to_owned()
    };
    assert!(advice(&[]).contains("`preprocess --bandwidth 0."), "{}", advice(&[]));
    let chosen = advice(&["--bandwidth", "0.1"]);
    assert!(!chosen.contains("--bandwidth") && chosen.contains("--thickened"), "{chosen}");
}
