//! Contacts lie in both triangles, and end where they must.

use nearmiss_mesh::{Corners, TriangleContact, triangle_contact, triangles_meet, unit_normal};

use super::cases::{Random, extent, lattice_pair, magnitude, nearly_touching, random, sorted};
use super::exact::distance_to;

/// Units of rounding by which a contact may miss the triangles.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Contacts are finite, in both triangles up to rounding, and there if and only if the triangles
/// meet.
fn checked(pair: &[Corners; 2]) -> Option<TriangleContact> {
    let [a, b] = pair;
    let contact = triangle_contact(a, b);
    assert_eq!(contact.is_some(), triangles_meet(a, b), "{a:?} {b:?}");
    let contact = contact?;
    let most = ROUNDING * magnitude(pair);
    for p in [contact.point, contact.ends[0], contact.ends[1]] {
        for t in pair {
            let off = distance_to(p, t);
            assert!(off <= most, "{p:?} is {off} off {t:?}; {a:?} {b:?}");
        }
    }
    for (t, normal) in pair.iter().zip(contact.normals) {
        let Some(n) = normal else { continue };
        let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((length - 1.0).abs() < 1e-14, "{n:?} of {t:?}");
    }
    Some(contact)
}

/// Beyond the ends of a crossing there is no common point.
fn check_ends(pair: &[Corners; 2], contact: &TriangleContact) {
    let way = [0, 1, 2].map(|k| contact.ends[1][k] - contact.ends[0][k]);
    let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
    if contact.flat || length < 1e-3 * extent(pair) {
        return;
    }
    for (end, step) in [(contact.ends[0], -1e-3), (contact.ends[1], 1e-3)] {
        let beyond = [0, 1, 2].map(|k| end[k] + step * way[k]);
        let off = pair.iter().map(|t| distance_to(beyond, t)).fold(0.0, f64::max);
        assert!(off > 1e-6 * length, "{beyond:?} beyond {contact:?} of {pair:?}");
    }
}

fn check(cases: u32, seed: u64, draw: fn(&mut Random) -> [Corners; 2], ends: bool) -> [u32; 3] {
    let rng = &mut random(seed);
    let [mut crossing, mut touching, mut flat] = [0; 3];
    for _ in 0..cases {
        let pair = draw(rng);
        let Some(contact) = checked(&pair) else { continue };
        if ends {
            check_ends(&pair, &contact);
        }
        if contact.flat {
            flat += 1;
        } else if contact.ends[0] == contact.ends[1] {
            touching += 1;
        } else {
            crossing += 1;
        }
    }
    [crossing, touching, flat]
}

#[test]
fn contacts_of_lattice_triangles_lie_in_both_and_end_there() {
    let counts = check(6_000, 11, lattice_pair, true);
    assert!(counts.iter().all(|&count| count > 300), "{counts:?}");
}

#[test]
fn contacts_of_nearly_touching_triangles_lie_in_both() {
    let counts = check(3_000, 12, nearly_touching, false);
    assert!(counts[0] > 500, "{counts:?}");
}

/// Planes at an angle of 1e-12, where rounded volumes would be wrong by half the edge.
#[test]
fn nearly_parallel_triangles_cross_where_they_do() {
    let rng = &mut random(13);
    let mut crossing = 0;
    for _ in 0..3_000 {
        let mut tilted = |height: f64| {
            let tilt = |x: f64| height * (x - 0.5);
            [(); 3].map(|()| {
                let [x, y]: [f64; 2] = [(); 2].map(|()| rand::RngExt::random(rng));
                [x, y, 1.0 + tilt(rand::RngExt::random(rng))]
            })
        };
        let pair = [tilted(1e-12), tilted(3e-12)];
        crossing += u32::from(checked(&pair).is_some_and(|contact| !contact.flat));
    }
    assert!(crossing > 500, "{crossing}");
}

#[test]
fn a_crossing_is_the_segment_it_is() {
    let floor = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
    let wall = [[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [1.0, -3.0, 1.0]];
    let contact = triangle_contact(&floor, &wall).unwrap();
    let ends = sorted(contact.ends);
    // On the floor, the wall reaches from y = -1 to y = 1; the floor starts at 0.
    assert_eq!(ends, [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
    assert_eq!(contact.point, [1.0, 0.5, 0.0]);
    assert_eq!(contact.normals[0], Some([0.0, 0.0, 1.0]));
    assert_eq!(contact.normals[1].map(|n| n.map(f64::abs)), Some([1.0, 0.0, 0.0]));
    assert!(!contact.flat);
}

#[test]
fn flat_contacts_are_polygons_segments_and_points() {
    let square = |x: f64| [[x, 0.0, 0.0], [x + 2.0, 0.0, 0.0], [x, 2.0, 0.0]];
    let same = triangle_contact(&square(0.0), &square(0.0)).unwrap();
    assert!(same.flat && same.ends[0] != same.ends[1]);
    assert!((same.point[0] - 2.0 / 3.0).abs() < 1e-15, "{:?}", same.point);
    let corner = triangle_contact(&square(0.0), &square(2.0)).unwrap();
    assert_eq!((corner.point, corner.ends), ([2.0, 0.0, 0.0], [[2.0, 0.0, 0.0]; 2]));
    // A segment through the face, along it, and two segments.
    let segment = |p: [f64; 3], q: [f64; 3]| [p, q, q];
    let through = triangle_contact(&square(0.0), &segment([0.5, 0.5, -1.0], [0.5, 0.5, 3.0])).unwrap();
    assert_eq!((through.point, through.normals[1]), ([0.5, 0.5, 0.0], None));
    let along = triangle_contact(&square(0.0), &segment([-1.0, 0.5, 0.0], [3.0, 0.5, 0.0])).unwrap();
    assert_eq!(along.point, [0.75, 0.5, 0.0]);
    let [p, q] = [segment([0.0; 3], [2.0; 3]), segment([0.0, 2.0, 1.0], [2.0, 0.0, 1.0])];
    assert_eq!(triangle_contact(&p, &q).unwrap().point, [1.0; 3]);
    let overlap = triangle_contact(&p, &segment([1.0; 3], [5.0; 3])).unwrap();
    assert_eq!(overlap.point, [1.5; 3]);
}

#[test]
fn normals_of_needles_are_accurate() {
    let thin = 1e-13;
    let needle = [[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.5 - thin, 0.5 + thin, 0.5]];
    // The normal is perpendicular to (1, 1, 1) and (-1, 1, 0).
    let expected = [-1.0, -1.0, 2.0].map(|x| x / 6.0_f64.sqrt());
    let n = unit_normal(&needle).unwrap();
    for k in 0..3 {
        assert!((n[k] - expected[k]).abs() < 1e-3, "{n:?}");
    }
    assert_eq!(unit_normal(&[[1.0; 3], [2.0; 3], [3.0; 3]]), None);
    let huge = [[-f64::MAX, 0.0, 0.0], [f64::MAX, 0.0, 0.0], [0.0, f64::MAX, 0.0]];
    assert_eq!(unit_normal(&huge), Some([0.0, 0.0, 1.0]));
    let tiny = [[0.0; 3], [1e-310, 0.0, 0.0], [0.0, 1e-310, 0.0]];
    assert_eq!(unit_normal(&tiny), Some([0.0, 0.0, 1.0]));
}
