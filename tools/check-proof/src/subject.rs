//! A scan of a proof, with data for the checks.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

use nearmiss::geometry::NodeId;
use nearmiss::{Bandwidth, BuildOptions, Check, Kernel, PointKind, Scan};
use nearmiss_testdata::oracle::{self, Parameters, SurfaceTwin};

use crate::Outcome;
use crate::proof::{Enclosure, Semantics};

/// The first bytes of a preprocessed scan.
const MAGIC: &[u8] = b"\x8Enmiss";

/// The greatest distance of the obstacle from the plane of a point on a sheet, in local radii.
const SLAB: f64 = 0.3;

/// A preprocessed scan.
pub(crate) struct Subject {
    pub(crate) scan: Scan,
    pub(crate) twin: SurfaceTwin,
    /// Support radius of a point, per unit of the twin's radii.
    pub(crate) support_radius: f64,
    /// Ids of the nodes by their points.
    ids: BTreeMap<(usize, usize), usize>,
    /// Bounds of the stored positions.
    pub(crate) bounds: [[f32; 3]; 2],
}

impl Subject {
    /// Opens a preprocessed scan, or preprocesses a raw input with default options.
    pub(crate) fn open(path: &Path) -> Outcome<Self> {
        let mut head = [0; MAGIC.len()];
        let named = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("nm"));
        let is_prepared =
            named || File::open(path).and_then(|mut f| f.read_exact(&mut head)).is_ok() && head == MAGIC;
        let scan = if is_prepared {
            Scan::open(path, Check::Full).map_err(|e| format!("{}: {e}", path.display()))?
        } else {
            Scan::build(&nearmiss::io::read(path, None)?.cloud, &BuildOptions::default())?
        };
        Self::new(scan).map_err(|e| format!("{}: {e}", path.display()).into())
    }

    /// # Errors
    /// If the nodes are not a tree over the points, or the surface has no naive twin.
    pub(crate) fn new(scan: Scan) -> Result<Self, String> {
        let nodes = nodes(&scan);
        check_tree(&nodes, scan.len())?;
        let ids = nodes.iter().enumerate().map(|(id, n)| ((n.points.start, n.points.len()), id)).collect();
        let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        for p in scan.positions() {
            for k in 0..3 {
                bounds[0][k] = bounds[0][k].min(p[k]);
                bounds[1][k] = bounds[1][k].max(p[k]);
            }
        }
        let (twin, support_radius) = twin(&scan)?;
        Ok(Self { scan, twin, support_radius, ids, bounds })
    }

    /// Returns the radius of the obstacle's ball about point `i`; zero if the point samples a
    /// sheet.
    pub(crate) fn ball(&self, i: usize) -> f64 {
        if self.is_on_sheet(i) {
            return 0.0;
        }
        let is_alone = matches!(self.scan.kind(i), PointKind::Line | PointKind::Stray | PointKind::Sparse);
        self.radius(i) * if is_alone { 0.5 } else { 0.325 }
    }

    /// Returns an upper bound of the distance from point `i` to the part of the obstacle whose
    /// nearest point it is. It is the radius of its ball, or of its cell, or of its disc with a
    /// thickness of a twentieth of the radius.
    pub(crate) fn reach(&self, i: usize) -> f64 {
        let arrays = self.scan.arrays();
        if self.is_on_sheet(i) {
            self.cell(i).max(1.05 * f64::from(arrays.discs.get(i)))
        } else {
            self.ball(i)
        }
    }

    /// Returns the normal of point `i`, if it samples a sheet, and half the thickness of the slab about its
    /// tangent plane that contains its part of the obstacle.
    pub(crate) fn slab(&self, i: usize) -> Option<([f32; 3], f64)> {
        self.is_on_sheet(i).then(|| (self.scan.arrays().normals[i], rounded(SLAB * self.radius(i))))
    }

    /// Returns `true` if `x`, a place of the surface in the stored frame, belongs to the obstacle,
    /// up to rounding: it is in the cell of its nearest point, which samples a sheet.
    pub(crate) fn is_in_cell(&self, x: [f64; 3]) -> bool {
        let away = |p: &[f32; 3]| [0, 1, 2].map(|k| x[k] - f64::from(p[k]));
        let length_sq = |d: [f64; 3]| d.iter().map(|x| x * x).sum::<f64>();
        let least = |(i, p): (usize, &[f32; 3])| (length_sq(away(p)), i);
        let nearest = self.scan.positions().iter().enumerate().map(least).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((distance_sq, nearest)) = nearest else { return false };
        // For places half-way between two points, either may be the nearest.
        let is_nearest = |p: &[f32; 3]| length_sq(away(p)) <= rounded(distance_sq);
        self.is_in_cell_of(nearest, x)
            || self
                .scan
                .positions()
                .iter()
                .enumerate()
                .any(|(i, p)| is_nearest(p) && self.is_in_cell_of(i, x))
    }

    /// Returns `true` if `x` in the stored frame is in the cell of point `i`, up to rounding,
    /// assuming that `i` is its nearest point.
    pub(crate) fn is_in_cell_of(&self, i: usize, x: [f64; 3]) -> bool {
        let arrays = self.scan.arrays();
        let d = [0, 1, 2].map(|k| x[k] - f64::from(arrays.position(i)[k]));
        let height: f64 = (0..3).map(|k| d[k] * f64::from(arrays.normals[i][k])).sum();
        let distance = d.iter().map(|x| x * x).sum::<f64>().sqrt();
        self.is_on_sheet(i)
            && height.abs() <= rounded(SLAB * self.radius(i))
            && distance <= rounded(self.cell(i))
    }

    fn is_on_sheet(&self, i: usize) -> bool {
        i < self.scan.arrays().dense && matches!(self.scan.kind(i), PointKind::Sheet | PointKind::Edge)
    }

    fn radius(&self, i: usize) -> f64 {
        f64::from(self.scan.radii()[i])
    }

    fn cell(&self, i: usize) -> f64 {
        self.radius(i).min(0.5 * f64::from(self.scan.arrays().reach))
    }

    /// # Errors
    /// If no node has these points, or its enclosure differs in a bit.
    pub(crate) fn check_node(&self, claimed: &Enclosure, semantics: Semantics) -> Result<(), String> {
        let Enclosure { first, count, .. } = *claimed;
        let Some(&id) = self.ids.get(&(first as usize, count as usize)) else {
            return Err(format!("expected the points of a node, got {count} from {first}"));
        };
        let arrays = self.scan.arrays();
        let stored = if semantics == Semantics::Obstacle {
            arrays.obstacle_enclosure(id)
        } else {
            arrays.enclosure(id)
        };
        let bits = |[a, b, c]: [f32; 3]| [a.to_bits(), b.to_bits(), c.to_bits()];
        let same = bits(stored.centre) == bits(claimed.centre)
            && bits(stored.half) == bits(claimed.half)
            && stored.axes.map(bits) == claimed.axes.map(bits);
        if same {
            Ok(())
        } else {
            Err(format!(
                "expected the stored enclosure of node {id} ({count} points from {first}), got another"
            ))
        }
    }
}

/// Returns `x` enlarged by rounding.
fn rounded(x: f64) -> f64 {
    x * (1.0 + 1e-6)
}

/// Checks that the points of every node are those of its children, and the root's are all points.
/// Then the nodes that contain a point are its leaf and that leaf's ancestors.
fn check_tree(nodes: &[Node], points: usize) -> Result<(), String> {
    if nodes.first().map(|root| &root.points) != Some(&(0..points)) {
        return Err("expected a root with all points, got another".into());
    }
    let mut parents = vec![0_u32; nodes.len()];
    for (id, node) in nodes.iter().enumerate().filter(|(_, node)| !node.children.is_empty()) {
        let mut next = node.points.start;
        for &child in &node.children {
            let Some(own) = nodes.get(child).map(|child| &child.points) else {
                return Err(format!("expected children of node {id} within the tree, got {child}"));
            };
            if own.start != next || own.is_empty() {
                return Err(format!("expected node {id} to have the points of its children, got others"));
            }
            next = own.end;
            parents[child] += 1;
        }
        if next != node.points.end {
            return Err(format!("expected node {id} to have the points of its children, got others"));
        }
    }
    if parents.iter().skip(1).any(|n| *n != 1) {
        Err("expected one parent for each node, got another number".into())
    } else {
        Ok(())
    }
}

/// A node as this checker uses it.
#[derive(Debug, Clone)]
struct Node {
    points: Range<usize>,
    children: Vec<usize>,
}

fn nodes(scan: &Scan) -> Vec<Node> {
    let topology = scan.topology();
    let children = |id: NodeId| match topology.is_leaf(id) {
        true => Vec::new(),
        false => topology.children(id).iter().map(NodeId::index).collect(),
    };
    let node = |id: NodeId| Node { points: topology.points(id), children: children(id) };
    topology.ids().map(node).collect()
}

/// Returns the scan's surface, evaluated by summing over all points, in the stored frame, and the
/// support radius per unit of the radii.
fn twin(scan: &Scan) -> Result<(SurfaceTwin, f64), String> {
    let options = scan.plan().options();
    let kernel = match options.kernel {
        Kernel::Gaussian => oracle::Kernel::Gaussian { theta: options.threshold },
        Kernel::Wendland => oracle::Kernel::Wendland,
        other => return Err(format!("expected the kernel Gaussian or Wendland, got {other:?}")),
    };
    let unit = scan.frame().scale;
    let (reach, radii) = match options.bandwidth {
        Bandwidth::Local => (options.support_radius, scan.radii().iter().map(|r| f64::from(*r)).collect()),
        Bandwidth::Global => (options.support_radius, vec![scan.sampling_radius() / unit; scan.len()]),
        // The support radius for which the bandwidth is the given one.
        Bandwidth::Fixed(h) => (1.0 / kernel.bandwidth(1.0), vec![h / unit; scan.len()]),
        other => return Err(format!("expected the bandwidth Local, Global or Fixed, got {other:?}")),
    };
    let points: Vec<[f64; 3]> = scan.positions().iter().map(|p| p.map(f64::from)).collect();
    let least_support = options.support_min as usize;
    let parameters = Parameters { reach, kernel, bandwidth: oracle::Bandwidth::Local, least_support };
    Ok((SurfaceTwin::with_radii(&points, &radii, parameters), reach))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_that_are_no_tree_are_refused() {
        let node = |points: Range<usize>, children: &[usize]| Node { points, children: children.into() };
        let tree =
            [node(0..10, &[1, 2]), node(0..6, &[3, 4]), node(6..10, &[]), node(0..3, &[]), node(3..6, &[])];
        assert_eq!(check_tree(&tree, 10), Ok(()));
        assert!(check_tree(&tree, 11).is_err(), "a point without a node");
        for (id, wrong) in [
            (1, node(0..5, &[3, 4])),
            (2, node(5..10, &[])),
            (1, node(0..6, &[2, 4])),
            (0, node(0..10, &[1, 9])),
            (3, node(0..0, &[])),
        ] {
            let mut nodes = tree.clone();
            nodes[id] = wrong.clone();
            assert!(check_tree(&nodes, 10).is_err(), "{wrong:?} for node {id}");
        }
    }
}
