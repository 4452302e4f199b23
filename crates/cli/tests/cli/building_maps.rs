//! `slices build` with less memory than the voxels need, and when it is killed.
#![cfg(unix)]

use std::fs;

use nearmiss_testdata::house::{house, scanned};
use nearmiss_testdata::shapes::sphere;

use crate::faults::spawn;
use crate::running::{Place, text};
use crate::slicing::{obj, with_house};

/// Names and contents of the files of a map.
fn files_of(place: &Place, map: &str) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(place.path(map)).unwrap().map(|entry| entry.unwrap());
    let mut files: Vec<_> = entries
        .map(|entry| (entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap()))
        .collect();
    files.sort();
    files
}

/// Within less memory than the voxels need, the same map is made on disk; a run that was killed is gone on
/// with.
#[test]
fn a_map_larger_than_memory_is_made_on_disk() {
    let place = with_house();
    place.write("house.obj", obj(&house()));
    let build = |input: &'static str, map: &'static str, more: &[&'static str]| {
        [&["slices", "build", input, "-o", map, "--pixel", "0.05"], more].concat()
    };
    let memory = ["--memory", "4MB"];
    for (input, threads) in [("house.xyz", "1"), ("house.xyz", "2"), ("house.obj", "2")] {
        place.ok(&build(input, "memory", &[]));
        let done = place.ok(&build(input, "disk", &[&memory[..], &["--threads", threads]].concat()));
        assert!(done.errors.contains("working on disk, in disk.work"), "{}", done.errors);
        assert_eq!(files_of(&place, "disk"), files_of(&place, "memory"), "{input}");
        assert!(!place.path("disk.work").exists());
    }
    place.refused(
        1,
        &build("house.xyz", "other", &["--memory", "200kB"]),
        &["house.xyz", "larger pixels", "--slice-height"],
    );

    let args = build("house.xyz", "disk", &memory);
    let mut child = spawn(&place, &args);
    while !place.path("disk.work/voxels.done").exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_micros(100));
    }
    child.kill().unwrap();
    assert!(!child.wait().unwrap().success(), "it was killed");
    let before = files_of(&place, "disk");
    let done = place.ok(&args);
    assert!(done.errors.contains("resuming an interrupted run"), "{}", done.errors);
    assert!(!place.path("disk.work").exists());
    place.ok(&build("house.xyz", "memory", &[]));
    assert_eq!(files_of(&place, "disk"), files_of(&place, "memory"));
    assert!(before.iter().any(|(name, _)| name == "index.nms"), "the old map stays until then");
}

/// Killed at many moments: the index is that of the old map or of the new one, and all slices that it names
/// are whole. The next build clears up.
#[test]
fn a_build_that_is_killed_leaves_the_old_map_or_the_new_one() {
    let place = with_house();
    place.cloud("ball.xyz", sphere(1.0), 0.02);
    let build = |input, map| ["slices", "build", input, "-o", map, "--pixel", "0.02", "--quiet"];
    let inputs = ["house.xyz", "ball.xyz"];
    let whole = inputs.map(|input| {
        place.ok(&build(input, "whole"));
        files_of(&place, "whole")
    });
    place.ok(&build(inputs[0], "map"));
    let index = |files: &[(String, Vec<u8>)]| files.iter().find(|(name, _)| name == "index.nms").cloned();
    let (mut killed, mut midway) = (0, 0);
    for round in 0..24_u32 {
        let mut child = spawn(&place, &build(inputs[round as usize % 2], "map"));
        if round < 16 {
            // As soon as it begins to write, or a little later.
            let writes = || {
                let entries = fs::read_dir(place.path("map")).unwrap().flatten();
                entries.into_iter().any(|entry| entry.file_name().to_string_lossy().contains(".tmp-"))
            };
            while child.try_wait().unwrap().is_none() && !writes() {}
            std::thread::sleep(std::time::Duration::from_micros(u64::from(round) * 200));
        } else {
            std::thread::sleep(std::time::Duration::from_millis(u64::from(round - 16) * 10));
        }
        child.kill().unwrap();
        killed += u32::from(!child.wait().unwrap().success());
        let found = files_of(&place, "map");
        midway += u32::from(!whole.contains(&found));
        assert!(whole.iter().any(|files| index(files) == index(&found)), "round {round}");
        place.ok(&["slices", "inspect", "map", "--verify"]);
    }
    assert!(killed >= 8 && midway >= 1, "{killed} of 24 were killed, {midway} while they wrote");
    for (input, files) in inputs.iter().zip(&whole) {
        place.ok(&build(input, "map"));
        assert!(files_of(&place, "map") == *files, "{input}: nothing else is left");
    }
}

#[test]
fn a_note_names_the_axis_that_may_point_up() {
    let place = Place::new();
    let turned: Vec<[f64; 3]> =
        scanned(&house(), 0.1, 0.003, 3).into_iter().map(|[x, y, z]| [y, z, x]).collect();
    place.write("turned.xyz", text(&turned));
    let build = |up| ["slices", "build", "turned.xyz", "-o", "turned", "--pixel", "0.2", "--up", up];
    let wrong = place.ok(&build("z"));
    assert!(wrong.errors.contains("if y points up, pass --up y"), "{}", wrong.errors);
    let right = place.ok(&build("y"));
    assert!(!right.errors.contains("points up"), "{}", right.errors);
}
