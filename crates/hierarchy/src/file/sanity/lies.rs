//! Hierarchies with one corrupt number: each is rejected, and the error names the number.

use std::sync::OnceLock;

use nearmiss_geometry::{NodeId, PointCloud};
use nearmiss_lanes::id32;
use nearmiss_testdata::arbitrary::{self, CloudKind};

use crate::bounds::boxes::OrientedBox;
use crate::patch::covering::Covering;
use crate::point::disc::PointCode;
use crate::scan::build::PointHierarchy;
use crate::scan::options::BuildOptions;
use nearmiss_store::Flaw;

fn honest() -> PointHierarchy {
    let points = arbitrary::cloud(CloudKind::Sphere, 301, 1);
    PointHierarchy::build(&PointCloud::from_positions(&points).unwrap(), &BuildOptions::default()).unwrap()
}

/// Returns the flaws found after `lie` has corrupted a scan: by the structural checks alone, and by
/// those of the contents as well.
fn found(lie: impl FnOnce(&mut PointHierarchy)) -> [Option<String>; 2] {
    let mut scan = honest();
    lie(&mut scan);
    let structure = scan.check_structure();
    let full = structure.clone().and_then(|()| scan.check_contents());
    assert!(full.is_err() == scan.sanity_check().is_err(), "the thorough check is no laxer");
    [structure, full].map(|outcome| outcome.err().map(|flaw| flaw.to_string()))
}

/// Expects that only the checks of the contents find the corruption.
fn deep(words: &str, lie: impl FnOnce(&mut PointHierarchy)) {
    let message = format!("{words} is invalid; prepare the scan again");
    assert_eq!(found(lie), [None, Some(message)]);
}

/// Expects that the structural checks find the corruption.
fn plain(words: &str, lie: impl FnOnce(&mut PointHierarchy)) {
    let message = Some(format!("{words}; prepare the scan again"));
    assert_eq!(found(lie), [message.clone(), message]);
}

const NONE: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];

#[test]
fn nothing_is_wrong_with_an_honest_one() {
    assert_eq!(found(|_| ()), [None, None]);
}

/// Returns the siblings that hold the box of node `id`, and its lane there.
fn place(scan: &PointHierarchy, id: usize) -> (usize, usize) {
    let (parent, lane) = scan.topology().parent(NodeId(id32(id))).unwrap();
    (parent.index(), lane)
}

/// Corrupts the box of node `id`.
fn lying(scan: &mut PointHierarchy, id: usize, lie: impl FnOnce(&mut OrientedBox)) {
    let (parent, lane) = place(scan, id);
    let siblings = &mut scan.arrays.siblings.to_mut()[parent];
    let reach = &mut scan.arrays.reaches.to_mut()[parent][lane];
    let mut bounds = siblings.get(lane, *reach);
    lie(&mut bounds);
    siblings.set(lane, &bounds);
    *reach = bounds.reach;
}

#[test]
fn boxes_that_are_none() {
    let wrong = |lie: &dyn Fn(&mut OrientedBox)| deep("the box of node 7", |scan| lying(scan, 7, lie));
    for value in NONE.into_iter().chain([2e12, -2e12]) {
        for k in 0..3 {
            wrong(&|bounds| bounds.centre[k] = value);
            wrong(&|bounds| bounds.half[k] = value);
        }
        for k in 0..2 {
            wrong(&|bounds| bounds.axes[k][1] = value);
        }
        wrong(&|bounds| bounds.reach = value);
        plain("the box of the root is invalid", |scan| scan.meta.root.bounds.half[0] = value);
    }
    wrong(&|bounds| bounds.half[2] = -1e-3);
    wrong(&|bounds| bounds.axes[1][0] = 1.01);
    wrong(&|bounds| bounds.axes = [[0.0; 3]; 3]);
    wrong(&|bounds| bounds.axes[1] = bounds.axes[0]);
    deep("the box of node 0", |scan| scan.meta.root.bounds.axes[1] = scan.meta.root.bounds.axes[0]);
}

#[test]
fn lanes_without_a_child_that_say_something() {
    let scan = honest();
    let inner = scan.topology().ids().take(scan.topology().inner());
    let few = inner.into_iter().find(|&id| scan.topology().children(id).len() < 4).unwrap();
    deep(&format!("the boxes of the children of node {}", few.0), |scan| {
        scan.arrays.siblings.to_mut()[few.index()].half[0][3] = 7.0;
    });
    deep(&format!("the boxes of the children of node {}", few.0), |scan| {
        scan.arrays.reaches.to_mut()[few.index()][3] = 7.0;
    });
}

#[test]
fn boxes_that_leave_their_parents_or_their_points() {
    let topology = *honest().topology();
    for id in 1..topology.len() {
        for k in 0..3 {
            // Some boxes have room in their parent's: large enough that none is left.
            deep(&format!("the box of node {id}"), |scan| lying(scan, id, |bounds| bounds.half[k] = 2.0));
            deep(&format!("the box of node {id}"), |scan| lying(scan, id, |bounds| bounds.centre[k] += 4.0));
        }
        deep(&format!("the box of node {id}"), |scan| lying(scan, id, |bounds| bounds.reach *= 2.0));
        if id >= topology.inner() {
            // Smaller than the discs in it: one or more of its points extend beyond it.
            let [_, flaw] = found(|scan| lying(scan, id, |bounds| bounds.half[0] *= 0.9));
            assert!(flaw.is_some_and(|words| words.starts_with("the bounding box of point ")), "leaf {id}");
            let [_, flaw] = found(|scan| lying(scan, id, |bounds| bounds.reach *= 0.5));
            assert!(flaw.is_some_and(|words| words.starts_with("the radius of point ")), "leaf {id}");
        }
    }
}

#[test]
fn enclosures_that_are_none() {
    for part in 0..2 {
        deep("the enclosure of node 7", |scan| {
            let (parent, lane) = place(scan, 7);
            let growths = [&mut scan.arrays.surface_growths, &mut scan.arrays.obstacle_growths];
            growths[part].to_mut()[parent].0[1][lane] = 0x8001;
        });
    }
}

#[test]
fn leaves_that_are_not_their_points() {
    for (leaf, lane) in [(0, 3), (7, 15), (18, 12), (18, 13)] {
        let block = format!("the block of leaf {leaf}");
        deep(&block, |scan| {
            scan.arrays.leaf_blocks.to_mut()[leaf].set(lane, [0.01; 3], [1.0, 0.0, 0.0], 0.02)
        });
        deep(&block, |scan| scan.arrays.leaf_blocks.to_mut()[leaf].half[1] *= 2.0);
        deep(&block, |scan| scan.arrays.marks.to_mut()[leaf] ^= 1);
    }
}

/// Corrupts a coordinate of point `i`.
fn lie_of_position(scan: &mut PointHierarchy, i: usize, k: usize, value: f32) {
    scan.arrays.blocks.to_mut()[i / 16].position[k][i % 16] = value;
    scan.positions = OnceLock::new();
}

#[test]
fn points_that_no_build_writes() {
    // The last point of all shares its block with padding.
    for i in [0, 7, 8, 150, 300] {
        let named = |words: &str| format!("{words} of point {i}");
        for value in NONE {
            deep(&named("the position"), |scan| lie_of_position(scan, i, 1, value));
            deep(&named("the normal"), |scan| scan.arrays.normals.to_mut()[i][2] = value);
        }
        for value in NONE.into_iter().chain([0.0, -0.1, 1e3]) {
            deep(&named("the radius"), |scan| scan.arrays.radii.to_mut()[i] = value);
        }
        deep(&format!("the bounding box of point {i}"), |scan| {
            let x = scan.arrays().position(i)[0];
            lie_of_position(scan, i, 0, x + 1.0);
        });
        deep(&named("the normal"), |scan| scan.arrays.normals.to_mut()[i] = [0.0; 3]);
        for code in [6, 7, 32, 255] {
            deep(&named("the kind"), |scan| scan.arrays.codes.to_mut()[i] = PointCode(code));
        }
        deep(&named("the source index"), |scan| scan.arrays.source.to_mut()[i] = 301);
    }
}

#[test]
fn blocks_that_are_not_the_points() {
    // The last block is not full: the contents of its unused lanes count too.
    for (block, lane) in [(0, 3), (7, 15), (18, 12), (18, 13)] {
        let copy = format!("the copy of the points of block {block}");
        deep(&copy, |scan| scan.arrays.blocks.to_mut()[block].position[1][lane] = 7.0);
        deep(&copy, |scan| scan.arrays.blocks.to_mut()[block].support_radius[lane] += 0.5);
    }
    for value in NONE.into_iter().chain([0.0, -1.0]) {
        deep("the bounding ball of block 5", |scan| scan.arrays.groups.to_mut()[0].support_radius[5] = value);
    }
    deep("the bounding ball of block 5", |scan| scan.arrays.groups.to_mut()[0].support_radius[5] *= 0.99);
    deep("the bounding ball of block 5", |scan| scan.arrays.groups.to_mut()[0].position[2][5] += 0.5);
    deep("the bounding ball of block 5", |scan| scan.arrays.groups.to_mut()[0].position[2][5] = f32::NAN);
}

#[test]
fn lists_that_are_none() {
    let words = "the neighbour list of block 4";
    for value in NONE {
        deep(words, |scan| scan.arrays.lists.to_mut()[4].within = value);
    }
    for value in [129, u32::MAX] {
        deep(words, |scan| scan.arrays.lists.to_mut()[4].count = value);
    }
    for value in [1 << 20, u32::MAX] {
        deep(words, |scan| scan.arrays.lists.to_mut()[4].first = value);
    }
    let at = honest().arrays.lists[4].first as usize;
    deep(words, |scan| scan.arrays.listed.to_mut()[at + 1] = scan.arrays.listed[at]);
    deep(words, |scan| {
        let last = at + scan.arrays.lists[4].count as usize - 1;
        scan.arrays.listed.to_mut()[last] = 19;
    });
    plain("expected 19 entries in neighbour lists, got 18", |scan| {
        scan.arrays.lists = scan.arrays.lists[1..].to_vec().into();
    });
}

#[test]
fn a_list_that_leaves_a_block_out_is_for_the_thorough_check() {
    for block in [0, 4, 18] {
        let mut scan = honest();
        scan.arrays.lists.to_mut()[block].count = 1;
        assert_eq!(scan.check_contents(), Ok(()), "one pass does not see it");
        let found = scan.sanity_check();
        assert!(matches!(found, Err(Flaw::Value { index, .. }) if index == block), "{found:?}");
    }
}

#[test]
fn samples_and_coverings_that_are_none() {
    let scan = honest();
    let topology = scan.topology();
    let inner = topology.ids().take(topology.inner());
    let id = inner.rev().find(|&id| topology.points(id).len() > scan.meta.samples as usize).unwrap();
    let (at, points) = (id.index() * scan.meta.samples as usize, topology.points(id));
    let named = format!("a sample of node {}", id.0);
    for value in [id32(points.start).wrapping_sub(1), id32(points.end), 301, u32::MAX] {
        deep(&named, |scan| scan.arrays.sample_lists.to_mut()[at + 3] = value);
    }
    deep(&named, |scan| scan.arrays.sample_lists.to_mut()[at + 3] = scan.arrays.sample_lists[at + 2]);
    for value in [f32::NAN, -1.0, f32::NEG_INFINITY] {
        deep("the covering of node 5", |scan| scan.arrays.coverings.to_mut()[5].radius = value);
        deep("the covering of node 5", |scan| scan.arrays.coverings.to_mut()[5].sampling = value);
        deep("the covering of node 5", |scan| scan.arrays.coverings.to_mut()[5].spacing = value);
    }
    deep("the covering of node 5", |scan| scan.arrays.coverings.to_mut()[5].sampling = 1e3);
    deep("the covering of node 5", |scan| scan.arrays.coverings.to_mut()[5].spacing = 2e12);
    deep("the covering of node 5", |scan| scan.arrays.coverings.to_mut()[5].spacing *= 10.0);
    deep("the covering of node 0", |scan| {
        scan.arrays.coverings.to_mut()[0] =
            Covering { radius: 0.1, sampling: 0.1, ..scan.arrays.coverings[0] };
    });
    for value in [0, 7, 33, u32::MAX] {
        let [structure, full] = found(|scan| scan.meta.samples = value);
        assert!(structure.is_some() && full.is_some(), "{value} samples a node");
    }
}

#[test]
fn metadata_that_no_build_writes() {
    for value in [f64::NAN, f64::INFINITY, 0.0, -1.0, 1e-320, f64::MAX] {
        plain("the frame of the stored positions is invalid", |scan| scan.meta.frame.scale = value);
    }
    for value in [f64::NAN, f64::INFINITY] {
        plain("the frame of the stored positions is invalid", |scan| scan.meta.frame.origin[2] = value);
        plain("the bounding box is invalid", |scan| scan.meta.bounds.max[0] = value);
        plain("the rounding error is invalid", |scan| scan.meta.step = value);
    }
    plain("the bounding box is invalid", |scan| scan.meta.bounds.min[0] = 7.0);
    deep("the bounding box", |scan| scan.meta.bounds.min[0] -= 1e-9);
    deep("the bounding box", |scan| scan.meta.frame.origin[1] = 0.5);
    for value in [f32::NAN, f32::INFINITY, 0.0, -1.0, 2e12] {
        plain("the sampling radius is invalid", |scan| scan.meta.sampling_radius = value);
    }
    deep("the sampling radius", |scan| scan.meta.sampling_radius *= 1.01);
    deep("the sampling radius", |scan| scan.meta.sampling_radius *= 0.99);
    for value in [0, 2, 33, u32::MAX] {
        plain("the number of neighbours for local radii is invalid", |scan| {
            scan.meta.radius_neighbours = value
        });
    }
    plain("the number of dropped points is invalid", |scan| scan.meta.dropped.duplicate = usize::MAX);
}

#[test]
fn a_point_stored_twice_is_for_the_thorough_check() {
    let mut scan = honest();
    let first = scan.arrays.source[0];
    scan.arrays.source.to_mut()[9] = first;
    assert_eq!(scan.check_contents(), Ok(()), "one pass does not see it");
    assert!(matches!(scan.sanity_check(), Err(Flaw::Value { index, .. }) if index == first as usize));
}
