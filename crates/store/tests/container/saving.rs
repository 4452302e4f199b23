//! Failed saves: they report an error and change nothing.

use std::fs;
use std::io::{self, Write};

use crate::sample::{Content, KIND};
use nearmiss_store::{Check, File, WriteError, WriteStep, Writer};

/// A stream that fails after `room` bytes. Counts the bytes taken.
struct Full {
    room: usize,
    taken: usize,
}

impl Write for Full {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = bytes.len().min(self.room - self.taken);
        if count == 0 && !bytes.is_empty() {
            return Err(io::ErrorKind::StorageFull.into());
        }
        self.taken += count;
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.taken == self.room { Err(io::ErrorKind::StorageFull.into()) } else { Ok(()) }
    }
}

#[test]
fn a_stream_that_fails_at_any_byte_is_reported() {
    let content = Content::small();
    let writer = content.writer();
    let length = content.bytes().len();
    for room in 0..=length {
        let error = writer.write_to(Full { room, taken: 0 }).expect_err("no room");
        let WriteError::Io { path: None, step: WriteStep::Write, source } = error else { panic!("{error}") };
        assert_eq!(source.kind(), io::ErrorKind::StorageFull, "at byte {room}");
    }
    let written = writer.write_to(Full { room: length + 1, taken: 0 }).unwrap();
    assert_eq!(written, length as u64);
}

#[test]
fn sections_reach_the_stream_without_being_gathered_first() {
    struct Addresses(Vec<*const u8>);
    impl Write for Addresses {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.push(bytes.as_ptr());
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let bulk = vec![1_u32; 1 << 16];
    let mut writer = Writer::new(KIND, 1);
    writer.section(*b"BULK", 0, &bulk).unwrap();
    let mut seen = Addresses(Vec::new());
    writer.write_to(&mut seen).unwrap();
    assert!(seen.0.contains(&bulk.as_ptr().cast()), "the very slice was handed on");
}

#[test]
fn places_that_cannot_be_written_are_refused_and_nothing_changes() {
    let content = Content::small();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.nm");
    content.writer().save(&path).unwrap();
    let before = fs::read(&path).unwrap();

    let nowhere = content.writer().save(folder.path().join("nowhere/scan.nm")).unwrap_err();
    assert!(
        matches!(&nowhere, WriteError::Io { step: WriteStep::Create, source, .. } if source.kind() == io::ErrorKind::NotFound),
        "{nowhere:?}"
    );
    let text = nowhere.to_string();
    assert!(
        text.contains("nowhere") && text.ends_with("check that the folder exists and is writable"),
        "{text}"
    );
    assert!(content.writer().save(path.join("below-a-file.nm")).is_err());

    let onto = content.writer().save(folder.path()).unwrap_err();
    assert!(
        matches!(&onto, WriteError::NotAFile { path, directory: true } if path == folder.path()),
        "{onto}"
    );
    for odd in ["", "..", "/"] {
        assert!(content.writer().save(odd).is_err(), "{odd:?} is no name for a file");
    }
    let long = folder.path().join("n".repeat(300));
    assert!(content.writer().save(&long).is_err());

    assert_eq!(fs::read(&path).unwrap(), before);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no litter");
}

#[cfg(unix)]
#[test]
fn a_folder_that_may_not_be_written_keeps_its_file() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.nm");
    Content::small().writer().save(&path).unwrap();
    let before = fs::read(&path).unwrap();
    let permit = |mode| fs::set_permissions(folder.path(), fs::Permissions::from_mode(mode)).unwrap();

    permit(0o555);
    // Root may write in spite of the permissions. Then the save must succeed.
    let bound_by_permissions = fs::write(folder.path().join("probe"), b"").is_err();
    let mut other = Writer::new(KIND, 9);
    other.section(*b"POSN", 0, &[1_u8]).unwrap();
    let saved = other.save(&path);
    permit(0o755);

    if bound_by_permissions {
        let error = saved.unwrap_err();
        assert!(matches!(error, WriteError::Io { step: WriteStep::Create, .. }), "{error}");
        assert_eq!(fs::read(&path).unwrap(), before);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no litter");
    } else {
        saved.unwrap();
        assert_eq!(File::open(&path, Check::Full).unwrap().version(), 9);
    }
}

/// Uses `/dev/full`, which fails for root too.
#[cfg(target_os = "linux")]
#[test]
fn a_full_device_is_reported() {
    let device = fs::File::options().write(true).open("/dev/full").unwrap();
    let error = Content::small().writer().write_to(device).unwrap_err();
    assert!(
        matches!(&error, WriteError::Io { source, .. } if source.kind() == io::ErrorKind::StorageFull),
        "{error}"
    );
    assert_eq!(
        error.to_string(),
        "cannot write (no space left on device); check the space left on the disk and try again"
    );
}

#[test]
fn a_name_without_a_folder_is_saved_where_the_process_stands() {
    let name = format!("nearmiss-store-test-{}.nm", std::process::id());
    Content::small().writer().save(&name).unwrap();
    Content::small().check(&File::open(&name, Check::Full).unwrap());
    fs::remove_file(&name).unwrap();
}
