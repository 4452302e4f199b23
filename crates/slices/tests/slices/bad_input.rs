//! Invalid options and points are rejected before anything is allocated.

use nearmiss_geometry::{Aabb, TriangleMesh};
use nearmiss_slices::{Floor, Obstacle, Pixel, SliceBuilder, SliceError, SliceOptions, SlicePlan, Up};

use crate::built::built;

fn plan(options: &SliceOptions, size: [f64; 3]) -> Result<SlicePlan, SliceError> {
    SlicePlan::new(
        options,
        &Aabb { min: [1.0, 2.0, 3.0], max: [1.0 + size[0], 2.0 + size[1], 3.0 + size[2]] },
    )
}

#[test]
fn refusals_say_what_would_mend_it() {
    let options = SliceOptions::default();
    let side = |t| options.with_pixel(Pixel::Side(t));
    let room = [20.0, 10.0, 3.0];
    let thin = side(100.0).with_slice_height(Some(1e-8)).with_obstacle(Obstacle::Share(0.5));
    let cases = [
        (plan(&options, [20.0, 10.0, 0.0]), "no extent along z"),
        (plan(&options.with_up(Up::NegX), [0.0, 10.0, 3.0]), "no extent along -x"),
        (plan(&options, [0.0; 3]), "no extent"),
        (plan(&options, [0.0, 0.0, 3.0]), "across z"),
        (plan(&options, [f64::INFINITY, 1.0, 1.0]), "finite"),
        (SlicePlan::new(&options, &Aabb::EMPTY), "finite"),
        (plan(&options, [1e308, 2.0, f64::INFINITY]), "from [1.0, 2.0, 3.0] to [1e308, 4.0, inf]"),
        (SlicePlan::new(&options, &Aabb { min: [-1e308; 3], max: [1e308; 3] }), "[1e308, 1e308, 1e308]"),
        (plan(&side(0.05), [1e30, 1.0, 3.0]), "to [1e30, 3.0, 6.0]"),
        (plan(&side(0.05), [1.0, 1.0, 1e30]), "7e30 slices of 21 × 21"),
        (plan(&side(0.05), [1.0, 1.0, 1e30]), "to [2.0, 3.0, 1e30]"),
        (plan(&side(1e308), room), "finite, got 1e308"),
        (plan(&side(0.05).with_memory(0), room), "at most 0 MiB"),
        (plan(&side(1.0).with_slice_height(Some(-1e-300)), room), "height above 0, got -1e-300"),
        (plan(&side(1.0).with_slice_height(Some(1e-300)), room), "below 1, got 1.0e300"),
        (plan(&side(1.0).with_memory(9), [1.0; 3]), "take 1 MiB"),
        (plan(&side(0.0), room), "a pixel side above 0"),
        (plan(&side(f64::NAN), room), "a pixel side above 0"),
        (plan(&options.with_pixel(Pixel::Count(0)), room), "at least 1"),
        (plan(&options.with_slice_height(Some(-1.0)), room), "a finite slice height above 0"),
        (plan(&side(1e-5), room), "2^31"),
        (plan(&side(1e-300), room), "2^31"),
        (plan(&side(0.001), room), "MiB"),
        (plan(&options.with_pixel(Pixel::Count(100_000)), [1.0, 1e-3, 1e6]), "MiB"),
        (plan(&options.with_memory(1 << 20), room), "at most 1 MiB"),
        // Thin slices of few pixels, whose cost is mostly overhead.
        (plan(&thin, [1e-9, 1e-9, 2.0]), "200000001 slices of 1 × 1 pixels"),
        (plan(&thin, [1e-9, 1e-9, 2.0]), "higher slices"),
        (plan(&thin.with_memory(u64::MAX).with_slice_height(Some(1e-10)), room), "higher slices"),
        (plan(&options.with_obstacle(Obstacle::Share(0.0)), room), "above 0"),
        (plan(&options.with_obstacle(Obstacle::Slope { degrees: 90.0, noise: None }), room), "below 90"),
        (
            plan(&options.with_obstacle(Obstacle::Slope { degrees: 20.0, noise: Some(-1.0) }), room),
            "at least 0",
        ),
        (plan(&options.with_obstacle(Obstacle::Slope { degrees: 80.0, noise: None }), room), "higher slices"),
        (plan(&options.with_obstacle(Obstacle::Share(1.5)), room), "higher slices"),
        (
            plan(&options.with_obstacle(Obstacle::Slope { degrees: 20.0, noise: Some(f64::NAN) }), room),
            "at least 0",
        ),
    ];
    for (i, (refused, word)) in cases.into_iter().enumerate() {
        let text = refused.map(|_| ()).unwrap_err().to_string();
        assert!(text.contains(word) && text.len() < 300, "case {i}: `{word}` in {text}");
    }
    assert!(built(&[[1.0, 2.0, 3.0]], &options).unwrap_err().to_string().contains("no extent"), "one point");
}

#[test]
fn options_are_refused_before_there_are_points() {
    let options = SliceOptions::default();
    let slope = |degrees, noise| Obstacle::Slope { degrees, noise };
    let side = |t| options.with_pixel(Pixel::Side(t));
    for (i, refused) in [
        side(0.0),
        side(f64::NAN),
        side(f64::INFINITY),
        side(1e308),
        options.with_pixel(Pixel::Count(0)),
        options.with_slice_height(Some(0.0)),
        options.with_slice_height(Some(f64::NAN)),
        options.with_obstacle(Obstacle::Share(f64::NAN)),
        options.with_obstacle(Obstacle::Share(-1.0)),
        options.with_obstacle(Obstacle::Share(1.0)),
        options.with_obstacle(slope(80.0, None)),
        options.with_slice_height(Some(0.2)).with_obstacle(Obstacle::Share(1.5)),
        options.with_obstacle(slope(90.0, None)),
        options.with_obstacle(slope(f64::NAN, None)),
        options.with_obstacle(slope(45.0, Some(-1.0))),
        options.with_obstacle(slope(45.0, Some(f64::NAN))),
        side(0.1).with_obstacle(slope(45.0, Some(0.25))),
        side(0.1).with_slice_height(Some(0.09)),
    ]
    .into_iter()
    .enumerate()
    {
        let cause = refused.check().unwrap_err().to_string();
        let with_points = plan(&refused, [20.0, 10.0, 3.0]).unwrap_err().to_string();
        assert_eq!(with_points, cause, "case {i}");
    }
    let high = options.with_slice_height(Some(0.2)).with_obstacle(slope(1e-9, Some(0.3)));
    assert!(matches!(high.check(), Err(SliceError::NoObstacles { share }) if share > 1.4));
    for options in [options, side(0.1), side(0.1).with_obstacle(slope(45.0, Some(0.15)))] {
        assert_eq!(options.check(), Ok(()));
    }
}

#[test]
fn points_outside_the_plan_or_broken_are_left_out_and_counted() {
    let plan = plan(&SliceOptions::default().with_pixel(Pixel::Side(0.1)), [2.0, 1.0, 3.0]).unwrap();
    let mut builder = SliceBuilder::new(&plan).unwrap();
    builder.add(&[
        [1.5, 2.5, 3.5],
        [0.9, 2.5, 3.5],
        [f64::NAN, 2.5, 3.5],
        [1.5, 2.5, f64::INFINITY],
        [3.0, 3.0, 6.0],
    ]);
    assert_eq!(builder.counts(), [2, 3]);
    let map = builder.finish();
    let everything = Aabb { min: [-1e9; 3], max: [1e9; 3] };
    assert_eq!(map.query(&everything, Floor::Max).unwrap().pixels, 2);
    assert_eq!((map.about().points, map.about().left_out), (2, 3));
    let nothing =
        [Aabb::EMPTY, Aabb { min: [f64::NAN; 3], max: [f64::NAN; 3] }, Aabb { min: [1e9; 3], max: [2e9; 3] }];
    for bounds in nothing {
        let found = map.query(&bounds, Floor::Mean).unwrap();
        assert!(!found.collides && found.pixels == 0 && found.floor.is_none(), "{bounds:?}");
        assert!(!map.touches(&bounds).unwrap(), "{bounds:?}");
    }
}

#[test]
fn of_triangles_only_what_lies_in_the_plan_is_sampled_and_the_others_are_counted() {
    let plan = plan(&SliceOptions::default().with_pixel(Pixel::Side(0.1)), [2.0, 1.0, 3.0]).unwrap();
    let corners = vec![
        [-1e9, -1e9, 4.0],
        [3e9, -1e9, 4.0],
        [-1e9, 3e9, 4.0],
        [f64::INFINITY, 2.0, 4.0],
        [1.0, f64::NAN, 4.0],
        [1e300, 1e300, 1e300],
        [1.5, 2.5, 3.5],
        [1.6, 2.5, 3.5],
        [1.5, 2.6, 3.6],
    ];
    let floor = TriangleMesh::new(corners.clone(), vec![[0, 1, 2]]).unwrap();
    let mut builder = SliceBuilder::new(&plan).unwrap();
    builder.add_mesh(&floor);
    assert_eq!(builder.counts()[1], 1);
    let map = builder.finish();
    let grid = map.grid();
    let pixels = map.query(&Aabb { min: [-1e9; 3], max: [1e9; 3] }, Floor::Max).unwrap().pixels;
    assert_eq!(pixels, grid.area() as u64, "a floor without end fills the plan");
    let mesh = TriangleMesh::new(corners, vec![[3, 6, 7], [4, 6, 7], [5, 6, 7], [0, 5, 2], [6, 7, 8]]);
    let mut builder = SliceBuilder::new(&plan).unwrap();
    let samples = builder.add_mesh(&mesh.unwrap());
    assert_eq!(builder.counts(), [samples, 4], "one is whole");
    assert!((3..100).contains(&samples), "{samples}");
}

#[test]
fn triangles_without_area_still_fill_their_pixels() {
    let corners = vec![[1.0, 2.0, 3.0], [3.0, 3.0, 6.0], [2.0, 2.5, 4.5]];
    let mesh = TriangleMesh::new(corners, vec![[0, 1, 2], [0, 0, 0], [1, 1, 0]]).unwrap();
    let plan = plan(&SliceOptions::default().with_pixel(Pixel::Side(0.1)), [2.0, 1.0, 3.0]).unwrap();
    let mut builder = SliceBuilder::new(&plan).unwrap();
    builder.add_mesh(&mesh);
    assert_eq!(builder.counts()[1], 0, "no sample is outside");
    let map = builder.finish();
    for i in 0..=1000_u16 {
        let s = f64::from(i) / 1000.0;
        let p = [1.0 + 2.0 * s, 2.0 + s, 3.0 + 3.0 * s];
        // Tolerates points on the borders of voxels.
        let near = Aabb { min: p.map(|x| x - 1e-6), max: p.map(|x| x + 1e-6) };
        assert!(map.touches(&near).unwrap(), "{p:?}");
    }
}
