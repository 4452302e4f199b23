//! `preprocess` in less memory than the points need. The resulting file is the same, even after
//! interruptions.
#![cfg(unix)]

use std::time::Duration;

use crate::faults::{on_own_disk, spawn};
use crate::running::Place;

/// A number of points that do not fit into [`MEMORY`].
const POINTS: usize = 400_000;

const MEMORY: &str = "100MB";

/// Writes a rough floor with a step as a NumPy array. Some points are duplicates or not finite.
fn floor(place: &Place, name: &str) {
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({POINTS}, 3), }}");
    while (header.len() + 11) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(u16::try_from(header.len()).unwrap().to_le_bytes());
    bytes.extend(header.as_bytes());
    let mut state = 7_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 24)
    };
    for i in 0..POINTS {
        let [x, y, z] = [random(), random(), random()];
        let p = match i % 1000 {
            // Sparse points, and points on lines.
            0 => [5.0 * x, 5.0 * y, 5.0 * z],
            1..=4 => [x, 3.0, 2.0],
            // Duplicates, and points that are not finite.
            5 => [0.5, 0.5, 0.0],
            6 => [f64::NAN, y, z],
            _ => [x, y, if x < 0.5 { 0.002 * z } else { 0.3 + 0.002 * z }],
        };
        #[expect(clippy::cast_possible_truncation, reason = "stored in single precision")]
        bytes.extend(p.iter().flat_map(|x| (*x as f32).to_le_bytes()));
    }
    place.write(name, bytes);
}

fn prepare<'a>(input: &'a str, output: &'a str, options: &[&'a str]) -> Vec<&'a str> {
    [&["preprocess", input, "-o", output], options].concat()
}

fn read(place: &Place, name: &str) -> Vec<u8> {
    std::fs::read(place.path(name)).unwrap()
}

#[test]
fn the_same_file_comes_out_on_disk() {
    let place = Place::new();
    floor(&place, "floor.npy");
    for options in
        [&[][..], &["--crop", "0,0,-1,0.8,0.9,3", "--leaf", "24"], &["--reach", "0.05", "--threads", "1"]]
    {
        place.ok(&prepare("floor.npy", "memory.nm", options));
        let done = place.ok(&prepare("floor.npy", "disk.nm", &[options, &["--memory", MEMORY]].concat()));
        assert!(done.errors.contains("working on disk in disk.nm.work"), "{}", done.errors);
        assert_eq!(read(&place, "memory.nm"), read(&place, "disk.nm"), "{options:?}");
        assert_eq!(place.files(), ["disk.nm", "floor.npy", "memory.nm"]);
    }
    let dropped = |options: &[&str]| {
        let crop = ["--json", "--crop", "0,0,-1,1,1,0.1"];
        place.ok(&prepare("floor.npy", "disk.nm", &[&crop, options].concat())).json()[0]["dropped"].clone()
    };
    assert_eq!(dropped(&["--memory", MEMORY]), dropped(&[]), "the report counts the same");
}

#[test]
fn what_cannot_be_done_on_disk_is_refused_with_remedies() {
    let place = Place::new();
    floor(&place, "floor.npy");
    let refused = |options: &[&str], words: &[&str]| {
        place.refused(
            1,
            &prepare("floor.npy", "f.nm", &[&["--quiet", "--memory", MEMORY], options].concat()),
            words,
        );
    };
    refused(&["--graph"], &["points need about", "leave out the graph"]);
    let args = prepare("floor.npy", "f.nm", &["--memory", "40MB", "--remove-outliers", "8,2"]);
    place.refused(1, &args, &["reading 400,000 points needs"]);
    refused(&["--class", "2"], &["points with classes", "leave it out"]);
    place.refused(
        1,
        &prepare("floor.npy", "f.nm", &["--memory", "60MB"]),
        &["set --memory 100MB to work on disk"],
    );
    // Files of others in the folder are kept.
    std::fs::create_dir(place.path("f.nm.work")).unwrap();
    place.write("f.nm.work/notes.txt", "mine");
    place.ok(&prepare("floor.npy", "f.nm", &["--memory", MEMORY]));
    assert_eq!(read(&place, "f.nm.work/notes.txt"), b"mine");
}

#[test]
fn a_disk_that_is_too_small_is_an_error_by_name() {
    let place = Place::new();
    floor(&place, "floor.npy");
    let args = prepare("floor.npy", "disk/f.nm", &["--memory", MEMORY, "--quiet"]);
    for size in ["size=1m", "size=20m", "size=60m"] {
        let Some((done, left)) = on_own_disk(&place, size, ":", &args) else { return };
        assert_eq!(done.status, 1, "{size}: {}", done.errors);
        assert_eq!(done.errors.matches("error: ").count(), 1, "{size}: {}", done.errors);
        assert!(
            done.errors.contains("free some space") || done.errors.contains("space left"),
            "{}",
            done.errors
        );
        // Finished files are kept for the next run.
        assert!(left.lines().all(|line| line.contains("f.nm.work/")), "{size}: {left}");
    }
    let (done, left) = on_own_disk(&place, "size=300m", ":", &args).unwrap();
    assert_eq!((done.status, left.lines().count()), (0, 1), "{left}{}", done.errors);
}

#[test]
fn a_run_that_was_killed_is_gone_on_with() {
    let place = Place::new();
    floor(&place, "floor.npy");
    place.ok(&prepare("floor.npy", "memory.nm", &[]));
    let expected = read(&place, "memory.nm");
    let on_disk = prepare("floor.npy", "disk.nm", &["--memory", MEMORY]);
    let is_done = |stage: &str| place.path("disk.nm.work").join(stage).exists();
    for (round, stage) in ["work.key", "points.done", "order.done"].into_iter().enumerate() {
        let mut child = spawn(&place, &on_disk);
        while !is_done(stage) && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        assert!(!child.wait().unwrap().success(), "round {round}: killed");
        assert!(is_done(stage), "round {round}: {stage}");
        if round == 0 {
            // With another input, the work starts from the beginning.
            floor(&place, "other.npy");
            place.ok(&prepare("other.npy", "disk.nm", &["--memory", MEMORY]));
            continue;
        }
        let done = place.ok(&on_disk);
        assert!(done.errors.contains("resuming an interrupted run"), "{}", done.errors);
        assert_eq!(read(&place, "disk.nm"), expected, "round {round}");
    }
    // A run in memory removes the files of a killed run too.
    let mut child = spawn(&place, &on_disk);
    while !is_done("points.done") && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    place.ok(&prepare("floor.npy", "disk.nm", &[]));
    assert_eq!(place.files(), ["disk.nm", "floor.npy", "memory.nm", "other.npy"]);
}

#[test]
fn two_runs_of_one_output_are_not_mixed() {
    let place = Place::new();
    floor(&place, "floor.npy");
    let on_disk = prepare("floor.npy", "disk.nm", &["--memory", MEMORY]);
    let mut child = spawn(&place, &on_disk);
    while !place.path("disk.nm.work/work.key").exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(Duration::from_millis(20));
    let second = place.run(&on_disk);
    assert_eq!(second.status, 1, "{}", second.errors);
    assert!(second.errors.contains("another process uses it"), "{}", second.errors);
    assert!(child.wait().unwrap().success(), "the first one goes on");
    place.ok(&["inspect", "disk.nm", "--verify"]);
}
