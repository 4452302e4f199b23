//! Files on disk after writers fail, overlap or are killed.

use std::env;
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Duration;

use super::*;

/// Environment variable of the child process that `a_killed_writer…` kills: the file to replace.
const VICTIM: &str = "NEARMISS_STORE_TEST_VICTIM";

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn put(bytes: &'static [u8]) -> impl FnOnce(&mut fs::File) -> io::Result<()> {
    move |file| file.write_all(bytes)
}

#[test]
fn a_new_file_and_a_replaced_one_leave_nothing_beside_them() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("scan.nm");
    replace(&target, put(b"first")).unwrap();
    replace(&target, put(b"second")).unwrap();
    assert_eq!(fs::read(&target).unwrap(), b"second");
    assert_eq!(names(folder.path()), ["scan.nm"]);
}

#[test]
fn a_writer_that_fails_or_panics_leaves_the_previous_file() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("scan.nm");
    replace(&target, put(b"previous")).unwrap();

    let error = replace(&target, |file| {
        file.write_all(b"half")?;
        Err(io::ErrorKind::StorageFull.into())
    });
    let Err(WriteError::Io { path, step: WriteStep::Write, source }) = error else { panic!("{error:?}") };
    assert_eq!(path.as_deref(), Some(target.as_path()));
    assert_eq!(source.kind(), io::ErrorKind::StorageFull);

    let panicked = std::panic::catch_unwind(|| replace(&target, |_| panic!("midway")));
    assert!(panicked.is_err());

    assert_eq!(fs::read(&target).unwrap(), b"previous");
    assert_eq!(names(folder.path()), ["scan.nm"]);
}

#[test]
fn only_abandoned_files_of_this_very_target_are_cleared() {
    let folder = tempfile::tempdir().unwrap();
    let litter = "scan.nm.tmp-a1B2c3D4e5F6";
    let kept = [
        "other.nm.tmp-a1B2c3D4e5F6",
        "scan.nm.tmp",
        "scan.nm.tmp-a1B2c3",
        "scan.nm.tmp-a1B2c3D4e5F6.bak",
        "scan.nm.tmp-notes_of_may",
        "xscan.nm.tmp-a1B2c3D4e5F6",
    ];
    for name in kept.iter().chain([&litter]) {
        fs::write(folder.path().join(name), b"left").unwrap();
    }
    fs::create_dir(folder.path().join("scan.nm.tmp-aFolder12345")).unwrap();
    replace(&folder.path().join("scan.nm"), put(b"new")).unwrap();

    let mut expected: Vec<_> = kept.to_vec();
    expected.extend(["scan.nm", "scan.nm.tmp-aFolder12345"]);
    expected.sort_unstable();
    assert_eq!(names(folder.path()), expected);
}

#[test]
fn a_living_writer_is_not_disturbed_by_another_one() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("scan.nm");
    replace(&target, |file| {
        file.write_all(b"outer")?;
        replace(&target, put(b"inner")).unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"inner");
        Ok(())
    })
    .unwrap();
    assert_eq!(fs::read(&target).unwrap(), b"outer");
    assert_eq!(names(folder.path()), ["scan.nm"]);
}

#[test]
fn many_writers_at_once_all_succeed_and_one_of_them_wins() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("scan.nm");
    std::thread::scope(|scope| {
        for writer in 0..4_u8 {
            let target = &target;
            scope.spawn(move || {
                for _ in 0..25 {
                    replace(target, |file| file.write_all(&[writer; 1000])).unwrap();
                }
            });
        }
    });
    let last = fs::read(&target).unwrap();
    assert!(last.len() == 1000 && last.iter().all(|&byte| byte == last[0]), "a file of one writer");
    assert_eq!(names(folder.path()), ["scan.nm"]);
}

/// Runs itself in a child process, which writes half a file and waits to be killed.
#[test]
fn a_killed_writer_leaves_the_previous_file_and_the_next_clears_up() {
    if let Some(target) = env::var_os(VICTIM) {
        let _ = replace(Path::new(&target), |file| {
            file.write_all(b"half")?;
            // Bounded, so that the child ends even if the parent dies.
            std::thread::sleep(Duration::from_secs(60));
            Err(io::ErrorKind::TimedOut.into())
        });
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("scan.nm");
    replace(&target, put(b"previous")).unwrap();

    let test = "atomic::tests::a_killed_writer_leaves_the_previous_file_and_the_next_clears_up";
    let mut child = Command::new(env::current_exe().unwrap())
        .args(["--exact", test])
        .env(VICTIM, &target)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let half_written = || {
        let others = names(folder.path()).into_iter().filter(|name| name != "scan.nm");
        others.map(|name| fs::read(folder.path().join(name)).unwrap()).any(|bytes| bytes == b"half")
    };
    let seen = (0..3000).any(|_| {
        std::thread::sleep(Duration::from_millis(10));
        half_written()
    });
    assert!(seen, "the second process began to write within half a minute");

    // The file of a running writer is not removed.
    replace(&target, put(b"between")).unwrap();
    assert!(half_written(), "a living writer's file is left alone");
    child.kill().unwrap();
    child.wait().unwrap();
    assert_eq!(fs::read(&target).unwrap(), b"between");
    assert_eq!(names(folder.path()).len(), 2);

    replace(&target, put(b"after")).unwrap();
    assert_eq!(fs::read(&target).unwrap(), b"after");
    assert_eq!(names(folder.path()), ["scan.nm"]);
}

#[cfg(unix)]
#[test]
fn links_stay_links_devices_stay_devices_and_permissions_are_kept() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let (target, link) = (folder.path().join("scan.nm"), folder.path().join("current.nm"));
    replace(&target, put(b"old")).unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    let fresh = folder.path().join("fresh");
    fs::write(&fresh, b"").unwrap();
    assert_eq!(mode(&target), mode(&fresh), "a new file has the permissions that any new file has");

    fs::set_permissions(&target, fs::Permissions::from_mode(0o640)).unwrap();
    symlink("scan.nm", &link).unwrap();
    replace(&link, put(b"new")).unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink(), "the link is still one");
    assert_eq!(fs::read(&target).unwrap(), b"new");
    assert_eq!(mode(&target), 0o640);

    symlink("nowhere", folder.path().join("dangling")).unwrap();
    let error = replace(&folder.path().join("dangling"), put(b"new"));
    assert!(matches!(error, Err(WriteError::Io { step: WriteStep::Inspect, .. })), "{error:?}");

    let error = replace(Path::new("/dev/null"), put(b"new"));
    assert!(matches!(error, Err(WriteError::NotAFile { directory: false, .. })), "{error:?}");
}
