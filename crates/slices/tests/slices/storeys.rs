//! Storeys of generated buildings.

use nearmiss_slices::{Avatar, AvatarOptions, Pixel, SliceOptions, Storey, Up, storey_of};
use nearmiss_testdata::house::{STOREY, house, scanned};

use crate::built::built;

fn storeys(points: &[[f64; 3]], up: Up, height: f64) -> Vec<Storey> {
    let turned: Vec<[f64; 3]> = points.iter().map(|p| up.from_map(*p)).collect();
    let map = built(&turned, &SliceOptions::default().with_pixel(Pixel::Side(0.05)).with_up(up)).unwrap();
    map.storeys(&Avatar::new(&AvatarOptions::default().with_box([0.4; 2], height)).unwrap()).unwrap()
}

/// A level of points 1.5 cm apart.
fn level(size: [f64; 2], z: f64) -> impl Iterator<Item = [f64; 3]> {
    let steps = |to: f64| (0..1000_u16).map(|i| 0.015 * f64::from(i)).take_while(move |x| *x < to);
    steps(size[1]).flat_map(move |y| steps(size[0]).map(move |x| [x, y, z]))
}

#[test]
fn a_house_has_two_storeys() {
    let points = scanned(&house(), 0.025, 0.003, 11);
    for up in [Up::Z, Up::NegX] {
        let found = storeys(&points, up, 1.6);
        assert_eq!(found.len(), 2, "{up}: {found:?}");
        for (storey, height) in found.iter().zip([0.0, STOREY]) {
            assert!((storey.height - height).abs() < 0.03, "{up}: {storey:?} at {height}");
            assert!(storey.area > 40.0 && storey.area < 16.0 * 12.0 + 1.0, "{up}: {storey:?}");
        }
        let of = |height: f64| storey_of(&found, height);
        assert_eq!([of(-9.0), of(0.0), of(1.5), of(STOREY - 0.1), of(99.0)], [0, 0, 0, 1, 1].map(Some));
    }
}

#[test]
fn tables_and_ceilings_are_no_storeys() {
    let walls = |from: f64| {
        let heights = (0..100_u8).map(move |i| from + 0.025 * f64::from(i));
        heights.flat_map(|z| level([4.0, 0.05], z).chain(level([0.05, 3.0], z)))
    };
    let room = |z: f64| level([4.0, 3.0], z).chain(walls(z)).chain(level([4.0, 3.0], z + 2.5));
    let table = |z: f64| level([2.5, 2.0], z + 0.8);
    let one: Vec<[f64; 3]> = room(0.0).chain(table(0.0)).collect();
    let found = storeys(&one, Up::Z, 1.6);
    assert_eq!(found.len(), 1, "{found:?}");
    // The floor under walls and table does not count; the table top is within a storey of the
    // floor.
    assert!(found[0].height.abs() < 0.03 && (6.0..8.0).contains(&found[0].area), "{found:?}");
    let two: Vec<[f64; 3]> = room(0.0).chain(room(2.8)).chain(room(5.6)).collect();
    let heights: Vec<f64> = storeys(&two, Up::Z, 1.6).iter().map(|storey| storey.height).collect();
    let off = heights.iter().zip([0.0, 2.8, 5.6]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(heights.len() == 3 && off < 0.03, "{heights:?}");
    // No headroom below the top level, which is all that is left.
    let found = storeys(&one, Up::Z, 3.0);
    assert!(found.len() == 1 && (found[0].height - 2.5).abs() < 0.03, "{found:?}");
    // A lone level.
    let mut flat: Vec<[f64; 3]> = level([4.0, 3.0], 1.0).collect();
    flat.push([0.0, 0.0, 2.0]);
    let found = storeys(&flat, Up::Z, 1.6);
    assert!(found.len() == 1 && (found[0].area - 12.0).abs() < 0.7, "{found:?}");
}
