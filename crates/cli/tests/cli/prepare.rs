//! `preprocess` and `inspect`.

use nearmiss_testdata::dragon::{Dragon, dragon_path};
use nearmiss_testdata::shapes::{bowl, sphere};

use crate::running::{Place, keys, name, numbers, sorted, text};

const FIELDS: &str = "points dropped bounds kernel sampling_radius reach bandwidth horizon support_min nodes leaves depth_mean \
                      bytes bytes_per_node usable kinds health graph";

#[test]
fn the_report_has_the_fields_that_scripts_rely_on() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.1);
    let done = place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm", "--close-pairs", "--json"]);
    let [report] = &done.json()[..] else { panic!("one line: {}", done.results) };
    assert_eq!(keys(report), sorted(&format!("{FIELDS} seconds")));
    assert_eq!(keys(&report["dropped"]), ["duplicate", "not_finite"]);
    assert_eq!(keys(&report["seconds"]), ["graph", "hierarchy", "read", "write"]);
    let graph = &report["graph"];
    assert_eq!(keys(graph), sorted("edges virtual_edges components close_pairs border oriented"));
    assert_eq!(graph["components"].as_u64(), Some(1), "{graph}");
    let of_graph = |field: &str| graph[field].as_f64().unwrap() / report["points"].as_f64().unwrap();
    assert!((6.0..12.0).contains(&of_graph("edges")), "{graph}");
    assert!((30.0..80.0).contains(&of_graph("close_pairs")), "{graph}");
    assert!(graph["oriented"].as_f64().unwrap() > 0.99, "{graph}");
    assert_eq!(done.errors, "", "nothing but results, off a terminal");

    let number = |field: &str| report[field].as_f64().unwrap();
    let bytes = std::fs::metadata(place.path("ball.nm")).unwrap().len();
    assert_eq!(report["bytes"].as_u64(), Some(bytes));
    assert!((100.0..=250.0).contains(&number("bytes_per_node")), "{report}");
    let inner = number("nodes") / number("leaves") - 1.0;
    assert!((0.33..0.67).contains(&inner), "two to four leaves a node: {report}");
    let depth = number("leaves").log2() / 2.0;
    assert!((number("depth_mean") - depth).abs() < 1.0, "balanced: {} for {depth}", number("depth_mean"));
    let radius = number("sampling_radius");
    assert!((0.1..0.25).contains(&radius), "radius {radius} at a spacing of 0.1");
    assert!(number("horizon") > number("bandwidth") && number("bandwidth") > 0.0, "{report}");
    assert!(number("usable") > 0.99, "a clean sphere");
    let kinds = &report["kinds"];
    let names = ["edge", "line", "noisy", "sheet", "sparse", "stray"];
    assert_eq!(keys(kinds), names);
    let share = |kind: &str| kinds[kind].as_f64().unwrap();
    assert!((share("sheet") + share("edge") - number("usable")).abs() < 1e-12, "{kinds}");
    let all: f64 = names.map(share).iter().sum();
    assert!((all - 1.0).abs() < 1e-12, "{kinds}");
    assert!((number("reach") - 2.0 * radius).abs() < 1e-6, "the default: {report}");
    let health = &report["health"];
    assert_eq!(keys(health), sorted("balls largest_ball border outliers uneven holes beyond_reach"));
    assert!(health["border"].as_f64().unwrap() < 0.005, "a closed surface: {health}");
    assert!(health["uneven"].is_null() && health["holes"].is_null(), "{health}");

    let mut seen = place.ok(&["inspect", "ball.nm", "--verify", "--json"]).json().remove(0);
    let version = seen.as_object_mut().unwrap().remove("format_version").unwrap();
    assert_eq!(version.as_u64(), Some(11));
    let mut told = report.clone();
    told.as_object_mut().unwrap().remove("seconds");
    assert_eq!(seen, told, "inspect sees what preprocess told");
}

#[test]
fn a_graph_is_made_where_it_is_asked_for() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.1);
    let mut sizes = Vec::new();
    for asked in [&[][..], &["--graph"], &["--close-pairs"], &["--paths", "stored"]] {
        let mut words = vec!["preprocess", "ball.xyz", "-o", "ball.nm", "--json"];
        words.extend(asked);
        let report = place.ok(&words).json().remove(0);
        sizes.push(report["bytes"].as_u64().unwrap());
        let seen = place.ok(&["inspect", "ball.nm", "--verify", "--json"]).json().remove(0);
        assert_eq!(seen["graph"], report["graph"], "{asked:?}");
        assert_eq!(report["graph"].is_null(), asked.is_empty(), "{asked:?}");
    }
    assert!(sizes.is_sorted_by(|a, b| a < b), "{sizes:?}");
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm"]);
    place.refused(1, &["export", "ball.nm", "--edges", "e.csv"], &["ball.nm", "--graph"]);
    // Options of the graph imply --graph.
    for asked in [["--neighbours", "5"], ["--scanner", "0,0,0"]] {
        let words = [&["preprocess", "ball.xyz", "-o", "ball.nm", "--json"][..], &asked].concat();
        let report = place.ok(&words).json().remove(0);
        assert_eq!(report["graph"]["close_pairs"].as_u64(), Some(0), "{report}");
    }
    for asked in [
        &["export", "ball.nm", "--close-pairs", "c.csv"][..],
        &["export", "ball.nm", "--edges", "e.csv", "--close-pairs", "c.csv"],
        &["eval", "ball.nm", "--points", "ball.xyz", "--kernel", "geodesic"],
    ] {
        place.refused(1, asked, &["ball.nm", "-o ball.nm --close-pairs`"]);
    }
    place.refused(2, &["preprocess", "ball.xyz", "-o", "ball.nm", "--scanner", "1,2"], &["--scanner"]);
}

/// The indices of edges and close pairs are those of exported points, and their lengths match these
/// points.
#[test]
fn edges_and_close_pairs_are_exported() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.1);
    let asked = ["export", "ball.xyz", "--points", "p.ply", "--edges", "e.csv", "--close-pairs", "c.csv"];
    place.ok(&asked);
    let points = nearmiss::io::read(place.path("p.ply"), None).unwrap().cloud;
    let rows = |name: &str, header: &str| {
        let text = std::fs::read_to_string(place.path(name)).unwrap();
        let (first, rest) = text.split_once('\n').unwrap();
        assert_eq!(first, header);
        let row = |line: &str| line.split(',').map(|c| c.parse::<f64>().unwrap()).collect::<Vec<_>>();
        rest.lines().map(row).collect::<Vec<_>>()
    };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "indices")]
    let straight = |i: f64, j: f64| {
        let [p, q] = [i, j].map(|i| points.point(i as usize));
        (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
    };
    let edges = rows("e.csv", "i,j,length,virtual");
    assert!(edges.len() > 5 * points.len(), "{} edges of {} points", edges.len(), points.len());
    for edge in &edges {
        assert!(edge[0] < edge[1] && (edge[3] == 0.0 || edge[3] == 1.0), "{edge:?}");
        assert!((straight(edge[0], edge[1]) - edge[2]).abs() < 1e-5, "{edge:?}");
    }
    let pairs = rows("c.csv", "i,j,distance");
    assert!(pairs.len() > 30 * points.len(), "{} pairs", pairs.len());
    for pair in pairs.iter().step_by(17) {
        assert!(pair[2] >= straight(pair[0], pair[1]) - 1e-5, "no way is shorter: {pair:?}");
    }
}

#[test]
fn people_read_a_health_line_and_advice() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.1);
    let done = place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm"]);
    assert!(done.results.lines().last().unwrap().starts_with("health"), "{}", done.results);
    assert!(done.results.contains("100 % of the points sample a surface\n"), "{}", done.results);

    // Rings whose distance is a thousand times the spacing of their points.
    let rings: Vec<[f64; 3]> = (0..20_u8)
        .flat_map(|ring| (0..600_u16).map(move |i| (f64::from(ring), f64::from(i) * 0.01)))
        .map(|(ring, turn)| [3.0 * turn.cos(), 3.0 * turn.sin(), 30.0 * ring])
        .collect();
    place.write("rings.xyz", text(&rings));
    let done = place.ok(&["preprocess", "rings.xyz", "-o", "rings.nm"]);
    let advice = done.results.lines().find(|line| line.contains("lie on lines")).unwrap();
    assert!(
        advice.contains("use `preprocess --reach ") && advice.contains("merge several frames"),
        "{advice}"
    );
    assert!(!advice.contains("--radius-neighbours"), "radii grow along lines by themselves: {advice}");
    let health = done.results.lines().find(|line| line.starts_with("health")).unwrap();
    assert!(health.contains("count as balls of radius up to") && health.contains("on lines"), "{health}");
    // Balls give a verdict. Surfaces alone give none, but the answer names remedies.
    let pose = ["--pose-b", "1 0 0 .09 0 1 0 .03 0 0 1 .01 0 0 0 1"];
    let ask = |options: &[&str]| {
        place.ok(&[&["collide", "rings.nm", "rings.nm"], &pose[..], options].concat()).results
    };
    let told = ask(&[]);
    assert!(told.starts_with("They touch at ") && told.contains("(certified)"), "{told}");
    let told = ask(&["--surface-only"]);
    assert!(told.contains("sampled as lines; leave out --surface-only, set --thickened"), "{told}");
    // The remedy gives a verdict.
    let radius = told.split_once("--thickened ").unwrap().1.split([',', ' ']).next().unwrap();
    let decided = ask(&["--thickened", radius]);
    assert!(decided.starts_with("Balls of radius"), "{decided}");
    let seen = place.ok(&["inspect", "rings.nm", "--verify"]);
    assert!(seen.results.contains("advice") && seen.results.contains("verified"), "{}", seen.results);
}

#[test]
fn sizes_are_told_a_point_and_odd_numbers_with_exponents() {
    let place = Place::new();
    for (name, scale) in [("vast.xyz", 1e20), ("tiny.xyz", 1e-20)] {
        let points: Vec<[f64; 3]> = sphere(1.0)
            .sample(nearmiss_testdata::shapes::Sampling::clean(0.2))
            .points
            .iter()
            .map(|p| p.map(|c| c * scale))
            .collect();
        place.write(name, text(&points));
        let told = place.ok(&["preprocess", name, "-o", "out.nm"]).results;
        assert!(told.contains(" bytes per point"), "{told}");
        assert!(told.lines().filter(|l| !l.starts_with("advice")).all(|l| l.len() < 150), "{told}");
    }
}

#[test]
fn threads_do_not_change_a_byte() {
    let place = Place::new();
    let dragon = dragon_path(Dragon::Points5k);
    for threads in ["1", "2", "0"] {
        place.ok(&[
            "preprocess",
            name(&dragon),
            "-o",
            &format!("{threads}.nm"),
            "--threads",
            threads,
            "--quiet",
        ]);
    }
    let [one, two, all] = ["1.nm", "2.nm", "0.nm"].map(|n| std::fs::read(place.path(n)).unwrap());
    assert!(one == two && one == all, "the same bytes");
}

#[test]
fn options_reach_the_surface() {
    let place = Place::new();
    place.cloud("bowl.xyz", bowl(1.0), 0.1);
    let report = |options: &[&str]| {
        let args = [&["preprocess", "bowl.xyz", "-o", "bowl.nm", "--json"], options].concat();
        place.ok(&args).json().remove(0)
    };
    let plain = report(&[]);
    let fixed = report(&["--bandwidth", "0.25"]);
    assert!((fixed["bandwidth"].as_f64().unwrap() - 0.25).abs() < 1e-6, "{fixed}");
    let wider = report(&["--radius-neighbours", "12"]);
    assert!(wider["sampling_radius"].as_f64() > plain["sampling_radius"].as_f64(), "{wider}");
    let smaller = report(&["--leaf", "4"]);
    assert!(smaller["leaves"].as_u64() > plain["leaves"].as_u64(), "{smaller}");
    let wendland = report(&["--weight", "wendland", "--bandwidth", "global"]);
    assert_ne!(wendland["bandwidth"], plain["bandwidth"]);
    assert_eq!(report(&["--format", "XYZ"])["points"], plain["points"]);
}

#[test]
fn what_is_dropped_is_counted_and_large_faces_are_warned_about() {
    let place = Place::new();
    let mut points = String::from("0 0 0\n0 0 0\nnan 1 1\n");
    for i in 0..20_u8 {
        points += &format!("{} {} 0\n", i % 5 + 1, i / 5);
    }
    place.write("odd.xyz", points);
    let report = place.ok(&["preprocess", "odd.xyz", "-o", "odd.nm", "--json"]).json().remove(0);
    assert_eq!(report["points"], 21);
    assert_eq!((&report["dropped"]["not_finite"], &report["dropped"]["duplicate"]), (&1.into(), &1.into()));
    assert_eq!(numbers(&report["bounds"][1]), [5.0, 3.0, 0.0]);

    // A dense patch, and one face that extends far beyond it.
    let mut mesh = String::new();
    for i in 0..100_u8 {
        mesh += &format!("v {} {} 0\n", i % 10, i / 10);
    }
    mesh += "v 500 0 0\nv 0 500 0\nf 1 2 12\nf 1 101 102\n";
    place.write("large.obj", mesh);
    let done = place.ok(&["preprocess", "large.obj", "-o", "large.nm", "--json"]);
    assert!(done.errors.starts_with("warning: large.obj: 100 % of the mesh's surface"), "{}", done.errors);
    assert_eq!(done.json().len(), 1, "results stay clean");

    // A beam of eight vertices: no edge is long beside their spacing.
    let corner = |i: u8| format!("v {} {} {}\n", 6 * (i & 1), i >> 1 & 1, i >> 2);
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    place.write("beam.obj", (0..8).map(corner).collect::<String>() + faces);
    let done = place.ok(&["clash", "odd.xyz", "beam.obj"]);
    let warning = "warning: beam.obj: the vertices of this mesh are about ";
    assert!(done.errors.starts_with(warning) && done.errors.contains("`sample`"), "{}", done.errors);
}

#[test]
fn far_from_the_origin_nothing_is_lost() {
    let place = Place::new();
    let shape = sphere(1.0).sample(nearmiss_testdata::shapes::Sampling::clean(0.1));
    let offset = [1e6, -2e6, 300.0];
    let mut ply = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nend_header\n",
        shape.points.len()
    )
    .into_bytes();
    let far = shape.points.iter().map(|p| [0, 1, 2].map(|k| p[k] + offset[k]));
    let far: Vec<[f64; 3]> = far.collect();
    for x in far.as_flattened() {
        ply.extend(x.to_le_bytes());
    }
    place.write("far.ply", ply);
    let done = place.ok(&["preprocess", "far.ply", "-o", "far.nm", "--json"]);
    assert_eq!(done.errors, "", "no warning: the step is small");
    let report = done.json().remove(0);
    for k in 0..3 {
        let bounds = [0, 1].map(|side| report["bounds"][side][k].as_f64().unwrap() - offset[k]);
        assert!((bounds[0] + 1.0).abs() < 0.05 && (bounds[1] - 1.0).abs() < 0.05, "axis {k}: {bounds:?}");
    }

    place.ok(&["export", "far.nm", "--points", "out.ply"]);
    let back = nearmiss::io::read(place.path("out.ply"), None).unwrap().cloud;
    assert_eq!(back.len(), far.len());
    let sources =
        place.ok(&["eval", "far.nm", "--points", name(&place.write("x.xyz", text(&far[..1]))), "--json"]);
    assert!(sources.json()[0]["f"].as_f64().unwrap().abs() < 0.02, "{}", sources.results);
    let centroid = numbers(&sources.json()[0]["centroid"]);
    assert!((0..3).all(|k| (centroid[k] - far[0][k]).abs() < 0.1), "{centroid:?} near {:?}", far[0]);

    let pose = crate::running::shift(0.3, 0.0, 0.0);
    let done = place.ok(&["collide", "far.nm", "far.nm", "--pose-b", &pose, "--json"]);
    let witness = numbers(&done.json()[0]["witness"]);
    let local = [0, 1, 2].map(|k| witness[k] - offset[k]);
    let middle = (0..3).map(|k| local[k] * local[k]).sum::<f64>().sqrt();
    assert!((middle - 1.0).abs() < 0.02 && (local[0] - 0.15).abs() < 0.02, "the circle x = 0.15: {local:?}");
}

/// The kernel of a scan is chosen by `preprocess`, stored, reported, and enforced.
#[test]
fn scans_are_prepared_for_a_kernel() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.1);
    let prepare = |kernel: &str, to: &str| {
        let words = ["preprocess", "ball.xyz", "-o", to, "--kernel", kernel, "--json"];
        let report = place.ok(&words).json().remove(0);
        let seen = place.ok(&["inspect", to, "--verify", "--json"]).json().remove(0);
        assert_eq!([&report["kernel"], &seen["kernel"]], [kernel; 2]);
        let told = place.ok(&["inspect", to]).results;
        assert!(told.contains(&format!("surface    {kernel} kernel")), "{told}");
    };
    prepare("euclidean", "straight.nm");
    prepare("geodesic", "along.nm");

    let touching = crate::running::shift(1.2, 0.0, 0.0);
    let ask = |a: &str, b: &str, options: &[&str]| {
        place.ok(&[&["collide", a, b, "--pose-b", &touching, "--json"], options].concat()).json().remove(0)
    };
    let geodesic = ["--kernel", "geodesic"];
    let expected = ask("along.nm", "along.nm", &geodesic);
    assert_eq!((&expected["verdict"], &expected["evidence"]), (&"intersecting".into(), &"certified".into()));
    // Raw inputs are prepared for the kernel given, or for that of the other scan.
    for (a, b, options) in [
        ("along.nm", "along.nm", &[][..]),
        ("ball.xyz", "ball.xyz", &geodesic),
        ("ball.xyz", "along.nm", &[]),
        ("along.nm", "ball.xyz", &[]),
    ] {
        assert_eq!(ask(a, b, options)["witness"], expected["witness"], "{a} and {b}");
    }
    assert_ne!(ask("straight.nm", "ball.xyz", &[])["witness"], expected["witness"], "straight distances");
    assert_eq!(ask("straight.nm", "along.nm", &["--thickened", "0.1"])["verdict"], "intersecting");
    for (words, said) in [
        (&["straight.nm", "along.nm"][..], "along.nm"),
        (&["straight.nm", "straight.nm", "--kernel", "geodesic"], "straight.nm"),
        (&["ball.xyz", "along.nm", "--kernel", "euclidean"], "along.nm"),
    ] {
        place.refused(2, &[&["collide"], words].concat(), &[said, "prepare it again", "--kernel"]);
    }
    place.refused(2, &["collide", "along.nm", "along.nm", "--prove", "p.jsonl"], &["--prove", "geodesic"]);
    let apart = crate::running::shift(2.5, 0.0, 0.0);
    for (file, options, warned) in [
        ("along.nm", &[][..], false),
        ("along.nm", &["--evidence", "estimated"], false),
        ("along.nm", &["--evidence", "certified"], true),
        ("straight.nm", &["--evidence", "certified"], false),
    ] {
        let done = place.ok(&[&["collide", file, file, "--pose-b", &apart, "--json"], options].concat());
        let evidence = if file == "along.nm" { "estimated" } else { "certified" };
        let miss = done.json().remove(0);
        assert_eq!((&miss["verdict"], &miss["evidence"]), (&"separated".into(), &evidence.into()));
        assert_eq!(done.errors.contains("proves no separation"), warned, "{options:?}: {}", done.errors);
    }

    // `eval` takes either kernel; the default is that of the scan.
    place.write("at.txt", "0.99 0 0");
    let f = |file: &str, options: &[&str]| {
        place.ok(&[&["eval", file, "--points", "at.txt", "--json"], options].concat()).json().remove(0)
    };
    let [straight, along] = ["euclidean", "geodesic"].map(|kernel| f("along.nm", &["--kernel", kernel]));
    assert_ne!(straight["f"], along["f"]);
    assert_eq!((f("straight.nm", &[]), f("along.nm", &[])), (straight, along));
}
