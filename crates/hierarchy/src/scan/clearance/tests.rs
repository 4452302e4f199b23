//! The grid of clearances against brute force.

use fearless_simd::Simd;
use nearmiss_geometry::PointCloud;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_testdata::arbitrary::{CloudKind, cloud, point_in, rng};
use rand::RngExt;

use super::*;
use crate::point::kind::{SLAB, THICKNESS};
use crate::{BuildOptions, PointHierarchy};

type Vector = Vector3<f64>;

/// The distances of a place from the disc or ball of a point, and from the volume that contains the
/// obstacle near it.
fn distances(scan: &ScanArrays<'_>, i: usize, place: [f64; 3]) -> [f64; 2] {
    let away = Vector::from(place) - Vector::from(scan.position(i).map(f64::from));
    let reach = f64::from(scan.obstacle_reach(i));
    if !scan.is_on_sheet(i) {
        return [(away.norm() - reach).max(0.0); 2];
    }
    let height = away.dot(&Vector::from(scan.normals[i].map(f64::from)).normalize());
    let beside = (away.norm_squared() - height * height).max(0.0).sqrt();
    let disc = f64::from(scan.discs.get(i));
    let from = |radius: f64, thick: f64| (height.hypot((beside - radius).max(0.0)) - thick).max(0.0);
    [from(disc, f64::from(THICKNESS) * disc), from(reach, f64::from(SLAB * scan.radii[i]))]
}

fn from_enclosure(scan: &ScanArrays<'_>, leaf: usize, place: [f64; 3]) -> f64 {
    let bounds = scan.tree.enclosure(Part::Obstacle, scan.tree.topology.leaf(leaf));
    let away = [0, 1, 2].map(|k| place[k] - f64::from(bounds.centre[k]));
    let beyond = [0, 1, 2].map(|k| {
        let along: f64 = (0..3).map(|j| away[j] * f64::from(bounds.axes[k][j])).sum();
        (along.abs() - f64::from(bounds.half[k])).max(0.0)
    });
    Vector::from(beyond).norm()
}

struct Visited(Vec<usize>);

impl PlaceVisitor for Visited {
    fn most_sq(&self) -> f32 {
        f32::INFINITY
    }

    fn leaf<S: Simd>(&mut self, _: S, number: usize) -> ControlFlow<()> {
        self.0.push(number);
        ControlFlow::Continue(())
    }
}

/// How often the grid told what, and how far below the truth.
#[derive(Debug, Default)]
struct Seen {
    grids: u32,
    free: u32,
    lost: f64,
    lost_obstacle: f64,
    /// The same by way of places beyond, and how often.
    beyond: u32,
    lost_beyond: f64,
    /// The error of estimated distances.
    off: f64,
    named: u32,
    listed: u32,
    unlisted: u32,
}

impl Seen {
    fn check(&mut self, scan: &ScanArrays<'_>, grid: &ClearanceGrid, place: [f64; 3]) {
        let rounding = 1e-5 * (f64::from(scan.tree.root_box().radius()) + grid.edge());
        let all = |i: usize| distances(scan, i, place);
        let nearest = (0..scan.radii.len())
            .map(all)
            .fold([f64::INFINITY; 2], |least, own| [least[0].min(own[0]), least[1].min(own[1])]);
        let at = grid.at(scan, place, 0.0);
        for (told, exact) in [at.discs, at.obstacle].into_iter().zip(nearest) {
            assert!(told <= exact + 1e-12, "{place:?} has {told}, not {exact}");
        }
        if nearest[1] > 0.0 && nearest[0] < grid.edge() {
            self.free += 1;
            self.lost += (nearest[0] - at.discs) / grid.edge();
            self.lost_obstacle += (nearest[1] - at.obstacle) / grid.edge();
        }
        self.check_beyond(scan, grid, (place.into(), &at), nearest);
        if let Some((leaf, number)) = at.nearest() {
            self.named += 1;
            let own = distances(scan, scan.leaves.points(leaf).start + number, place)[0];
            // It is nearest to a place that is at most half the diagonal of a sixth of a cube away.
            let most = nearest[0] + grid.edge() * 3.0_f64.sqrt() / 3.0 + rounding;
            assert!(own <= most, "{place:?}: point {number} of leaf {leaf} at {own} of {most}");
        }
        if let Some(leaf) = grid.leaf(place) {
            assert!(leaf < scan.tree.topology.leaves());
        }
        let within = 0.5 * grid.edge();
        let mut visited = Visited(Vec::new());
        let near = (&at, place);
        match grid.visit_near(Level::new(), near, within, &mut visited) {
            None => self.unlisted += u32::from(at.nearest().is_some()),
            Some(_) => {
                self.listed += 1;
                for leaf in 0..scan.tree.topology.leaves() {
                    let distance = from_enclosure(scan, leaf, place);
                    let is_visited = visited.0.contains(&leaf);
                    assert!(is_visited || distance > within, "{place:?}: not leaf {leaf} at {distance}");
                    assert!(!is_visited || distance <= within + 2.0 * rounding);
                }
            }
        }
    }
}

impl Seen {
    /// Checks what the grid tells about a place, whose distances are known, by way of others.
    fn check_beyond(
        &mut self,
        scan: &ScanArrays<'_>,
        grid: &ClearanceGrid,
        (place, at): (Vector, &Clearance<'_>),
        exact: [f64; 2],
    ) {
        let within = 0.25 * grid.edge();
        let direction = at.direction();
        let steps = [
            Vector::x() * grid.edge(),
            Vector::new(-0.7, 0.3, 0.2) * grid.edge(),
            direction.map_or(Vector::zeros(), |(own, _)| Vector::from(own) * grid.step_beyond(within)),
        ];
        let told = steps.map(|step| {
            let other = grid.beside(scan, (place + step).into(), (-step).into(), 0.0);
            for (told, exact) in [other.discs, other.obstacle].into_iter().zip(exact) {
                assert!(told <= exact + 1e-12, "{place:?} has {told} by {step:?}, not {exact}");
            }
            other.discs
        });
        let Some((_, estimate)) = direction.filter(|_| 0.05 < exact[0] && exact[0] < grid.edge()) else {
            return;
        };
        self.beyond += 1;
        self.lost_beyond += (exact[0] - told[2].max(at.discs)) / grid.edge();
        self.off += (estimate - exact[0]).abs() / grid.edge();
    }
}

#[test]
fn the_grid_tells_bounds_and_what_is_near() {
    let rng = &mut rng(9401);
    let mut seen = Seen::default();
    for kind in CloudKind::ALL {
        let points = cloud(kind, 900, 7);
        let Ok(cloud) = PointCloud::from_positions(&points) else { continue };
        let Ok(scan) = PointHierarchy::build(&cloud, &BuildOptions::default()) else { continue };
        let arrays = scan.arrays();
        let Some(grid) = ClearanceGrid::new(&arrays, Level::new()) else { continue };
        seen.grids += 1;
        let root = scan.root_box();
        for round in 0..600 {
            let place = if round % 3 == 0 {
                let half = 1.5 * f64::from(root.radius());
                [0, 1, 2].map(|k| f64::from(root.centre[k]) + point_in(rng, half)[k])
            } else {
                let point = arrays.position(rng.random_range(0..scan.len()));
                [0, 1, 2].map(|k| f64::from(point[k]) + point_in(rng, grid.edge())[k])
            };
            seen.check(&arrays, &grid, place);
        }
    }
    println!("{seen:?}");
    let Seen { grids, free, lost, lost_obstacle, beyond, lost_beyond, off, named, listed, unlisted } = seen;
    assert!(grids >= 8 && free > 1000 && named > 3000, "{seen:?}");
    assert!(lost.max(lost_obstacle) < 0.35 * f64::from(free), "{seen:?}");
    let beyond = f64::from(beyond);
    assert!(beyond > 1000.0 && lost_beyond < 0.1 * beyond && off < 0.05 * beyond, "{seen:?}");
    assert!(listed > 2000 && unlisted > 0, "{seen:?}");
}

#[test]
fn places_that_are_none_are_not_free() {
    let points = cloud(CloudKind::ALL[0], 500, 7);
    let cloud = PointCloud::from_positions(&points).unwrap();
    let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
    let grid = ClearanceGrid::new(&scan.arrays(), Level::new()).unwrap();
    for place in [[f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0]] {
        let at = grid.at(&scan.arrays(), place, 0.0);
        assert!(at.discs == f64::NEG_INFINITY && at.obstacle == f64::NEG_INFINITY);
        assert_eq!(grid.leaf(place), None);
    }
    assert!(grid.at(&scan.arrays(), [1e300; 3], 0.0).obstacle > 0.0);
}

/// Pages that are made one after the other are those that are made at once.
#[test]
fn a_complete_grid_tells_the_same() {
    let points = cloud(CloudKind::ALL[0], 900, 7);
    let cloud = PointCloud::from_positions(&points).unwrap();
    let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
    let arrays = scan.arrays();
    let [complete, other] = [(); 2].map(|()| ClearanceGrid::new(&arrays, Level::new()).unwrap());
    complete.complete(&arrays);
    let rng = &mut rng(9402);
    for i in 0..scan.len() {
        let place = arrays.position(i).map(|c| f64::from(c) + rng.random_range(-1.0..1.0) * complete.edge());
        let [a, b] = [&complete, &other].map(|grid| grid.at(&arrays, place, 0.0));
        assert_eq!((a.discs, a.obstacle, a.nearest()), (b.discs, b.obstacle, b.nearest()));
    }
}

/// A scan most of whose points are in one block: its page would take long, and tells nothing.
#[test]
fn a_crowded_block_is_left_out() {
    let grid = |side: u32, step: f64, from: f64| {
        (0..side * side).map(move |i| [f64::from(i % side) * step, f64::from(i / side) * step + from, 0.0])
    };
    let points: Vec<[f64; 3]> = grid(190, 0.001, 0.0).chain(grid(75, 0.05, 0.5)).collect();
    let cloud = PointCloud::from_positions(&points).unwrap();
    let scan = PointHierarchy::build(&cloud, &BuildOptions::default()).unwrap();
    let arrays = scan.arrays();
    let clear = ClearanceGrid::new(&arrays, Level::new()).unwrap();
    let frame = scan.frame();
    let stored = |place: [f64; 3]| [0, 1, 2].map(|k| (place[k] - frame.origin[k]) / frame.scale);
    let (crowded, free) = (stored([0.1, 0.1, 0.05]), stored([1.0, 3.0, 0.05]));
    assert!(clear.at(&arrays, crowded, 0.0).discs <= 0.0);
    let at = clear.at(&arrays, free, 0.0);
    assert!(at.discs > 0.0 && at.nearest().is_some(), "{at:?}");
}
