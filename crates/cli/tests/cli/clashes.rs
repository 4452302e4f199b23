//! `clash`, and the clashes of `collide --all`.

use nearmiss_testdata::shapes::sphere;

use crate::running::{Place, keys, numbers, shift, sorted};

/// Two balls of radius 1 whose centres are 1.8 apart, a ball beside them, and an odd name.
fn balls() -> Place {
    let place = Place::new();
    place.cloud("a.xyz", sphere(1.0), 0.1);
    place.cloud("b <i> \"c\".xyz", sphere(1.0), 0.1);
    place
}

const B: &str = "b <i> \"c\".xyz";

#[test]
fn two_balls_clash_in_a_circle() {
    let place = balls();
    let pose = shift(1.8, 0.0, 0.0);
    let told = place.ok(&["clash", "a.xyz", B, "--pose-b", &pose, "--json"]).json();
    assert_eq!(
        keys(&told[0]),
        sorted(
            "clashes hard clearance contacts near_contacts clearance_distance link verdict reason complete micros"
        )
    );
    assert_eq!(
        keys(&told[1]),
        sorted(
            "id kind centre size bounds lower upper evidence contacts surroundings depth depth_lower depth_direction \
             point residual source_a source_b"
        )
    );
    assert_eq!(told.len(), 2, "one clash: {told:?}");
    let clash = &told[1];
    assert_eq!((clash["id"].as_u64(), clash["kind"].as_str()), (Some(1), Some("hard")));
    assert!(clash["depth"].is_null() && clash["lower"] == 0.0 && clash["upper"] == 0.0, "{clash}");
    let (centre, size) = (numbers(&clash["centre"]), numbers(&clash["size"]));
    // The circle has radius √(1 − 0.9²) = 0.436 about (0.9, 0, 0).
    assert!((centre[0] - 0.9).abs() < 0.05 && centre[1].abs() < 0.1 && centre[2].abs() < 0.1, "{clash}");
    assert!(size[0] < 0.15 && (size[1] - 0.87).abs() < 0.15 && (size[2] - 0.87).abs() < 0.15, "{clash}");
    let people = place.ok(&["clash", "a.xyz", B, "--pose-b", &pose]).results;
    assert!(people.starts_with("clash  kind") && people.contains("1 clash, all hard."), "{people}");
}

#[test]
fn depths_are_measured_on_request() {
    let place = balls();
    let pose = shift(1.8, 0.0, 0.0);
    let asked = ["clash", "a.xyz", B, "--pose-b", &pose, "--depth"];
    let told = place.ok(&[&asked[..], &["--solid", "both", "--json", "--csv", "c.csv"]].concat()).json();
    let depth = |clash: &serde_json::Value| clash["depth"].as_f64().unwrap();
    let (clash, way) = (&told[1], numbers(&told[1]["depth_direction"]));
    assert!((depth(clash) - 0.2).abs() < 0.06 && way[0] > 0.95, "{clash}");
    let lower = clash["depth_lower"].as_f64().unwrap();
    assert!(lower > 0.1 && lower <= depth(clash), "{clash}");
    let table = std::fs::read_to_string(place.path("c.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|&head| head == name).unwrap();
    assert_eq!(rows[0].len(), rows[1].len());
    for (name, number) in [("depth", depth(clash)), ("depth_lower", lower), ("depth_direction_x", way[0])] {
        assert_eq!(rows[1][column(name)].parse::<f64>().unwrap(), number, "{name}");
    }
    let people = place.ok(&asked).results;
    assert!(people.contains(" deep  "), "{people}");
    let collided = ["collide", "a.xyz", B, "--pose-b", &pose, "--all", "--penetration", "--solid", "both"];
    let all = place.ok(&[&collided[..], &["--json"]].concat()).json();
    assert!((depth(&all[0]["clashes"][0]) - depth(clash)).abs() < 0.02, "{all:?}");
    assert!(place.ok(&collided).results.contains(" deep\n"), "in the list for people");
    place.refused(2, &["clash", "a.xyz", B, "--solid", "b"], &["--depth"]);
}

#[test]
fn clearance_and_no_clash() {
    let place = balls();
    let pose = shift(2.3, 0.0, 0.0);
    let told = place.ok(&["clash", "a.xyz", B, "--pose-b", &pose, "--clearance", "0.5", "--json"]).json();
    assert_eq!((told.len(), told[0]["clearance"].as_u64()), (2, Some(1)), "{told:?}");
    let (lower, upper) = (told[1]["lower"].as_f64().unwrap(), told[1]["upper"].as_f64().unwrap());
    assert!(lower <= 0.3 && 0.28 < upper && upper < 0.35 && lower > 0.0, "{lower} {upper}");
    let asked =
        ["clash", "a.xyz", B, "--pose-b", &pose, "--clearance", "0.2", "--csv", "c.csv", "--html", "c.html"];
    let done = place.ok(&asked);
    assert!(done.results.starts_with("No clash within 0.2; the scans are between 0."), "{}", done.results);
    assert_eq!(std::fs::read_to_string(place.path("c.csv")).unwrap().lines().count(), 1, "a header");
    let page = std::fs::read_to_string(place.path("c.html")).unwrap();
    assert!(page.contains("No clash within 0.2.") && !page.contains("<table>"));
    let told = place.ok(&["clash", "a.xyz", B, "--pose-b", &pose, "--json"]).json();
    assert!(told.len() == 1 && told[0]["clashes"] == 0 && told[0]["verdict"] == "separated", "{told:?}");
}

#[test]
fn pages_and_tables_hold_the_list_and_escape_names() {
    let place = balls();
    let pose = shift(1.8, 0.0, 0.0);
    let asked = ["clash", "a.xyz", B, "--pose-b", &pose, "--csv", "c.csv", "--html", "c.html", "--threads"];
    place.ok(&[&asked[..], &["1"]].concat());
    let (table, page) =
        (std::fs::read(place.path("c.csv")).unwrap(), std::fs::read(place.path("c.html")).unwrap());
    place.ok(&[&asked[..], &["2"]].concat());
    assert_eq!(std::fs::read(place.path("c.csv")).unwrap(), table, "threads change nothing");
    assert_eq!(std::fs::read(place.path("c.html")).unwrap(), page, "threads change nothing");

    let (table, page) = (String::from_utf8(table).unwrap(), String::from_utf8(page).unwrap());
    let rows: Vec<&str> = table.lines().collect();
    assert_eq!(rows.len(), 2, "{table}");
    assert!(rows[0].starts_with("id,kind,centre_x,") && rows[1].starts_with("1,hard,0."), "{table}");
    assert!(rows[1].contains(",\"a.xyz\",\"b <i> \"\"c\"\".xyz\","), "{table}");
    assert_eq!(rows[0].split(',').count(), rows[1].split(',').count(), "{table}");
    assert!(page.contains("b &lt;i&gt; &quot;c&quot;.xyz") && !page.contains("<i>"), "names are escaped");
    assert_eq!(page.matches("data:image/png;base64,").count(), 2, "an overview and a clash");
    assert!(!page.contains("http"), "nothing is loaded");

    let fewer = ["clash", "a.xyz", B, "--pose-b", &pose, "--html", "c.html", "--pictures", "0"];
    place.ok(&fewer);
    let page = std::fs::read_to_string(place.path("c.html")).unwrap();
    assert_eq!(page.matches("data:image/png;base64,").count(), 1, "the overview");
}

#[test]
fn all_contacts_are_counted_grouped_and_written() {
    let place = balls();
    let pose = shift(1.8, 0.0, 0.0);
    let asked = ["collide", "a.xyz", B, "--pose-b", &pose, "--all", "--csv", "c.csv", "--ply", "c.ply"];
    let told = place.ok(&[&asked[..], &["--json"]].concat()).json();
    let contacts = told[0]["contacts"].as_array().unwrap();
    assert_eq!(told[0]["contact_count"].as_u64().unwrap(), contacts.len() as u64);
    let clashes = told[0]["clashes"].as_array().unwrap();
    assert_eq!((clashes.len(), clashes[0]["contacts"].as_u64()), (1, Some(contacts.len() as u64)));
    assert!(contacts.iter().all(|contact| contact["clash"] == 1), "{contacts:?}");
    let table = std::fs::read_to_string(place.path("c.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), contacts.len() + 1);
    for (row, contact) in rows[1..].iter().zip(contacts) {
        assert_eq!((row.len(), row[0]), (rows[0].len(), "1"));
        let point: Vec<f64> = row[1..4].iter().map(|x| x.parse().unwrap()).collect();
        let told = numbers(&contact["point"]);
        assert!(point.iter().zip(told).all(|(x, y)| (x - y).abs() < 1e-12), "{row:?}: {contact}");
    }
    let ply = std::fs::read(place.path("c.ply")).unwrap();
    let head = String::from_utf8_lossy(&ply[..ply.len().min(400)]).into_owned();
    let vertices = format!("element vertex {}", contacts.len());
    for line in [vertices.as_str(), "property float nx", "property uint clash"] {
        assert!(head.contains(line), "`{line}` in {head}");
    }
    let people = place.ok(&asked).results;
    assert!(people.contains(&format!("{} contacts in 1 clash (", contacts.len())), "{people}");
    let listed = |text: &str| text.lines().filter(|line| line.contains(", residual ")).count();
    assert_eq!(listed(&people), contacts.len(), "{people}");

    // Of many contacts people see the first; places are rounded.
    let people = place.ok(&[&asked[..6], &["--margin", "0.5"]].concat()).results;
    assert_eq!(listed(&people), 40, "{people}");
    assert!(people.ends_with(" other contacts; --csv, --ply and --json hold all\n"), "{people}");
    assert!(people.lines().all(|line| line.chars().count() < 160), "{people}");

    // Without a link every contact is alone.
    let alone = place.ok(&[&asked[..6], &["--link", "0", "--json"]].concat()).json();
    assert!(alone[0]["clashes"].as_array().unwrap().len() > 10, "{alone:?}");
}

#[test]
fn wrong_usage_is_refused() {
    let place = balls();
    place.refused(2, &["collide", "a.xyz", B, "--csv", "c.csv"], &["--all"]);
    place.refused(2, &["clash", "a.xyz", B, "--clearance", "-1"], &["--clearance", "zero or more"]);
    place.refused(2, &["clash", "a.xyz", B, "--csv", "a.xyz"], &["a.xyz", "replace the input"]);
    place.refused(2, &["clash", "a.xyz", B, "--csv", "c", "--html", "c"], &["two outputs"]);
    place.refused(1, &["clash", "a.xyz", "none.xyz"], &["none.xyz", "no such file"]);
}
