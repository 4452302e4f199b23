//! Parts of meshes around clashes.

use nearmiss_geometry::Aabb;
use nearmiss_geometry::nalgebra::Vector3;
use nearmiss_hierarchy::{MeshHierarchy, MeshView};
use nearmiss_lanes::id32;
use nearmiss_mesh::nearest_on_triangle;

use crate::clash::depths::MOST_ITEMS;
use crate::clash::group::ContactGroup;
use crate::clash::stored::positions;
use crate::mesh::penetration::piece::MeshPiece;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::{MeshSolid, Parts, SomePieces};

/// A mesh of which parts are taken.
pub(super) struct PartedMesh<'a> {
    mesh: &'a PlacedMesh<'a>,
    solid: &'a MeshSolid,
    /// The triangle of each contact, in leaf order.
    stored: Vec<usize>,
    /// The pieces of a mesh with a closed part.
    pieces: Option<Pieces>,
}

/// The pieces of a mesh: triangles that are linked by common vertices.
struct Pieces {
    /// The number of the piece of each triangle, in leaf order.
    of: Vec<u32>,
    /// The numbers of pieces with closed triangles, and the bounding boxes of these, in the frame of the
    /// mesh's input.
    closed: Vec<(u32, Aabb)>,
}

/// A mesh at one of its clashes.
pub(super) struct MeshAtClash<'a, 'm> {
    parted: &'m PartedMesh<'a>,
    /// The triangles of the contacts, in leaf order.
    touched: Vec<u32>,
    /// The pieces that count, ascending, of a mesh with a closed part.
    kept: Vec<u32>,
}

/// A part of a mesh.
pub(super) enum MeshPart {
    /// The mesh itself.
    Whole,
    /// Some triangles, and a place on each of their pieces.
    Own(Box<(MeshHierarchy, Vec<[f64; 3]>)>),
    /// No triangle.
    None,
}

impl<'a> PartedMesh<'a> {
    /// A mesh with its solid, and the number of the triangle in the caller's mesh for each contact.
    pub(super) fn new<I: Iterator<Item = u32>>(
        mesh: &'a PlacedMesh<'a>,
        solid: &'a MeshSolid,
        touched: impl Fn() -> I,
    ) -> Self {
        let view = mesh.mesh().arrays();
        let pieces = solid.is_closed().then(|| Pieces::new(&view, solid));
        Self { mesh, solid, stored: positions(view.source, touched), pieces }
    }

    /// The mesh at the contacts of a group.
    pub(super) fn at<'m>(&'m self, group: &ContactGroup) -> MeshAtClash<'a, 'm> {
        let touched = group.contacts.iter().filter_map(|&i| self.stored.get(i)).map(|&i| id32(i));
        let mut touched: Vec<u32> = touched.collect();
        touched.sort_unstable();
        touched.dedup();
        let kept = self.pieces.as_ref().map_or_else(Vec::new, |pieces| pieces.around(&touched));
        MeshAtClash { parted: self, touched, kept }
    }
}

impl MeshAtClash<'_, '_> {
    /// The triangles whose bounding boxes meet `bounds`, a box in the world, and that belong to the
    /// contacts. Those of a mesh with a closed part are all triangles of the pieces that meet there, and of
    /// closed pieces around or inside of these. Those of another mesh are linked to the contacts within the
    /// box.
    pub(super) fn part(&self, bounds: &Aabb) -> MeshPart {
        let PartedMesh { mesh: placed, pieces, .. } = self.parted;
        let (mesh, pose) = (placed.mesh(), placed.pose());
        let view = mesh.arrays();
        let radius = bounds.half_extents().into_iter().fold(0.0, f64::hypot) / pose.scale();
        let centre = pose.apply_inverse(bounds.centre());
        let Some(mut triangles) = mesh.triangles_in_ball(centre, radius, MOST_ITEMS) else {
            return MeshPart::Whole;
        };
        let in_world = |i: u32| Aabb::of(view.corners(i as usize).map(|corner| pose.apply(corner)));
        triangles.retain(|&i| in_world(i).meets(bounds));
        match pieces {
            Some(pieces) => triangles.retain(|&i| self.kept.binary_search(&pieces.of[i as usize]).is_ok()),
            None => keep_linked(view.triangles, &self.touched, &mut triangles),
        }
        if triangles.len() == mesh.len() {
            return MeshPart::Whole;
        }
        mesh.part(&triangles).map_or(MeshPart::None, |part| {
            let places = places(&part.arrays(), centre);
            MeshPart::Own(Box::new((part, places)))
        })
    }

    /// A part as a piece of the mesh.
    pub(super) fn piece<'p>(&'p self, part: &'p MeshPart) -> Option<MeshPiece<'p>> {
        let PartedMesh { mesh, solid, pieces, .. } = self.parted;
        let (part, places) = match part {
            MeshPart::Whole => (**mesh, None),
            MeshPart::Own(own) => (PlacedMesh::new(&own.0, mesh.pose()), Some(own.1.as_slice())),
            MeshPart::None => return None,
        };
        let some = pieces.as_ref().map(|pieces| SomePieces { of: &pieces.of, kept: &self.kept });
        Some(MeshPiece { part, places, whole: mesh.mesh(), solid, some })
    }
}

impl Pieces {
    fn new(view: &MeshView<'_>, solid: &MeshSolid) -> Self {
        let mut sets =
            linked((0..).zip(view.triangles).map(|(i, corners)| (i, *corners)), view.triangles.len());
        let (mut of, mut boxes) = (Vec::with_capacity(view.triangles.len()), Vec::new());
        for i in 0..view.triangles.len() {
            // The root of a set is its first triangle.
            let root = sets.root(id32(i)) as usize;
            let piece = if root == i { id32(boxes.len()) } else { of[root] };
            of.push(piece);
            if root == i {
                boxes.push(None);
            }
            if solid.is_closed_at(i) {
                let bounds: &mut Aabb = boxes[piece as usize].get_or_insert(Aabb::EMPTY);
                view.corners(i).into_iter().for_each(|corner| bounds.grow(corner));
            }
        }
        let closed = (0..).zip(boxes).filter_map(|(piece, bounds)| Some((piece, bounds?))).collect();
        Self { of, closed }
    }

    /// Returns the pieces of the `touched` triangles, and the closed pieces that may be around or inside of
    /// closed ones of these, so that both bound the same solid. Ascending.
    fn around(&self, touched: &[u32]) -> Vec<u32> {
        let mut kept: Vec<u32> = touched.iter().map(|&i| self.of[i as usize]).collect();
        kept.sort_unstable();
        kept.dedup();
        let is_met = |(piece, _): &&(u32, Aabb)| kept.binary_search(piece).is_ok();
        let met: Vec<Aabb> = self.closed.iter().filter(is_met).map(|(_, bounds)| *bounds).collect();
        let is_around = |own: &Aabb| met.iter().any(|other| own.encloses(other) || other.encloses(own));
        let more = self.closed.iter().filter(|piece| !is_met(piece)).filter(|(_, bounds)| is_around(bounds));
        let more: Vec<u32> = more.map(|(piece, _)| *piece).collect();
        kept.extend(more);
        kept.sort_unstable();
        kept
    }
}

/// Joins triangles that have a vertex in common. `triangles` are pairs of a number below `count` and the
/// vertices.
fn linked(triangles: impl Iterator<Item = (u32, [u32; 3])>, count: usize) -> Parts {
    let mut ends: Vec<(u32, u32)> = Vec::with_capacity(3 * count);
    ends.extend(triangles.flat_map(|(i, corners)| corners.map(|vertex| (vertex, i))));
    ends.sort_unstable();
    let mut sets = Parts::new(count);
    for two in ends.windows(2).filter(|two| two[0].0 == two[1].0) {
        sets.join(two[0].1, two[1].1);
    }
    sets
}

/// Keeps the triangles, in ascending order, that are linked by common vertices to those that are `touched`.
fn keep_linked(corners: &[[u32; 3]], touched: &[u32], triangles: &mut Vec<u32>) {
    let own = (0..).zip(triangles.iter()).map(|(at, &i)| (at, corners[i as usize]));
    let mut pieces = linked(own, triangles.len());
    let mut is_linked = vec![false; triangles.len()];
    for triangle in touched {
        if let Ok(at) = triangles.binary_search(triangle) {
            is_linked[pieces.root(id32(at)) as usize] = true;
        }
    }
    let mut at = 0..;
    triangles.retain(|_| at.next().is_some_and(|at| is_linked[pieces.root(at) as usize]));
}

/// Returns the point nearest to `centre` on each piece of a part, whose triangles are linked by common
/// vertices: large triangles reach far beyond the clash.
fn places(view: &MeshView<'_>, centre: [f64; 3]) -> Vec<[f64; 3]> {
    let count = view.triangles.len();
    let mut sets = linked((0..).zip(view.triangles).map(|(i, corners)| (i, *corners)), count);
    let mut nearest = vec![(f64::INFINITY, centre); count];
    for i in 0..count {
        let place = nearest_on_triangle(&view.corners(i), centre);
        let square = (Vector3::from(place) - Vector3::from(centre)).norm_squared();
        let best = &mut nearest[sets.root(id32(i)) as usize];
        if square < best.0 {
            *best = (square, place);
        }
    }
    nearest.into_iter().filter(|(square, _)| square.is_finite()).map(|(_, place)| place).collect()
}
