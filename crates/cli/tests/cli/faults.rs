//! Full disks, killed processes, and files that change while they are read. In each case the old or
//! the new file is left whole, and the error is clear.
#![cfg(unix)]

use std::process::{Child, Command, Stdio};
use std::time::Duration;

use nearmiss_testdata::shapes::{bowl, sphere};

use crate::running::{Done, Place};

/// Returns the names of temporary files of writers that did not finish.
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
    // No file may grow beyond four blocks. With the signal ignored, a larger write fails with an
    // error.
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

pub(crate) fn spawn(place: &Place, args: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_nearmiss"))
        .args(args)
        .current_dir(place.path(""))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Kills two commands that write `out` at many moments. `out` must always be the whole output of
/// one of them.
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

/// Runs a command with a disk of its own, mounted at `disk` with the options `limit`, after the
/// shell commands `before`. Returns the result and a list of the files on the disk with their
/// checksums, or `None` if the system does not allow the mount.
pub(crate) fn on_own_disk(place: &Place, limit: &str, before: &str, args: &[&str]) -> Option<(Done, String)> {
    let script = format!(
        "mkdir -p disk && mount -t tmpfs -o {limit} none disk 2>/dev/null || exit 77
         {before}
         \"$0\" \"$@\"; status=$?
         echo ===; cd disk; find . -type f | sort | xargs -r cksum
         exit $status"
    );
    let output = Command::new("unshare")
        .args(["-rm", "sh", "-c", &script, env!("CARGO_BIN_EXE_nearmiss")])
        .args(args)
        .current_dir(place.path(""))
        .output();
    let output = output.ok().filter(|output| output.status.code().is_some_and(|code| code < 3));
    if output.is_none() {
        eprintln!("skipped: this system lets no test mount a disk");
    }
    let mut done = Done::new(output?, args);
    let (results, left) = done.results.split_once("===\n")?;
    let left = left.to_owned();
    done.results = results.to_owned();
    Some((done, left))
}

/// On a full or read-only disk there is one error, and the old files are unchanged.
#[test]
fn a_disk_that_takes_nothing_keeps_what_was_there() {
    let place = Place::new();
    place.cloud("bowl.xyz", bowl(1.0), 0.2);
    place.cloud("ball.xyz", sphere(1.0), 0.02);
    place.ok(&["preprocess", "bowl.xyz", "-o", "old.nm", "--quiet"]);
    place.ok(&["convert", "bowl.xyz", "old.ply", "--quiet"]);
    place.ok(&["slices", "build", "bowl.xyz", "-o", "old", "--quiet"]);
    let commands: [&[&str]; 3] = [
        &["preprocess", "ball.xyz", "-o", "disk/old.nm"],
        &["convert", "ball.xyz", "disk/old.ply", "--voxel", "0.001"],
        &["slices", "build", "ball.xyz", "-o", "disk/old", "--pixel", "0.002"],
    ];
    for args in commands {
        let name = args.iter().find_map(|arg| arg.strip_prefix("disk/")).unwrap();
        let fill = format!("cp -r {name} disk/");
        let Some((_, before)) = on_own_disk(&place, "size=300k", &fill, &["--version"]) else { return };
        assert!(!before.is_empty(), "{name}");
        for (limit, more, words) in
            [("size=300k", "", "space left"), ("size=300k", "; mount -o remount,ro disk", "ead-only")]
        {
            let (done, after) = on_own_disk(&place, limit, &format!("{fill}{more}"), args).unwrap();
            assert_eq!(done.status, 1, "{args:?}: {}{}", done.results, done.errors);
            assert_eq!(done.errors.matches("error: ").count(), 1, "{args:?}: {}", done.errors);
            assert!(done.errors.contains(words) && done.errors.contains("disk"), "{args:?}: {}", done.errors);
            assert_eq!(after, before, "{args:?}: {}", done.errors);
        }
    }
}

/// A prepared scan that is removed while it is open can still be read; a truncated one cannot.
#[test]
fn a_file_that_vanishes_or_is_cut_short_while_it_is_read() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.02);
    let far: String = (0..200_000)
        .map(|i| {
            format!(
                "{{\"a\":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],\"b\":[1,0,0,{},0,1,0,0,0,0,1,0,0,0,0,1]}}\n",
                1.0 + f64::from(i) * 1e-6
            )
        })
        .collect();
    place.write("poses.jsonl", far);
    for (is_cut, words) in [(false, ""), (true, "error: a prepared file was cut short while it was read")] {
        place.ok(&["preprocess", "ball.xyz", "-o", "ball.nm", "--quiet"]);
        let mut child = Command::new(env!("CARGO_BIN_EXE_nearmiss"))
            .args(["collide", "ball.nm", "ball.nm", "--poses", "poses.jsonl", "--json"])
            .current_dir(place.path(""))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // Once there is an answer, both scans are open.
        let mut out = child.stdout.take().unwrap();
        let mut first = [0; 1];
        std::io::Read::read_exact(&mut out, &mut first).unwrap();
        if is_cut {
            std::fs::File::options().write(true).open(place.path("ball.nm")).unwrap().set_len(4096).unwrap();
        } else {
            std::fs::remove_file(place.path("ball.nm")).unwrap();
        }
        let drained = std::thread::spawn(move || std::io::copy(&mut out, &mut std::io::sink()));
        let output = child.wait_with_output().unwrap();
        drained.join().unwrap().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(errors.starts_with(words), "{errors}");
        assert_eq!(output.status.code(), Some(i32::from(is_cut)), "{errors}");
    }
}

/// Interrupts a command with Ctrl-C at many moments.
#[test]
fn an_interrupted_command_leaves_the_old_file_or_the_new_one() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.015);
    let args = ["convert", "ball.xyz", "out.las", "--quiet", "--voxel", "0.01"];
    place.ok(&args);
    let expected = std::fs::read(place.path("out.las")).unwrap();
    let mut interrupted = 0;
    for round in 0..20 {
        let mut child = spawn(&place, &args);
        std::thread::sleep(Duration::from_millis(4 * round));
        let id = child.id().to_string();
        Command::new("kill").args(["-INT", &id]).status().unwrap();
        interrupted += u32::from(!child.wait().unwrap().success());
        assert_eq!(std::fs::read(place.path("out.las")).unwrap(), expected, "round {round}");
    }
    assert!(interrupted > 3, "{interrupted} of 20 were interrupted; is SIGINT ignored here?");
    place.ok(&args);
    assert_eq!(place.files(), ["ball.xyz", "out.las"]);
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

/// If a decoder ends its process, here for lack of memory, the command fails with an ordinary
/// error.
#[cfg(target_os = "linux")]
#[test]
fn a_decoder_that_ends_the_process_is_an_error_by_name() {
    let place = Place::new();
    place.cloud("ball.xyz", sphere(1.0), 0.01);
    place.ok(&["convert", "ball.xyz", "ball.laz", "--quiet"]);
    place.ok(&["preprocess", "ball.laz", "-o", "ball.nm", "--quiet"]);
    let before = std::fs::read(place.path("ball.nm")).unwrap();
    let limited = |kilobytes: u32, args: &[&str]| {
        let script = format!("ulimit -d {kilobytes}; exec \"$0\" \"$@\"");
        let output = Command::new("sh")
            .args(["-c", &script, env!("CARGO_BIN_EXE_nearmiss")])
            .args(args)
            .current_dir(place.path(""))
            .output()
            .unwrap();
        Done::new(output, args)
    };
    let args = ["preprocess", "ball.laz", "-o", "ball.nm", "--quiet", "--threads", "1"];
    let done = limited(4_000, &args);
    assert_eq!(done.status, 1, "{}", done.errors);
    assert!(done.errors.contains("error: ball.laz: expected a file that can be decoded"), "{}", done.errors);
    assert_eq!(std::fs::read(place.path("ball.nm")).unwrap(), before, "the previous file");
    assert_eq!(limited(400_000, &args).status, 0);
    // Other errors of the child, and its exit status, are passed on.
    place.refused(2, &["convert", "ball.laz", "./ball.laz"], &["would replace the input"]);
    place.refused(1, &["preprocess", "ball.laz", "-o", "nowhere/ball.nm"], &["there is no folder nowhere"]);
    assert_eq!(place.ok(&["collide", "ball.laz", "ball.nm", "--json"]).json().len(), 1);
}

/// If two commands write the same file at the same time, the result is the whole output of one of
/// them.
#[test]
fn two_commands_that_write_one_file() {
    let place = Place::new();
    place.cloud("bowl.xyz", bowl(1.0), 0.02);
    place.cloud("ball.xyz", sphere(1.0), 0.03);
    for out in ["out.nm", "out.laz"] {
        let args = |input| match out {
            "out.nm" => ["preprocess", input, "-o", out, "--quiet"].to_vec(),
            _ => ["convert", input, out, "--quiet"].to_vec(),
        };
        let whole = ["bowl.xyz", "ball.xyz"].map(|input| {
            place.ok(&args(input));
            std::fs::read(place.path(out)).unwrap()
        });
        for round in 0..10 {
            let children = ["bowl.xyz", "ball.xyz"].map(|input| spawn(&place, &args(input)));
            for mut child in children {
                assert!(child.wait().unwrap().success(), "{out}, round {round}");
            }
            assert!(whole.contains(&std::fs::read(place.path(out)).unwrap()), "{out}, round {round}");
        }
        assert_eq!(litter(&place), [""; 0], "{out}");
    }
}
