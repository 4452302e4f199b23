//! What no map can be made of is refused before anything is allocated.

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
    let cases = [
        (plan(&options, [20.0, 10.0, 0.0]), "no extent along z"),
        (plan(&options.with_up(Up::NegX), [0.0, 10.0, 3.0]), "no extent along -x"),
        (plan(&options, [0.0; 3]), "no extent"),
        (plan(&options, [0.0, 0.0, 3.0]), "across z"),
        (plan(&options, [f64::INFINITY, 1.0, 1.0]), "finite"),
        (SlicePlan::new(&options, &Aabb::EMPTY), "finite"),
        (plan(&side(0.0), room), "a length above 0"),
        (plan(&side(f64::NAN), room), "a length above 0"),
        (plan(&options.with_pixel(Pixel::Count(0)), room), "at least 1"),
        (plan(&options.with_slice_height(Some(-1.0)), room), "a length above 0"),
        (plan(&side(1e-5), room), "2^31"),
        (plan(&side(1e-300), room), "2^31"),
        (plan(&side(0.001), room), "MiB"),
        (plan(&options.with_pixel(Pixel::Count(100_000)), [1.0, 1e-3, 1e6]), "MiB"),
        (plan(&options.with_memory(1 << 20), room), "1 are allowed"),
        (plan(&options.with_obstacle(Obstacle::Share(0.0)), room), "above 0"),
        (plan(&options.with_obstacle(Obstacle::Slope { degrees: 90.0, noise: None }), room), "below 90"),
        (
            plan(&options.with_obstacle(Obstacle::Slope { degrees: 20.0, noise: Some(-1.0) }), room),
            "at least 0",
        ),
        (plan(&options.with_obstacle(Obstacle::Slope { degrees: 80.0, noise: None }), room), "higher slices"),
        (plan(&options.with_obstacle(Obstacle::Share(1.5)), room), "higher slices"),
    ];
    for (i, (refused, word)) in cases.into_iter().enumerate() {
        let text = refused.map(|_| ()).unwrap_err().to_string();
        assert!(text.contains(word), "case {i}: `{word}` in {text}");
    }
    assert!(built(&[[1.0, 2.0, 3.0]], &options).unwrap_err().to_string().contains("no extent"), "one point");
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
    assert_eq!(map.about().points, 2);
    let nothing =
        [Aabb::EMPTY, Aabb { min: [f64::NAN; 3], max: [f64::NAN; 3] }, Aabb { min: [1e9; 3], max: [2e9; 3] }];
    for bounds in nothing {
        let found = map.query(&bounds, Floor::Mean).unwrap();
        assert!(!found.collides && found.pixels == 0 && found.floor.is_none(), "{bounds:?}");
        assert!(!map.touches(&bounds).unwrap(), "{bounds:?}");
    }
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
        // Off the walls of the lattice.
        let near = Aabb { min: p.map(|x| x - 1e-6), max: p.map(|x| x + 1e-6) };
        assert!(map.touches(&near).unwrap(), "{p:?}");
    }
}
