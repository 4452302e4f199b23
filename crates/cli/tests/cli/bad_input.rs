//! Invalid inputs, and the errors about them.

use nearmiss_testdata::shapes::sphere;

use crate::running::Place;

#[test]
fn raw_inputs_are_refused_with_file_and_place() {
    let place = Place::new();
    std::fs::create_dir(place.path("folder")).unwrap();
    place.write("empty.ply", "");
    place.write("unknown.bin", b"\x01\x02\x03 what is this");
    let header =
        "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\nproperty float z\n";
    place.write("short.ply", format!("{header}end_header\n0 0 0\n1 1 1\n"));
    place.write("words.xyz", "0 0 0\n0 1 2\n0 one 2\n");
    place.write("few.xyz", "0 0 0\n0 0 1\n0 1 0\n0 0 0\nnan 0 0\n");
    place.write("scan.las", b"LASF and so on");
    let binary = header.replace("ascii", "binary_little_endian").replace("vertex 9", "vertex 4000000000");
    place.write("vast.ply", format!("{binary}end_header\nabcdefghijklmnop"));
    for (file, words) in [
        ("missing.ply", &["missing.ply: no such file; check the path"][..]),
        ("folder", &["folder", "a regular file"]),
        ("empty.ply", &["empty.ply", "empty"]),
        ("unknown.bin", &["unknown.bin", "unknown format", "--format"]),
        ("short.ply", &["short.ply", "line", "9", "2"]),
        ("words.xyz", &["words.xyz", "line 3", "`one`"]),
        ("few.xyz", &["few.xyz", "at least 8 distinct", "got 3"]),
        ("scan.las", &["scan.las", "byte 14", "end of the file"]),
        ("vast.ply", &["vast.ply", "4000000000"]),
    ] {
        place.refused(1, &["preprocess", file, "-o", "out.nm"], words);
        place.refused(1, &["collide", file, file, "--json"], &words[..1]);
        place.refused(1, &["export", file, "--points", "out.ply"], &words[..1]);
        place.refused(1, &["poses", file, file, "--sweep", "-o", "out.jsonl"], &words[..1]);
    }
}

#[test]
fn prepared_files_are_refused_when_anything_is_off() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm", "--quiet"]);
    let good = std::fs::read(place.path("ball.nm")).unwrap();
    let with = |name: &str, change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = good.clone();
        change(&mut bytes);
        place.write(name, bytes);
    };
    with("cut.nm", &|b| b.truncate(b.len() / 2));
    with("head.nm", &|b| b.truncate(10));
    with("none.nm", &|b| b.clear());
    with("longer.nm", &|b| b.extend([0; 64]));
    with("text.nm", &|b| *b = b"0 0 0\n1 1 1\n".to_vec());
    with("zeros.nm", &|b| b.fill(0));
    let mut names: Vec<String> =
        ["cut", "head", "none", "longer", "text", "zeros"].map(|n| format!("{n}.nm")).into();
    place.write("at.txt", "0 0 0");
    std::fs::create_dir(place.path("lines")).unwrap();
    for question in [
        &["touch", "ball.nm", "--surface", "--shapes", "lines"][..],
        &["cast", "ball.nm", "--rays", "lines"],
        &["collide", "ball.nm", "ball.nm", "--poses", "lines"],
        &["eval", "ball.nm", "--points", "lines"],
    ] {
        place.refused(1, question, &["lines: expected a text file, got a folder; name a file"]);
    }
    for file in &names {
        let file = file.as_str();
        place.refused(1, &["inspect", file], &[file]);
        place.refused(1, &["collide", file, "ball.nm"], &[file]);
        place.refused(1, &["eval", file, "--points", "at.txt"], &[file]);
    }
    for place_of_flip in (0..good.len()).step_by(good.len() / 40) {
        let name = format!("flip{place_of_flip}.nm");
        with(&name, &|b| b[place_of_flip] ^= 0x10);
        names.push(name);
    }
    // A flipped bit is found by --verify, which checks all numbers.
    for file in &names {
        let file = file.as_str();
        place.refused(1, &["inspect", file, "--verify"], &[file]);
        place.refused(1, &["collide", file, "ball.nm", "--verify"], &[file]);
        place.refused(1, &["eval", file, "--points", "at.txt", "--verify"], &[file]);
    }
    place.refused(1, &["inspect", "missing.nm"], &["missing.nm: no such file; check the path"]);
    place.refused(1, &["inspect", "ball.xyz"], &["ball.xyz", "preprocess"]);
    place.refused(1, &["preprocess", "ball.nm", "-o", "out.nm"], &["ball.nm", "prepared scan"]);
    place.ok(&["inspect", "ball.nm", "--verify"]);
}

#[test]
fn another_version_is_refused_by_name() {
    let place = Place::new();
    let mut writer = nearmiss::store::Writer::new(*b"SCAN", 99);
    writer.metadata(&0_u8).unwrap();
    writer.save(place.path("new.nm")).unwrap();
    place.refused(1, &["inspect", "new.nm"], &["new.nm", "version 99", "update the program"]);
    let mut writer = nearmiss::store::Writer::new(*b"MAPS", 1);
    writer.metadata(&0_u8).unwrap();
    writer.save(place.path("other.nm")).unwrap();
    place.refused(1, &["collide", "other.nm", "other.nm"], &["other.nm", "MAPS"]);
}

#[test]
fn outputs_that_cannot_be_are_refused_before_the_work() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    std::fs::create_dir(place.path("folder")).unwrap();
    place.refused(2, &["collide", "ball.xyz", "ball.xyz", "--image", "out.jpg"], &["out.jpg", ".png"]);
    place.refused(2, &["preprocess", "ball.xyz", "out.nm"], &["use `-o out.nm`"]);
    place.refused(
        2,
        &["touch", "ball.nm", "--shapes", "s", "--pose", "0", "0", "1"],
        &["make them one argument"],
    );
    for (output, word) in [("folder", "got a folder"), ("nowhere/out", "no folder nowhere")] {
        place.refused(1, &["preprocess", "ball.xyz", "-o", output], &[output, word]);
        place.refused(1, &["export", "ball.xyz", "--radii", output], &[output, word]);
        place.refused(1, &["collide", "ball.xyz", "ball.xyz", "--image", output], &[output, word]);
        place.refused(1, &["poses", "ball.xyz", "ball.xyz", "--near", "-o", output], &[output, word]);
    }
}

#[test]
fn odd_but_legal_clouds_work() {
    let place = Place::new();
    let line: String = (0..40).map(|i| format!("{i} 0 0\n")).collect();
    let plane: String = (0..64).map(|i| format!("{} {} 5\n", i % 8, i / 8)).collect();
    let huge: String = (0..64).map(|i| format!("{}e9 {}e9 {}e8\n", i % 8, i / 8, i % 3)).collect();
    let same_x: String = (0..500).map(|i| format!("1 {} {}\n", i % 25, i / 25)).collect();
    for (name, text) in [("line", line), ("plane", plane), ("huge", huge), ("same_x", same_x)] {
        let (raw, prepared) = (format!("{name}.xyz"), format!("{name}.nm"));
        place.write(&raw, text);
        place.ok(&["preprocess", &raw, "-o", &prepared, "--quiet"]);
        place.ok(&["inspect", &prepared, "--verify"]);
        let answer = place.ok(&["collide", &prepared, &prepared, "--json"]).json().remove(0);
        assert_ne!(answer["verdict"], "separated", "{name} on itself: {answer}");
        let picture = format!("{name}.png");
        place.ok(&["collide", &prepared, &prepared, "--thickened", "0", "--image", &picture]);
        place.ok(&["poses", &prepared, &prepared, "--sweep", "--per-distance", "1", "-o", "p.jsonl"]);
    }
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_ends_it_quietly() {
    use std::io::Read;
    use std::process::{Command, Stdio};
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    place.write("at.txt", "0 0 1\n".repeat(200_000));
    let mut child = Command::new(env!("CARGO_BIN_EXE_nearmiss"))
        .args(["eval", "ball.xyz", "--points", "at.txt", "--json"])
        .current_dir(place.path(""))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut start = [0; 10];
    child.stdout.take().unwrap().read_exact(&mut start).unwrap();
    let mut errors = String::new();
    child.stderr.take().unwrap().read_to_string(&mut errors).unwrap();
    assert!(matches!(child.wait().unwrap().code(), Some(0 | 1)), "{errors}");
    assert_eq!(errors, "");
}
