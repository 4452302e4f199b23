//! `distance`.

use nearmiss_testdata::shapes::sphere;

use crate::running::{Place, keys, numbers, shift, sorted};

#[test]
fn two_spheres_are_as_far_apart_as_they_are() {
    let place = Place::new();
    place.cloud("one.xyz", sphere(1.0), 0.05);
    let pose = shift(3.0, 0.0, 0.0);
    let asked = ["distance", "one.xyz", "one.xyz", "--pose-b", &pose, "--json"];
    let told = place.ok(&asked).json().remove(0);
    let expected =
        "lower upper points band evidence source_a source_b evaluations node_pairs leaf_pairs micros";
    assert_eq!(keys(&told), sorted(expected));
    let [lower, upper] = ["lower", "upper"].map(|key| told[key].as_f64().unwrap());
    // Both surfaces are slightly inside their spheres.
    assert!(lower > 0.7 && lower <= upper && (1.0..1.01).contains(&upper), "{told}");
    assert_eq!(told["evidence"], "certified", "{told}");
    let points = numbers(&serde_json::json!([told["points"][0][0], told["points"][1][0]]));
    assert!((points[0] - 1.0).abs() < 0.01 && (points[1] - 2.0).abs() < 0.01, "{told}");

    let people = place.ok(&asked[..5]).results;
    assert!(people.starts_with("They are between 0.9") && people.contains(" and 1.0"), "{people}");
    assert!(
        people.contains(" apart (certified); the scans themselves are known to their local spacing of 0."),
        "{people}"
    );
    let band = told["band"].as_f64().unwrap();
    assert!((0.05..0.15).contains(&band), "a spacing of 0.05: {told}");
    let thick = [&asked[..], &["--thickened", "0.25"]].concat();
    let told = place.ok(&thick).json().remove(0);
    assert_eq!(told["lower"], told["upper"], "of points exact");
    assert!((told["upper"].as_f64().unwrap() - 0.5).abs() < 0.02, "{told}");
    let people = [&asked[..5], &["--thickened", "0.25"]].concat();
    assert!(place.ok(&people).results.starts_with("They are 0."), "exact");

    let near = ["distance", "one.xyz", "one.xyz", "--pose-b", &shift(2.3, 0.0, 0.0)];
    let limits = " apart, more than the 10 % of --relative, because of this spacing.";
    let told = place.ok(&near).results;
    assert!(told.contains(limits), "{told}");
    let exact = place.ok(&[&near[..], &["--json"]].concat()).json().remove(0);
    let [least, most, band] = ["lower", "upper", "band"].map(|key| exact[key].as_f64().unwrap());
    let stay: f64 =
        told.split("The bounds stay ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((stay - (most - least)).abs() < 0.06 * stay, "{told}, {exact}");
    assert!(most - least > 0.1 * most && most - least < 2.0 * band, "{exact}");
    for options in [&["--relative", "0.5"][..], &["--thickened", "0.01"], &["--work", "40"]] {
        let told = place.ok(&[&near[..], options].concat()).results;
        assert!(!told.contains(limits), "{options:?}: {told}");
    }

    let short = place.ok(&[&asked[..], &["--work", "40"]].concat()).json().remove(0);
    assert_eq!(short["complete"], false, "{short}");
    let bounds = ["lower", "upper"].map(|key| short[key].as_f64().unwrap());
    assert!(bounds[0] <= lower && bounds[1] >= upper, "{short}");
    assert!(place.ok(&[&asked[..5], &["--budget", "0us"]].concat()).results.contains("budget ran out"));
}

#[test]
fn what_meets_is_at_distance_zero_and_lines_are_answered_in_order() {
    let place = Place::new();
    place.cloud("one.xyz", sphere(1.0), 0.05);
    let pose = shift(1.0, 0.0, 0.0);
    let asked = ["distance", "one.xyz", "one.xyz", "--pose-b", &pose];
    assert!(place.ok(&asked).results.starts_with("They touch (certified); gaps below 0."));
    place.ok(&["poses", "one.xyz", "one.xyz", "--sweep", "--per-distance", "1", "-o", "poses.jsonl"]);
    let told = place.ok(&["distance", "one.xyz", "one.xyz", "--poses", "poses.jsonl", "--json"]).json();
    assert_eq!(told.len(), 13, "a line a pose");
    let upper: Vec<f64> = told.iter().map(|line| line["upper"].as_f64().unwrap()).collect();
    assert!(upper[7..8].iter().all(|&d| d <= 1e-9) && (upper[12] - 1.0).abs() < 0.02, "{upper:?}");
    let people = place.ok(&["distance", "one.xyz", "one.xyz", "--poses", "poses.jsonl"]).results;
    assert!(people.lines().nth(12).unwrap().starts_with("line 13: They are between 0."), "{people}");
}

#[test]
fn a_relative_precision_is_reached() {
    let place = Place::new();
    place.cloud("one.xyz", sphere(1.0), 0.05);
    let lower = |relative: &[&str]| {
        let pose = shift(12.0, 0.0, 0.0);
        let asked = ["distance", "one.xyz", "one.xyz", "--pose-b", &pose, "--json"];
        let told = place.ok(&[&asked[..], relative].concat()).json().remove(0);
        let [lower, upper] = ["lower", "upper"].map(|key| told[key].as_f64().unwrap());
        assert!((upper - 10.0).abs() < 0.02, "{told}");
        lower / upper
    };
    let [rough, default, fine] = [&["--relative", "0.5"][..], &[], &["--relative", "0.02"]].map(lower);
    assert!(rough >= 0.5 && default >= 0.9 && fine >= 0.98, "{rough}, {default}, {fine}");
    assert!(rough <= default && default <= fine, "{rough}, {default}, {fine}");
}

#[test]
fn a_picture_shows_the_segment() {
    let place = Place::new();
    place.cloud("one.xyz", sphere(1.0), 0.1);
    let pose = shift(3.0, 0.0, 0.0);
    place.ok(&["distance", "one.xyz", "one.xyz", "--pose-b", &pose, "--image", "d.png"]);
    let (width, pixels) = place.picture("d.png");
    let count = |is: fn(&[u8]) -> bool| pixels.chunks(3).filter(|p| is(p)).count();
    let [blue, orange] =
        [count(|p| p[2] > p[0].saturating_add(60)), count(|p| p[0] > p[2].saturating_add(60))];
    assert!(blue > 10_000 && orange > 10_000, "{blue} blue and {orange} orange pixels");
    // A dark horizontal line crosses the close view, over half its width or more.
    let longest = pixels
        .chunks(3 * width)
        .take(780)
        .map(|row| row[3 * (width / 2)..].chunks(3).filter(|p| p.iter().all(|&c| c < 90)).count())
        .max();
    assert!(longest > Some(200), "{longest:?}");
    let both = ["distance", "one.xyz", "one.xyz", "--image", "d.png", "--poses", "p.jsonl"];
    place.refused(2, &both, &["cannot be used with"]);
    place.refused(2, &["distance", "one.xyz", "one.xyz", "--image", "d.jpg"], &["pictures are PNG"]);
}

#[test]
fn pictures_are_taken_from_where_it_is_said() {
    let place = Place::new();
    place.cloud("one.xyz", sphere(1.0), 0.1);
    let pose = shift(0.0, 0.0, 3.0);
    let ask = |options: &[&str]| {
        let asked = ["distance", "one.xyz", "one.xyz", "--pose-b", &pose, "--image", "d.png"];
        place.ok(&[&asked[..], options].concat());
        let (width, pixels) = place.picture("d.png");
        // The mean column and row of what is blue, and of what is orange, in the whole view.
        let middle = |is: fn(&[u8]) -> bool| {
            let inside = |&i: &usize| i % width < width / 2 && i / width < 790;
            let all: Vec<usize> =
                (0..pixels.len() / 3).filter(inside).filter(|i| is(&pixels[3 * i..3 * i + 3])).collect();
            [0, 1].map(|k| {
                let sum: usize = all.iter().map(|i| if k == 0 { i % width } else { i / width }).sum();
                sum / all.len().max(1)
            })
        };
        [middle(|p| p[2] > p[0].saturating_add(60)), middle(|p| p[0] > p[2].saturating_add(60))]
    };
    let [[ax, ay], [bx, by]] = ask(&["--up", "z"]);
    assert!(ay > by + 200 && ax.abs_diff(bx) < 20, "b is above a: {ax}, {ay}, {bx}, {by}");
    let [[ax, ay], [bx, by]] = ask(&["--up", "-z", "--view", "30,10"]);
    assert!(by > ay + 200 && ax.abs_diff(bx) < 20, "below: {ax}, {ay}, {bx}, {by}");
    // Seen from +x with y up, +z is to the left.
    let [[ax, ay], [bx, by]] = ask(&["--up", "y", "--view", "90,0"]);
    assert!(ax > bx + 200 && ay.abs_diff(by) < 20, "to the left: {ax}, {ay}, {bx}, {by}");

    let refused = |options: &[&str], told: &str| {
        for command in [&["distance", "one.xyz", "one.xyz"][..], &["collide", "one.xyz", "one.xyz"]] {
            place.refused(2, &[command, options].concat(), &[told]);
        }
    };
    refused(&["--image", "d.png", "--up", "w"], "expected x, y, z, -x, -y or -z, got `w`");
    refused(&["--image", "d.png", "--view", "30"], "such as 30,20");
    refused(&["--image", "d.png", "--view", "30,95"], "the elevation from -90 to 90");
    refused(&["--up", "z"], "--image");
    place.refused(2, &["export", "one.xyz", "--points", "p.ply", "--up", "z"], &["--image"]);
    let curve = ["curve", "one.xyz", "one.xyz", "-o", "c.ply", "--view", "0,0"];
    place.refused(2, &curve, &["--image"]);
}

#[test]
fn distances_are_refused_with_a_reason() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    let both = |options: &[&'static str]| [&["distance", "ball.xyz", "ball.xyz"][..], options].concat();
    for (options, word) in [
        (&["--thickened", "-1"][..], "zero or more"),
        (&["--budget", "5"], "the unit ns"),
        (&["--relative", "1"], "at least 0 and less than 1"),
        (&["--pose-b", "1 2 3"], "got 3"),
        (&["--thickened", "1", "--kernel", "geodesic"], "cannot be used with"),
    ] {
        place.refused(2, &both(options), &[word]);
    }
    place.refused(1, &["distance", "ball.xyz", "none.xyz"], &["none.xyz", "no such file"]);
}
