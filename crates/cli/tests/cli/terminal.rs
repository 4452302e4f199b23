//! Progress on a terminal.
#![cfg(target_os = "linux")]

use std::fs::{File, OpenOptions};
use std::io::{Read as _, Write as _};
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use nearmiss_testdata::shapes::sphere;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use crate::running::Place;

/// Opens a terminal. Returns the end that reads what a program writes to it, and the program's end.
fn terminal() -> [File; 2] {
    let screen = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&screen).unwrap();
    unlockpt(&screen).unwrap();
    let name = ptsname(&screen, Vec::new()).unwrap();
    let end = OpenOptions::new().read(true).write(true).open(name.to_str().unwrap()).unwrap();
    [File::from(screen), end]
}

/// Runs `collide` with poses from standard input, the last of which comes after a second. Returns what
/// it writes to the terminal, and its results.
fn asked_slowly(more: &[&str]) -> (String, String) {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.2);
    place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm"]);
    let [mut screen, end] = terminal();
    let mut child = Command::new(env!("CARGO_BIN_EXE_nearmiss"))
        .args(["collide", "ball.nm", "ball.nm", "--poses", "-", "--json"])
        .args(more)
        .current_dir(place.path(""))
        .env("TERM", "xterm")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(end)
        .spawn()
        .unwrap();
    let reader = thread::spawn(move || {
        let mut bytes = Vec::new();
        // The error at the end means that the program has closed the terminal.
        let _ended = screen.read_to_end(&mut bytes);
        String::from_utf8_lossy(&bytes).into_owned()
    });
    let mut poses = child.stdin.take().unwrap();
    poses.write_all(b"1 0 0 0 0 0 1\n5 0 0 0 0 0 1\n").unwrap();
    poses.flush().unwrap();
    thread::sleep(Duration::from_millis(1100));
    poses.write_all(b"6 0 0 0 0 0 1\n").unwrap();
    drop(poses);
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    (reader.join().unwrap(), String::from_utf8(output.stdout).unwrap())
}

#[test]
fn a_terminal_shows_progress_and_is_left_clean() {
    let (shown, results) = asked_slowly(&[]);
    assert_eq!(results.lines().count(), 3, "{results}");
    assert!(shown.contains("answering"), "{shown:?}");
    assert!(shown.contains("poses"), "{shown:?}");
    let last = shown.rsplit(['\r', '\n']).next().unwrap_or_default();
    assert!(!last.contains("answering"), "the line is cleared at the end: {shown:?}");
}

#[test]
fn quiet_commands_leave_a_terminal_alone() {
    let (shown, results) = asked_slowly(&["--quiet"]);
    assert_eq!(results.lines().count(), 3, "{results}");
    assert_eq!(shown, "", "nothing is written");
}
