//! Parts of meshes around clashes.

use nearmiss_geometry::Aabb;
use nearmiss_hierarchy::{MeshHierarchy, MeshView};
use nearmiss_lanes::id32;

use crate::clash::depths::MOST_ITEMS;
use crate::clash::group::ContactGroup;
use crate::clash::stored::positions;
use crate::mesh::penetration::MeshPiece;
use crate::mesh::placed::PlacedMesh;
use crate::mesh::solid::{MeshSolid, Parts};

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
    /// The number of the piece of each triangle, in leaf order: that of its first triangle.
    of: Vec<u32>,
    /// The bounding box of each piece by its number, in the frame of the mesh's input.
    bounds: Vec<Aabb>,
}

/// A part of a mesh.
pub(super) enum MeshPart {
    /// The mesh itself.
    Whole,
    /// Some triangles, and their pieces.
    Own(Box<(MeshHierarchy, MeshSolid)>),
    /// No triangle.
    None,
}

impl MeshPart {
    /// The part as a piece of its mesh.
    pub(super) fn of<'p>(&'p self, parted: &PartedMesh<'p>) -> Option<MeshPiece<'p>> {
        let (mesh, solid) = (*parted.mesh, parted.solid);
        let (part, pieces) = match self {
            Self::Whole => (mesh, solid),
            Self::Own(own) => (PlacedMesh::new(&own.0, mesh.pose()), &own.1),
            Self::None => return None,
        };
        Some(MeshPiece { part, pieces, whole: mesh.mesh(), solid })
    }
}

impl<'a> PartedMesh<'a> {
    /// A mesh with its solid, and the number of the triangle in the caller's mesh for each contact.
    pub(super) fn new<I: Iterator<Item = u32>>(
        mesh: &'a PlacedMesh<'a>,
        solid: &'a MeshSolid,
        touched: impl Fn() -> I,
    ) -> Self {
        let view = mesh.mesh().arrays();
        let pieces = solid.is_closed().then(|| Pieces::new(&view));
        Self { mesh, solid, stored: positions(view.source, touched), pieces }
    }

    /// The triangles whose bounding boxes meet `bounds`, a box in the world, and that belong to the contacts of
    /// a group. Those of a mesh with a closed part are all triangles of the pieces that meet there, and of
    /// closed pieces around or inside of these. Those of another mesh are linked to the contacts within the
    /// box.
    pub(super) fn part(&self, group: &ContactGroup, bounds: &Aabb) -> MeshPart {
        let (mesh, pose) = (self.mesh.mesh(), self.mesh.pose());
        let view = mesh.arrays();
        let radius = bounds.half_extents().into_iter().fold(0.0, f64::hypot) / pose.scale();
        let centre = pose.apply_inverse(bounds.centre());
        let Some(mut triangles) = mesh.triangles_in_ball(centre, radius, MOST_ITEMS) else {
            return MeshPart::Whole;
        };
        triangles
            .retain(|&i| Aabb::of(view.corners(i as usize).map(|corner| pose.apply(corner))).meets(bounds));
        match &self.pieces {
            Some(pieces) => {
                let is_kept = pieces.around(self.touched(group), self.solid);
                triangles.retain(|&i| is_kept[pieces.of[i as usize] as usize]);
            }
            None => keep_linked(view.triangles, self.touched(group), &mut triangles),
        }
        if triangles.len() == mesh.len() {
            return MeshPart::Whole;
        }
        mesh.part(&triangles).map_or(MeshPart::None, |part| {
            let pieces = MeshSolid::new(&part);
            MeshPart::Own(Box::new((part, pieces)))
        })
    }

    /// The triangles of the contacts of a group.
    fn touched(&self, group: &ContactGroup) -> impl Iterator<Item = u32> {
        group.contacts.iter().filter_map(|&i| self.stored.get(i)).map(|&i| id32(i))
    }
}

impl Pieces {
    fn new(view: &MeshView<'_>) -> Self {
        let mut sets = Parts::new(view.triangles.len());
        let mut first = vec![u32::MAX; view.vertices.len()];
        for (i, corners) in (0..).zip(view.triangles) {
            for &vertex in corners {
                match first.get_mut(vertex as usize) {
                    Some(first) if *first == u32::MAX => *first = i,
                    Some(first) => sets.join(*first, i),
                    // A damaged file.
                    None => {}
                }
            }
        }
        let of: Vec<u32> = (0..id32(view.triangles.len())).map(|i| sets.root(i)).collect();
        let mut bounds = vec![Aabb::EMPTY; of.len()];
        for (i, &piece) in of.iter().enumerate() {
            view.corners(i).into_iter().for_each(|corner| bounds[piece as usize].grow(corner));
        }
        Self { of, bounds }
    }

    /// Returns `true` for each piece with a triangle of `touched`, and for each closed piece that may be
    /// around or inside of a closed one of these, so that both bound the same solid.
    fn around(&self, touched: impl Iterator<Item = u32>, solid: &MeshSolid) -> Vec<bool> {
        let mut is_kept = vec![false; self.of.len()];
        touched.for_each(|i| is_kept[self.of[i as usize] as usize] = true);
        let is_first = |i: &usize| self.of[*i] as usize == *i && solid.is_closed_at(*i);
        let met: Vec<Aabb> =
            (0..self.of.len()).filter(|i| is_kept[*i] && is_first(i)).map(|i| self.bounds[i]).collect();
        for i in (0..self.of.len()).filter(is_first) {
            let own = &self.bounds[i];
            is_kept[i] |= met.iter().any(|other| own.encloses(other) || other.encloses(own));
        }
        is_kept
    }
}

/// Keeps the triangles, in ascending order, that are linked by common vertices to those that are `touched`.
fn keep_linked(corners: &[[u32; 3]], touched: impl Iterator<Item = u32>, triangles: &mut Vec<u32>) {
    let mut ends: Vec<(u32, u32)> = (0..)
        .zip(triangles.iter())
        .flat_map(|(at, &i)| corners[i as usize].map(|vertex| (vertex, at)))
        .collect();
    ends.sort_unstable();
    let mut pieces = Parts::new(triangles.len());
    for two in ends.windows(2).filter(|two| two[0].0 == two[1].0) {
        pieces.join(two[0].1, two[1].1);
    }
    let mut is_linked = vec![false; triangles.len()];
    for triangle in touched {
        if let Ok(at) = triangles.binary_search(&triangle) {
            is_linked[pieces.root(id32(at)) as usize] = true;
        }
    }
    let mut at = 0..;
    triangles.retain(|_| at.next().is_some_and(|at| is_linked[pieces.root(at) as usize]));
}
