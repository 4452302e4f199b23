//! Volumes of Klein & Zachmann 2004, §4.2, measured. H is the union of the convex hulls of each
//! leaf's points with those of its border. K is the union of a node's balls. The radius can also be
//! grown as in the paper, without a certificate.

use nearmiss::PointHierarchy;
use nearmiss::geometry::NodeId;
use nearmiss::geometry::nalgebra::Vector3;
use nearmiss::hierarchy::{OrientedBox, Part, ScanArrays};

use crate::sample::count;

/// Directions that bound a hull, the axes first. The bounded volume is a few hundredths too large.
const DIRECTIONS: usize = 64;

/// Consecutive test points that must be inside before the growth of the radius ends.
const INSIDE_IN_A_ROW: usize = 256;

/// Test points drawn near one that was outside.
const NEAR_A_MISS: usize = 8;

/// A leaf's points with those of its border.
#[derive(Debug, Clone)]
struct Hull {
    points: Vec<[f32; 3]>,
    extent: [[f64; 2]; DIRECTIONS],
}

/// The volume H of a scan, leaf by leaf.
#[derive(Debug, Clone)]
pub struct Hulls {
    directions: [Vector3<f64>; DIRECTIONS],
    of_leaves: Vec<Hull>,
}

/// Shares of a box that the volumes of a node fill.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Volumes {
    /// K, the balls.
    pub balls: f64,
    /// H, the hulls.
    pub hulls: f64,
    /// The enclosures of the leaves.
    pub enclosures: f64,
}

fn wide(p: [f32; 3]) -> Vector3<f64> {
    Vector3::from(p.map(f64::from))
}

fn distance_sq(centres: &[Vector3<f64>], x: Vector3<f64>) -> f64 {
    centres.iter().map(|c| (c - x).norm_squared()).fold(f64::INFINITY, f64::min)
}

fn centres(arrays: &ScanArrays<'_>, node: usize) -> Vec<Vector3<f64>> {
    arrays.samples(node).iter().map(|i| wide(arrays.position(i))).collect()
}

impl Hulls {
    /// Computes the hulls of a scan.
    #[must_use]
    pub fn new(scan: &PointHierarchy) -> Self {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let directions = std::array::from_fn(|i| {
            if i < 3 {
                return Vector3::ith(i, 1.0);
            }
            let z = (count(i) - 2.5) / count(DIRECTIONS - 3);
            let flat = (1.0 - z * z).sqrt();
            Vector3::new(flat * (golden * count(i)).cos(), flat * (golden * count(i)).sin(), z)
        });
        let leaves = scan.boxes().skip(scan.topology().inner());
        let of_leaves = leaves.map(|bounds| hull(scan, &bounds, &directions)).collect();
        Self { directions, of_leaves }
    }

    fn under(&self, arrays: &ScanArrays<'_>, node: usize) -> &[Hull] {
        &self.of_leaves[arrays.tree.topology().leaves_under(node_id(node))]
    }

    fn contain(&self, hulls: &[Hull], x: Vector3<f64>) -> bool {
        let inside = |d: &Vector3<f64>, &[low, high]: &[f64; 2]| (low..=high).contains(&d.dot(&x));
        hulls.iter().any(|hull| self.directions.iter().zip(&hull.extent).all(|(d, extent)| inside(d, extent)))
    }

    /// Estimates the volumes of a node with `draws` random points in a common box. `share` draws
    /// numbers from 0 to 1.
    pub fn volumes(
        &self,
        arrays: &ScanArrays<'_>,
        node: usize,
        draws: usize,
        share: &mut impl FnMut() -> f64,
    ) -> Volumes {
        let (centres, hulls) = (centres(arrays, node), self.under(arrays, node));
        let radius = f64::from(arrays.covering_radius(node));
        let topology = arrays.tree.topology();
        let leaves = topology.leaves_under(node_id(node));
        let enclosures: Vec<OrientedBox> =
            leaves.map(|leaf| arrays.tree.enclosure(Part::Surface, topology.leaf(leaf))).collect();
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for c in &centres {
            low = low.inf(&c.add_scalar(-radius));
            high = high.sup(&c.add_scalar(radius));
        }
        for hull in hulls {
            low = low.inf(&Vector3::from([0, 1, 2].map(|k| hull.extent[k][0])));
            high = high.sup(&Vector3::from([0, 1, 2].map(|k| hull.extent[k][1])));
        }
        let mut found = [0_usize; 3];
        for _ in 0..draws {
            let at = Vector3::from_fn(|_, _| share());
            let x = low + at.component_mul(&(high - low));
            #[expect(clippy::cast_possible_truncation, reason = "a random place")]
            let single = [x.x as f32, x.y as f32, x.z as f32];
            found[0] += usize::from(distance_sq(&centres, x) <= radius * radius);
            found[1] += usize::from(self.contain(hulls, x));
            found[2] += usize::from(enclosures.iter().any(|b| b.distance_sq(single) <= 0.0));
        }
        let [balls, hulls, enclosures] = found.map(|n| count(n) / count(draws));
        Volumes { balls, hulls, enclosures }
    }

    /// The radius of a node's balls as the paper finds it. Test points in H, weighted means of the
    /// points of random leaves with their borders, make it grow. After a miss the next points are
    /// drawn near it. `share` draws numbers from 0 to 1.
    pub fn grown_radius(&self, arrays: &ScanArrays<'_>, node: usize, share: &mut impl FnMut() -> f64) -> f64 {
        let (centres, hulls) = (centres(arrays, node), self.under(arrays, node));
        let (mut radius_sq, mut inside, mut near) = (0.0_f64, 0, 0);
        let mut hull = &hulls[0];
        while inside < INSIDE_IN_A_ROW {
            if near == 0 {
                #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
                let index = (share() * count(hulls.len())) as usize;
                hull = &hulls[index.min(hulls.len() - 1)];
            }
            near = near.max(1) - 1;
            let mut sum = (0.0, Vector3::zeros());
            for p in &hull.points {
                // Skewed, so that the means do not cluster in the middle.
                let weight = share().powi(16);
                sum = (sum.0 + weight, sum.1 + weight * wide(*p));
            }
            let away = distance_sq(&centres, sum.1 / sum.0);
            inside += 1;
            if away > radius_sq {
                (radius_sq, inside, near) = (away, 0, NEAR_A_MISS);
            }
        }
        radius_sq.sqrt()
    }
}

/// The identifier of the node at an index.
fn node_id(index: usize) -> NodeId {
    NodeId(u32::try_from(index).unwrap_or(u32::MAX))
}

/// The hull of the points whose support reaches the box of a leaf.
fn hull(scan: &PointHierarchy, bounds: &OrientedBox, directions: &[Vector3<f64>; DIRECTIONS]) -> Hull {
    let mut points = Vec::new();
    let (tree, mut open) = (scan.tree(), vec![NodeId::ROOT]);
    while let Some(id) = open.pop() {
        let about = tree.bounds(id);
        let border = scan.plan().support_radius(about.reach);
        if bounds.distance_sq(about.centre).sqrt() > border + about.radius() {
            continue;
        }
        if !tree.topology().is_leaf(id) {
            open.extend(tree.topology().children(id).iter().rev());
            continue;
        }
        let within = |&i: &usize| {
            let border = scan.plan().support_radius(scan.radii()[i]);
            bounds.distance_sq(scan.positions()[i]) <= border * border
        };
        points.extend(tree.topology().points(id).filter(within).map(|i| scan.positions()[i]));
    }
    let mut extent = [[f64::INFINITY, f64::NEG_INFINITY]; DIRECTIONS];
    for p in &points {
        for (d, [low, high]) in directions.iter().zip(&mut extent) {
            let t = d.dot(&wide(*p));
            (*low, *high) = (low.min(t), high.max(t));
        }
    }
    Hull { points, extent }
}
