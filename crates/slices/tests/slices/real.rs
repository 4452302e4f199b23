//! The real scan of two storeys, where the environment names a folder that has it.

use std::path::PathBuf;

use nearmiss_slices::{
    Avatar, AvatarOptions, Back, Ended, Pixel, Route, SliceBuilder, SliceOptions, SlicePlan, Up, WalkError,
};

/// Up the two flights, over the landing, to the upper floor.
const UP: [[f64; 2]; 7] = [
    [-10.9, -4.35],
    [-12.5, -4.17],
    [-14.2, -4.05],
    [-14.15, -2.55],
    [-13.5, -2.55],
    [-10.3, -2.9],
    [-9.0, -3.0],
];

#[test]
fn an_avatar_climbs_the_real_staircase_and_comes_down_again() {
    let folder = std::env::var_os("NEARMISS_DATA").map(PathBuf::from);
    let path = folder.map(|folder| folder.join("buildings/two-storey-scan-zup-753k.ply"));
    let Some(path) = path.filter(|path| path.is_file()) else { return };
    let cloud = nearmiss_io::read(&path, None).unwrap().cloud;
    let avatar = Avatar::new(&AvatarOptions::default()).unwrap();
    let start = [-9.79, -4.4, -1.3];
    let back = UP.iter().rev().skip(1).copied().chain([[start[0], start[1]]]);
    let route = Route { start, points: UP.into_iter().chain(back).collect() };
    for pixel in [0.03, 0.04, 0.05, 0.06] {
        let options = SliceOptions::default().with_pixel(Pixel::Side(pixel)).with_up(Up::Z);
        let mut builder = SliceBuilder::new(&SlicePlan::new(&options, &cloud.bounds()).unwrap()).unwrap();
        builder.add_cloud(&cloud);
        let map = builder.finish();
        let mut heights = Vec::new();
        let ended = route.walk(&mut &map, &avatar, &Back, |_, step| {
            assert!(!step.blocked && !step.falling, "pixels of {pixel}: {step:?}");
            heights.push(step.position[2]);
            Ok::<(), WalkError>(())
        });
        assert_eq!(ended.unwrap(), Ended::Arrived, "pixels of {pixel}");
        let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!((4.4..4.55).contains(&highest), "pixels of {pixel}: the upper floor at {highest}");
        assert!((heights.last().unwrap() + 1.28).abs() < 0.05, "pixels of {pixel}: down again");
    }
}
