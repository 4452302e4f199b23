//! Disks that are full, and processes that are killed, while a scan is saved: there is the old file or the
//! new one.
#![cfg(unix)]

use std::process::{Child, Command, Stdio};
use std::time::Duration;

use nearmiss_testdata::shapes::{bowl, sphere};

use crate::running::{Done, Place};

/// Names of what writers leave that did not end.
fn litter(place: &Place) -> Vec<String> {
    place.files().into_iter().filter(|name| name.contains(".tmp-")).collect()
}

#[test]
fn a_disk_with_no_room_left_keeps_the_previous_file() {
    let place = Place::new();
    place.cloud("bowl.xyz", bowl(1.0), 0.2);
    place.cloud("ball.xyz", sphere(1.0), 0.05);
    place.ok(&["preprocess", "bowl.xyz", "-o", "out.nm", "--quiet"]);
    let before = std::fs::read(place.path("out.nm")).unwrap();
    assert!(before.len() > 8 * 512, "{} bytes", before.len());
    // No file may grow beyond four blocks, and what would make it ends with an error instead of a signal.
    let script = "trap '' XFSZ; ulimit -f 4; exec \"$0\" \"$@\"";
    let args = ["preprocess", "ball.xyz", "-o", "out.nm", "--quiet"];
    let output = Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_nearmiss")])
        .args(args)
        .current_dir(place.path(""))
        .output()
        .unwrap();
    let done = Done::new(output, &args);
    assert_eq!(done.status, 1, "{}{}", done.results, done.errors);
    assert!(
        done.errors.contains("out.nm") && done.errors.contains("check the space left"),
        "{}",
        done.errors
    );
    assert!(!done.errors.contains("panicked"), "{}", done.errors);
    assert_eq!(std::fs::read(place.path("out.nm")).unwrap(), before, "the previous file");
    assert_eq!(litter(&place), [""; 0]);
}

fn spawn(place: &Place, args: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_nearmiss"))
        .args(args)
        .current_dir(place.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Kills commands that write `out` at many moments: it is always one of the two files that they write.
fn killed_at_any_time(place: &Place, out: &str, commands: [&[&str]; 2]) {
    let content = commands.map(|args| {
        place.ok(args);
        std::fs::read(place.path(out)).unwrap()
    });
    assert_ne!(content[0], content[1], "two files to be told apart");
    let (mut killed, mut midway) = (0, 0);
    for round in 0..24_u32 {
        let before = litter(place);
        let mut child = spawn(place, commands[round as usize % 2]);
        if round < 12 {
            // As soon as it begins to write, or a little later.
            while child.try_wait().unwrap().is_none() && (litter(place).is_empty() || litter(place) == before)
            {
                std::thread::sleep(Duration::from_micros(20));
            }
            std::thread::sleep(Duration::from_micros(u64::from(round) * 30));
        } else {
            std::thread::sleep(Duration::from_millis(u64::from(round - 12) * 12));
        }
        child.kill().unwrap();
        killed += u32::from(!child.wait().unwrap().success());
        midway += u32::from(!litter(place).is_empty() && litter(place) != before);
        assert!(litter(place).len() <= 1, "the next writer clears up: {:?}", place.files());
        let found = std::fs::read(place.path(out)).unwrap();
        assert!(content.contains(&found), "round {round}: {} bytes of neither file", found.len());
    }
    assert!(killed >= 6, "{killed} of 24 were killed, {midway} while they wrote");
    place.ok(commands[0]);
    assert_eq!(std::fs::read(place.path(out)).unwrap(), content[0]);
    assert_eq!(litter(place), [""; 0], "the last run leaves nothing behind");
}

#[test]
fn a_process_killed_while_it_prepares_leaves_the_old_file_or_the_new_one() {
    let place = Place::new();
    place.cloud("bowl.xyz", bowl(1.0), 0.02);
    place.cloud("ball.xyz", sphere(1.0), 0.03);
    let prepare = |input| ["preprocess", input, "-o", "out.nm", "--quiet", "--threads", "1"];
    killed_at_any_time(&place, "out.nm", [&prepare("bowl.xyz"), &prepare("ball.xyz")]);
    place.ok(&["inspect", "out.nm", "--verify"]);
}

#[test]
fn a_process_killed_while_it_converts_leaves_the_old_file_or_the_new_one() {
    let place = Place::new();
    place.cloud("bowl.xyz", bowl(1.0), 0.01);
    place.cloud("ball.xyz", sphere(1.0), 0.015);
    let convert = |input| ["convert", input, "out.laz", "--quiet", "--voxel", "0.02"];
    killed_at_any_time(&place, "out.laz", [&convert("bowl.xyz"), &convert("ball.xyz")]);
}
