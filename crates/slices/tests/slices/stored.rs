//! Maps in folders: complete, replaced, damaged, and loaded on demand.

use std::fs;
use std::path::{Path, PathBuf};

use nearmiss_slices::{
    Avatar, AvatarOptions, Back, CacheOptions, Ended, Floor, Pixel, Route, SliceCache, SliceFolder, SliceMap,
    SliceOptions, SliceTarget, Step, StoreError,
};
use nearmiss_testdata::house::{STAIRS, house, scanned};

use crate::built::{built, of_quads};

fn map() -> SliceMap {
    built(&scanned(&house(), 0.04, 0.003, 2), &SliceOptions::default().with_pixel(Pixel::Side(0.05))).unwrap()
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

#[test]
fn maps_come_back_whole_and_equal_slices_are_stored_once() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("house");
    let map = map();
    let bytes = map.save(&folder).unwrap();
    let opened = SliceFolder::open(&folder).unwrap();
    assert_eq!((opened.grid(), opened.about()), (map.grid(), map.about()));
    assert_eq!(opened.bytes(), bytes);
    let (loaded, faults) = opened.load_all();
    assert!(faults.is_empty() && loaded == map);
    // On disk at most a tenth of what it takes in memory, which is at most two bytes a pixel.
    assert!(10 * bytes < map.bytes() as u64, "{bytes} on disk, {} in memory", map.bytes());
    assert!(map.bytes() <= 2 * map.grid().area() * map.slices().len());

    // Walls of triangles are the same at every height between floor and ceiling.
    let plain = of_quads(&house(), &SliceOptions::default().with_pixel(Pixel::Side(0.05)));
    let second = place.path().join("plain");
    plain.save(&second).unwrap();
    let opened = SliceFolder::open(&second).unwrap();
    assert!(
        opened.distinct() < plain.slices().len(),
        "{} distinct of {}",
        opened.distinct(),
        plain.slices().len()
    );
    assert_eq!(files(&second).len(), opened.distinct() + 1, "a file a distinct slice, and the index");
    let (loaded, _) = opened.load_all();
    assert_eq!(loaded.distinct(), opened.distinct(), "in memory too");
    let again = place.path().join("again");
    plain.save(&again).unwrap();
    for (a, b) in files(&second).iter().zip(&files(&again)) {
        assert_eq!(
            (a.file_name(), fs::read(a).unwrap()),
            (b.file_name(), fs::read(b).unwrap()),
            "the same bytes"
        );
    }
}

#[test]
fn a_map_replaces_another_and_nothing_else() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("map");
    let (first, second) = (map(), of_quads(&house(), &SliceOptions::default().with_pixel(Pixel::Side(0.1))));
    first.save(&folder).unwrap();
    let before = files(&folder).len();
    second.save(&folder).unwrap();
    let opened = SliceFolder::open(&folder).unwrap();
    assert_eq!(opened.load_all().0, second);
    assert_eq!(files(&folder).len(), opened.distinct() + 1, "{before} files before");
    // Files of killed writers are removed; other files are not touched, whatever their names.
    let image = files(&folder)[0].clone();
    fs::copy(&image, folder.join("0123456789abcdef.nms")).unwrap();
    fs::write(folder.join("0123456789abcdee.nms.tmp-abcdefghijkl"), b"half").unwrap();
    fs::write(folder.join("index.lock"), b"").unwrap();
    second.save(&folder).unwrap();
    assert_eq!(files(&folder).len(), opened.distinct() + 1);
    for name in ["0123456789abcdef.nms", "0123456789abcdee.nms.tmp-letter", "notes.txt"] {
        fs::write(folder.join(name), b"dear").unwrap();
    }
    second.save(&folder).unwrap();
    assert_eq!(files(&folder).len(), opened.distinct() + 4);
    let others = place.path().join("letters");
    fs::create_dir(&others).unwrap();
    fs::write(others.join("letter.txt"), b"dear").unwrap();
    assert!(matches!(second.save(&others), Err(StoreError::Foreign { .. })));
    assert_eq!(files(&others).len(), 1);
    assert!(matches!(SliceFolder::open(&others), Err(StoreError::Open(_))), "no index");
    let occupied = place.path().join("letters/letter.txt");
    assert!(matches!(second.save(&occupied), Err(StoreError::Folder { .. })), "a file is no folder");
}

#[test]
fn files_named_like_a_maps_are_not_taken_for_one() {
    let place = tempfile::tempdir().unwrap();
    let map = of_quads(&house(), &SliceOptions::default().with_pixel(Pixel::Side(0.1)));
    for name in ["0123456789abcdef.nms", "index.nms"] {
        let folder = place.path().join(name);
        fs::create_dir(&folder).unwrap();
        fs::write(folder.join(name), b"1 2 3").unwrap();
        assert!(matches!(map.save(&folder), Err(StoreError::Foreign { .. })), "{name}");
        assert_eq!((files(&folder).len(), fs::read(folder.join(name)).unwrap()), (1, b"1 2 3".to_vec()));
        fs::remove_file(folder.join(name)).unwrap();
        fs::create_dir(folder.join(name)).unwrap();
        assert!(matches!(map.save(&folder), Err(StoreError::Foreign { .. })), "{name} is a folder");
        assert_eq!(files(&folder).len(), 1);
    }
    // A damaged index counts as a map.
    let folder = place.path().join("damaged");
    map.save(&folder).unwrap();
    fs::write(folder.join("index.nms"), b"").unwrap();
    map.save(&folder).unwrap();
    assert_eq!(SliceFolder::open(&folder).unwrap().load_all().0, map);
}

#[test]
fn only_one_writes_into_a_folder() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path().join("map");
    let [first, second] =
        [0.1, 0.11].map(|t| of_quads(&house(), &SliceOptions::default().with_pixel(Pixel::Side(t))));
    let target = SliceTarget::new(&folder).unwrap();
    let refused = second.save(&folder).unwrap_err();
    assert!(matches!(&refused, StoreError::Busy { path } if *path == folder), "{refused}");
    target.save(&first).unwrap();
    second.save(&folder).unwrap();
    let write = |map: &SliceMap| {
        let saved = map.save(&folder);
        assert!(matches!(saved, Ok(_) | Err(StoreError::Busy { .. })), "{saved:?}");
        u32::from(saved.is_ok())
    };
    for _ in 0..20 {
        let done: u32 = std::thread::scope(|scope| {
            let threads = [&first, &second, &first].map(|map| scope.spawn(move || write(map)));
            threads.into_iter().map(|thread| thread.join().unwrap()).sum()
        });
        assert!(done > 0, "nobody has written");
        let (map, faults) = SliceFolder::open(&folder).unwrap().load_all();
        assert!(faults.is_empty() && (map == first || map == second), "{faults:?}");
    }
}

#[test]
fn what_fails_leaves_nothing() {
    let place = tempfile::tempdir().unwrap();
    let [first, second] =
        [0.1, 0.11].map(|t| of_quads(&house(), &SliceOptions::default().with_pixel(Pixel::Side(t))));
    let (folder, other) = (place.path().join("map"), place.path().join("other"));
    first.save(&folder).unwrap();
    second.save(&other).unwrap();
    // A slice that cannot be written.
    let name = image(&other, 9);
    fs::create_dir(folder.join(name.file_name().unwrap())).unwrap();
    let before = files(&folder);
    assert!(matches!(second.save(&folder), Err(StoreError::Write(_))));
    assert_eq!(files(&folder), before);
    assert_eq!(SliceFolder::open(&folder).unwrap().load_all().0, first);
    // A map without one of its slices cannot be written either; folders that were made for it are
    // removed.
    fs::remove_file(image(&other, 9)).unwrap();
    let (missing, _) = SliceFolder::open(&other).unwrap().load_all();
    let deep = place.path().join("new/and/deep");
    assert!(matches!(missing.save(&deep), Err(StoreError::Incomplete { .. })));
    drop(SliceTarget::new(&deep).unwrap());
    assert!(!place.path().join("new").exists());
}

/// The file of a slice.
fn image(folder: &Path, slice: usize) -> PathBuf {
    let checksum = SliceFolder::open(folder).unwrap().checksums()[slice];
    folder.join(format!("{checksum:016x}.nms"))
}

#[test]
fn damage_is_named_and_the_others_serve() {
    let place = tempfile::tempdir().unwrap();
    let map = map();
    map.save(place.path()).unwrap();
    let opened = SliceFolder::open(place.path()).unwrap();
    let file = |slice: usize| place.path().join(format!("{:016x}.nms", opened.checksums()[slice]));
    let (missing, cut, flipped, swapped) = (file(5), file(8), file(12), file(20));
    fs::remove_file(&missing).unwrap();
    let bytes = fs::read(&cut).unwrap();
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let mut bytes = fs::read(&flipped).unwrap();
    let at = bytes.len() - 100;
    bytes[at] ^= 4;
    fs::write(&flipped, bytes).unwrap();
    fs::copy(file(30), &swapped).unwrap();
    let (loaded, faults) = opened.load_all();
    let texts: Vec<String> = faults.iter().map(ToString::to_string).collect();
    assert_eq!(faults.len(), 4, "{texts:?}");
    for (slice, path, word) in [
        (5, &missing, "no such file; build the slices again"),
        (8, &cut, "(cut short); build the slices again"),
        (12, &flipped, "build"),
        (20, &swapped, "got another image"),
    ] {
        let name = path.file_name().unwrap().to_str().unwrap();
        let text = texts.iter().find(|text| text.contains(name));
        let text = text.unwrap_or_else(|| panic!("{name} is not in {texts:?}"));
        assert!(text.contains(&format!("slice {slice}")) && text.contains(word), "{text}");
    }
    assert!(
        ["slice 5:", "slice 8:", "slice 12:", "slice 20:"]
            .iter()
            .zip(&texts)
            .all(|(s, text)| text.starts_with(s)),
        "lowest first: {texts:?}"
    );
    // A query of a box above the missing slices succeeds, one of a box in them fails.
    let grid = *opened.grid();
    let boxed = |slices: [u32; 2]| {
        let height = |s: u32| grid.origin[2] + (f64::from(s) + 0.5) * grid.slice_height;
        nearmiss_geometry::Aabb { min: [1.0, 3.0, height(slices[0])], max: [9.5, 9.0, height(slices[1])] }
    };
    assert_eq!(loaded.touches(&boxed([21, 25])), map.touches(&boxed([21, 25])));
    assert_eq!(loaded.query(&boxed([4, 6]), Floor::Max).unwrap_err().slice, 5);
    assert!(loaded.query(&boxed([0, 3]), Floor::Max).is_ok());
    // An index that is damaged anywhere is refused.
    let index = place.path().join("index.nms");
    let bytes = fs::read(&index).unwrap();
    for i in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[i] ^= 0x20;
        fs::write(&index, damaged).unwrap();
        let refused = SliceFolder::open(place.path()).unwrap_err().to_string();
        assert!(!refused.contains("prepare") && refused.contains("; "), "byte {i}: {refused}");
    }
    for bytes in [&b""[..], b"1 2 3"] {
        fs::write(&index, bytes).unwrap();
        let refused = SliceFolder::open(place.path()).unwrap_err().to_string();
        assert!(refused.contains("index.nms: ") && refused.contains("; build the slices again"), "{refused}");
    }
    fs::remove_file(&index).unwrap();
    assert!(SliceFolder::open(place.path()).unwrap_err().to_string().contains("check the path"));
}

const Y: f64 = 0.5 * (STAIRS[0] + STAIRS[1]);

fn up_the_stairs() -> Route {
    Route { start: [1.2, 8.0, 0.2], points: vec![[1.2, Y], [8.0, Y], [1.2, Y]] }
}

/// Up the stairs, then off the edge of the upper floor, and up again.
fn up_and_over_the_edge() -> Route {
    let points = [[1.2, Y], [8.0, Y], [8.0, 9.5], [10.0, 9.0], [10.0, 4.5], [7.0, 4.5], [1.2, 4.5], [1.2, Y]];
    Route { points: [&points[..], &[[8.0, Y]]].concat(), ..up_the_stairs() }
}

/// Returns the map in a folder, and the steps of a walk with the whole map in memory.
fn saved_and_walked(route: &Route, avatar: &Avatar) -> (tempfile::TempDir, SliceFolder, Vec<Step>) {
    let place = tempfile::tempdir().unwrap();
    let map = map();
    map.save(place.path()).unwrap();
    let mut steps = Vec::new();
    let ended = route.walk(&mut &map, avatar, &Back, |_, step| {
        steps.push(*step);
        Ok(())
    });
    assert_eq!(ended.unwrap(), Ended::Arrived);
    let folder = SliceFolder::open(place.path()).unwrap();
    (place, folder, steps)
}

fn walked(folder: &SliceFolder, route: &Route, slices: u32, prefetch: bool) -> (Vec<Step>, [u64; 2], usize) {
    let avatar = Avatar::new(&AvatarOptions::default()).unwrap();
    let options = CacheOptions::default().with_slices(slices).with_prefetch(prefetch);
    let mut cache = SliceCache::new(folder, &options, avatar.slices(folder.grid()));
    let capacity = cache.capacity();
    let mut steps = Vec::new();
    let ended = route.walk(&mut cache, &avatar, &Back, |cache: &SliceCache, step| {
        assert!(cache.map().slices().iter().flatten().count() <= capacity, "never more than {capacity}");
        steps.push(*step);
        Ok::<(), StoreError>(())
    });
    assert_eq!(ended.unwrap(), Ended::Arrived);
    let counts = cache.counts();
    (steps, [counts.hits, counts.misses], capacity)
}

#[test]
fn a_cache_never_changes_a_walk_and_counts_the_same_every_time() {
    let avatar = Avatar::new(&AvatarOptions::default()).unwrap();
    let (_place, folder, expected) = saved_and_walked(&up_the_stairs(), &avatar);
    let span = avatar.slices(folder.grid()) as usize;
    let mut misses = Vec::new();
    for (slices, prefetch) in [(1, false), (20, false), (60, false), (1, true), (20, true), (60, true)] {
        let (steps, counts, capacity) = walked(&folder, &up_the_stairs(), slices, prefetch);
        assert_eq!(steps, expected, "{slices} slices");
        let most = folder.grid().counts[2] as usize;
        assert_eq!(
            capacity,
            span.max(slices as usize).min(most),
            "raised to what is needed, if there is so much"
        );
        for _ in 0..3 {
            assert_eq!(
                walked(&folder, &up_the_stairs(), slices, prefetch).1,
                counts,
                "{slices} slices, {prefetch}"
            );
        }
        assert!(counts[0] > 50 * counts[1], "{counts:?}");
        misses.push(counts[1]);
    }
    // A larger cache loads fewer slices twice; loading ahead reduces misses.
    assert!(misses[0] > misses[2] && misses[4] <= misses[1] && misses[5] < misses[2], "{misses:?}");
    let all = folder.grid().counts[2];
    assert!(misses[2] <= u64::from(all), "each once: {misses:?} of {all}");
}

#[test]
fn an_uneven_floor_is_no_movement_up_or_down() {
    let place = tempfile::tempdir().unwrap();
    map().save(place.path()).unwrap();
    let folder = SliceFolder::open(place.path()).unwrap();
    let avatar = Avatar::new(&AvatarOptions::default()).unwrap();
    let route = Route { start: [1.2, 8.0, 0.2], points: vec![[7.0, 8.0], [7.0, 9.0], [1.2, 8.0]] };
    let mut counted = Vec::new();
    for prefetch in [false, true] {
        let options = CacheOptions::default().with_slices(60).with_prefetch(prefetch);
        let mut cache = SliceCache::new(&folder, &options, avatar.slices(folder.grid()));
        let (mut steps, mut rises, mut feet) = (0, 0, 0.0);
        let ended = route.walk(&mut cache, &avatar, &Back, |cache: &SliceCache, step| {
            rises += u32::from(step.position[2] > feet);
            feet = step.position[2];
            steps += 1;
            counted.push(cache.map().slices().iter().flatten().count());
            Ok::<(), StoreError>(())
        });
        assert_eq!(ended.unwrap(), Ended::Arrived);
        assert!(rises > 20 && steps > 200, "{rises} times up in {steps} steps");
        std::thread::sleep(std::time::Duration::from_millis(20));
        cache.want(0..=0, 0.0).unwrap();
        counted.push(cache.map().slices().iter().flatten().count());
    }
    let (without, ahead) = counted.split_at(counted.len() / 2);
    assert_eq!(without, ahead, "nothing is loaded ahead");
}

#[test]
fn a_cache_never_changes_a_fall() {
    let avatar = Avatar::new(&AvatarOptions::default()).unwrap();
    let (_place, folder, expected) = saved_and_walked(&up_and_over_the_edge(), &avatar);
    let falls = expected.iter().filter(|step| step.falling).count();
    assert!(falls >= 8, "{falls} steps of a fall by a storey");
    let most = expected.windows(2).map(|pair| pair[0].position[2] - pair[1].position[2]).fold(0.0, f64::max);
    assert!((most - avatar.options().climb).abs() < 1e-9, "as fast as it climbs: {most}");
    for (slices, prefetch) in [(1, false), (20, false), (1, true), (20, true), (60, true)] {
        let (steps, counts, _) = walked(&folder, &up_and_over_the_edge(), slices, prefetch);
        assert_eq!(steps, expected, "{slices} slices, ahead: {prefetch}");
        assert_eq!(walked(&folder, &up_and_over_the_edge(), slices, prefetch).1, counts);
    }
}

#[test]
fn a_walk_into_a_damaged_slice_ends_there_with_its_name() {
    let place = tempfile::tempdir().unwrap();
    map().save(place.path()).unwrap();
    let folder = SliceFolder::open(place.path()).unwrap();
    let name = format!("{:016x}.nms", folder.checksums()[24]);
    fs::remove_file(place.path().join(&name)).unwrap();
    let avatar = Avatar::new(&AvatarOptions::default()).unwrap();
    for prefetch in [false, true] {
        let mut cache = SliceCache::new(
            &folder,
            &CacheOptions::default().with_prefetch(prefetch),
            avatar.slices(folder.grid()),
        );
        let mut steps = 0;
        let ended = up_the_stairs().walk(&mut cache, &avatar, &Back, |_: &SliceCache, _| {
            steps += 1;
            Ok::<(), StoreError>(())
        });
        let text = ended.unwrap_err().to_string();
        assert!(text.contains(&name) && text.contains("slice 24"), "{text}");
        assert!(steps > 40, "{steps} steps before");
    }
}
