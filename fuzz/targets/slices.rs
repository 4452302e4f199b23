//! Bytes as files of a slice map: an index and a slice, whose names and checksums are made to fit first. The
//! first byte says which of the two they are, the other is sound.
#![no_main]

#[path = "../../crates/nearmiss/tests/facade/hostile/repair.rs"]
mod repair;

use std::fs;
use std::path::PathBuf;
use std::sync::OnceLock;

use nearmiss::slices::{Floor, SliceBuilder, SliceFolder, SliceOptions, SlicePlan, SliceTarget};

/// A folder with a sound map, and what its files hold.
fn sound() -> &'static (PathBuf, Vec<(PathBuf, Vec<u8>)>) {
    static SOUND: OnceLock<(PathBuf, Vec<(PathBuf, Vec<u8>)>)> = OnceLock::new();
    SOUND.get_or_init(|| {
        let folder = std::env::temp_dir().join(format!("nearmiss-fuzz-{}", std::process::id()));
        let points: Vec<[f64; 3]> = (0..400_u32)
            .map(|i| [f64::from(i % 20) * 0.1, f64::from(i / 20) * 0.1, f64::from(i % 3) * 0.4])
            .collect();
        let bounds = nearmiss::Aabb::of(points.iter().copied());
        let plan = SlicePlan::new(&SliceOptions::default(), &bounds).expect("sound options");
        let mut builder = SliceBuilder::new(&plan).expect("little memory");
        builder.add(&points);
        SliceTarget::new(&folder)
            .and_then(|target| target.save(&builder.finish()))
            .expect("a folder of our own");
        let files = fs::read_dir(&folder).expect("it is there").flatten().map(|entry| entry.path());
        let files = files
            .filter(|path| path.is_file())
            .map(|path| (path.clone(), fs::read(&path).unwrap_or_default()));
        let mut files: Vec<_> = files.collect();
        files.sort();
        (folder, files)
    })
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let [which, bytes @ ..] = bytes else { return };
    let (folder, files) = sound();
    let (path, before) = &files[usize::from(*which) % files.len()];
    let mut bytes = bytes.to_vec();
    repair::repair(&mut bytes);
    fs::write(path, &bytes).expect("a folder of our own");
    match SliceFolder::open(folder) {
        Ok(map) => {
            let (map, _faults) = map.load_all();
            let bounds = nearmiss::Aabb { min: [0.0; 3], max: [1.0; 3] };
            let (_touches, _occupancy) = (map.touches(&bounds), map.query(&bounds, Floor::Max));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
    fs::write(path, before).expect("a folder of our own");
});
