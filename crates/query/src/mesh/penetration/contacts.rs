//! The contacts of two meshes in brief: how many there are, where, and between which normals.

use std::ops::ControlFlow;

use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{BoxVisitor, Open, PairVisitor, Stack, descend};
use nearmiss_lanes::wide::Bits;
use nearmiss_mesh::triangle_contact;

use crate::mesh::mesh_pair::MeshPairing;
use crate::mesh::penetration::triangle_depth::triangle_depth;

type Vector = Vector3<f64>;

/// The contacts of two meshes in the world, in brief.
#[derive(Debug, Clone, Default)]
pub(crate) struct ContactSurvey {
    pub(crate) count: u32,
    /// Sums of the coordinates, and of their products xx xy xz yy yz zz, about the first point.
    first: Vector,
    sum: Vector,
    products: [f64; 6],
    /// Unit normals of both triangles of some contacts, evenly spread over all.
    pub(crate) normals: Vec<[Vector; 2]>,
    /// One of this many contacts is kept.
    stride: u32,
    /// The greatest shift under which two triangles surely keep in contact.
    pub(crate) least: f64,
}

/// The number of contacts whose normals are kept at most.
pub(crate) const KEPT: usize = 8;

impl ContactSurvey {
    /// Forgets all contacts, and keeps the memory.
    fn clear(&mut self) {
        let mut normals = std::mem::take(&mut self.normals);
        normals.clear();
        *self = Self { normals, stride: 1, ..Self::default() };
    }

    fn add(&mut self, point: Vector, normals: [Vector; 2], depth: f64) {
        if self.count == 0 {
            self.first = point;
        }
        let d = point - self.first;
        self.sum += d;
        let products = [d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z];
        self.products = [0, 1, 2, 3, 4, 5].map(|k| self.products[k] + products[k]);
        if self.count.is_multiple_of(self.stride) {
            if self.normals.len() == KEPT {
                // Every other one.
                let mut i = 0;
                self.normals.retain(|_| {
                    i += 1;
                    i % 2 == 1
                });
                self.stride *= 2;
            }
            if self.count.is_multiple_of(self.stride) {
                self.normals.push(normals);
            }
        }
        self.count += 1;
        self.least = self.least.max(depth);
    }

    /// Returns the mean of the points.
    pub(crate) fn centre(&self) -> Vector {
        self.first + self.sum / f64::from(self.count.max(1))
    }

    /// Returns the principal axes of the points, the one of least extent first.
    pub(crate) fn axes(&self) -> [Vector; 3] {
        let n = f64::from(self.count.max(1));
        let m = self.sum / n;
        let of_mean = [m.x * m.x, m.x * m.y, m.x * m.z, m.y * m.y, m.y * m.z, m.z * m.z];
        let covariance = [0, 1, 2, 3, 4, 5].map(|k| self.products[k] / n - of_mean[k]);
        nearmiss_surface::symmetric_eigen(covariance).vectors.map(Vector::from)
    }
}

/// A search for all contacts.
struct Gathering<'c, 'a> {
    pair: &'c mut MeshPairing<'a>,
    survey: &'c mut ContactSurvey,
}

impl PairVisitor for Gathering<'_, '_> {
    fn compared(&mut self, pairs: u32) -> ControlFlow<()> {
        self.pair.meter.spent.node_pairs += u64::from(pairs);
        self.pair.meter.go_on()
    }

    fn leaf_pair(&mut self, leaves: [usize; 2], _: &Open) -> ControlFlow<()> {
        for lane in Bits(self.pair.lanes_that_may_meet(leaves)) {
            let [a, b] = self.pair.corners(MeshPairing::triangles(leaves, lane));
            let Some(contact) = triangle_contact(&a, &b) else { continue };
            let pose = self.pair.meshes[0].pose();
            let normals = contact.normals.map(|n| n.map_or(Vector::zeros(), |n| pose.rotate(n).into()));
            let depth = triangle_depth(&a, &b).0 * pose.scale();
            self.survey.add(pose.apply(contact.point).into(), normals, depth);
        }
        self.pair.meter.go_on()
    }
}

impl BoxVisitor for Gathering<'_, '_> {}

impl ContactSurvey {
    /// Finds all contacts of a pair, as far as its budget lasts. Breaks if the budget ended the search.
    pub(crate) fn find(&mut self, pair: &mut MeshPairing<'_>, stack: &mut Stack) -> ControlFlow<()> {
        self.clear();
        stack.clear();
        let (relative, level) = (pair.relative, pair.level);
        let mut search = Gathering { pair, survey: self };
        let trees = search.pair.trees(&relative);
        descend(trees, level, stack, &mut search)
    }
}
