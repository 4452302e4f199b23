//! Bytes as the files that commands read lines of: poses, shapes, boxes, a route. The first byte says which.
#![no_main]

use std::ffi::OsString;
use std::fs;
use std::path::PathBuf;
use std::sync::OnceLock;

/// A folder with a small scan and its map.
fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = std::env::temp_dir().join(format!("nearmiss-lines-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder of our own");
        let rows =
            (0..400_u32).map(|i| format!("{} {} {}\n", f64::from(i % 20) * 0.1, f64::from(i / 20) * 0.1, 0));
        fs::write(folder.join("floor.xyz"), rows.collect::<String>()).expect("a folder of our own");
        for args in ["preprocess floor.xyz -o floor.nm --quiet", "slices build floor.xyz -o map --quiet"] {
            run(&folder, args);
        }
        folder
    })
}

/// Runs a command, whose words that name files of the folder are made to.
fn run(folder: &PathBuf, args: &str) {
    let words = args.split(' ').map(|word| {
        let is_file = word.contains('.') || word == "map";
        if is_file { folder.join(word).into_os_string() } else { OsString::from(word) }
    });
    let _status = nearmiss_cli::run([OsString::from("nearmiss")].into_iter().chain(words));
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let [which, bytes @ ..] = bytes else { return };
    let folder = folder();
    fs::write(folder.join("lines.txt"), bytes).expect("a folder of our own");
    run(
        folder,
        match which % 4 {
            0 => "collide floor.nm floor.nm --poses lines.txt --json --quiet",
            1 => "touch floor.nm --shapes lines.txt --json",
            2 => "slices query map --boxes lines.txt --json",
            _ => "slices walk map --route lines.txt --json",
        },
    );
});
