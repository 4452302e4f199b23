//! Queries of blocks compared with brute force over all points in the same arithmetic.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use nearmiss_index::{BlockBoxes, Nearest, Overlaps, PointBlock};
use nearmiss_testdata::arbitrary::{CloudKind, cloud};
use nearmiss_testdata::instructions::levels;

type Point = [f32; 3];

/// Returns every distinct point of `cloud`, sorted by coordinates so that points that follow each
/// other are mostly close.
#[expect(clippy::cast_possible_truncation, reason = "points are stored in single precision")]
fn points(kind: CloudKind, n: u32, seed: u64, scale: f64) -> Vec<Point> {
    let mut points: Vec<Point> =
        cloud(kind, n, seed).iter().map(|p| p.map(|x| (scale * x) as f32 + 0.0)).collect();
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2])));
    points.dedup();
    points
}

fn blocks(points: &[Point], support_radius: impl Fn(usize) -> f32) -> Vec<PointBlock> {
    let mut blocks = vec![PointBlock::EMPTY; points.len().div_ceil(16)];
    for (i, p) in points.iter().enumerate() {
        for k in 0..3 {
            blocks[i / 16].position[k][i % 16] = p[k];
        }
        blocks[i / 16].support_radius[i % 16] = support_radius(i);
    }
    blocks
}

fn distance_sq(a: Point, b: Point) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|k| a[k] - b[k]);
    x * x + y * y + z * z
}

fn naive_nearest(points: &[Point], i: usize, count: usize) -> Vec<(f32, u32)> {
    let others = (0_u32..).zip(points).filter(|(j, _)| *j as usize != i);
    let mut near: Vec<(f32, u32)> = others.map(|(j, p)| (distance_sq(*p, points[i]), j)).collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    near.truncate(count);
    near
}

fn compare_nearest(points: &[Point], counts: &[usize], what: &str) {
    let blocks = blocks(points, |_| 0.0);
    let boxes = BlockBoxes::new(&blocks, points.len());
    let tree = boxes.over(&blocks);
    let mut found = Nearest::default();
    for level in levels() {
        for &count in counts {
            for block in 0..blocks.len() {
                tree.nearest(level, block, count, &mut found);
                for lane in 0..16.min(points.len() - block * 16) {
                    let i = block * 16 + lane;
                    let near: Vec<_> = found.of(lane).map(|n| (n.distance_sq, n.id)).collect();
                    assert_eq!(near, naive_nearest(points, i, count), "{what}: {count} of point {i}");
                    let last = near.len().checked_sub(1).and_then(|rank| found.ranked(lane, rank));
                    assert_eq!(last.map(|n| n.id), near.last().map(|n| n.1), "{what}: point {i}");
                    assert_eq!(found.ranked(lane, count), None, "{what}: point {i}");
                }
            }
        }
    }
}

#[test]
fn neighbours_are_those_of_a_look_at_all_points() {
    for kind in CloudKind::ALL {
        for (n, seed) in [(1, 1), (2, 2), (15, 3), (16, 4), (17, 5), (700, 6)] {
            let points = points(kind, n, seed, 1.0);
            compare_nearest(&points, &[0, 1, 4, 6, 33], &format!("{kind:?}, {n}"));
        }
    }
    compare_nearest(&points(CloudKind::Sphere, 600, 1, 1.0), &[257], "many");
    compare_nearest(&points(CloudKind::Lattice, 200, 1, 1.0), &[257], "more than there are");
}

#[test]
fn neither_size_nor_an_order_without_places_changes_an_answer() {
    for scale in [1e-15, 1e-22, 1e15] {
        compare_nearest(&points(CloudKind::Clustered, 300, 1, scale), &[4, 6], &format!("{scale}"));
    }
    let mut scattered = points(CloudKind::Sphere, 1200, 2, 1.0);
    scattered.sort_by_key(|p| p[0].to_bits().reverse_bits());
    compare_nearest(&scattered, &[6], "scattered");
    // Distinct points that are clustered at three positions.
    let close: Vec<Point> = (1_u16..100).map(|i| [f32::from(i % 3), 1e-30 * f32::from(i), 0.0]).collect();
    compare_nearest(&close, &[1, 5, 40], "distances that underflow");
}

fn compare_overlaps(points: &[Point], support_radius: impl Fn(usize) -> f32, what: &str) {
    let blocks = blocks(points, &support_radius);
    let boxes = BlockBoxes::new(&blocks, points.len());
    let tree = boxes.over(&blocks);
    let mut found = Overlaps::default();
    for level in levels() {
        for block in 0..blocks.len() {
            tree.overlapping(level, block, &mut found);
            for lane in 0..16.min(points.len() - block * 16) {
                let i = block * 16 + lane;
                let near = |j: usize| {
                    let far = support_radius(i) + support_radius(j);
                    distance_sq(points[i], points[j]) < far * far
                };
                let all: Vec<u32> =
                    (0..u32::try_from(points.len()).unwrap()).filter(|&j| near(j as usize)).collect();
                assert_eq!(found.at(lane), all, "{what}: point {i}");
            }
            for lane in points.len().saturating_sub(block * 16)..16 {
                assert!(found.at(lane).is_empty(), "{what}: lane {lane}");
            }
        }
    }
}

#[test]
fn overlapping_points_are_those_of_an_exhaustive_search() {
    for kind in CloudKind::ALL {
        for n in [1, 17, 700] {
            let points = points(kind, n, 7, 1.0);
            let radius = |i: usize| naive_nearest(&points, i, 3).last().map_or(0.0, |n| n.0.sqrt());
            let support_radii: Vec<f32> = (0..points.len()).map(radius).collect();
            compare_overlaps(&points, |i| support_radii[i], &format!("{kind:?}, {n}"));
        }
    }
    let points = points(CloudKind::Sphere, 500, 8, 1.0);
    compare_overlaps(
        &points,
        |i| if i.is_multiple_of(97) { 3.0 } else { 0.01 },
        "a few whose balls overlap all others",
    );
    compare_overlaps(&points, |_| 0.0, "no point is found");
}

fn compare_cones(points: &[Point], tips: &[f32], own: &[f32], slope: f32, what: &str) {
    let blocks = blocks(points, |_| 0.0);
    let boxes = BlockBoxes::new(&blocks, points.len());
    let tree = boxes.over(&blocks);
    let mut room = vec![[0.0; 16]; blocks.len()];
    let cones = tree.cones(&mut room, |i| tips[i], slope);
    for level in levels() {
        for (block, own) in own.chunks(16).enumerate() {
            let mut heights = [7.0; 16];
            heights[..own.len()].copy_from_slice(own);
            let below = cones.below(level, block, &heights);
            for (lane, (&own, &found)) in own.iter().zip(&below).enumerate() {
                let p = points[block * 16 + lane];
                let cone = |(q, tip): (&Point, &f32)| distance_sq(p, *q).sqrt() * slope + tip;
                let all = points.iter().zip(tips).map(cone).fold(own, f32::min);
                assert_eq!(found.to_bits(), all.to_bits(), "{what}: {found} for {all}, {own}");
            }
            assert!(below[own.len()..].iter().all(|&height| height == 7.0), "{what}: lanes without a point");
        }
    }
}

#[test]
fn cones_are_those_of_all_points() {
    for kind in CloudKind::ALL {
        for (n, scale) in [(1, 1.0), (17, 1e12), (700, 1.0), (700, 1e-9)] {
            let points = points(kind, n, 9, scale);
            let radius = |i: usize| naive_nearest(&points, i, 6).last().map_or(1e-18, |n| n.0.sqrt());
            let radii: Vec<f32> = (0..points.len()).map(radius).collect();
            for slope in [0.0, 0.3, 4.0] {
                compare_cones(&points, &radii, &radii, slope, &format!("{kind:?}, {n}, slope {slope}"));
            }
            // Infinite tips, tips equal to the heights, and tips far below.
            let tips = |i: usize| [f32::INFINITY, radii[i], 1e-3 * radii[i]][i % 7 % 3];
            let tips: Vec<f32> = (0..points.len()).map(tips).collect();
            let own = |i: usize| if i.is_multiple_of(5) { f32::MAX } else { radii[i] };
            let own: Vec<f32> = (0..points.len()).map(own).collect();
            compare_cones(&points, &tips, &own, 0.3, &format!("{kind:?}, {n}, uneven"));
        }
    }
}
