//! Workspaces: arrays in files, finished stages, and locked folders.

use std::fs;

use nearmiss_store::{Array, Room, WorkError, Workspace};

fn open(folder: &std::path::Path, key: &str) -> Result<Workspace, WorkError> {
    Workspace::in_folder(folder, key, 1 << 30)
}

fn filled(mut room: Room<u32>) -> Room<u32> {
    room.iter_mut().zip(1..).for_each(|(x, i)| *x = i);
    room
}

#[test]
fn rooms_are_zero_at_first_and_become_arrays_without_a_copy() {
    let place = tempfile::tempdir().unwrap();
    let on_disk = open(&place.path().join("work"), "").unwrap();
    for work in [&Workspace::in_memory(), &on_disk] {
        let room: Room<u32> = work.room(100_000).unwrap();
        assert!(room.len() == 100_000 && room.iter().all(|x| *x == 0));
        let mut room = filled(room);
        room.truncate(99_999);
        let address = room.as_ptr();
        let array = Array::from(room);
        assert_eq!((array.len(), array[99_998], array.as_ptr()), (99_999, 99_999, address));
        assert_eq!(array.is_in_place(), !work.is_in_memory());
        assert!(work.room::<u64>(0).unwrap().is_empty());
    }
    on_disk.remove();
    assert_eq!(fs::read_dir(place.path()).unwrap().count(), 0, "nothing is left");
}

#[test]
fn a_closed_stage_is_found_again_for_the_same_key_alone() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("work");
    {
        let work = open(&folder, "a").unwrap();
        let stage = work.stage("one");
        assert_eq!(stage.done::<u64>(), None);
        let kept = filled(stage.room("x", 1000).unwrap());
        let copied = stage.keep("y", filled(work.room(10).unwrap())).unwrap();
        assert_eq!((kept[999], copied[9]), (1000, 10));
        stage.close(&42_u64).unwrap();
        let _open = filled(work.stage("two").room("x", 1000).unwrap());
    }
    {
        let work = open(&folder, "a").unwrap();
        let stage = work.stage("one");
        assert_eq!(stage.done::<u64>(), Some(42));
        assert_eq!(stage.room::<u32>("x", 1000).unwrap()[..3], [1, 2, 3]);
        assert_eq!(stage.room::<u32>("y", 10).unwrap()[9], 10);
        let wrong = stage.room::<u32>("x", 999).unwrap_err();
        assert!(wrong.to_string().contains("(expected 3996 bytes, got 4000); remove the folder"), "{wrong}");
        let stage = work.stage("two");
        assert_eq!(stage.done::<u64>(), None, "it was not closed");
        assert!(stage.room::<u32>("x", 1000).unwrap().iter().all(|x| *x == 0), "made anew");
    }
    let work = open(&folder, "b").unwrap();
    assert_eq!(work.stage("one").done::<u64>(), None, "of another key");
}

#[test]
fn a_folder_is_one_workspaces_and_other_files_stay() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("work");
    let work = open(&folder, "a").unwrap();
    fs::write(folder.join("notes.txt"), "mine").unwrap();
    let refused = open(&folder, "a").unwrap_err().to_string();
    assert!(refused.contains("(another process uses it); wait for that process to end"), "{refused}");
    let stage = work.stage("one");
    drop(filled(stage.room("x", 10).unwrap()));
    stage.close(&()).unwrap();
    Workspace::clear(&folder);
    assert!(folder.join("one.done").exists(), "a living workspace is not cleared");
    drop(work);
    Workspace::clear(&folder);
    let left: Vec<_> = fs::read_dir(&folder).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left, ["notes.txt"]);
    Workspace::clear(&place.path().join("none"));
    let file = place.path().join("file");
    fs::write(&file, "").unwrap();
    assert!(open(&file, "a").unwrap_err().to_string().contains("cannot create the folder"));
}

/// Fills an array of several times the memory limit, and checks the resident memory meanwhile.
#[cfg(target_os = "linux")]
#[test]
fn little_memory_is_held() {
    let held = || {
        let text = fs::read_to_string("/proc/self/status").unwrap();
        let line = text.lines().find_map(|line| line.strip_prefix("RssFile:"));
        line.unwrap().trim().trim_end_matches(" kB").parse::<u64>().unwrap() * 1024
    };
    let place = tempfile::tempdir().unwrap();
    let work = Workspace::in_folder(place.path().join("work"), "", 60_000_000).unwrap();
    let mut room: Room<u64> = work.room(50_000_000).unwrap();
    let mut most = 0;
    for (i, part) in room.chunks_mut(1_000_000).enumerate() {
        part.fill(i as u64);
        most = most.max(held());
    }
    let sum: u64 = room.iter().sum();
    assert_eq!(sum, (0..50).sum::<u64>() * 1_000_000, "the content stays");
    assert!(most < 200_000_000, "{most} bytes were held, of 400,000,000");
}
