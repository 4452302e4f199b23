//! `eval` and `export`.

use nearmiss_testdata::shapes::{patch, plates, sphere};

use crate::running::{Place, keys, numbers, sorted};

#[test]
fn f_is_told_where_it_means_something() {
    let place = Place::new();
    place.cloud("patch.xyz", patch(2.0, 2.0), 0.1);
    place.ok(&["preprocess", "patch.xyz", "-o", "patch.nm", "--quiet"]);
    place.write(
        "at.txt",
        "# on, above, beyond the border, far off\n0.01 0.02 0\n0.2, 0.1, 0.03\n\n1.12;0;0\n9 9 9\n",
    );
    let told = place.ok(&["eval", "patch.nm", "--points", "at.txt", "--json"]).json();
    assert_eq!(told.len(), 4);
    for line in &told {
        assert_eq!(keys(line), sorted("f normal centroid support status"));
        let is_ok = line["status"] == "ok";
        assert_eq!((line["f"].is_number(), line["normal"].is_array()), (is_ok, is_ok), "{line}");
        assert!(line["centroid"].is_array(), "{line}");
    }
    let statuses: Vec<_> = told.iter().map(|l| l["status"].as_str().unwrap()).collect();
    assert_eq!(statuses, ["ok", "ok", "border", "outside"]);
    assert!(told[0]["f"].as_f64().unwrap().abs() < 1e-7, "on the plane: {}", told[0]);
    assert!((told[1]["f"].as_f64().unwrap() + 0.03).abs() < 1e-6, "above it: {}", told[1]);
    assert!(numbers(&told[1]["normal"])[2] > 0.999, "its largest component is positive");
    assert_eq!(told[3]["support"], 0);

    let people = place.ok(&["eval", "patch.xyz", "--points", "at.txt"]);
    let starts = ["f = ", "f = -0.03", "border", "outside"];
    for (line, start) in people.results.lines().zip(starts) {
        assert!(line.starts_with(start), "{line}");
    }
}

#[test]
fn between_two_sheets_f_is_ambiguous() {
    let place = Place::new();
    place.cloud("plates.xyz", plates(2.0, 2.0, 0.16), 0.1);
    place.ok(&["preprocess", "plates.xyz", "-o", "plates.nm", "--bandwidth", "0.12", "--quiet"]);
    place.write("at.txt", "0.03 0.02 0");
    let told = place.ok(&["eval", "plates.nm", "--points", "at.txt", "--json"]).json();
    assert_eq!(told[0]["status"], "ambiguous", "{}", told[0]);
    assert!(told[0]["f"].is_null() && told[0]["normal"].is_null(), "{}", told[0]);
}

#[test]
fn points_that_are_none_are_named_by_line() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    for (text, words) in [
        ("0 0 0\n1 2\n", ["at.txt: line 2", "column `z`"]),
        ("0 0 0\n\n1 two 3\n", ["at.txt: line 3", "`two`"]),
        ("0 0 inf\n", ["at.txt: line 1", "`inf`"]),
    ] {
        place.write("at.txt", text);
        place.refused(1, &["eval", "ball.xyz", "--points", "at.txt", "--json"], &words);
    }
    place.write("at.txt", b"0 0 \xff\n");
    place.refused(1, &["eval", "ball.xyz", "--points", "at.txt"], &["line 1", "UTF-8"]);
    place.refused(
        1,
        &["eval", "ball.xyz", "--points", "none.txt"],
        &["none.txt: no such file; check the path"],
    );
    for text in ["", "\n# nothing but a comment\n"] {
        place.write("at.txt", text);
        place.refused(1, &["eval", "ball.xyz", "--points", "at.txt"], &["at.txt: expected points, got none"]);
    }
    place.write("at.txt", "0 0 1\n");
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm", "--quiet"]);
    place.ok(&["export", "ball.nm", "--points", "ball.ply"]);
    for scan in ["ball.nm", "ball.ply"] {
        place.refused(
            1,
            &["eval", "at.txt", "--points", scan],
            &[scan, "check that the two files are not swapped"],
        );
    }
}

#[test]
fn an_export_comes_back() {
    let place = Place::new();
    let input = place.cloud("ball.xyz", sphere(2.0), 0.3);
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm", "--quiet", "--leaf", "8"]);
    place.ok(&["export", "ball.nm", "--points", "p.ply", "--boxes", "b.obj", "--radii", "r.csv"]);

    let given = nearmiss::io::read(&input, None).unwrap().cloud;
    let back = nearmiss::io::read(place.path("p.ply"), None).unwrap().cloud;
    assert_eq!(back.len(), given.len());
    let normals = back.normals().unwrap();
    for i in 0..back.len() {
        let (p, n) = (back.point(i), normals[i].map(f64::from));
        let cosine = (0..3).map(|k| p[k] * n[k] / 2.0).sum::<f64>();
        assert!(cosine.abs() > 0.97, "the normal of a sphere at {p:?}: {n:?}");
    }
    // A row has six values of four bytes, a colour of three bytes, the source and the kind.
    let ply = std::fs::read(place.path("p.ply")).unwrap();
    let header = String::from_utf8_lossy(&ply[..400]).into_owned();
    assert!(header.contains("uchar red") && header.contains("property uint kind"), "{header}");
    let rows = &ply[ply.len() - 35 * given.len()..];
    for (i, row) in rows.chunks(35).enumerate() {
        let [source, kind] = [27, 31].map(|at| u32::from_le_bytes(row[at..at + 4].try_into().unwrap()));
        assert_eq!(back.point(i), given.point(source as usize), "row {i}");
        assert_eq!((kind, &row[24..27]), (0, &[158, 166, 178][..]), "a sphere is a sheet: row {i}");
    }

    let report = place.ok(&["inspect", "ball.nm", "--json"]).json().remove(0);
    let obj = std::fs::read_to_string(place.path("b.obj")).unwrap();
    let count = |text: &str, start: &str| text.lines().filter(|l| l.starts_with(start)).count() as u64;
    let nodes = report["nodes"].as_u64().unwrap();
    assert_eq!((count(&obj, "v "), count(&obj, "l ")), (8 * nodes, 12 * nodes));
    place.ok(&["export", "ball.nm", "--boxes", "b2.obj", "--level", "1"]);
    let level = std::fs::read_to_string(place.path("b2.obj")).unwrap();
    assert_eq!(count(&level, "v "), 8 * 2, "two nodes at depth 1");

    let radii = std::fs::read_to_string(place.path("r.csv")).unwrap();
    let mut lines = radii.lines();
    assert_eq!(lines.next(), Some("i,r,h"));
    let rows: Vec<Vec<f64>> = lines.map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), given.len());
    let in_sampling = rows.iter().filter(|r| r[1] <= report["sampling_radius"].as_f64().unwrap()).count();
    let share = in_sampling as f64 / rows.len() as f64;
    assert!((share - 0.9).abs() < 0.02, "the 0.9-quantile: {share}");
    place.refused(2, &["export", "ball.nm", "--points", "x", "--radii", "x"], &["two outputs"]);
}

/// A plate and points along a line are exported and drawn in the colours of their kinds.
#[test]
fn kinds_are_exported_and_painted() {
    let place = Place::new();
    let mut cloud = String::new();
    for i in 0..40_u8 {
        for j in 0..40_u8 {
            cloud += &format!("{} {} 0\n", f64::from(i) * 0.1, f64::from(j) * 0.1);
        }
    }
    for i in 0..160_u8 {
        cloud += &format!("{} 8 0\n", f64::from(i) * 0.025);
    }
    place.write("scan.xyz", cloud);
    place.ok(&["export", "scan.xyz", "--image", "kinds.png", "--points", "p.ply"]);
    let (width, pixels) = place.picture("kinds.png");
    assert!(width > 1500, "{width}");
    // Lines are green.
    let green = pixels.chunks(3).filter(|p| p[1] > p[0].saturating_add(60) && p[1] > p[2].saturating_add(20));
    let count = green.count();
    assert!(count > 1000, "the line and its patch of the legend: {count} pixels");
    let ply = std::fs::read(place.path("p.ply")).unwrap();
    let rows = &ply[ply.len() - 35 * 1760..];
    let kinds = rows.chunks(35).map(|row| u32::from_le_bytes(*row.last_chunk().unwrap()));
    let lines = kinds.clone().filter(|&kind| kind == 3).count();
    let sheets = kinds.filter(|&kind| kind == 0).count();
    assert!((130..=160).contains(&lines) && (1400..=1600).contains(&sheets), "{lines} and {sheets}");
    place.refused(2, &["export", "scan.xyz", "--image", "kinds.jpg"], &["pictures are PNG"]);
}

#[test]
fn the_samples_of_a_level_come_with_their_coverings() {
    let place = Place::new();
    let input = place.cloud("ball.xyz", sphere(2.0), 0.3);
    let given = nearmiss::io::read(&input, None).unwrap().cloud;
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm", "--quiet", "--leaf", "8"]);
    place.ok(&["export", "ball.nm", "--samples", "s.ply", "--level", "2"]);
    let back = nearmiss::io::read(place.path("s.ply"), None).unwrap().cloud;
    assert_eq!(back.len(), 8 * 16, "eight nodes of sixteen samples");
    let ply = std::fs::read(place.path("s.ply")).unwrap();
    // A row has three values of eight bytes, the source, the node, the covering radius and the
    // sampling radius.
    let rows = &ply[ply.len() - 40 * back.len()..];
    let mut nodes = Vec::new();
    for (i, row) in rows.chunks(40).enumerate() {
        let words: Vec<[u8; 4]> = row[24..].chunks(4).map(|word| word.try_into().unwrap()).collect();
        let source = u32::from_le_bytes(words[0]) as usize;
        assert_eq!(back.point(i), given.point(source), "row {i}");
        nodes.push(u32::from_le_bytes(words[1]));
        let [covering, sampling] = [words[2], words[3]].map(f32::from_le_bytes);
        assert!(0.0 < sampling && sampling < covering && covering < 3.0, "{sampling}, {covering}");
    }
    nodes.dedup();
    assert_eq!(nodes.len(), 8, "{nodes:?}");
    place.refused(2, &["export", "ball.nm", "--samples", "s.ply"], &["--level"]);
    place.refused(2, &["export", "ball.nm", "--points", "p.ply", "--level", "1"], &["--samples"]);
}
