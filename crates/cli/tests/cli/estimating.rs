//! Estimates of memory, and units of pairs of scans.

use nearmiss_testdata::shapes::{Sampling, sphere};

use crate::running::{Place, shift, text};

#[test]
fn what_does_not_fit_into_memory_is_refused_with_remedies() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.05);
    let refused = |options: &[&str], words: &[&str]| {
        let command = ["preprocess", "ball.xyz", "-o", "ball.nm", "--close-pairs"];
        place.refused(1, &[&command[..], options].concat(), words);
    };
    let all = [
        "points need about 2",
        "but 22 MB are allowed by --memory",
        "use --voxel 0.",
        ", or set --memory 2",
        "MB to run anyway",
    ];
    refused(&["--memory", "22MB"], &all);
    refused(&["--memory", "24MB"], &["leave out --close-pairs, or set --memory"]);
    refused(&["--memory", "1MB"], &["reading ", "a part of the file, or set --memory 2"]);
    refused(&["--memory", "22MB", "--voxel", "0.01", "--quiet"], &["points need about", "--memory 2"]);
    place.refused(2, &["preprocess", "ball.xyz", "-o", "b.nm", "--memory", "big"], &["--memory", "500MB"]);
    for fitting in [
        &["--memory", "22MB", "--voxel", "0.5", "--close-pairs"][..],
        &["--memory", "24MB"],
        &["--memory", "1GB"],
    ] {
        let done = place.ok(&[&["preprocess", "ball.xyz", "-o", "ball.nm"], fitting].concat());
        assert!(!done.errors.contains("takes about"), "a short run: {}", done.errors);
    }
    // The refusal comes before the file is read: its invalid last line goes unnoticed.
    let rows = text(&sphere(1.0).sample(Sampling::clean(0.02)).points);
    place.write("broken.xyz", format!("{rows}one two three\n"));
    place.refused(1, &["preprocess", "broken.xyz", "-o", "b.nm", "--memory", "25MB"], &["points need about"]);
    place.refused(1, &["preprocess", "broken.xyz", "-o", "b.nm"], &["`one`"]);
}

#[test]
fn long_runs_are_announced() {
    let place = Place::new();
    // 600,000 equal points, which are refused only after they have been read.
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 600000\nproperty float x\nproperty float y\n\
                  property float z\nend_header\n";
    let path = place.write("zeros.ply", header);
    let file = std::fs::File::options().append(true).open(path).unwrap();
    file.set_len(header.len() as u64 + 600_000 * 12).unwrap();
    let command =
        ["preprocess", "zeros.ply", "-o", "z.nm", "--threads", "1", "--memory", "4GB", "--close-pairs"];
    let done = place.run(&command);
    let mut lines = done.errors.lines();
    assert_eq!(lines.next(), Some("preparing 600,000 points takes about 16 s and 890 MB"), "{}", done.errors);
    assert!(lines.next().is_some_and(|line| line.contains("got 1 (of 600000 given)")), "{}", done.errors);
    let quiet = place.run(&[&command[..], &["--quiet"]].concat());
    assert_eq!(quiet.errors.lines().count(), 1, "{}", quiet.errors);
    let quick = place.run(&command[..command.len() - 1]);
    assert_eq!(quick.errors.lines().count(), 1, "{}", quick.errors);
}

#[test]
fn samples_that_do_not_fit_into_memory_are_refused_before_they_are_made() {
    let place = Place::new();
    place.write("plate.obj", "v 0 0 0\nv 100 0 0\nv 100 100 0\nv 0 100 0\nf 1 2 3 4\n");
    let regular = ["--pattern", "regular"];
    let command = [&["sample", "plate.obj", "-o", "plate.ply", "--spacing", "0.1"], &regular[..]].concat();
    let words =
        ["plate.obj: about 1,", "samples need about 5", "40 MB are allowed", "--spacing 0.1", "--memory 5"];
    place.refused(1, &[&command[..], &["--memory", "40MB"]].concat(), &words);
    place.ok(&[&command[..], &["--memory", "80MB"]].concat());
    let wider = ["sample", "plate.obj", "-o", "plate.ply", "--spacing", "0.2", "--memory", "40MB"];
    place.ok(&[&wider[..], &regular].concat());

    let spaced = ["sample", "plate.obj", "-o", "plate.ply", "--spacing", "0.1", "--memory", "60MB"];
    place.refused(
        1,
        &spaced,
        &["about 770,000 samples need about 86 MB", "use --spacing 0.1", "--memory 90MB"],
    );
    let counted = ["sample", "plate.obj", "-o", "plate.ply", "--points", "200000", "--memory", "60MB"];
    place.refused(
        1,
        &counted,
        &["200,000 samples need about 110 MB", "use --points 69000", "--memory 111MB"],
    );
    place.ok(&["sample", "plate.obj", "-o", "plate.ply", "--points", "69000", "--memory", "60MB"]);
}

/// Writes and prepares a ball in metres, and the same ball in millimetres.
fn balls(place: &Place) {
    let ball = sphere(1.0).sample(Sampling::clean(0.1)).points;
    let large: Vec<[f64; 3]> = ball.iter().map(|p| p.map(|x| 1000.0 * x)).collect();
    place.write("m.xyz", text(&ball));
    place.write("mm.xyz", text(&large));
    place.ok(&["preprocess", "m.xyz", "-o", "m.nm", "--quiet"]);
    place.ok(&["preprocess", "mm.xyz", "-o", "mm.nm", "--quiet"]);
}

#[test]
fn sizes_that_differ_much_raise_a_question_of_units() {
    let place = Place::new();
    balls(&place);
    let pose = shift(3.0, 0.0, 0.0);
    for command in ["collide", "distance"] {
        let ask = |pair: [&str; 2], options: &[&str]| {
            place.ok(&[&[command, pair[0], pair[1], "--json", "--pose-b", &pose], options].concat())
        };
        let done = ask(["m.nm", "mm.nm"], &[]);
        assert!(
            done.errors.starts_with("warning: b is 1000 times larger than a; if b is in millimetres"),
            "{}",
            done.errors
        );
        assert!(done.errors.contains("`--units-b mm`"), "{}", done.errors);
        assert_eq!((done.errors.lines().count(), done.json().len()), (1, 1), "{command}");
        assert!(ask(["mm.nm", "m.nm"], &[]).errors.contains("`--units-a mm`"), "{command}");
        assert_eq!(ask(["m.nm", "mm.nm"], &["--quiet"]).errors, "");
        assert_eq!(ask(["m.nm", "mm.nm"], &["--units-b", "m"]).errors, "", "the user has answered");
        assert_eq!(ask(["m.nm", "m.nm"], &[]).errors, "");
        assert!(
            ask(["m.nm", "mm.nm"], &["--units-a", "mm"]).errors.contains("check --units-a"),
            "made worse"
        );
        let poses = format!("{{\"a\":[{0}],\"b\":[{0}]}}\n", shift(0.0, 0.0, 0.0).replace(' ', ","));
        place.write("poses.jsonl", poses.repeat(3));
        let batch = place.ok(&[command, "m.nm", "mm.nm", "--json", "--poses", "poses.jsonl"]);
        assert_eq!(
            (batch.errors.lines().count(), batch.json().len()),
            (1, 3),
            "asked once: {}",
            batch.errors
        );
    }
}

#[test]
fn units_scale_scans_to_metres_before_their_poses() {
    let place = Place::new();
    balls(&place);
    let gap = |pair: [&str; 2], options: &[&str]| {
        let pose = shift(3.0, 0.0, 0.0);
        let done =
            place.ok(&[&["distance", pair[0], pair[1], "--json", "--pose-b", &pose], options].concat());
        assert_eq!(done.errors, "", "{options:?}");
        let answer = done.json().remove(0);
        ["lower", "upper"].map(|bound| answer[bound].as_f64().unwrap())
    };
    let both = gap(["m.nm", "m.nm"], &[]);
    for (pair, options) in [
        (["m.nm", "mm.nm"], &["--units-b", "mm"][..]),
        (["mm.nm", "m.nm"], &["--units-a", "mm"]),
        (["mm.nm", "m.nm"], &["--units-a", "mm", "--units-b", "m"]),
    ] {
        let same = gap(pair, options);
        for (one, other) in both.iter().zip(&same) {
            assert!((one - other).abs() < 0.01, "{same:?} for {both:?} with {options:?}");
        }
    }
    let feet = gap(["m.nm", "m.nm"], &["--units-a", "ft", "--units-b", "ft"]);
    assert!(feet[0] <= 3.0 - 2.0 * 0.3048 + 0.01 && feet[1] > 3.0 - 2.0 * 0.3048 - 0.01, "{feet:?}");
    let poses = format!(
        "{{\"a\":[{}],\"b\":[{}]}}",
        shift(0.0, 0.0, 0.0).replace(' ', ","),
        shift(3.0, 0.0, 0.0).replace(' ', ",")
    );
    place.write("poses.jsonl", poses);
    let line =
        place.ok(&["distance", "m.nm", "mm.nm", "--json", "--poses", "poses.jsonl", "--units-b", "mm"]);
    let upper = line.json()[0]["upper"].as_f64().unwrap();
    assert!((upper - both[1]).abs() < 0.01, "{upper} for {both:?}");
    assert_eq!(
        place.ok(&["collide", "m.nm", "mm.nm", "--json", "--units-b", "mm"]).json()[0]["verdict"],
        "intersecting"
    );
    place.refused(2, &["collide", "m.nm", "mm.nm", "--units-b", "km"], &["--units-b", "mm, cm, m, in, ft"]);
}
