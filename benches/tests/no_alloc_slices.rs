//! Tests of boxes against slices and steps of avatars allocate no memory.
//!
//! This is a program without a test harness because the counter covers the whole process.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss::Aabb;
use nearmiss::slices::{
    Avatar, AvatarOptions, Floor, Pixel, SliceBuilder, SliceOptions, SlicePlan, Slide, Walker,
};
use nearmiss_benches::counting::Counting;
use nearmiss_testdata::house::{STAIRS, STOREY, house, scanned};

#[global_allocator]
static ALLOCATOR: Counting = Counting::new();

fn main() {
    let points = scanned(&house(), 0.05, 0.003, 1);
    let options = SliceOptions::default().with_pixel(Pixel::Side(0.05));
    let plan = SlicePlan::new(&options, &Aabb::of(points.iter().copied())).unwrap();
    let mut builder = SliceBuilder::new(&plan).unwrap();
    builder.add(&points);
    let map = builder.finish();
    let y = 0.5 * (STAIRS[0] + STAIRS[1]);
    let avatar = Avatar::new(&AvatarOptions::default()).unwrap();
    let mut walker = Walker::new(avatar, &map, [1.0, y, 0.1]).unwrap();
    let before = ALLOCATOR.calls();
    let (mut highest, mut touched) = (0.0_f64, 0);
    for _ in 0..400 {
        let step = walker.step(&map, [8.0, y], &Slide).unwrap();
        highest = highest.max(step.position[2]);
        let bounds = avatar.bounds(map.grid(), step.position);
        touched += usize::from(map.touches(&bounds).unwrap());
        touched += usize::from(map.query(&bounds, Floor::Mean).unwrap().floor.is_some());
    }
    assert_eq!(ALLOCATOR.calls(), before, "calls of the allocator");
    assert!((highest - STOREY).abs() < 0.02 && touched > 500, "{highest}, {touched}");
}
