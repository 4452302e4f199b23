//! Reports of how far to move one thing out of another.

use crate::running::{Place, numbers, shift};
use nearmiss_testdata::shapes::{patch, sphere};

#[test]
fn a_penetration_tells_how_to_get_scans_apart() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.05);
    place.cloud("floor.xyz", patch(4.0, 4.0), 0.05);
    let pose = shift(0.1, 0.2, 0.7);
    let asked = ["collide", "floor.xyz", "ball.xyz", "--pose-b", &pose, "--penetration", "--quiet"];
    let answer = place.ok(&[&asked[..], &["--solid", "b", "--json"]].concat()).json().remove(0);
    let found = &answer["penetration"];
    let [lower, upper] = ["lower", "upper"].map(|key| found[key].as_f64().unwrap());
    assert!(lower > 0.2 && lower < 0.33 && (upper - 0.3).abs() < 0.05, "{answer}");
    assert!(numbers(&found["direction"])[2] > 0.98, "{answer}");
    let words = place.ok(&[&asked[..], &["--solid", "b"]].concat()).results;
    assert!(words.contains("Moving b by 0.3") && words.contains("no move below 0.2"), "{words}");
    let hollow = place.ok(&asked).results;
    assert!(hollow.contains("a shorter move may be enough"), "{hollow}");
    let short = place.ok(&[&asked[..], &["--work", "100", "--json"]].concat()).json().remove(0);
    assert!(short["penetration"]["complete"] == false, "{short}");
    place.write("poses.txt", "0 0 0.7 0 0 0 1\n0 0 3 0 0 0 1\n");
    let options = ["--poses", "poses.txt", "--penetration", "--solid", "b", "--csv", "path.csv", "--quiet"];
    let many = place.ok(&[&asked[..3], &options].concat()).results;
    assert_eq!(many.matches("Moving b by").count(), 1, "{many}");
    assert!(
        many.contains("2 poses: 1 touches (") && many.contains("Greatest way out: moving b by 0.3"),
        "{many}"
    );
    let table = std::fs::read_to_string(place.path("path.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0][11..], ["penetration_lower", "penetration_upper"], "{table}");
    let [lower, upper] = [11, 12].map(|k| rows[1][k].parse::<f64>().unwrap());
    assert!(lower > 0.2 && lower < upper && (upper - 0.3).abs() < 0.05, "{table}");
    assert_eq!(rows[2][11..], ["", ""], "{table}");
}

/// The same box as a mesh, as a and as b, in a floor.
#[test]
fn a_penetration_tells_how_to_get_a_mesh_and_a_scan_apart() {
    let place = Place::new();
    place.cloud("floor.xyz", patch(4.0, 4.0), 0.05);
    let corners = (0..8_u8).map(|n| [1, 2, 4].map(|bit| if n & bit == 0 { -0.5 } else { 0.5 }));
    let corners = corners.map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = ["1 2 4 3", "5 6 8 7", "1 2 6 5", "3 4 8 7", "1 3 7 5", "2 4 8 6"];
    let faces = faces.map(|face| format!("f {face}\n"));
    place.write("box.obj", &(corners.collect::<String>() + &faces.concat()));
    let pose = shift(0.1, 0.2, 0.3);
    let ask = |asked: &[&str]| {
        let answer = place.ok(&[&["collide"], asked, &["--penetration", "--quiet"]].concat());
        answer.json().remove(0)["penetration"].clone()
    };
    let of_b = ask(&["floor.xyz", "box.obj", "--as-mesh", "b", "--pose-b", &pose, "--json"]);
    let of_a = ask(&["box.obj", "floor.xyz", "--as-mesh", "a", "--pose-a", &pose, "--json"]);
    for (found, sign) in [(&of_b, 1.0), (&of_a, -1.0)] {
        let [lower, upper] = ["lower", "upper"].map(|key| found[key].as_f64().unwrap());
        assert!(lower > 0.15 && lower <= 0.2 + 1e-6 && (upper - 0.2).abs() < 0.02, "{found}");
        assert!(sign * numbers(&found["direction"])[2] > 0.99, "{found}");
    }
    let asked = ["collide", "floor.xyz", "box.obj", "--as-mesh", "b", "--pose-b", &pose, "--penetration"];
    let words = place.ok(&[&asked[..], &["--quiet"]].concat()).results;
    assert!(words.contains("Moving b by 0.2") && words.contains("no move below 0.1"), "{words}");
    for which in ["b", "both"] {
        let refused = place.run(&[&asked[..], &["--solid", which]].concat());
        let wanted = format!("got --solid {which}");
        assert!(refused.status == 2 && refused.errors.contains(&wanted), "{}", refused.errors);
    }
}
